"""How a deviation follows from a strut's length: a constant, and a multiple of the length."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats

ROUNDING = 1e-9
"""Of the values: by which the law may miss them."""


def law_of_length(values: Floats, lengths: Floats) -> tuple[float, float, float] | None:
    """(constant, slope, slack) with `values` (n,) = constant + slope * `lengths` (n,) within slack.

    None where they follow no such law. The slack is `ROUNDING` of the largest value.
    """
    slack = ROUNDING * float(np.abs(values).max())
    if np.ptp(values) <= slack:
        return float(values[0]), 0.0, float(np.ptp(values))
    low, high = int(np.argmin(lengths)), int(np.argmax(lengths))
    if lengths[high] <= lengths[low]:
        return None
    slope = float((values[high] - values[low]) / (lengths[high] - lengths[low]))
    constant = float(values[low] - slope * lengths[low])
    if (np.abs(constant + slope * lengths - values) > slack).any():
        return None
    return constant, slope, slack


__all__ = ["ROUNDING", "law_of_length"]
