"""Worst: the most that the unknown part of a deviation can do, to first order.

    reach[c] = most of sum over variables of effect[c, v] t[v],    t where the variables can lie
    effect[c, v] = sum over the variable's columns of sensitivity[c, k] half[k]

A variable is one column, or a correlation group whose members move together with their signs. Where
every variable lies in [-1, 1] the reach is the sum of the effects' sizes, down as up; listed values
that are not symmetric and directions that are not known are `truepose.probability.domain`'s.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine
from truepose.runs.displacement import sum_deviations
from truepose.sources import Deviation, PoseBlock

EVERY = slice(None)
"""All poses of a block."""


def variable_effects(
    machine: Machine, block: PoseBlock, deviation: Deviation, poses: slice = EVERY
) -> tuple[Floats, Floats, np.ndarray]:
    """First-order error of each variable at +1, about the shift, at some poses of the block.

    Returns effects (n, n_component, n_variable) over the variables that have a band, m and rad,
    the half band of each in standard deviations (n_variable,), and a kernel status (n,). The
    sensitivities are those of the machine at the source's shift, where the command takes it.
    """
    banded = deviation.banded
    joints, placements = block.joints[poses], block.placements[poses]
    columns = deviation.parameters[banded]
    parameters, shift = sum_deviations([(deviation.parameters, deviation.shift)])
    if shift.any():
        moved = np.ascontiguousarray(shift if len(shift) == 1 else shift[poses])
        sensitivity, status = machine.kernel.sensitivity_moved(
            joints, placements, columns, parameters, moved
        )
    else:
        sensitivity, status = machine.kernel.sensitivity_at(joints, placements, columns)
    effects, variable = by_variable(deviation, sensitivity, poses)
    sigmas = np.empty(effects.shape[2])
    sigmas[variable] = [deviation.distribution[column].sigmas for column in banded]
    return effects, sigmas, status


def by_variable(
    deviation: Deviation, slopes: Floats, poses: slice = EVERY
) -> tuple[Floats, Indices]:
    """What each variable does at +1, from `slopes` (n, m, n_banded) per unit of a banded column.

    `poses` are those of the deviation that the slopes belong to. `slopes` are written over: there
    is seldom room for two of them in the cache.

    Returns effects (n, m, n_variable), and the variable of each banded column (n_banded,).
    """
    banded = deviation.banded
    half = deviation.signed_half
    if len(half) > 1:
        half = half[poses]
    if banded.size < half.shape[1]:
        half = half[:, banded]
    effects: Floats = np.multiply(slopes, half[:, np.newaxis], out=slopes)
    numbers, variable = deviation.banded_variables
    if numbers.size < banded.size:
        member = np.zeros((banded.size, numbers.size))
        member[np.arange(banded.size), variable] = 1.0
        effects = effects @ member
    return effects, variable


def worst(error: Floats, reach: tuple[Floats, Floats]) -> Floats:
    """(n, n_component) the largest |error|, from that at the shift and its reach down and up."""
    down, up = reach
    most: Floats = np.maximum(np.abs(error - down), np.abs(error + up))
    return most
