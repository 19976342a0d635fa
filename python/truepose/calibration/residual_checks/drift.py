"""A trend over the rows: an instrument, or its constant, that drifts while it measures."""

from __future__ import annotations

import numpy as np

from truepose.calibration.residual_checks._base import Pattern, PatternKind, ResidualsView
from truepose.calibration.residual_checks.sizes import place_words


def inspect(view: ResidualsView) -> tuple[Pattern, str, tuple[int, ...]] | None:
    """As far as it would have moved from the first row to the last, evenly."""
    along = np.linspace(-0.5, 0.5, view.rows.size)[view.place]
    pattern = view.pattern(along[:, np.newaxis] * view.by_place)
    if pattern is None:
        return None
    moved = place_words(view, pattern.sizes)
    return pattern, f"it looks as if it drifts, by {moved} from the first row to the last", ()


KIND = PatternKind("drift", "an instrument drifts over the rows", inspect)
