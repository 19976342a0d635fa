"""A pattern over the workspace: residuals that depend on the pose as no unknown does."""

from __future__ import annotations

import numpy as np

from truepose.calibration.residual_checks._base import Finding, Pattern, PatternKind, ResidualsView
from truepose.calibration.residual_checks.sizes import length_words


def inspect(view: ResidualsView) -> Finding | None:
    """Polynomials of second degree in the tool's place, for each measured column by itself."""
    points = view.data.placements[view.data.row[view.own], :3]
    half = 0.5 * np.ptp(points, axis=0)
    moving = half > 1e-3 * half.max(initial=1e-300)
    if not moving.any():
        return None
    places = ((points - points.min(axis=0)) / np.where(moving, half, 1.0) - 1.0)[:, moving]
    pairs = [places[:, i] * places[:, j] for i in range(places.shape[1]) for j in range(i + 1)]
    terms = np.column_stack([places, *pairs])
    best: tuple[int, Pattern] | None = None
    of_columns = view.by_column
    for column in range(of_columns.shape[1]):
        pattern = view.pattern(of_columns[:, [column]] * terms, of_columns.shape[1])
        if pattern is not None and (best is None or pattern.probability < best[1].probability):
            best = column, pattern
    if best is None:
        return None
    column, pattern = best
    own = of_columns[:, column] != 0.0
    rms = float(np.sqrt(np.mean((terms[own] @ pattern.sizes) ** 2)))
    lengths = bool(view.of_lengths[own].all())
    size = length_words(view, rms) if lengths else f"{rms:.2g}"
    words = f"its readings depend on the place as no unknown does, by {size} (rms)"
    return Finding(pattern, of_columns[:, [column]] * terms, words)


KIND = PatternKind("workspace-pattern", "residuals depend on the pose as no unknown does", inspect)
