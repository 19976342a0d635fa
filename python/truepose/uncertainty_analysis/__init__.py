"""How sure an error is: samples, coverage intervals, variance shares, worst cases and bounds."""
