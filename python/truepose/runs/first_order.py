"""First order: where all sources at their shifts take the tool, and what each variable adds there.

    error = value + sum over variables of effect t + second order,    t in [-1, 1]

`value` is exact, `effect` the sensitivities there times the swings of the columns that a variable
moves.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats, Indices, sorted_union
from truepose.machine import Machine
from truepose.runs.displacement import ParameterDeviation, displacement
from truepose.runs.poses import OK
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock

EVERY = slice(None)
"""All poses of a block."""


def first_order(
    machine: Machine, block: PoseBlock, variables: Variables, poses: slice = EVERY
) -> tuple[Floats, Floats, np.ndarray]:
    """Value (n, m) and effects (n, m, n_variable), m and rad, and a kernel status (n,).

    At some `poses` of the block; derivatives where all variables are 0, so about the shifts.
    """
    joints, placements = block.joints[poses], block.placements[poses]
    parameters, shift = variables.shift
    moved = np.ascontiguousarray(rows_of(shift, poses))
    value, status = displacement(machine, joints, placements, (parameters, moved))
    slopes, regular = effects_at(machine, block, variables, (parameters, moved), poses)
    return value, slopes, np.where(status == OK, regular, status)


def effects_at(
    machine: Machine,
    block: PoseBlock,
    variables: Variables,
    moved: ParameterDeviation,
    poses: slice = EVERY,
) -> tuple[Floats, np.ndarray]:
    """Effects (n, m, n_variable), m and rad, where the parameters are `moved`, and a status (n,).

    At some `poses` of the block; `moved` at these.
    """
    slopes, status = machine.kernel.sensitivity_moved(
        block.joints[poses], block.placements[poses], variables.columns, *moved
    )
    slopes *= rows_of(variables.half_width, poses)[:, np.newaxis]
    count = len(variables.names)
    if np.array_equal(variables.variable_of, np.arange(count)):
        return slopes, status
    member = np.zeros((variables.columns.size, count))
    member[np.arange(variables.columns.size), variables.variable_of] = 1.0
    return slopes @ member, status


class ExactError:
    """Evaluates the exact error at any poses of a block, each with variables of its own."""

    def __init__(self, machine: Machine, block: PoseBlock, variables: Variables) -> None:
        self._machine, self._block, self._variables = machine, block, variables
        parameters, shift = variables.shift
        every = sorted_union(parameters, variables.columns)
        self._parameters = every
        self._shift = np.zeros((len(shift), every.size))
        self._shift[:, np.searchsorted(every, parameters)] = shift
        self._place = np.searchsorted(every, variables.columns)
        own = np.arange(every.size)
        self._is_plain = np.array_equal(self._place, own) and np.array_equal(
            variables.variable_of, own
        )
        """Whether each parameter has one variable, in the same order, and none has none."""

    def __call__(self, poses: Indices, t: Floats) -> tuple[Floats, np.ndarray]:
        """Errors (s, m) and kernel status (s,) at poses (s,) of the block, variables (s, v)."""
        return displacement(
            self._machine,
            self._block.joints[poses],
            self._block.placements[poses],
            (self._parameters, self._deviations(poses, t)),
        )

    def _deviations(self, poses: Indices, t: Floats) -> Floats:
        """(s, k) of the parameters."""
        half, shift = _at(self._variables.half_width, poses), _at(self._shift, poses)
        if self._is_plain:
            values = t * half
            values += shift
            return values
        moved = t[:, self._variables.variable_of]
        moved *= half
        values = shift + np.zeros((len(t), 1))
        if np.bincount(self._place).max(initial=0) <= 1:
            values[:, self._place] += moved
        else:
            for column, place in enumerate(self._place):
                values[:, place] += moved[:, column]
        return values


def rows_of(table: Floats, poses: slice) -> Floats:
    """The rows of `poses` in a table (n or 1, k)."""
    return table if len(table) == 1 else table[poses]


def _at(table: Floats, poses: Indices) -> Floats:
    return table if len(table) == 1 else table[poses]
