"""The circular test: what a ball bar will show, both ways round, and which cause makes what of it.

The path is driven with an overshoot, so that every drive's flank is what it is on the way; a sample
is one machine, and it goes to every point of both paths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.machine_tests._base import MachineTest, TestOption
from truepose.machine_tests.circle_path import CirclePath, circle_path, option_problem, out_of_reach
from truepose.machine_tests.circular_diagnosis import (
    Cause,
    Step,
    known_causes,
    steps_of,
    uncertain_causes,
)
from truepose.machine_tests.circular_quantities import QUANTITIES, STANDARD
from truepose.machine_tests.seen import Seen
from truepose.part.samples import Sampled, sampled
from truepose.part.states import part_states
from truepose.runs.arguments import checked
from truepose.runs.poses import OK, REASONS, Progress, required_sources
from truepose.sources import Source
from truepose.uncertainty_analysis.arguments import (
    required_probability,
    required_samples,
    required_seed,
)
from truepose.verdict.states import STATES

if TYPE_CHECKING:
    import xarray as xr

    from truepose.controllers.gcode.work_offsets import Positions
    from truepose.machine_tests.circular_measured import Compared

SAMPLES = 2000
"""Machines drawn where nobody says how many: the ends of a 95 % interval are good to some 4 %."""

LEAST_SAMPLES = 100

DEGREE = math.pi / 180.0

UNCERTAINTY = 0.5e-6
"""M, standard uncertainty of a reading of a ball bar where nobody says another."""


@dataclass(frozen=True, eq=False)
class CircularTest:
    """A test, evaluated: `seen` and `sampled` of each of `STATES`."""

    path: CirclePath
    sources: tuple[Source, ...]
    condition: Condition
    seen: tuple[Seen, ...]
    sampled: tuple[Sampled, ...]
    """Of the quantities, and of F at every angle, counter-clockwise first."""
    probability: float
    seed: int

    @property
    def before(self) -> Seen:
        """The machine as it is commanded."""
        return self.seen[0]

    @cached_property
    def known_causes(self) -> list[Cause]:
        """Of the known error before compensation."""
        return known_causes(self.before, self.before.state, self.sources)

    @cached_property
    def uncertain_causes(self) -> list[Cause]:
        """Of what is not known."""
        return uncertain_causes(self.before, self.before.state, self.seed)

    @cached_property
    def steps(self) -> list[Step]:
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


def _sampled(seen: Seen, count: int, seed: int, progress: Progress | None, state: int) -> Sampled:
    def values(points: Floats) -> Floats:
        found = seen.evaluated(points - seen.state.points)
        return np.concatenate([found.values, found.deviations.reshape(len(points), -1)], axis=1)

    def account(done: int) -> None:
        if progress is not None:
            progress(state * count + done, len(STATES) * count)

    return sampled(seen.state, values, count, seed, account=account)


@checked
def circular_test(
    machine: Machine,
    radius: float,
    centre: Positions,
    *,
    plane: str = "xy",
    start: float = 0.0,
    overshoot: float = math.pi,
    step: float = DEGREE,
    measured: str | PathLike[str] | None = None,
    uncertainty: float = UNCERTAINTY,
    readings: str | PathLike[str] | None = None,
    samples: int = SAMPLES,
    seed: int = 0,
    probability: float = 0.95,
    condition: Condition | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """What a ball bar will show on a circle, driven counter-clockwise and then clockwise.

    `radius`, m, about `centre`: coordinates by name (x y z a b c), m and rad, those that are angles
    by default of home. `plane`: "xy", "yz" or "zx"; angles count from its first axis towards the
    second. Readings begin at the angle `start` after an `overshoot`, and are a `step` apart, rad.
    `measured`: a file of readings (docs/circular_test.md), each with a standard `uncertainty`, m,
    that are compared; `readings`: a file to which they are written for `truepose.calibrate`.
    `samples` machines are drawn with `seed`; intervals hold the share `probability` of them.
    `condition`, default the file's. `progress` is called with (samples done, samples in all).

    Returns a Dataset over state, quantity, direction and angle, SI, described in docs/results.md.

    Raises `RequestError`: test-option, circle-out-of-reach, no-source, bad-samples, bad-seed,
    bad-probability; `MachineFileError` for a file of readings; `TrueposeError` as the sources do.
    """
    from truepose.machine_tests.circular_result import dataset

    test = evaluate(
        machine,
        radius,
        centre,
        plane=plane,
        start=start,
        overshoot=overshoot,
        step=step,
        samples=samples,
        seed=seed,
        probability=probability,
        condition=condition,
        progress=progress,
    )
    return dataset(test, _compared(test, measured, uncertainty, readings))


def _compared(
    test: CircularTest,
    measured: str | PathLike[str] | None,
    uncertainty: float,
    readings: str | PathLike[str] | None,
) -> Compared | None:
    if not (math.isfinite(uncertainty) and uncertainty > 0.0):
        found = f"{uncertainty:g} m"
        raise RequestError(option_problem("uncertainty", found, "a length above zero"))
    if measured is None:
        if readings is not None:
            raise RequestError(option_problem("readings", "no measured file", "measured readings"))
        return None
    from truepose.machine_tests.circular_measured import Compared
    from truepose.machine_tests.circular_readings import measurements, read_readings

    read = read_readings(Path(measured), test.path.radius)
    if readings is not None:
        from truepose.calibration.measurements.write_csv import write_measurements

        known = test.before.known
        handed_on = measurements(test.path, read, uncertainty, known, test.condition)
        write_measurements(Path(readings), test.path.machine, handed_on)
    return Compared(test, read, uncertainty)


TEST = MachineTest(
    "circular",
    "a circle both ways round, as a ball bar shows it",
    STANDARD,
    {
        "plane": TestOption("xy, yz or zx", "word"),
        "radius": TestOption('of the circle, such as "100 mm"', "length", required=True),
        "centre": TestOption(
            'of the circle, such as "x=0 mm, y=0 mm, z=200 mm"', "place", required=True
        ),
        "start": TestOption("angle at which the readings begin", "angle"),
        "overshoot": TestOption("angle that is driven before and after them", "angle"),
        "step": TestOption("angle between readings", "angle"),
        "measured": TestOption("file of readings to compare", "file"),
        "uncertainty": TestOption("standard uncertainty of a measured reading", "length"),
        "readings": TestOption("file for `truepose calibrate` to write", "file"),
    },
    circular_test,
    reporting="truepose.reporting.circular_test",
    page="truepose.reporting.circular_page",
)
