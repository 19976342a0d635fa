"""The tolerance that nobody asks for follows from the error before, and nothing is made worse.

What the program and its correction do is computed here, for two sliders and two struts in the
plane: circles about the carriages, struts longer by expansion times rise. Nothing of the library
but the written file and the numbers that are judged.
"""

from __future__ import annotations

import itertools
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import PLANAR, call
from truepose.controllers.gcode import NoBetter, correct
from truepose.controllers.gcode.proof import Errors, Worst, improves
from truepose.controllers.gcode.tolerance import MOST
from truepose.machine import Machine

APART, STRUT, EXPANSION = 600.0, 500.0, 1.1e-5
"""mm, mm, 1/K: what `planar_two_slider.toml` says."""

CORNERS = np.array([[240.0, 140.0], [360.0, 140.0], [330.0, 260.0]])
PART = "G21 G90 G94 F900\nG0 X240 Y140\nG1 X360\nX330 Y260\n"


def warm(rise: float) -> Machine:
    """Struts warmer by `rise`, K, and no load."""
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    kelvin = machine.condition.reference_temperature + rise
    return machine.with_condition(
        machine.condition.replace(temperature=kelvin, force=(0.0, 0.0, 0.0))
    )


def carriages(points: np.ndarray) -> np.ndarray:
    """(n, 2) where the nominal machine has its carriages for points (n, 2), mm."""
    x, y = points.T
    return np.stack([y + np.sqrt(STRUT**2 - x**2), y + np.sqrt(STRUT**2 - (APART - x) ** 2)], -1)


def tool(joints: np.ndarray, length: float) -> np.ndarray:
    """(n, 2) where struts of a length meet below the carriages, mm."""
    first, second = joints.T
    middle = np.stack([np.full(len(joints), 0.5 * APART), 0.5 * (first + second)], -1)
    across = np.stack([np.full(len(joints), APART), second - first], -1)
    half = 0.5 * np.linalg.norm(across, axis=1)
    below = np.stack([across[:, 1], -across[:, 0]], -1) / (2.0 * half[:, np.newaxis])
    return middle + below * np.sqrt(length**2 - half**2)[:, np.newaxis]


def off(target: Path, rise: float) -> tuple[float, float]:
    """µm, before and after: how far the warm machine is off, pose or joints straight between."""
    length = STRUT * (1.0 + EXPANSION * rise)
    share = np.linspace(0.0, 1.0, 4001)[:, np.newaxis]
    programmed = np.concatenate([a + (b - a) * share for a, b in itertools.pairwise(CORNERS)])
    before = np.linalg.norm(tool(carriages(programmed), length) - programmed, axis=1).max()
    ends, at = [], np.full(2, np.nan)
    for line in target.read_text(encoding="utf-8").splitlines():
        for letter, value in re.findall(r"([XY])(-?[\d.]+)", line):
            at["XY".index(letter)] = float(value)
        if np.isfinite(at).all():
            ends.append(at.copy())
    table, t = np.array(ends), np.linspace(0.0, 1.0, 41)[:, np.newaxis]
    worst = 0.0
    for a, b in itertools.pairwise(table):
        joints = carriages(np.stack([a, b]))
        for ways in (carriages(a + (b - a) * t), joints[0] + (joints[1] - joints[0]) * t):
            found = tool(ways, length)
            worst = max(worst, _from_path(found))
    return 1e3 * before, 1e3 * worst


def _from_path(points: np.ndarray) -> float:
    """mm, the farthest of points (n, 2) from the nearest of the programmed lines."""
    gaps = []
    for a, b in itertools.pairwise(CORNERS):
        along = b - a
        share = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
        gaps.append(np.linalg.norm(points - a - share[:, np.newaxis] * along, axis=1))
    return float(np.min(gaps, axis=0).max())


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.ngc"
    path.write_text(PART, encoding="utf-8")
    return path


@pytest.mark.parametrize("rise", [0.05, 0.25, 2.0, -2.0])
def test_a_small_error_is_made_smaller(rise: float, part: Path, tmp_path: Path) -> None:
    target = tmp_path / "out.ngc"
    proof = tp.correct_program(warm(rise), part, target)
    before, after = off(target, rise)
    assert proof.before.position
    assert proof.after.position
    assert 1e6 * proof.before.position.value == pytest.approx(before, rel=1e-6)
    assert after < 0.11 * before
    # What is stated counts along the path as well, and so is a little more.
    assert after <= 1e6 * proof.after.position.value + 1e-3
    assert proof.improves
    assert proof.tolerance == pytest.approx(0.1e-6 * before, rel=1e-6)
    assert proof.tolerance_from.reason == "error"


def test_a_large_error_has_the_usual_tolerance(part: Path, tmp_path: Path) -> None:
    proof = tp.correct_program(warm(25.0), part, tmp_path / "out.ngc")
    before, after = off(tmp_path / "out.ngc", 25.0)
    assert before > 50.0 > 5.0 >= after
    assert proof.tolerance == MOST == 5e-6
    assert proof.tolerance_from.reason == "most"


