"""Readings of a ball bar against the prediction: within, or not, and what would explain them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import load_text
from made_circular import CENTRE, PLAY, Truth, readings_text, with_keys
from sweeps import sweep
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.errors import MachineFileError, RequestError
from truepose.machine import Machine
from truepose.machine_tests.circular_measured import ComparedReadings
from truepose.machine_tests.circular_prediction import CircularTest, evaluate
from truepose.machine_tests.circular_readings import read_readings

RADIUS = 0.05
PLACE = {"x": CENTRE[0], "y": CENTRE[1]}
NOISE = 0.5e-6
BAND = 3e-4
"""m: of both lengths, uniform."""

OPEN = f'backlash = {{ play = "{1e3 * PLAY} mm", threshold = "5 kN" }}'


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    text = with_keys(drive=OPEN).replace(
        'section_area = "28 mm^2"\nmaterial',
        'length_tolerance = [-0.3, 0.3]\nsection_area = "28 mm^2"\nmaterial',
    )
    assert text.count("length_tolerance") == 2
    return load_text(tmp_path_factory.mktemp("machine"), text)


@pytest.fixture(scope="module")
def test(machine: Machine) -> CircularTest:
    return evaluate(machine, RADIUS, PLACE, samples=1000)


def noise(seed: int, size: int = 180) -> np.ndarray:
    return np.random.default_rng(seed).normal(scale=NOISE, size=(2, size))


def compared(test: CircularTest, folder: Path, truth: Truth, seed: int = 1) -> ComparedReadings:
    """Of readings of a machine, by a ball bar that is not in the middle."""
    file = folder / "readings.csv"
    file.write_text(readings_text(truth, RADIUS, noise(seed), eccentric=20e-6 - 35e-6j))
    return ComparedReadings(test, read_readings(file, RADIUS), NOISE)


def share_within(test: CircularTest, folder: Path, count: int) -> float:
    rng = np.random.default_rng(7)
    within = 0
    for seed in range(count):
        lengths = rng.uniform(-BAND, BAND, 2)
        within += compared(test, folder, Truth(tuple(lengths), PLAY), seed).within
    return within / count


def test_machines_of_the_model_are_within(test: CircularTest, tmp_path: Path) -> None:
    """95 of 100, less four standard deviations of a binomial."""
    assert share_within(test, tmp_path, 100) >= 0.95 - 0.09


@sweep
def test_as_many_machines_of_the_model_are_within_as_is_said(
    test: CircularTest, tmp_path: Path
) -> None:
    assert share_within(test, tmp_path, 400) == pytest.approx(0.95, abs=0.04)


@pytest.mark.parametrize(
    ("truth", "first", "value"),
    [
        (Truth((12e-4, 0.0), PLAY), "strut.1.length", 12e-4),
        (Truth((0.0, -9e-4), PLAY), "strut.2.length", -9e-4),
        (Truth((0.0, 0.0), PLAY, (0.0, 1.5e-3)), "drive.d2.scale", 1.5e-3),
    ],
    ids=["strut 1", "strut 2", "scale of drive 2"],
)
def test_what_is_off_is_named_first(
    test: CircularTest, truth: Truth, first: str, value: float, tmp_path: Path
) -> None:
    found = compared(test, tmp_path, truth)
    assert not found.within
    best = found.explanations[0]
    assert best.names[0] == first
    assert best.value == pytest.approx(value, rel=0.1)
    assert best.share > 0.95
    assert found.explanations[1].share < best.share - 0.005


@pytest.mark.parametrize("drive", [0, 1])
def test_more_play_than_the_file_says_is_named(
    test: CircularTest, drive: int, tmp_path: Path
) -> None:
    """No length makes steps: that the lengths are free by far more does not hide them."""
    play = [PLAY, PLAY]
    play[drive] *= 1.3
    found = compared(test, tmp_path, Truth(play=(play[0], play[1])))
    assert not found.within
    best = found.explanations[0]
    assert best.names[0] == f"drive.d{drive + 1}.play"
    assert best.value == pytest.approx(0.3 * PLAY, rel=0.15)
    assert best.share > 0.7


def test_a_measured_circle_has_the_quantities_of_its_readings(
    test: CircularTest, tmp_path: Path
) -> None:
    found = compared(test, tmp_path, Truth((1e-4, 0.0), PLAY))
    exact = compared(evaluate_exact(test), tmp_path, Truth((1e-4, 0.0), PLAY))
    assert found.values == pytest.approx(exact.values, abs=1e-12)
    low, high = found.intervals
    assert ((low <= found.values) & (found.values <= high)).all()


def evaluate_exact(test: CircularTest) -> CircularTest:
    """Another seed changes nothing of what is measured."""
    return evaluate(test.path.machine, RADIUS, PLACE, samples=100, seed=5)


def test_readings_are_handed_on_to_a_calibration(machine: Machine, tmp_path: Path) -> None:
    """Which finds the length together with where the ball bar stands."""
    file, handed_on = tmp_path / "readings.csv", tmp_path / "handed_on.csv"
    file.write_text(readings_text(Truth((2e-4, -1e-4), PLAY), RADIUS, noise(4)))
    tp.circular_test(machine, RADIUS, PLACE, measured=file, readings=handed_on, samples=100)
    assert read_measurements(handed_on, machine).n_row == 360
    found = tp.calibrate(machine, handed_on)
    values = dict(zip(found.fit.unknowns.labels, found.fit.values, strict=False))
    lengths = [value for name, value in values.items() if "length" in name]
    assert lengths == pytest.approx([2e-4, -1e-4], abs=1e-5)


def refused(machine: Machine, file: Path, text: str) -> MachineFileError:
    file.write_text(text)
    with pytest.raises(MachineFileError) as caught:
        tp.circular_test(machine, RADIUS, PLACE, measured=file, samples=100)
    return caught.value


GOOD = readings_text(Truth(), RADIUS, np.zeros((2, 180)))


@pytest.mark.parametrize(
    ("text", "code", "line", "found"),
    [
        (GOOD.replace("radius (mm)", "radius"), "no-unit", 1, '"radius"'),
        (GOOD.replace(", direction", ", way"), "unknown-column", 1, '"way"'),
        (
            re.sub(r"\n0\.000000, [\d.]+", "\n0, 0.002", GOOD, count=1),
            "test-readings",
            2,
            "0.002 mm",
        ),
        (GOOD.replace(", 1, cw", ", 1.5, cw"), "test-readings", 182, "1.5"),
        (GOOD.replace("counter-clockwise", "cw"), "test-readings", None, "clockwise"),
        (GOOD.replace("counter-clockwise", "left"), "unknown-choice", 2, '"left"'),
        ("\n".join(GOOD.splitlines()[:20] + GOOD.splitlines()[181:]), "test-readings", None, None),
        ("\n".join(GOOD.splitlines()[:5] + GOOD.splitlines()[181:]), "test-readings", None, None),
    ],
    ids=["unit", "column", "deviation", "run", "one way", "word", "gap", "few"],
)
def test_readings_that_are_none(
    text: str, code: str, line: int | None, found: str | None, machine: Machine, tmp_path: Path
) -> None:
    problem = refused(machine, tmp_path / "readings.csv", text).problems[0]
    assert problem.code == code
    assert line is None or problem.line == line
    assert found is None or problem.found == found
    assert problem.expected


@pytest.mark.parametrize(
    ("options", "code", "found"),
    [
        ({"radius": 0.5}, "circle-out-of-reach", "angles"),
        ({"radius": -0.1}, "test-option", "-0.1 m"),
        ({"plane": "yz"}, "test-option", "yz"),
        ({"centre": {"x": 0.3}}, "test-option", "x"),
        ({"centre": {"x": 0.3, "y": 0.2, "z": 0.1}}, "test-option", "z"),
        ({"step": 0.5}, "test-option", "28.6479 deg"),
        ({"overshoot": -1.0}, "test-option", "0 to 720 deg"),
        ({"uncertainty": 0.0}, "test-option", "0 m"),
        ({"readings": "there.csv"}, "test-option", "no measured file"),
    ],
)
def test_a_test_that_cannot_be_made(
    options: dict[str, object], code: str, found: str, machine: Machine
) -> None:
    asked = {"radius": RADIUS, "centre": PLACE, "samples": 100} | options
    with pytest.raises(RequestError) as caught:
        tp.circular_test(machine, **asked)  # type: ignore[arg-type]
    problem = caught.value.problems[0]
    assert problem.code == code
    assert found in f"{problem.found} {problem.expected}"
