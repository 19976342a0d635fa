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


def smallest(machine: Machine) -> float:
    """The smallest coordinate of the tool point, m, that an error is a percent of."""
    return SMALLEST * machine.characteristic_length


def defined(machine: Machine, placements: Floats) -> Flags:
    """(n, n_component) where there is a percent of the tool point's coordinate, base frame."""
    flags = np.zeros((len(placements), len(machine.components)), np.bool_)
    for index, component in enumerate(machine.components):
        if component in POSITIONS:
            size = np.abs(placements[:, POSITIONS.index(component)])
            flags[:, index] = size >= smallest(machine)
    return flags
