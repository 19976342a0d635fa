"""From raw data of a simulated printer: Klipper's own calibration beside truepose's.

The truth is known, so that it is known too where the nozzle goes with the numbers of each, all over
the workspace, and not on the bed alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from klipper_host import klipper
from numpy.typing import NDArray
from printed_config import kinematics_of

import truepose as tp
from klipper_printer import LINEAR, ROTARY, Printer, as_saved, saved
from sweeps import long_member, sweep, thinned
from truepose.calibration.calibrate import Calibration
from truepose.errors import MachineFileError

Array = NDArray[np.float64]
MM = 1e-3

pytestmark = pytest.mark.timeout(1800)
"""Klipper's search may take minutes where others compute too."""

BUILT_LINEAR = replace(
    LINEAR, radius=149.35, arms=(300.6, 300.45, 300.75), ends=(309.4, 309.9, 309.1),
    angles=(210.2, 329.75, 90.0),
)  # fmt: skip
BUILT_ROTARY = replace(
    ROTARY, radius=60.4, height=399.2, ends=(180.9, 179.6, 180.3), angles=(30.12, 149.9, 270.0)
)
TRUTHS = {
    "linear": (LINEAR, BUILT_LINEAR),
    "linear-other-pulleys": (LINEAR, replace(BUILT_LINEAR, scale=(1.001, 1.0012, 1.0008))),
    "rotary": (ROTARY, BUILT_ROTARY),
}
SEEDS = (1, 2, 3, 4, 5)


@dataclass(frozen=True)
class Compared:
    """Where the nozzle goes, off where it was commanded, (n,) mm over the workspace `points`."""

    held: Array
    ours: Array
    calibration: Calibration
    measured: str
    points: Array


def ours(name: str, seed: int, folder: Path) -> Compared:
    """The simulated printer measured, imported and calibrated here."""
    held, true = TRUTHS[name]
    measured = saved(held, true, z_offset=0.15, noise=(0.005, 0.02), seed=seed)
    text = held.config() + as_saved(measured)
    path = folder / "printer.cfg"
    path.write_text(text, "utf-8")
    found = tp.import_machine(path)
    assert found.measurements is not None
    calibration = tp.calibrate(found.machine, found.measurements)
    points = found.machine.poses() / MM
    ends = np.array([drive.travel[1] for drive in found.machine.drives])
    unit = 1.0 if held.turns else MM
    commanded = calibration.calibrated().inverse(points * MM)
    steps = (ends - commanded) / (unit * held.step)
    return Compared(
        off(true, points, np.array([held.steps(point) for point in points])),
        off(true, points, steps),
        calibration,
        measured,
        points,
    )


def off(true: Printer, points: Array, steps: Array) -> Array:
    """(n,) mm from where it was commanded to where the tool is."""
    places = np.array([true.tool(row) for row in steps])
    distances: Array = np.linalg.norm(places - points, axis=1)
    return distances


def klippers(name: str, measured: str, points: Array) -> Array:
    """Likewise with the numbers that Klipper finds, which searches in Python for many seconds."""
    held, true = TRUTHS[name]
    config = kinematics_of(held.config() + measured, steps=True, measured=True)
    answer = klipper(config, [], extended=True).calibrated
    steppers = [answer[f"stepper_{letter}"] for letter in "abc"]
    numbers = {
        "ends": tuple(float(row["position_endstop"]) for row in steppers),
        "angles": tuple(float(row["angle"]) for row in steppers),
        "radius": float(answer["printer"]["shoulder_radius" if held.turns else "delta_radius"]),
    }
    if held.turns:
        numbers["height"] = float(answer["printer"]["shoulder_height"])
    else:
        numbers["arms"] = tuple(float(row["arm_length"]) for row in steppers)
    theirs = replace(held, **numbers)
    return off(true, points, np.array([theirs.steps(point) for point in points]))


@pytest.mark.parametrize("seed", thinned(SEEDS))
@pytest.mark.parametrize("name", thinned(TRUTHS))
def test_what_is_stated_holds_of_the_machine(name: str, seed: int, tmp_path: Path) -> None:
    """The tool is where the calibrated machine says, within what the answer states of it."""
    found = ours(name, seed, tmp_path)
    assert found.calibration.accepted
    stated = found.calibration.gate.after.within[0] / MM
    assert found.ours.max() < stated
    assert found.ours.max() < 0.3 * found.held.max()


@pytest.mark.parametrize(
    ("name", "seed"),
    [
        ("linear", 1),
        pytest.param("linear-other-pulleys", 2, marks=sweep),
        *(
            long_member(name, seed)
            for name, seed in product(TRUTHS, SEEDS)
            if (name, seed) not in (("linear", 1), ("linear-other-pulleys", 2))
        ),
    ],
)
def test_klippers_numbers_are_further_off(name: str, seed: int, tmp_path: Path) -> None:
    """A bed and distances on it leave them free to be wrong above it; nothing it says tells.

    Of arms that are as drawn Klipper takes them to be, and may be nearer.
    """
    found = ours(name, seed, tmp_path)
    theirs = klippers(name, found.measured, found.points)
    assert np.isfinite(theirs).all()
    if name.startswith("linear"):
        assert rms(found.ours) < 0.5 * rms(theirs)


def rms(distances: Array) -> float:
    return float(np.sqrt(np.mean(distances**2)))


def test_klipper_is_not_told_of_other_microsteps(tmp_path: Path) -> None:
    """Its calibration takes them as they are; truepose refuses them, and says what was changed."""
    measured = saved(LINEAR, BUILT_LINEAR, z_offset=0.15)
    lines = [
        line if "height" not in line or "_pos" not in line else _halved(line)
        for line in measured.splitlines()
    ]
    changed = "\n".join([*lines, ""])
    config = kinematics_of(LINEAR.config() + changed, steps=True, measured=True)
    assert klipper(config, [], extended=True).calibrated["printer"]
    path = tmp_path / "printer.cfg"
    path.write_text(LINEAR.config() + as_saved(changed), "utf-8")
    with pytest.raises(MachineFileError) as refused:
        tp.import_machine(path)
    (problem,) = refused.value.problems
    assert problem.code == "import-steps"
    assert "7 heights" in problem.message
    assert "--set heights.microsteps=8" in (problem.hint or "")


def _halved(line: str) -> str:
    key, _, counted = line.partition(": ")
    return f"{key}: {','.join(f'{float(count) / 2.0:.3f}' for count in counted.split(','))}"
