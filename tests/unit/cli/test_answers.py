"""Exit codes of the commands that answer, and what `check` says."""

from __future__ import annotations

import csv
import io
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose
from command_line import MACHINES, PLANAR, call
from two_slider import LENGTH, carriages, tensions, tool

ENDS = list(itertools.product((-3e-4, 3e-4), repeat=2))
"""The lengths of the two struts at the ends of their bands, m."""


def farthest(corrected: bool) -> tuple[float, list[list[float]]]:
    """The farthest that the planar machine can be, mm: every corner of the bands, by circles.

    Also the poses where it is, mm: all along the guideways are alike.
    """
    machine = truepose.load(PLANAR)
    poses = machine.poses()
    known = elongations(machine, poses)
    joints = (
        truepose.compensate(machine)["joint_corrected"].values
        if corrected
        else machine.inverse(poses)
    )
    sizes = np.stack(
        [
            np.linalg.norm(tool(carriages(joints), LENGTH + known + end, poses) - poses, axis=1)
            for end in map(np.array, ENDS)
        ]
    )
    worst = sizes.max(axis=0) > sizes.max() * (1 - 1e-9)
    return float(sizes.max()) * 1e3, (poses[worst] * 1e3).round(9).tolist()


def elongations(machine: truepose.Machine, poses: np.ndarray) -> np.ndarray:
    """(n, 2) what heat and force make of the struts, m: 15 K, and 210 GPa on a 6 mm bar."""
    held = tensions(machine, poses, (1200.0, -1500.0))
    return LENGTH * (1.1e-5 * 15.0 + held / (210e9 * np.pi * 0.003**2))


FARTHEST = {"before compensation": farthest(False), "after compensation": farthest(True)}


