"""Distributions of the variables, what correlates them, and where they can lie together."""
