"""`truepose gcode`: a corrected program, its proof on stdout, and bad input told with its place."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import truepose as tp
from command_line import MACHINES, PLANAR, call

PROGRAM = """\
G21 G90 G94 F900
G0 X300 Y200
G1 X340 Y210
G3 X350 Y220 I0 J10
"""
HEXAPOD = MACHINES / "hexapod.toml"


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part.ngc"
    path.write_text(PROGRAM, encoding="utf-8")
    return path


def test_the_proof_is_printed(
    capsys: pytest.CaptureFixture[str], part: Path, tmp_path: Path
) -> None:
    target = tmp_path / "corrected.ngc"
    outcome = call(capsys, "gcode", PLANAR, part, "-o", target)
    assert outcome.code == 0
    assert outcome.err == f"wrote {target}\n"
    assert "Error of the tool, before and after" in outcome.out
    assert "Tolerance 5.00 µm" in outcome.out
    assert "3 moves" in outcome.out
    assert "start at X300 Y200;" in outcome.out, "where it is taken to start"
    assert "line 2" in outcome.out
    rows = [line.split() for line in outcome.out.splitlines() if line.startswith(" position")]
    assert [row[1] for row in rows] == ["before", "after"]
    assert float(rows[0][2]) > 100.0 > 5.0 >= float(rows[1][2])
    assert target.read_text(encoding="utf-8").split("\n", 1)[1].startswith("G21 G90 G94 F900\nG0 X")


def test_the_same_for_programs(
    capsys: pytest.CaptureFixture[str], part: Path, tmp_path: Path
) -> None:
    target = tmp_path / "corrected.ngc"
    outcome = call(capsys, "gcode", PLANAR, part, "-o", target, "--format", "json")
    found = json.loads(outcome.out)
    proof = tp.correct_program(tp.load(PLANAR), part, tmp_path / "again.ngc")
    assert (tmp_path / "again.ngc").read_bytes() == target.read_bytes()
    assert proof.after.position is not None
    assert found["after"]["position"]["maximum"] == proof.after.position.value
    assert found["after"]["position"]["rms"] == proof.after.position_rms
    assert found["before"]["position"]["line"] in (2, 3, 4)
    assert set(found["before"]["position"]["pose"]) == {"x", "y"}
    assert found["after"]["orientation"] is None
    assert found["tolerance"] == pytest.approx(5e-6)
    assert (found["moves"], found["blocks"]) == (proof.moves, proof.blocks)
    assert found["units"] == {
        "position": "m",
        "orientation": "rad",
        "start": "mm, deg",
        "feed_time": "s",
        "acceleration": "m/s^2",
    }


def test_orientation_has_rows_where_there_is_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G21 G90 G94 F900\nG0 X0 Y0 Z500\nG1 X10\n", encoding="utf-8")
    outcome = call(capsys, "gcode", HEXAPOD, part, "-o", tmp_path / "out.ngc")
    assert outcome.code == 0
    assert sum(line.startswith(" orientation") for line in outcome.out.splitlines()) == 2
    assert "mdeg" in outcome.out


def test_options_reach_the_correction(
    capsys: pytest.CaptureFixture[str], part: Path, tmp_path: Path
) -> None:
    def blocks(*options: object) -> int:
        target = tmp_path / "out.ngc"
        outcome = call(capsys, "gcode", PLANAR, part, "-o", target, "--format", "json", *options)
        assert outcome.code == 0, outcome.err
        return int(json.loads(outcome.out)["blocks"])

    plain = blocks()
    assert blocks("--tolerance", "0.5 um") > 2 * plain
    # A bare number is in the units of the machine file: here 0.05 mm.
    assert blocks("--tolerance", "0.05") < plain
    assert blocks("--interpolation", "pose") < plain
    bare = tmp_path / "bare.ngc"
    bare.write_text("G90 G94 F20\nG0 X0 Y0\n/X1\nG1 X0.5\n", encoding="utf-8")
    target = tmp_path / "out.ngc"
    options = ["--units", "inch", "--offset", "g54", "x=300,y=8 in", "--block-delete", "on"]
    outcome = call(
        capsys, "gcode", PLANAR, bare, "-o", target, "--start", "x=310,y=190", "--digits", "3",
        "--set", "condition.temperature=40", "--format", "json", *options,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    found = json.loads(outcome.out)
    assert found["start"] == pytest.approx({"X": 310.0, "Y": 190.0})
    assert found["before"]["position"]["pose"]["y"] == pytest.approx(8 * 0.0254)
    assert found["moves"] == 2
    words = target.read_text(encoding="utf-8").splitlines()[-1].replace("Y", " Y").split()
    assert all(len(word.partition(".")[2]) <= 4 for word in words)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--tolerance", "5 kg"], "--tolerance"),
        (["--tolerance", "little"], "--tolerance"),
        (["--start", "x"], "--start"),
        (["--start", "x=1,x=2"], "--start"),
        (["--start", "x=1 deg"], "--start"),
        (["--offset", "g54", "y=far"], "--offset"),
        (["--offset", "g5", "y=1"], "offset"),
        (["--tolerance", "0"], "tolerance"),
    ],
)
def test_options_that_are_none(
    options: list[str],
    named: str,
    capsys: pytest.CaptureFixture[str],
    part: Path,
    tmp_path: Path,
) -> None:
    outcome = call(capsys, "gcode", PLANAR, part, "-o", tmp_path / "out.ngc", *options)
    assert (outcome.code, outcome.codes) == (2, ["bad-correction"])
    assert named in outcome.err
    assert not (tmp_path / "out.ngc").exists()


def test_a_problem_of_the_program_has_file_line_and_column(
    capsys: pytest.CaptureFixture[str], part: Path, tmp_path: Path
) -> None:
    part.write_text(PROGRAM + "G1 X310 Yfar\n", encoding="utf-8")
    arguments = ["gcode", PLANAR, part, "-o", tmp_path / "out.ngc", "--format", "json"]
    outcome = call(capsys, *arguments)
    assert outcome.code == 2
    assert outcome.err.startswith(f"{part}:5:9: error[gcode-")
    (problem,) = json.loads(outcome.out)["problems"]
    assert (problem["line"], problem["column"]) == (5, 9)


def test_a_move_out_of_the_workspace_is_named(
    capsys: pytest.CaptureFixture[str], part: Path, tmp_path: Path
) -> None:
    part.write_text(PROGRAM + "G1 X700\n", encoding="utf-8")
    outcome = call(capsys, "gcode", PLANAR, part, "-o", tmp_path / "out.ngc")
    assert (outcome.code, outcome.codes) == (2, ["gcode-pose"])
    assert outcome.err.startswith(f"{part}:5: error[gcode-pose]")
    assert "strut 1 misses by" in outcome.err


def test_the_output_is_asked_for(capsys: pytest.CaptureFixture[str], part: Path) -> None:
    outcome = call(capsys, "gcode", PLANAR, part)
    assert outcome.code == 2
    assert "--output" in outcome.err
    outcome = call(capsys, "gcode", PLANAR, part, "-o", part)
    assert (outcome.code, outcome.codes) == (2, ["output-is-input"])
    assert part.read_text(encoding="utf-8") == PROGRAM
    machine = part.with_name("machine.toml")
    machine.write_bytes(PLANAR.read_bytes())
    outcome = call(capsys, "gcode", machine, part, "-o", machine)
    assert (outcome.code, outcome.codes) == (2, ["output-is-input"])
    assert machine.read_bytes() == PLANAR.read_bytes()
