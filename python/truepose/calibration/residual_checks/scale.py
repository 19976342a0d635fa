"""A scale: all lengths that an instrument reads are too long or too short by one share."""

from __future__ import annotations

import numpy as np

from truepose.calibration.residual_checks._base import Finding, PatternKind, ResidualsView


def inspect(view: ResidualsView) -> Finding | None:
    """The share by which lengths are off; air, temperature or a wrong constant do that."""
    value = view.data.value[view.own] / view.data.uncertainty[view.own]
    columns = np.where(view.of_lengths, value, 0.0)[:, np.newaxis]
    pattern = view.pattern(columns)
    if pattern is None:
        return None
    share = float(pattern.sizes[0])
    side = "too short" if share < 0.0 else "too long"
    return Finding(pattern, columns, f"its lengths look {side} by {abs(share) * 1e6:.0f} ppm")


KIND = PatternKind("scale", "lengths read too long or too short by one share", inspect)
