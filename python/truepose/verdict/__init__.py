"""The verdict: whether an accuracy asked is met, NOT met, or undecided, and what says so."""
