"""A trend over the rows: an instrument, or its constant, that drifts while it measures."""

from __future__ import annotations

import numpy as np

from truepose.calibration.residual_checks._base import Finding, PatternKind, ResidualsView
from truepose.calibration.residual_checks.sizes import place_words


def inspect(view: ResidualsView) -> Finding | None:
    """As far as it would have moved from the first row to the last, evenly."""
    along = np.linspace(0.0, 1.0, view.rows.size)[view.place]
    columns = along[:, np.newaxis] * view.by_place
    pattern = view.pattern(columns)
    if pattern is None:
        return None
    moved = place_words(view, pattern.sizes)
    words = f"it looks as if it drifts, by {moved} from the first row to the last"
    return Finding(pattern, columns, words)


KIND = PatternKind("drift", "an instrument drifts over the rows", inspect)