@pytest.mark.parametrize("command", ["check", "budget", "compensate", "bounds", "report"])
@pytest.mark.parametrize("factor", [0.9999, 1.003])
def test_the_exit_code_turns_at_the_largest_error(
    command: str, factor: float, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    state = "after" if command in ("compensate", "report") else "before"
    size, _ = FARTHEST[f"{state} compensation"]
    asked = ["--set", f"accuracy.target={size * factor!r} mm"]
    if command == "report":
        asked += ["--output", str(tmp_path / "page.html")]
    required = [] if command == "check" else ["--require-accuracy"]
    outcome = call(capsys, command, PLANAR, *asked, *required)
    assert outcome.code == int(factor < 1)
    word, _, _ = next(line for line in outcome.out.splitlines() if state in line).partition("  ")
    assert word == ("NOT met" if factor < 1 else "met")
    if required:
        assert call(capsys, command, PLANAR, *asked).code == 0


@pytest.mark.parametrize("state", FARTHEST)
def test_the_first_lines_are_the_answers(state: str, capsys: pytest.CaptureFixture[str]) -> None:
    size, poses = FARTHEST[state]
    outcome = call(capsys, "check", PLANAR)
    where, before, witness, after, other, gains, *_ = outcome.out.splitlines()
    assert where.strip() == "At all 25 poses of the workspace; nothing is said between them."
    line, machine = (before, witness) if state.startswith("before") else (after, other)
    assert line in {
        f"NOT met  position {state}: {size * 1e3:.1f} µm, asked 0.5 mm (500 µm), at x {x:.0f} mm, "
        f"y {y:.0f} mm; rests on one machine inside the bands, solved exactly"
        for x, y in poses
    }
    assert machine.strip().startswith("witness: strut.")
    assert machine.count("end (") == 2, "both lengths stand at an end"
    linear = [answer["linear"] for answer in json_answers(capsys)]
    change = 1 - linear[1] / linear[0]
    assert gains.strip() == f"position: reduced by {100 * change:.0f} % by compensation."


def json_answers(capsys: pytest.CaptureFixture[str], *asked: str) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(
        call(capsys, "check", PLANAR, *asked, "--format", "json").out
    )["answers"]
    return found


def test_programs_get_the_known_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    for answer in json_answers(capsys):
        size, poses = FARTHEST[answer["state"]]
        assert set(answer) == {
            "quantity", "state", "highest", "asked", "units", "pose", "at", "met", "not_assembled",
            "answer", "witness", "linear", "bound", "rests_on", "example", "poses_used",
            "poses_left_out",
        }  # fmt: skip
        assert (answer["quantity"], answer["asked"], answer["units"]) == ("position", 0.5, "mm")
        assert (answer["answer"], answer["met"], answer["not_assembled"]) == ("NOT met", False, 0)
        assert answer["witness"] == pytest.approx(size, rel=1e-12)
        assert answer["witness"] <= answer["bound"]
        assert answer["highest"] == answer["linear"] == pytest.approx(size, rel=3e-3)
        assert list(answer["at"].values()) in poses
        of_number = truepose.load(PLANAR).poses()[answer["pose"]] * 1e3
        assert of_number == pytest.approx(list(answer["at"].values()))
        assert answer["rests_on"] == "one machine inside the bands, solved exactly"
        deviations = {each["parameter"]: each for each in answer["example"]["causes"]}
        assert {name: abs(each["deviation"]["value"]) for name, each in deviations.items()} == {
            "strut.1.length": pytest.approx(0.3),
            "strut.2.length": pytest.approx(0.3),
        }


def test_only_met_is_met(capsys: pytest.CaptureFixture[str]) -> None:
    met, *_ = json_answers(capsys, "--set", "accuracy.target=2 mm")
    assert (met["answer"], met["met"]) == ("met", True)
    missed, *_ = json_answers(capsys)
    assert (missed["answer"], missed["met"]) == ("NOT met", False)


def test_csv_has_a_row_for_each_answer(capsys: pytest.CaptureFixture[str]) -> None:
    rows = list(csv.DictReader(io.StringIO(call(capsys, "check", PLANAR, "--format", "csv").out)))
    for row, answer in zip(rows, json_answers(capsys), strict=True):
        for name in ("answer", "state", "rests_on"):
            assert row[name] == answer[name]
        for name in ("witness", "linear", "bound", "highest", "asked"):
            assert float(row[name]) == answer[name]
        assert float(row["pose_x [mm]"]) == answer["at"]["x"]


def test_check_answers_in_the_units_of_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(call(capsys, "check", PLANAR, "--format", "json").out)
    assert document["machine"]["characteristic_length"] == {
        "value": pytest.approx(500),
        "units": "mm",
    }
    thermal = next(source for source in document["sources"] if source["name"] == "thermal")
    # 500 mm x 1.1e-5 1/K x 15 K
    assert [each["shift"] for each in thermal["deviations"]] == pytest.approx([0.0825, 0.0825])


def test_check_says_where_in_the_units_of_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    machine = MACHINES / "hexapod.toml"  # in inches
    document = json.loads(call(capsys, "check", machine, "--format", "json").out)
    answer = document["answers"][0]
    pose = truepose.load(machine).poses()[answer["pose"]]
    factors = np.array([1 / 0.0254] * 3 + [180 / np.pi] * 3)
    assert list(answer["at"].values()) == pytest.approx((pose * factors).tolist(), abs=1e-9)
    assert [answer["at"][name] for name in "xyz"] == [4.0, -4.0, 22.0]
    assert answer["units"] == "in"
    assert answer["witness"] == pytest.approx(4138.4e-6, abs=1e-7)
    assert answer["asked"] == pytest.approx(0.1 / 25.4)
    header, first, *_ = call(capsys, "check", machine, "--format", "csv").out.splitlines()
    assert header.endswith(
        "pose_x [in],pose_y [in],pose_z [in],pose_a [deg],pose_b [deg],pose_c [deg]"
    )
    assert [float(cell) for cell in first.split(",")[-6:]] == list(answer["at"].values())
    shown = call(capsys, "check", machine).out
    assert shown.splitlines()[1].startswith(
        "NOT met  position before compensation: 4138.4 µin, asked 0.1 mm (3937 µin), at x 4 in, "
    )


def test_check_says_why_poses_are_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    setting = ["--set", "workspace.grid.x=[-100, 200, 3]"]
    document = json.loads(call(capsys, "check", PLANAR, *setting, "--format", "json").out)
    assert document["workspace"]["status"] == {"ok": 5, "unreachable": 10}
    assert {(a["poses_used"], a["poses_left_out"]) for a in document["answers"]} == {(5, 10)}
    shown = [line.strip() for line in call(capsys, "check", PLANAR, *setting).out.splitlines()]
    assert next(line for line in shown if line.startswith("At ")) == (
        "At 5 of the workspace's 15 poses ONLY: the machine cannot take the other 10, and nothing "
        "is said of them, nor of what lies between."
    )
    # The second guideway is at x = 600 mm and its strut 500 mm long: x = -100 is 200 mm too far.
    (reason,) = document["workspace"]["reasons"]
    assert (reason["what"], reason["name"], reason["count"]) == ("strut", "2", 10)
    assert (reason["amount"], reason["unit"]) == (pytest.approx(200), "mm")
    shown = call(capsys, "check", PLANAR, *setting).out
    assert "strut 2: up to 200.000 mm too far to reach" in shown


def test_check_of_poses_out_of_travel(capsys: pytest.CaptureFixture[str]) -> None:
    setting = ["--set", "drive.d1.travel=[0, 700]"]
    document = json.loads(call(capsys, "check", PLANAR, *setting, "--format", "json").out)
    (reason,) = document["workspace"]["reasons"]
    assert (reason["what"], reason["name"]) == ("travel", "d1")
    # Carriage 1 stands highest at x = 200, y = 300: 300 + sqrt(500^2 - 200^2).
    assert reason["amount"] == pytest.approx(300 + 210000**0.5 - 700)


def test_check_says_on_which_side_a_pose_is_out(capsys: pytest.CaptureFixture[str]) -> None:
    setting = ["--set", "workspace.grid.y=[-900, 900, 3]"]
    document = json.loads(call(capsys, "check", PLANAR, *setting, "--format", "json").out)
    # At y = 0 all is well; at -900 and 900 a carriage is 300 to 500 mm higher than the tool.
    amounts = {
        (each["name"], each["amount"] < 0): each for each in document["workspace"]["reasons"]
    }
    assert set(amounts) == {("d1", False), ("d1", True), ("d2", False), ("d2", True)}
    highest, lowest = 210000**0.5, 90000**0.5
    assert amounts["d1", False]["amount"] == pytest.approx(highest)
    assert amounts["d1", True]["amount"] == pytest.approx(lowest - 900)
    shown = call(capsys, "check", PLANAR, *setting).out
    assert f"drive d1: up to {900 - lowest:.3f} mm below its travel" in shown
    assert f"drive d1: up to {highest:.3f} mm above its travel" in shown


def test_check_says_that_a_pose_is_too_near(capsys: pytest.CaptureFixture[str]) -> None:
    setting = ["--set", "workspace.grid={ x = [0, 50, 2], y = [20, 20, 1] }"]
    outcome = call(capsys, "check", MACHINES / "five_bar.toml", *setting)
    assert "strut 2: up to 22.379 mm too near to reach" in outcome.out


def test_every_machine_shipped_can_be_checked(capsys: pytest.CaptureFixture[str]) -> None:
    for file in sorted(MACHINES.glob("*.toml")):
        outcome = call(capsys, "check", file)
        assert outcome.code in (0, 1), (file, outcome.err)
        assert "worst conditioning" in outcome.out


def test_no_accuracy_asked_is_no_failure(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text = PLANAR.read_text()
    head, _, tail = text.partition("[accuracy]")
    assert tail.count("\n[") == 0
    file = tmp_path / "machine.toml"
    file.write_text(head)
    for command in ("check", "budget"):
        outcome = call(capsys, command, file)
        assert outcome.code == 0
        assert "not asked" in outcome.out
    # To say of how many machines it is asked is not to ask.
    for told in ([], ["--set", "accuracy.at=95 %"]):
        outcome = call(capsys, "budget", "--require-accuracy", file, *told)
        assert outcome.code == 2
        assert "no-accuracy" in outcome.err
        assert outcome.out == ""
