"""What is to be found, and the fit that finds it."""
