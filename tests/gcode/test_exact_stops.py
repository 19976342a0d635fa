"""Exact stops: how many there are, what they take, and what a path mode makes of them."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import call
from truepose import _kernel
from truepose.controllers.gcode._axes import Axes
from truepose.controllers.gcode.proof import Proof
from truepose.errors import RequestError
from truepose.machine import Machine

TWO_ARCS = """\
G21 G90 G17 G94 G61.1
G0 X280 Y180
G3 X280 Y180 I20 J0 F900
G2 X320 Y180 I20 J20
M2
"""


def hot() -> Machine:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    warm = machine.condition.reference_temperature + 25.0
    return machine.with_condition(
        machine.condition.replace(temperature=warm, force=(300.0, 200.0, 0.0))
    )


def corrected(text: str, folder: Path, **options: object) -> tuple[Proof, str]:
    source, target = folder / "part.ngc", folder / "corrected.ngc"
    source.write_text(text)
    proof = tp.correct_program(hot(), source, target, tolerance=2e-7, **options)  # type: ignore[arg-type]
    return proof, target.read_text()


def seconds(program: Path, machine: Machine, acceleration: float) -> tuple[int, float]:
    """Blocks at feed, and the time of all with a stop behind each, by their highest speed."""
    axes = Axes(machine)
    moves = _kernel.GcodeReader(program, start=axes.home(), axes=axes.names).read(100_000)
    count, time = 0, 0.0
    for kind, length, speed in zip(
        moves.kind, moves.length * 1e-3, moves.speed * 1e-3, strict=True
    ):
        if kind:
            highest = min(speed, math.sqrt(acceleration * length))
            # Half the way at half the highest speed on average, if that is all it comes to.
            time += length / highest + highest / acceleration
            count += 1
    return count, time


@pytest.mark.parametrize("mode", ["G61", "G61.1"])
def test_stops_and_their_time_are_told_before_and_after(mode: str, tmp_path: Path) -> None:
    proof, _ = corrected(TWO_ARCS.replace("G61.1", mode), tmp_path, acceleration=0.4)
    stops = proof.exact_stops
    before = seconds(tmp_path / "part.ngc", hot(), 0.4)
    after = seconds(tmp_path / "corrected.ngc", hot(), 0.4)
    assert stops.before == before[0] == 2
    assert stops.after == after[0] > 20
    assert stops.seconds_before == pytest.approx(before[1], rel=1e-9)
    # The pieces' lengths are those of the programmed path.
    assert stops.seconds_after == pytest.approx(after[1], rel=1e-3)
    assert stops.seconds_after > stops.seconds_before + 0.3
    (warning,) = proof.warnings
    assert warning["code"] == "exact-stops"
    assert f"the 2 blocks at feed there are {stops.after:,} now" in warning["sentence"]
    assert "400 mm/s^2" in warning["sentence"]


@pytest.mark.parametrize("mode", ["", "G64 P0.01"])
def test_without_exact_stops_nothing_is_said(mode: str, tmp_path: Path) -> None:
    proof, _ = corrected(TWO_ARCS.replace("G61.1", mode), tmp_path)
    assert proof.warnings == ()
    assert (proof.exact_stops.before, proof.exact_stops.after) == (0, 0)
    length = (
        2.0 * math.pi * 0.02
        + _kernel.GcodeReader(tmp_path / "part.ngc", start={"X": 0.0, "Y": 0.0}, axes="XY")
        .read(9)
        .length[2]
        * 1e-3
    )
    assert proof.exact_stops.seconds_after == pytest.approx(length / 0.015, rel=1e-9)
    assert proof.exact_stops.seconds_before == pytest.approx(length / 0.015, rel=1e-9)


def test_a_path_mode_keeps_the_stops_of_the_program_and_makes_none(tmp_path: Path) -> None:
    plain, text = corrected(TWO_ARCS, tmp_path)
    proof, blended = corrected(TWO_ARCS, tmp_path, path_mode="G64 P0.002")
    assert proof.warnings == ()
    assert proof.path_mode == "G64 P0.002"
    assert (proof.exact_stops.before, proof.exact_stops.after) == (2, 2)
    assert proof.exact_stops.seconds_after == proof.exact_stops.seconds_before
    # Beside the modes it is the same program, and each arc ends in the mode that it asks for.
    lines = blended.splitlines()
    assert [line for line in lines if line not in ("G64 P0.002", "G61.1")] == text.splitlines()
    modes = [line for line in lines if line.startswith("G6")]
    assert modes == ["G64 P0.002", "G61.1"] * 2
    exact = [number for number, line in enumerate(lines) if line == "G61.1"]
    assert lines[exact[0] + 2] == "G64 P0.002"  # one piece of the first arc lies between
    assert lines[exact[1] + 2] == "M2"
    assert proof.after == plain.after


def test_feeds_in_other_units_and_of_angles_alone_have_their_time(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    hot = machine.with_condition(machine.condition.replace(temperature=318.15))
    source = tmp_path / "part.ngc"
    source.write_text(
        "G21 G90 G94 G61\nG0 X0 Y0 Z500 A0 B0 C0\nG1 A1 F30\nG93 X5 F20\n"
        "G94 G20 F60 X0.5\nG95 F.1 X0\n"
    )
    stops = tp.correct_program(hot, source, None, acceleration=1.0).exact_stops
    turning = math.degrees(1.0 / machine.characteristic_length)
    expected = 1.0 / 0.5 + 0.5 / turning  # deg, deg/s
    for length, speed in ((5e-3, 5e-3 / 3.0), (7.7e-3, 1e-3)):  # F60 is read before G20
        expected += length / speed + speed / 1.0
    assert stops.seconds_before == pytest.approx(expected, rel=1e-9)
    assert stops.before == 4


@pytest.mark.parametrize(
    "mode",
    ["G64", "G61", "P0.002", "G64 P0", "G64 P-1", "G64 P0.1 P0.2", "G64 P0.1 X1", "G64 Pnan"],
)
def test_a_path_mode_that_keeps_to_no_path_is_refused(mode: str, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="path mode") as refusal:
        corrected(TWO_ARCS, tmp_path, path_mode=mode)
    assert [problem.code for problem in refusal.value.problems] == ["bad-correction"]
    assert not (tmp_path / "corrected.ngc").exists()


@pytest.mark.parametrize("acceleration", [0.0, -1.0, math.nan, math.inf])
def test_an_acceleration_that_is_none_is_refused(acceleration: float, tmp_path: Path) -> None:
    with pytest.raises(RequestError, match="acceleration"):
        corrected(TWO_ARCS, tmp_path, acceleration=acceleration)


def test_the_command_warns_and_says_what_the_path_mode_adds(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    source = tmp_path / "part.ngc"
    source.write_text(TWO_ARCS)
    arguments = ["gcode", MACHINES / "planar_two_slider.toml", source, "--dry-run"]
    arguments += ["--set", "condition.temperature=45 degC", "--tolerance", "0.2 um"]
    told = call(capsys, *arguments, "--acceleration", "400 mm/s^2")
    assert told.code == 0
    assert "warning[exact-stops]: in G61 and G61.1 the tool stops" in told.err
    assert "with 400 mm/s^2 of acceleration" in told.err
    answer = call(capsys, *arguments, "--path-mode", "G64 P0.002", "--format", "json")
    stops = json.loads(answer.out)["exact_stops"]
    assert stops["before"] == stops["after"]
    assert stops["before"]["stops"] == 2
    assert not answer.err
    blended = call(capsys, *arguments, "--path-mode", "G64 P0.002")
    assert "Pieces joined by G64 P0.002" in blended.out
    assert np.isclose(stops["acceleration"], 1.0)
