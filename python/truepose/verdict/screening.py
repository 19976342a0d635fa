"""Which poses may be the worst at a coverage, from the linear model: what is sampled exactly.

At every pose the same variables, drawn from their distributions with their correlations, go through
value + effects @ t (`budget.first_order`), and the quantile of the lengths is taken. It is that of
|N(c, C)| where variables are normal, and of what they are where they are not. The farthest point of
an ellipsoid is no quantile of the length: that of 95 % in space is 2.80 standard deviations long
where an error along one line has 1.96.

Few draws tell which poses are far from the largest, more draws, at the rest, which lie within
`WITHIN` of it. These draws are none of those that the answer is made of, so that the poses chosen
do not depend on them, and an interval that holds at each holds at the poses chosen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.machine import Machine
from truepose.runs.displacement import displacement
from truepose.runs.first_order import first_order
from truepose.runs.poses import OK
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.sampler import Random
from truepose.verdict.order_statistics import Ranks, ranks

State = tuple[PoseBlock, Variables]
"""Some poses as they are commanded, and what is unknown there."""

WITHIN = 0.1
"""Of the largest: poses whose first-order number is smaller by more are not sampled."""

FIRST = 1 << 40
"""Number of the first sample that poses are screened with; no run draws as many."""

TAIL = (50, 200)
"""Screening draws beyond the quantile, at all poses and at those left."""

FEWEST = (1_000, 8_000)
MOST = (20_000, 80_000)
"""Screening draws at a pose; at coverages that want more, a lower quantile tells the poses."""

RISK = 0.002
"""Of screening a pose out by chance, roughly: draws are the same at every pose."""

REFINED = 4
"""Of the poses that may be sampled: how many times as many are screened with more draws."""

PILOTS = 8
"""Poses of the largest first-order numbers at which the exact ones are taken, for the scale."""

AT_ONCE = 4_000_000
"""Components of linear errors that are worked on together."""


@dataclass(frozen=True, eq=False)
class Pose:
    """One pose that is sampled: its `number` in the run, and the state there.

    `part`: poses of one part have the same variables, and the same `draws` of them.
    """

    machine: Machine
    number: int
    part: int
    block: PoseBlock
    variables: Variables
    draws: Random
    columns: Indices

    def sizes(self, t: Floats) -> Floats:
        """(s,) lengths of the exact error where the variables are t (s, v); inf where none."""
        parameters, moved = self.variables.parameters_moved(t)
        joints = np.repeat(self.block.joints, len(t), axis=0)
        placements = np.repeat(self.block.placements, len(t), axis=0)
        error, status = displacement(self.machine, joints, placements, (parameters, moved))
        length = np.sqrt(np.square(error[:, self.columns]).sum(axis=1))
        return np.where(status == OK, length, np.inf)


@dataclass(frozen=True)
class Screened:
    """The poses to sample, of the largest first-order number first, and how many there were.

    `within`: poses that may be the worst, of which `poses` are those to be sampled.
    """

    poses: list[Pose]
    within: int
    every: int


@dataclass(frozen=True, eq=False)
class _Part:
    """Some poses of a block: first-order estimates of the quantile with its ends, each (n,)."""

    number: int
    block: PoseBlock
    variables: Variables
    draws: Random
    estimate: Floats
    lower: Floats
    upper: Floats

    def only(self, chosen: Flags) -> _Part:
        """Some of them."""
        return _Part(
            self.number,
            self.block.select(chosen),
            _select(self.variables, chosen),
            self.draws,
            self.estimate[chosen],
            self.lower[chosen],
            self.upper[chosen],
        )


class Screen:
    """A run of poses at a coverage: `states` is gone through twice."""

    def __init__(
        self,
        machine: Machine,
        states: Iterable[State],
        columns: Indices,
        probability: float,
        seed: int,
    ) -> None:
        """`columns`: components of the quantity."""
        if iter(states) is states:
            raise ValueError("states that can be gone through but once")
        self._machine, self._states, self._columns = machine, states, columns
        self._probability, self._seed = probability, seed

    def candidates(self, most: int) -> Screened:
        """The poses that may be the worst, at most so many; those without first order are."""
        chosen, left = self._coarsely(most * REFINED)
        many, largest = self._ranks(1), _Largest(self._sized)
        kept = []
        for (number, (block, variables)), wanted in zip(self._numbered(), chosen, strict=True):
            if wanted.any():
                part = self._part(number, block.select(wanted), _select(variables, wanted), many)
                kept.append(part)
                largest.add(part, part.estimate)
        least = (1.0 - WITHIN) * largest.level(many, sure=False)
        within = [part.only(part.estimate >= least) for part in kept]
        poses = [
            (float(part.estimate[at]), self._pose(part, at))
            for part in within
            for at in _largest(part.estimate, most)
        ]
        poses.sort(key=lambda ranked: (-ranked[0], ranked[1].number))
        count = left + sum(part.estimate.size for part in within)
        every = sum(flags.size for flags in chosen)
        return Screened([pose for _, pose in poses[:most]], count, every)

    def _coarsely(self, most: int) -> tuple[list[Flags], int]:
        """The poses of each block that few draws leave, at most so many, and how many more."""
        few, largest = self._ranks(0), _Largest(self._sized)
        parts = []
        for number, (block, variables) in self._numbered():
            # Single precision is far finer than what so few draws tell, and half the work.
            part = self._part(number, block, variables, few, np.float32)
            parts.append((part.estimate, part.upper))
            largest.add(part, part.lower)
        if not parts:
            raise ValueError("no pose")
        least = (1.0 - WITHIN) * largest.level(few, sure=True)
        likely = np.concatenate([estimate[upper >= least] for estimate, upper in parts])
        enough = np.sort(likely)[-most] if likely.size > most else 0.0
        chosen = [(upper >= least) & (estimate >= enough) for estimate, upper in parts]
        return chosen, likely.size - sum(int(flags.sum()) for flags in chosen)

    def _numbered(self) -> Iterator[tuple[int, State]]:
        """The states that have a pose."""
        for number, state in enumerate(self._states):
            if state[0].indices.size:
                yield number, state

    def _ranks(self, stage: int) -> Ranks:
        """How many draws, and which of them in order."""
        wanted = TAIL[stage] / (1.0 - self._probability)
        count = int(min(max(wanted, FEWEST[stage]), MOST[stage]))
        return ranks(count, min(self._probability, 1.0 - TAIL[stage] / count), RISK)

    def _part(
        self,
        number: int,
        block: PoseBlock,
        variables: Variables,
        of: Ranks,
        precision: type = np.float64,
    ) -> _Part:
        draws = Random(variables, self._seed)
        t: np.ndarray = draws.rows(FIRST, of.count).astype(precision)
        value, effects, status = first_order(self._machine, block, variables)
        value = value[:, self._columns].astype(precision)
        effects = effects[:, self._columns].astype(precision)
        ranks = np.empty((3, len(value)))
        step = max(1, AT_ONCE // (of.count * self._columns.size))
        for start in range(0, len(value), step):
            rows = slice(start, start + step)
            # One product of matrices, not one for each pose.
            some = effects[rows]
            # Sizes in full: without a band there is no variable, of which -1 could not be told.
            count, width, variable = some.shape
            errors = (some.reshape(count * width, variable) @ t.T).reshape(count, width, of.count)
            errors += value[rows, :, np.newaxis]
            ranks[:, rows] = np.sqrt(of.of(np.square(errors, out=errors).sum(axis=1)))
        # Without a first order nothing says that it is not the worst; nor that it is.
        ranks[:, status != OK] = np.array([[np.inf], [0.0], [np.inf]])
        return _Part(number, block, variables, draws, *ranks)

    def _pose(self, part: _Part, at: int) -> Pose:
        one = part.only(_at(part.estimate, at))
        number = int(one.block.indices[0])
        return Pose(
            self._machine, number, one.number, one.block, one.variables, one.draws, self._columns
        )

    def _sized(self, part: _Part, at: int, count: int) -> Floats:
        """(count,) exact lengths at a pose, of the screening draws."""
        return self._pose(part, at).sizes(part.draws.rows(FIRST, count))


class _Largest:
    """How large the largest number is: by first order, and exactly where that is largest.

    Near singularities the exact number may be well below that of first order, and another pose's
    the largest: poses are measured against the smaller of the two.
    """

    def __init__(self, sized: Callable[[_Part, int, int], Floats]) -> None:
        self._sized = sized
        self._linear = 0.0
        self._found: list[tuple[float, _Part]] = []

    def add(self, part: _Part, numbers: Floats) -> None:
        """Numbers (n,) of more poses, by first order; those that are not finite are none."""
        finite = np.isfinite(numbers)
        self._linear = max(self._linear, float(numbers.max(initial=0.0, where=finite)))
        few = [part.only(_at(part.estimate, at)) for at in _largest(part.estimate, PILOTS)]
        self._found += [(float(pose.estimate[0]), pose) for pose in few]
        self._found = sorted(self._found, key=lambda ranked: -ranked[0])[:PILOTS]

    def level(self, of: Ranks, *, sure: bool) -> float:
        """What poses are measured against, m or rad; `sure`: the lower end of the exact one."""
        exact = [of.of(self._sized(part, 0, of.count))[int(sure)] for _, part in self._found]
        return min(self._linear, float(max(exact)))


def _largest(values: Floats, most: int) -> Indices:
    """Places of the largest of `values`, at most so many; of equal ones the first."""
    return np.asarray(np.argsort(-values, kind="stable")[:most], np.intp)


def _select(variables: Variables, chosen: Flags) -> Variables:
    return variables if chosen.all() else variables.select(chosen)


def _at(values: Floats, at: int) -> Flags:
    return np.asarray(np.arange(values.size) == at)
