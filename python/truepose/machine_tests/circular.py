"""The circular test: what a ball bar will show, both ways round, and whether it has shown that."""

from __future__ import annotations

import math
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from truepose.controllers.gcode.work_offsets import Positions
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.machine_tests._base import MachineTest, TestOption
from truepose.machine_tests.circle_path import option_problem
from truepose.machine_tests.circular_prediction import DEGREE, SAMPLES, CircularTest, evaluate
from truepose.machine_tests.circular_quantities import STANDARD
from truepose.runs.arguments import checked
from truepose.runs.poses import Progress

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine_tests.circular_measured import ComparedReadings

UNCERTAINTY = 0.5e-6
"""M, standard uncertainty of a reading of a ball bar where nobody says another."""


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
) -> ComparedReadings | None:
    if not (math.isfinite(uncertainty) and uncertainty > 0.0):
        said = f"{uncertainty:g} m"
        raise RequestError(option_problem("uncertainty", said, "a length above zero"))
    if measured is None:
        if readings is not None:
            raise RequestError(option_problem("readings", "no measured file", "measured readings"))
        return None
    from truepose.machine_tests.circular_measured import ComparedReadings
    from truepose.machine_tests.circular_readings import measurements, read_readings

    read = read_readings(Path(measured), test.path.radius)
    if readings is not None:
        from truepose.calibration.measurements.write_csv import write_measurements

        known = test.before.deviations
        handed_on = measurements(test.path, read, uncertainty, known, test.condition)
        write_measurements(Path(readings), test.path.machine, handed_on)
    return ComparedReadings(test, read, uncertainty)


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
