"""A step over the rows: an instrument, or its constant, that stands elsewhere from a row on."""

from __future__ import annotations

import numpy as np

from truepose.calibration.residual_checks._base import Finding, Pattern, PatternKind, ResidualsView
from truepose.calibration.residual_checks.sizes import place_words

LEAST_ROWS = 3
"""Rows on either side of a step: fewer are outliers."""


def inspect(view: ResidualsView) -> Finding | None:
    """The likeliest row from which on it stands elsewhere."""
    count = view.rows.size
    tests = count - 2 * LEAST_ROWS + 1
    best: tuple[int, Pattern] | None = None
    for row, squares, products, left in view.steps(view.by_place):
        if not LEAST_ROWS <= row <= count - LEAST_ROWS:
            continue
        pattern = view.pattern_of(squares, products, left, tests)
        if pattern is not None and (best is None or pattern.probability < best[1].probability):
            best = row, pattern
    if best is None:
        return None
    row, pattern = best
    where = view.named_rows(row - 1, row)
    words = f"it looks as if it was moved {where}, by {place_words(view, pattern.sizes)}"
    columns = np.where((view.place >= row)[:, np.newaxis], view.by_place, 0.0)
    return Finding(pattern, columns, words, (int(view.rows[row]),))


KIND = PatternKind("step", "an instrument was moved between two rows", inspect)
