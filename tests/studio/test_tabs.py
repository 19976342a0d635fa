"""The tabs answer what their commands answer, of files in the machine's folder alone."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES, PLANAR
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.errors import RequestError
from truepose.studio.answers import DroppedFile, Question
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
    with pytest.raises(RequestError) as failure:
        only("over_time", Question(tp.load(PLANAR)))
    assert failure.value.problems[0].code == "no-temperature-log"


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
    assert only("part", Question(machine, folder=folder)) == {}


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
