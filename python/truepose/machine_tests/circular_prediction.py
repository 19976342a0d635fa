"""The circular test: what a ball bar will show, both ways round, and which cause makes what of it.

The path is driven with an overshoot, so that every drive's flank is what it is on the way; a sample
is one machine, and it goes to every point of both paths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.cluster.evaluator import Here
from truepose.machine import Condition, Machine
from truepose.machine_tests.circle_path import CirclePath, circle_path, out_of_reach
from truepose.machine_tests.circular_diagnosis import (
    RadialCause,
    TurnStep,
    known_causes,
    steps_of,
    uncertain_causes,
)
from truepose.machine_tests.circular_quantities import QUANTITIES
from truepose.machine_tests.seen import Seen
from truepose.runs.poses import OK, REASONS, Progress, required_sources
from truepose.sources import Source
from truepose.uncertainty_analysis.arguments import (
    required_probability,
    required_samples,
    required_seed,
)
from truepose.verdict.states import STATES
from truepose.workpiece.samples import SampledParts, SampledState, sampled
from truepose.workpiece.states import part_states

if TYPE_CHECKING:
    from truepose.controllers.gcode.work_offsets import Positions

SAMPLES = 2000
"""Machines drawn where nobody says how many: the ends of a 95 % interval are good to some 4 %."""

LEAST_SAMPLES = 100

DEGREE = math.pi / 180.0


@dataclass(frozen=True, eq=False)
class CircularTest:
    """A test, evaluated: `seen` and `sampled` of each of `STATES`."""

    path: CirclePath
    sources: tuple[Source, ...]
    condition: Condition
    seen: tuple[Seen, ...]
    sampled: tuple[SampledParts, ...]
    """Of the quantities, and of F at every angle, counter-clockwise first."""
    probability: float
    seed: int

    @property
    def before(self) -> Seen:
        """The machine as it is commanded."""
        return self.seen[0]

    @cached_property
    def known_causes(self) -> list[RadialCause]:
        """Of the known error before compensation."""
        return known_causes(self.before, self.before.state, self.sources)

    @cached_property
    def uncertain_causes(self) -> list[RadialCause]:
        """Of what is not known."""
        return uncertain_causes(self.before, self.before.state, self.seed)

    @cached_property
    def steps(self) -> list[TurnStep]:
        """Where drives turn round."""
        return steps_of(self.path, self.before.state, self.sources)

    def quantities(self, state: int) -> Floats:
        """(s, q) of the machines drawn, NaN where one could not be assembled."""
        return self.sampled[state].values[:, : len(QUANTITIES)]

    def deviations(self, state: int) -> Floats:
        """(s, 2, n) F at every angle, likewise."""
        table = self.sampled[state].values[:, len(QUANTITIES) :]
        return table.reshape(len(table), 2, self.path.count)

    def interval(self, values: Floats) -> tuple[Floats, Floats]:
        """Ends of the interval, as much left out on either side, over the first axis.

        A machine that could not be assembled counts as beyond both ends.
        """
        tail = 0.5 * (1.0 - self.probability)
        lost = np.isnan(values)
        low = np.quantile(np.where(lost, -np.inf, values), tail, axis=0, method="lower")
        high = np.quantile(np.where(lost, np.inf, values), 1.0 - tail, axis=0, method="higher")
        return np.asarray(low), np.asarray(high)


def evaluate(
    machine: Machine,
    radius: float,
    centre: Positions,
    *,
    plane: str = "xy",
    start: float = 0.0,
    overshoot: float = math.pi,
    step: float = DEGREE,
    samples: int = SAMPLES,
    seed: int = 0,
    probability: float = 0.95,
    condition: Condition | None = None,
    progress: Progress | None = None,
) -> CircularTest:
    """As `circular_test`, before it is a Dataset."""
    count = required_samples(samples, LEAST_SAMPLES)
    number, share = required_seed(seed), required_probability(probability)
    given = machine.condition if condition is None else condition
    machine.check_condition(given)
    sources = required_sources(machine, given)
    path = circle_path(machine, radius, centre, plane, start, overshoot, step)
    poses, travel = path.both
    states, status = part_states(machine, given, sources, poses, travel)
    if (status != OK).any():
        order = np.concatenate([path.order(0), path.order(1)])
        whole = np.full(path.count, OK, np.uint8)
        failed = status != OK
        whole[order[failed]] = status[failed]
        raise out_of_reach(machine, path.angles, path.poses, np.array(REASONS)[whole])
    seen = tuple(Seen(path, state) for state in states)
    drawn = tuple(_sampled(one, count, number, progress, at) for at, one in enumerate(seen))
    return CircularTest(path, sources, given, seen, drawn, share, number)


def _sampled(
    seen: Seen, count: int, seed: int, progress: Progress | None, state: int
) -> SampledParts:
    def values(points: Floats) -> Floats:
        outcome = seen.evaluated(points - seen.state.points)
        return np.concatenate([outcome.values, outcome.deviations.reshape(len(points), -1)], axis=1)

    def account(done: int) -> None:
        if progress is not None:
            progress(state * count + done, len(STATES) * count)

    return sampled(SampledState(seen.state, values, seed), count, Here(), account=account)
