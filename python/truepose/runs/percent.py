"""Percent: an error against the tool's coordinate at the same pose.

    percent = 100 |error| / |coordinate|

of one source (equation 8 of the paper) or of all together (equation 9).

It has no meaning for a rotation, nor where the coordinate is about zero.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.machine import Machine
from truepose.runs.quantities import POSITIONS

SMALLEST = 1e-6
"""Coordinate, in characteristic lengths of the machine, below which a percentage says nothing."""


def coordinates(machine: Machine, placements: Floats) -> tuple[Floats, Flags]:
    """The tool point's coordinates, base frame, m, and where a percent of them is defined.

    Both (n, n_component); a rotation has no coordinate (NaN).
    """
    values = np.full((len(placements), len(machine.components)), np.nan)
    for index, component in enumerate(machine.components):
        if component in POSITIONS:
            values[:, index] = placements[:, POSITIONS.index(component)]
    return values, np.abs(values) >= SMALLEST * machine.characteristic_length


def per_error(coordinate: Floats, defined: Flags) -> Floats:
    """(n, n_component) percent of `coordinate` per m of error; NaN where it is not `defined`."""
    result = np.full(coordinate.shape, np.nan)
    np.divide(100.0, np.abs(coordinate), out=result, where=defined)
    return result


def percent(error: Floats, per_error: Floats, out: Floats | None = None) -> Floats:
    """(n, n_component) the size of `error` in percent, from what one metre of it is."""
    result: Floats = np.multiply(np.abs(error), per_error, out=out)
    return result