def test_no_tolerance_is_below_what_digits_hold(part: Path, tmp_path: Path) -> None:
    """At 1e-4 mm the last decimal is off by 0.05 µm on two axes; a program may be of inches."""
    proof = tp.correct_program(warm(0.25), part, tmp_path / "out.ngc", digits=4, tolerance=None)
    before, _ = off(tmp_path / "out.ngc", 0.25)
    rounding = 0.05e-6 * math.sqrt(2.0) * 2.54
    assert 0.1e-6 * before < rounding / 0.1
    assert proof.tolerance == pytest.approx(rounding / 0.1, rel=1e-12)
    assert proof.tolerance_from.reason == "digits"


def test_what_is_no_better_is_not_written(part: Path, tmp_path: Path) -> None:
    """5 µm of tolerance for a machine that is off by less than 2."""
    target = tmp_path / "out.ngc"
    with pytest.raises(NoBetter) as no:
        tp.correct_program(warm(0.25), part, target, tolerance=5e-6)
    assert [path.name for path in tmp_path.iterdir()] == ["part.ngc"]
    (problem,) = no.value.problems
    assert problem.code == "gcode-no-better"
    proof = tp.correct_program(warm(0.25), part, target, tolerance=5e-6, force=True)
    before, after = off(target, 0.25)
    assert 1.5 < before < 2.0 < 3.0 < after < 5.0
    assert not proof.improves
    stated = [float(text) for text in re.findall(r"[\d.]+(?= µm)", problem.found or "")]
    assert stated[1] == pytest.approx(before, rel=5e-3)
    assert after <= stated[0] * 1.005 <= 5.0
    assert no.value.proof.after == proof.after


def test_the_command_says_what_it_took_and_refuses(
    part: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "out.ngc"
    ask = ["gcode", PLANAR, part, "-o", target, "--set", "condition.temperature=20.25"]
    ask += ["--set", "condition.force.x=0", "--set", "condition.force.y=0"]
    outcome = call(capsys, *ask)
    assert outcome.code == 0
    before, _ = off(target, 0.25)
    assert f"Tolerance {0.1 * before:.4f} µm, 10 % of the error before ({before:.2f} µm)" in (
        outcome.out
    )
    target.unlink()
    outcome = call(capsys, *ask, "--tolerance", "5 um")
    assert (outcome.code, outcome.codes) == (1, ["gcode-no-better"])
    assert not target.exists()
    assert "before" in outcome.out
    outcome = call(capsys, *ask, "--tolerance", "5 um", "--format", "json")
    found = json.loads(outcome.out)
    assert (found["improves"], found["written"], found["tolerance_from"]) == (False, False, "asked")
    outcome = call(capsys, *ask, "--tolerance", "5 um", "--force", "--format", "json")
    found = json.loads(outcome.out)
    assert outcome.code == 0
    assert (found["improves"], found["written"]) == (False, True)
    assert 1e6 * found["before"]["position"]["maximum"] == pytest.approx(before, rel=1e-6)
    assert target.exists()


def test_points_of_a_long_program_are_thinned(part: Path, tmp_path: Path) -> None:
    """The error is looked up evenly, at as few points as are enough."""
    y = 140.0 + 120.0 * np.arange(6001) / 6000
    text = PART + "".join(f"Y{value:.4f}\n" for value in y)
    part.write_text(text, encoding="utf-8")
    batch = correct.BATCH
    found = []
    for size in (batch, 97):
        correct.BATCH = size
        try:
            proof = tp.correct_program(warm(2.0), part, tmp_path / "out.ngc")
        finally:
            correct.BATCH = batch
        found.append(proof.tolerance)
        assert proof.before.position
        assert proof.tolerance == pytest.approx(0.1 * proof.before.position.value, rel=0.01)
    assert found[0] == found[1]


def errors(position: float, angle: float) -> Errors:
    return Errors(Worst(position, 1, (0.0,)), None, Worst(angle, 1, (0.0,)), None)


@pytest.mark.parametrize(
    ("before", "after", "better"),
    [
        ((10e-6, 1e-5), (1e-6, 1e-6), True),
        ((10e-6, 1e-5), (10e-6, 1e-6), False),
        # The angle alone: 20 µm at 0.5 m before, the position within a hundredth of that after.
        ((0.0, 40e-6), (0.19e-6, 1e-6), True),
        ((0.0, 40e-6), (0.21e-6, 1e-6), False),
        ((1.64e-6, 40e-6), (4.38e-6, 1e-6), False),
        # Nothing is to be corrected, and rounding is not worse than it must be.
        ((3e-9, 0.0), (2e-9, 8e-9), False),
        ((30e-9, 0.0), (2e-9, 8e-9), True),
        ((0.0, 0.0), (0.0, 0.0), False),
    ],
)
def test_better(before: tuple[float, float], after: tuple[float, float], better: bool) -> None:
    """An angle counts times half a metre; digits make 5 nm."""
    assert improves(errors(*before), errors(*after), 0.5, 5e-9) is better
