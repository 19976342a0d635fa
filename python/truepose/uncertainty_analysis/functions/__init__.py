"""Plain functions of uncertain inputs, combined by the same code as a machine's errors."""
