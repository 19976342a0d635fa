"""Exit codes of the commands that answer, and what `check` says."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import truepose
from command_line import MACHINES, PLANAR, call


def overall_worst() -> float:
    """What all sources can do to the planar machine's position, mm, from the results alone."""
    found = truepose.budget(truepose.load(PLANAR))
    bands = (found["worst"] - np.abs(found["error"])).sum("source")
    worst = np.abs(found["overall_error"]) + bands
    return float(np.sqrt((worst**2).sum("component")).max() * 1e3)


def remaining() -> float:
    """What compensation leaves of it, mm."""
    found = truepose.compensate(truepose.load(PLANAR))
    worst = np.maximum(found["bound"] + found["second_order"], np.abs(found["residual_lower"]))
    worst = np.maximum(worst, np.abs(found["residual_upper"]))
    return float(np.sqrt((worst**2).sum("component")).max() * 1e3)


@pytest.mark.parametrize("command", ["check", "budget", "compensate"])
@pytest.mark.parametrize("factor", [0.999, 1.001])
def test_the_exit_code_turns_at_the_accuracy_asked(
    command: str, factor: float, capsys: pytest.CaptureFixture[str]
) -> None:
    limit = remaining() if command == "compensate" else overall_worst()
    asked = ["--set", f"accuracy.target={limit * factor!r} mm"]
    required = [] if command == "check" else ["--require-accuracy"]
    assert call(capsys, command, PLANAR, *asked, *required).code == int(factor < 1)
    if required:
        assert call(capsys, command, PLANAR, *asked).code == 0


def test_check_answers_in_the_units_of_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(call(capsys, "check", PLANAR, "--format", "json").out)
    before, after = document["answers"]
    assert before["highest"] == pytest.approx(overall_worst(), rel=1e-12)
    assert after["highest"] == pytest.approx(remaining(), rel=1e-12)
    assert (before["asked"], before["units"], before["met"]) == (0.5, "mm", False)
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
    assert answer["at"] == {"x": 4.0, "y": 4.0, "z": 22.0, "a": -10.0, "b": -10.0, "c": 0.0}
    pose = truepose.load(machine).poses()[answer["pose"]]
    assert pose[:3] == pytest.approx([0.1016, 0.1016, 0.5588])
    header, first, *_ = call(capsys, "check", machine, "--format", "csv").out.splitlines()
    assert header.endswith(
        "pose_x [in],pose_y [in],pose_z [in],pose_a [deg],pose_b [deg],pose_c [deg]"
    )
    assert [float(cell) for cell in first.split(",")[-6:]] == list(answer["at"].values())


def test_check_says_why_poses_are_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    setting = ["--set", "workspace.grid.x=[-100, 200, 3]"]
    document = json.loads(call(capsys, "check", PLANAR, *setting, "--format", "json").out)
    assert document["workspace"]["status"] == {"ok": 5, "unreachable": 10}
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
        assert "no accuracy asked" in outcome.out
    # To say of how many machines it is asked is not to ask.
    for told in ([], ["--set", "accuracy.at=95 %"]):
        outcome = call(capsys, "budget", "--require-accuracy", file, *told)
        assert outcome.code == 2
        assert "no-accuracy" in outcome.err
        assert outcome.out == ""
