"""What proven bounds are measured on; only what other commits have, too."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import truepose
from benchmarks.hexapod import Array

BAND = 1e-4  # m, of every parameter of the hexapod, to either side
PLANAR = {"x": (0.2, 0.4), "y": (0.1, 0.3)}
"""The planar machine's whole workspace, m."""
GAP = 0.05
"""How far bounds over a region may be from what is reached in it, relative."""

Bounds = Callable[[], tuple[Any, ...]]


def home_bounds(
    machine: truepose.Machine, columns: NDArray[np.int64]
) -> tuple[tuple[Array, Array], Array, Bounds]:
    """Joints (1, 6) and placement (1, 7) at home, sensitivities there, and the work itself.

    The work encloses the error of bands of `BAND` on the parameters `columns`.
    """
    joints, placements, status = machine.kernel.place(machine.kernel.home[np.newaxis])
    slopes, regular = machine.kernel.sensitivity_at(joints, placements, columns)
    if status.any() or regular.any():
        raise ValueError("home is not a pose to bound the error at")
    numbers, band = list(range(columns.size)), np.full((1, columns.size), BAND)
    shift = np.empty(0, np.int64), np.empty((1, 0))

    def bounds() -> tuple[Any, ...]:
        return machine.kernel.bounds_at(joints, placements, *shift, columns, numbers, band)

    return (joints, placements), slopes, bounds
