"""A design's machines, drawn at random: how far off they are, to first order and exactly.

They are those that `truepose.check` draws: the variables of all sources from their distributions
with their correlations, by the kernel's numbered random numbers.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.runs.displacement import displacement
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import BLOCK, OK
from truepose.runs.quantities import quantities
from truepose.runs.variables import Variables
from truepose.uncertainty_analysis.sampler import Random
from truepose.verdict.states import Population, State

AT_ONCE = 4_000_000
"""Components of linear errors that are worked on together."""

EXACTLY = 20_000
"""Machines solved together."""

_NO_POSE = "no-pose-left"


@dataclass(frozen=True, eq=False)
class LinearSizes:
    """Lengths of linear errors (n, q, s) at the poses numbered `numbers` (n,), infinite of none."""

    numbers: Indices
    sizes: np.ndarray


class DrawnMachines:
    """Machines of one design in one `condition` and `state`."""

    def __init__(self, machine: Machine, condition: Condition, state: str) -> None:
        self.machine, self.condition, self.state = machine, condition, state
        self.kinds: list[Indices] = list(quantities(machine.components).values())
        self._drawn: dict[tuple[object, ...], Floats] = {}

    def quantiles(self, poses: Floats, level: float, count: int, seed: int) -> tuple[Floats, Flags]:
        """First-order quantiles (n, q) at poses (n, d) of `count` machines, and whose they are.

        Minus infinity at poses that do not belong to the run, (n,) of the second; infinite where
        the machine cannot be commanded.
        """
        values = np.full((len(poses), len(self.kinds)), -np.inf)
        belongs = np.zeros(len(poses), np.bool_)
        rank = rank_of(level, count)
        for part in self.linear(poses, count, seed):
            values[part.numbers] = np.partition(part.sizes, rank, axis=2)[..., rank]
            belongs[part.numbers] = True
        return values, belongs

    def linear(self, poses: Floats, count: int, seed: int) -> Iterator[LinearSizes]:
        """Linear errors of the first `count` machines, some poses at a time."""
        for start, state in self._states(poses):
            # Single precision is far finer than what draws tell, and half the work.
            t = self._rows(state.variables, count, seed).astype(np.float32)
            value, effects, regular = first_order(self.machine, state.block, state.variables)
            there = (regular == OK) & (state.status == OK)
            m = len(self.machine.components)
            step = max(1, AT_ONCE // (count * m))
            for at in range(0, len(value), step):
                rows = slice(at, at + step)
                some = effects[rows].astype(np.float32)
                poses_here, width, variable = some.shape
                errors = (some.reshape(poses_here * width, variable) @ t.T).reshape(
                    poses_here, width, count
                )
                errors += value[rows, :, np.newaxis].astype(np.float32)
                squares = np.square(errors, out=errors)
                sizes = np.stack(
                    [np.sqrt(squares[:, columns].sum(axis=1)) for columns in self.kinds], axis=1
                )
                sizes[~there[rows]] = np.inf
                yield LinearSizes(start + state.block.indices[rows], sizes)

    def exact(self, poses: Floats, count: int, seed: int) -> Iterator[tuple[int, Floats]]:
        """Pose by pose its number and the exact errors (count, m); NaN of what is not assembled."""
        for start, state in self._states(poses):
            for at, number in enumerate(state.block.indices.tolist()):
                yield start + number, self._exact(state.at(at), count, seed)

    def exact_of(
        self, poses: Floats, at: Indices, numbers: Indices, count: int, seed: int
    ) -> Floats:
        """(k, m) exact errors of machines `numbers` (k,), below `count`, at poses numbered `at`.

        NaN of what is not assembled, or does not belong to the run.
        """
        errors = np.full((len(at), len(self.machine.components)), np.nan)
        for start, state in self._states(poses):
            place = np.full(len(poses), -1, np.intp)
            there = state.status == OK
            place[start + state.block.indices[there]] = np.flatnonzero(there)
            pairs = np.flatnonzero(place[at] >= 0)
            solve = ExactError(self.machine, state.block, state.variables)
            drawn = self._rows(state.variables, count, seed)
            for first in range(0, len(pairs), EXACTLY):
                some = pairs[first : first + EXACTLY]
                error, status = solve(place[at[some]], drawn[numbers[some]])
                errors[some] = np.where((status == OK)[:, np.newaxis], error, np.nan)
        return errors

    # --- inside

    def _exact(self, state: State, count: int, seed: int) -> Floats:
        t = self._rows(state.variables, count, seed)
        parts = [self._solved(state, t[at : at + EXACTLY]) for at in range(0, count, EXACTLY)]
        return np.concatenate(parts)

    def _rows(self, variables: Variables, count: int, seed: int) -> Floats:
        """(count, v) the variables of the first machines; the last are kept."""
        key = variables.streams.tobytes(), variables.numbers.tobytes(), count, seed
        if key not in self._drawn:
            self._drawn = {key: Random(variables, seed).rows(0, count)}
        return self._drawn[key]

    def _solved(self, state: State, t: Floats) -> Floats:
        if state.status[0] != OK:
            return np.full((len(t), len(self.machine.components)), np.nan)
        joints = np.repeat(state.block.joints, len(t), axis=0)
        placements = np.repeat(state.block.placements, len(t), axis=0)
        moved = state.variables.parameters_moved(t)
        error, status = displacement(self.machine, joints, placements, moved)
        return np.where((status == OK)[:, np.newaxis], error, np.nan)

    def _states(self, poses: Floats) -> Iterator[tuple[int, State]]:
        """The poses that belong to the run, and from which number of `poses` they are counted."""
        for start in range(0, len(poses), BLOCK):
            population = Population(self.machine, poses[start : start + BLOCK], self.condition)
            try:
                for state in population.states(self.state):
                    yield start, state
            except RequestError as refusal:
                if refusal.problems[0].code != _NO_POSE:
                    raise


def rank_of(level: float, count: int) -> int:
    """Place, from 0, of the least of `count` ordered values with the share `level` up to it."""
    return min(max(int(np.ceil(level * count * (1.0 - 1e-12))) - 1, 0), count - 1)


__all__ = ["DrawnMachines", "LinearSizes", "rank_of"]
