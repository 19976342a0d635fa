"""Results for people: tables, figures and the report page, and files for programs.

Reads Datasets of `truepose.budget` and `truepose.compensate`; computes nothing of its own but
norms and highest values over poses.
"""
