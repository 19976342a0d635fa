"""Work offsets of corrected programs: given, read from LinuxCNC's file, or refused."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from command_line import call
from gcode import linuxcnc
from truepose.compensation.commands import actual_poses
from truepose.controllers.gcode._axes import Axes
from truepose.controllers.gcode.work_offsets import SYSTEMS, read_parameters
from truepose.errors import RequestError
from truepose.machine import Machine

MACHINE = MACHINES / "planar_two_slider.toml"
PROGRAM = "G21 G90 G94 G55\nG0 X0 Y0\nG1 X40 Y10 F600\nG3 X30 Y20 I-10 J0\nG91 G1 X-20 Y5\nM2\n"
ORIGIN, TURN = (250.0, 180.0), 20.0


def machine() -> Machine:
    """Ten kelvin above the temperature of its drawing."""
    return tp.load(MACHINE, settings=["condition.temperature=30"])


def parameter_file(folder: Path, active: int = 2) -> Path:
    """G55 as LinuxCNC keeps it, in mm; and what else stands in such a file."""
    path = folder / "linuxcnc.var"
    values = {5161: 1.0, 5210: 0.0, 5211: 3.0, 5220: active, 5221: 0.0}
    values |= {5241: ORIGIN[0], 5242: ORIGIN[1], 5250: TURN}
    path.write_text("".join(f"{n}\t{v:.6f}\n" for n, v in values.items()), encoding="ascii")
    return path


def program(folder: Path, text: str = PROGRAM) -> Path:
    path = folder / "part.ngc"
    path.write_text(text, encoding="ascii")
    return path


def given() -> dict[str, dict[str, float]]:
    return {"G55": {"x": ORIGIN[0] / 1e3, "y": ORIGIN[1] / 1e3, "r": math.radians(TURN)}}


def ends_by_linuxcnc(path: Path, folder: Path) -> np.ndarray:
    """(n, 9) ends of the moves, mm and degrees, machine coordinates."""
    offsets = {"G55": [*ORIGIN, *[0.0] * 7, TURN]}
    (outcome,) = linuxcnc.theirs([path], folder, offsets)
    assert outcome.error is None
    return outcome.moves[:, linuxcnc.END]


@pytest.mark.parametrize("word", ["G54", "G55", "G59.3"])
def test_an_offset_that_was_not_given_is_refused(word: str, tmp_path: Path) -> None:
    part = program(tmp_path, f"G21 G90 G94\nG0 X250 Y180\n{word} G1 X10 F600\n")
    with pytest.raises(RequestError) as refused:
        tp.correct_program(machine(), part, tmp_path / "out.ngc")
    (problem,) = refused.value.problems
    assert (problem.code, problem.line, problem.found) == ("gcode-no-offset", 3, word)
    assert "--offset" in str(problem.hint)
    assert "--var" in str(problem.hint)
    assert not (tmp_path / "out.ngc").exists()
    # Of another system nothing is known by that either.
    with pytest.raises(RequestError):
        tp.correct_program(machine(), part, tmp_path / "out.ngc", offsets={"G56": {"x": 0.1}})


def test_a_turned_offset_is_corrected_where_linuxcnc_goes(tmp_path: Path) -> None:
    """Both programs read by LinuxCNC under the same parameters, and the actual machine driven."""
    linuxcnc.require()
    hot = machine()
    part, target = program(tmp_path), tmp_path / "corrected.ngc"
    proof = tp.correct_program(hot, part, target, offsets=given())
    asked, commanded = (ends_by_linuxcnc(path, tmp_path) for path in (part, target))
    axes = Axes(hot)
    there, status = actual_poses(hot, axes.poses(commanded))
    assert not status.any()
    # Corners of the program are ends of blocks of what was written; arcs became more of them.
    for end in axes.poses(asked):
        assert np.linalg.norm(there - end, axis=1).min() <= proof.tolerance
    uncorrected, _ = actual_poses(hot, axes.poses(asked))
    assert np.linalg.norm(uncorrected - axes.poses(asked), axis=1).max() > 10.0 * proof.tolerance


def test_the_parameter_file_says_the_same(tmp_path: Path) -> None:
    hot, part = machine(), program(tmp_path)
    targets = tmp_path / "given.ngc", tmp_path / "read.ngc"
    one = tp.correct_program(hot, part, targets[0], offsets=given())
    file = parameter_file(tmp_path)
    other = tp.correct_program(hot, part, targets[1], parameter_file=file)
    texts = [target.read_text("utf-8").splitlines() for target in targets]
    assert texts[0][1:] == texts[1][1:]
    assert one.after == other.after
    assert other.coordinates == (
        "work offsets in mm and deg: G55 X250 Y180 R20, others of linuxcnc.var 0; G55 first"
    )
    # Without a word the system that is active in the file holds.
    bare = program(tmp_path, PROGRAM.replace(" G55", ""))
    tp.correct_program(hot, bare, targets[0], parameter_file=file)
    assert targets[0].read_text("utf-8").splitlines()[2:] == texts[1][2:]


def test_what_was_taken_for_granted_is_said(tmp_path: Path) -> None:
    hot, target = machine(), tmp_path / "corrected.ngc"
    part = program(tmp_path, "%\nG21 G90 G94\nG0 X250 Y180\nG1 X260 F600\n%\n")
    proof = tp.correct_program(hot, part, target)
    assert proof.coordinates == "in machine coordinates, no work offset"
    assert target.read_text("utf-8").splitlines()[1] == (
        f"(truepose for {hot.name}: in machine coordinates, no work offset)"
    )
    proof = tp.correct_program(hot, program(tmp_path), target, offsets=given())
    words = "work offsets in mm and deg: G55 X250 Y180 R20; machine coordinates first"
    assert proof.coordinates == words
    assert target.read_text("utf-8").startswith(f"(truepose for {hot.name}: {words})\n")


def test_on_the_command_line(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    part, target = program(tmp_path), tmp_path / "corrected.ngc"
    command = ["gcode", MACHINE, part, "--set", "condition.temperature=30"]
    output = ["--output", target, "--format", "json"]
    offset = ["--offset", "g55", "x=250,y=180,r=20"]
    done = call(capsys, *command, *output, *offset)
    assert done.code == 0, done.err
    assert json.loads(done.out)["coordinates"].startswith("work offsets in mm and deg: G55 X250")
    text = target.read_text("utf-8")
    assert call(capsys, *command, *output, "--var", parameter_file(tmp_path)).code == 0
    assert target.read_text("utf-8").splitlines()[1:] == text.splitlines()[1:]
    done = call(capsys, *command, *output)
    assert (done.code, done.codes) == (2, ["gcode-no-offset"])
    done = call(capsys, *command, *offset, "--dry-run")
    assert done.code == 0
    assert "program work offsets in mm and deg" in done.out


def test_a_dry_run_is_the_proof_without_the_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    part, target = program(tmp_path), tmp_path / "corrected.ngc"
    hot = machine()
    proof = tp.correct_program(hot, part, target, offsets=given())
    before = sorted(tmp_path.iterdir())
    dry = tp.correct_program(hot, part, None, offsets=given())
    assert (dry.before, dry.after, dry.target) == (proof.before, proof.after, "")
    assert sorted(tmp_path.iterdir()) == before
    # A tolerance above the error makes it worse: no, with the proof.
    command = ["gcode", MACHINE, part, "--offset", "G55", "x=250,y=180"]
    done = call(capsys, *command, "--dry-run", "--tolerance", "5 mm")
    assert (done.code, done.codes) == (1, ["gcode-no-better"])
    assert call(capsys, *command, "--dry-run", "--output", target).code == 2
    assert call(capsys, *command, "--dry-run", "--force").code == 2
    assert call(capsys, *command).code == 2


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        ("5210 1\n5211 2.5\n", "G92", None),
        ("5220 12\n", "5220", None),
        ("5220 1\n5241 abc\n", "cannot be read", 2),
        ("5241\n", "cannot be read", 1),
        ("5241 nan\n", "not finite", 1),
    ],
)
def test_bad_parameter_files(text: str, message: str, line: int | None, tmp_path: Path) -> None:
    path = tmp_path / "linuxcnc.var"
    path.write_text(text, encoding="ascii")
    with pytest.raises(RequestError) as refused:
        tp.correct_program(machine(), program(tmp_path), None, parameter_file=path)
    (problem,) = refused.value.problems
    assert (problem.code, problem.line, problem.file) == ("bad-correction", line, str(path))
    assert message in problem.message


def test_the_parameter_file_is_not_written_over(tmp_path: Path) -> None:
    file = parameter_file(tmp_path)
    with pytest.raises(RequestError) as refused:
        tp.correct_program(machine(), program(tmp_path), file, parameter_file=file)
    assert [problem.code for problem in refused.value.problems] == ["output-is-input"]
    with pytest.raises(RequestError) as refused:
        tp.correct_program(machine(), program(tmp_path), None, parameter_file=tmp_path / "none")
    assert [problem.code for problem in refused.value.problems] == ["file-missing"]
    with pytest.raises(RequestError) as refused:
        tp.correct_program(machine(), program(tmp_path), None, parameter_file=tmp_path)
    assert [problem.code for problem in refused.value.problems] == ["file-is-directory"]


def test_many_offsets_are_named_by_their_systems_and_their_file(tmp_path: Path) -> None:
    path = tmp_path / "linuxcnc.var"
    numbers = [5221 + 20 * system + axis for system in range(9) for axis in range(3)]
    path.write_text("".join(f"{n} {n / 7:.6f}\n" for n in numbers), encoding="ascii")
    known = read_parameters(path, machine())
    assert len(known.words) <= 200
    assert known.words == f"work offsets of linuxcnc.var, {' '.join(SYSTEMS)}; G54 first"
