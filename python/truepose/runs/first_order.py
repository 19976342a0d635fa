"""First order: where all sources at their shifts take the tool, and what each variable adds there.

    error = value + sum over variables of effect t + second order,    t in [-1, 1]

`value` is exact, `effect` the sensitivities there times the swings of the columns that a variable
moves.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine
from truepose.runs.displacement import ParameterDeviation, displacement
from truepose.runs.poses import OK
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock

EVERY = slice(None)
"""All poses of a block."""


def first_order(
    machine: Machine, block: PoseBlock, spread: Variables, poses: slice = EVERY
) -> tuple[Floats, Floats, np.ndarray]:
    """Value (n, m) and effects (n, m, n_variable), m and rad, and a kernel status (n,).

    At some `poses` of the block; derivatives where all variables are 0, so about the shifts.
    """
    joints, placements = block.joints[poses], block.placements[poses]
    parameters, shift = spread.shift
    moved = np.ascontiguousarray(rows_of(shift, poses))
    value, status = displacement(machine, joints, placements, (parameters, moved))
    slopes, regular = effects_at(machine, block, spread, (parameters, moved), poses)
    return value, slopes, np.where(status == OK, regular, status)


def effects_at(
    machine: Machine,
    block: PoseBlock,
    spread: Variables,
    moved: ParameterDeviation,
    poses: slice = EVERY,
) -> tuple[Floats, np.ndarray]:
    """Effects (n, m, n_variable), m and rad, where the parameters are `moved`, and a status (n,).

    At some `poses` of the block; `moved` at these.
    """
    slopes, status = machine.kernel.sensitivity_moved(
        block.joints[poses], block.placements[poses], spread.columns, *moved
    )
    slopes *= rows_of(spread.half_width, poses)[:, np.newaxis]
    count = len(spread.names)
    if np.array_equal(spread.variables, np.arange(count)):
        return slopes, status
    member = np.zeros((spread.columns.size, count))
    member[np.arange(spread.columns.size), spread.variables] = 1.0
    return slopes @ member, status


class ExactError:
    """Evaluates the exact error at any poses of a block, each with variables of its own."""

    def __init__(self, machine: Machine, block: PoseBlock, spread: Variables) -> None:
        self._machine, self._block, self._spread = machine, block, spread
        parameters, shift = spread.shift
        every = np.union1d(parameters, spread.columns)
        self._parameters: Indices = np.asarray(every, np.intp)
        self._shift = np.zeros((len(shift), every.size))
        self._shift[:, np.searchsorted(every, parameters)] = shift
        self._place = np.searchsorted(every, spread.columns)

    def __call__(self, poses: Indices, t: Floats) -> tuple[Floats, np.ndarray]:
        """Errors (s, m) and kernel status (s,) at poses (s,) of the block, variables (s, v)."""
        moved = t[:, self._spread.variables]
        moved *= _at(self._spread.half_width, poses)
        values = _at(self._shift, poses) + np.zeros((len(t), 1))
        if np.unique(self._place).size == self._place.size:
            values[:, self._place] += moved
        else:
            for column, place in enumerate(self._place):
                values[:, place] += moved[:, column]
        return displacement(
            self._machine,
            self._block.joints[poses],
            self._block.placements[poses],
            (self._parameters, values),
        )


def rows_of(table: Floats, poses: slice) -> Floats:
    """The rows of `poses` in a table (n or 1, k)."""
    return table if len(table) == 1 else table[poses]


def _at(table: Floats, poses: Indices) -> Floats:
    return table if len(table) == 1 else table[poses]
