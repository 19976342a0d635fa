"""The tabs answer what their commands answer, of files in the machine's folder alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR
from machine_texts import load_text
from oracle_cases import case, dietmaier_text
from oracle_cases import pose as pose_of
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.errors import RequestError
from truepose.studio.answers import DroppedFile, Question
from truepose.studio.messages import fits
from truepose.studio.settings import Settings
from truepose.studio.tabs import TABS
from truepose.studio.tabs.over_time import MOST_TIMES

DATA = MACHINES.parent / "examples" / "data"

PROGRAM = """G21 G90 G94 F900
G0 X300 Y200
(feature: front, straightness 0.1)
G1 X340 Y210
(end)
"""
FEATURES = '[[feature]]\nname = "front"\nkind = "straightness"\nlines = "4"\nzone = "0.1 mm"\n'


def only(name: str, question: Question) -> Any:
    *_, value = TABS[name].give(question)
    return json.loads(json.dumps(value, allow_nan=False))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    inside = tmp_path / "machines"
    inside.mkdir()
    (inside / "part.ngc").write_text(PROGRAM.replace("(feature: front, straightness 0.1)\n", "\n"))
    (inside / "part.toml").write_text(FEATURES)
    (tmp_path / "secret.ngc").write_text(PROGRAM)
    text = PLANAR.read_text().replace("\ntemperature = 35", '\ntemperature_log = "log.csv"')
    rows = "\n".join(f"{60 * n}, {20 + 10 * np.sin(n / 200):.3f}" for n in range(1000))
    (inside / "log.csv").write_text(f"time (s), default (degC)\n{rows}\n")
    (inside / "warm.toml").write_text(text)
    (inside / "m.toml").write_bytes(PLANAR.read_bytes())
    return inside


def test_error_over_time_is_that_of_the_function(folder: Path) -> None:
    machine = tp.load(folder / "warm.toml")
    told = only("over_time", Question(machine, Settings((), (0.3, 0.2))))
    whole = tp.over_time(machine, [0.3, 0.2])
    sizes = np.linalg.norm(whole["error"].values[:, 0], axis=1)
    times = whole["time"].values.tolist()
    assert told["times"] == len(times) == 1000
    assert len(told["time"]) <= MOST_TIMES + 1
    shown = dict(zip(told["time"], told["error"]["position"], strict=True))
    assert all(shown[time] == sizes[times.index(time)] for time in shown)
    assert told["time"] == sorted(told["time"])
    largest = told["largest"]["position"]
    assert (largest["value"], times.index(largest["time"])) == (sizes.max(), sizes.argmax())
    assert largest["value"] == max(told["error"]["position"])
    assert only("over_time", Question(tp.load(PLANAR))) == {}  # no log: nothing is wrong


def test_the_part_is_that_of_the_function(folder: Path) -> None:
    options = {"program": "part.ngc", "features": "part.toml"}
    machine = tp.load(folder / "m.toml")
    told = only("part", Question(machine, options=options, folder=folder))
    whole = tp.part(machine, folder / "part.ngc", folder / "part.toml")
    assert told["samples"] == whole.attrs["samples"]
    assert told["points"] == whole.attrs["path_points"]
    for at, row in enumerate(told["rows"]):
        assert row["feature"] == str(whole["feature"].values[at])
        assert row["unit"] == str(whole["characteristic_units"].values[at])
        for number, state in enumerate(row["states"]):
            there = whole.isel(state=number, characteristic=at)
            assert state["verdict"] == str(there["verdict"].values)
            assert state["known"] == float(there["known"])
            assert state["interval"] == [float(there["lower"]), float(there["upper"])]
    assert [row["feature"] for row in told["rows"]] == ["front"]
    (folder / "other.NC").write_text(PROGRAM)
    names = {
        "programs": ["other.NC", "part.ngc"],
        "features_files": ["m.toml", "part.toml", "warm.toml"],
    }
    assert only("part", Question(machine, folder=folder)) == names
    assert {name: told[name] for name in names} == names | {"programs": ["part.ngc"]}


@pytest.mark.parametrize(
    "name", ["../secret.ngc", "link.ngc", "/etc/passwd", "none.ngc", ".", "", "a\0b", "x" * 5000]
)
def test_no_file_of_another_folder_is_read(name: str, folder: Path) -> None:
    (folder / "link.ngc").symlink_to(folder.parent / "secret.ngc")
    question = Question(tp.load(PLANAR), options={"program": name}, folder=folder)
    with pytest.raises(RequestError) as failure:
        only("part", question)
    (problem,) = failure.value.problems
    assert problem.code == "file-missing"
    assert "secret" not in problem.message


def test_names_that_are_no_names(folder: Path) -> None:
    question = Question(tp.load(PLANAR), options={"program": 3}, folder=folder)
    with pytest.raises(RequestError) as failure:
        only("part", question)
    assert failure.value.problems[0].code == "bad-argument"


def test_poses_to_measure_are_planned_with_the_instruments_of_the_file() -> None:
    machine, path = tp.load(DATA / "delta_printer.toml"), DATA / "delta_positions.csv"
    files = {1: DroppedFile(path.name, path.read_bytes())}

    def asked(**options: Any) -> Any:
        return only("calibration", Question(machine, options={"file": 1, **options}, files=files))

    told = asked(plan=4)
    data = read_measurements(path, machine)
    planned = tp.plan(machine, data.instruments, 4)
    assert told["planned"]["poses"] == planned.poses.tolist()
    assert told["planned"]["rms"]["position"] == planned.rms[:, 0].tolist()
    assert told["accepted"] == asked()["accepted"]
    for count in (0, -1, 2.5, "three"):
        with pytest.raises(RequestError) as failure:
            asked(plan=count)
        assert failure.value.problems[0].code == "plan-budget"


# --- other solutions


@pytest.mark.parametrize("name", ["planar_two_slider", "hexapod", "3prs"])
def test_modes_are_those_of_the_functions(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    pose = machine.poses()[1]
    question = Question(machine, Settings((), tuple(pose.tolist())), options={"starts": 300})
    told = only("modes", question)
    reached = tp.inverse_solutions(machine, pose)
    assert [row["mode"] for row in told["modes"]] == list(reached.working_modes)
    assert [row["joints"] for row in told["modes"]] == reached.joints.tolist()
    assert told["modes_left_out"] == 0
    found = tp.forward_solutions(machine, machine.inverse(pose), reached.poses[0], starts=300)
    forward = told["forward"]
    assert (forward["starts"], forward["converged"]) == (301, found.converged)
    assert forward["found"] == len(found.poses) > 1
    assert [row["pose"] for row in forward["solutions"]] == found.poses.tolist()
    assert forward["apart"] == found.apart.tolist()
    for at, row in enumerate(forward["solutions"]):
        assert found.in_workspace is not None
        assert row["in_workspace"] is bool(found.in_workspace[at])
        assert (row["status"], row["mode"]) == (found.status[at], found.working_modes[at])
        assert row["residual"] == found.residual[at]
        assert row["joint_residual"] == found.joint_residual[at]
        others = [value for n, value in enumerate(found.apart[at].tolist()) if n != at]
        assert (row["distance"], row["nearest"]) == (found.apart[at, 0], min(others))
    # The pose shown is the first of them.
    assert forward["solutions"][0]["distance"] == 0.0
    columns = [machine.dof.index(freedom) for freedom in machine.commanded]
    first = forward["solutions"][0]["pose"]
    assert [first[column] for column in columns] == pytest.approx(pose.tolist(), abs=1e-12)
    assert has_room(told)


def has_room(told: Any) -> bool:
    return fits({"type": "tab", "number": 1, "name": "modes", "value": told})


def test_forty_solutions_fit_into_a_message(tmp_path: Path) -> None:
    machine = load_text(tmp_path, dietmaier_text())
    solution = case("d01_dietmaier")["computed_reference"]["solutions"][0]
    pose = tuple(pose_of(solution[:3], np.array(solution[3:]).reshape(3, 3)).tolist())
    told = only("modes", Question(machine, Settings((), pose), options={"starts": 20_000}))
    assert (told["forward"]["found"], told["forward"]["left_out"]) == (40, 0)
    assert has_room(told)


def test_many_working_modes_are_counted() -> None:
    machine = tp.load(MACHINES / "hexaglide.toml")
    told = only("modes", Question(machine, options={"starts": 10}))
    assert len(told["modes"]) + told["modes_left_out"] + told["modes_unsolved"] == 64
    assert told["modes_left_out"] > 0
    assert told["modes"][0]["status"] == "ok"


def test_a_pose_that_no_joints_reach_has_no_solutions() -> None:
    machine = tp.load(PLANAR)
    told = only("modes", Question(machine, Settings((), (5.0, 5.0))))
    assert (told["status"], told["modes"]) == ("unreachable", [])
    assert "forward" not in told
    for starts in (0, -1, 50_001, "many", True, 2.5, None):
        with pytest.raises(RequestError) as failure:
            only("modes", Question(machine, options={"starts": starts}))
        assert failure.value.problems[0].code == "bad-argument"
