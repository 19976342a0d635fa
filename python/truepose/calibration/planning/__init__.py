"""Which poses to measure: what each buys, the list of them and a measuring program."""
