"""The error budget: each source's error, all together, and how they compare; a question a file."""
