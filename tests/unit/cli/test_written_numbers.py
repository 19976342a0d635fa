"""Numbers in files are those that were meant: 350, not 350.00000000000006, and the rest in full."""

from __future__ import annotations

import csv
import io
import json
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from command_line import PLANAR, call


def grid(low: int, high: int, count: int) -> list[str]:
    """What a grid from `low` to `high` is in decimals, by fractions."""
    steps = [Fraction(low) + Fraction((high - low) * at, count - 1) for at in range(count)]
    return [repr(float(step)) for step in steps]


def poses_of(text: str) -> list[tuple[str, str]]:
    rows = list(csv.DictReader(io.StringIO(text)))
    return [(row["pose_x [mm]"], row["pose_y [mm]"]) for row in rows]


def test_poses_of_a_grid_are_decimals(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """60 mm in 49 steps: most of them are no doubles in metres."""
    asked = [PLANAR, "--set", "workspace.grid.x=[300, 360, 49]"]
    asked += ["--set", "workspace.grid.y=[100.1, 100.7, 3]"]
    csv_file = tmp_path / "budget.csv"
    assert call(capsys, "budget", *asked, "--output", csv_file).code == 0
    found = poses_of(csv_file.read_text(encoding="utf-8"))
    assert {x for x, _ in found} == set(grid(300, 360, 49))
    assert {y for _, y in found} == {"100.1", "100.4", "100.7"}
    outcome = call(capsys, "budget", *asked, "--format", "json")
    document = json.loads(outcome.out)
    x = document["coordinates"]["pose_x"]["values"]
    assert {repr(float(value)) for value in x} == set(grid(300, 360, 49))


def test_poses_of_a_template_are_decimals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    template = tmp_path / "template.csv"
    outcome = call(
        capsys, "plan", PLANAR, "--instrument", "position=10um", "--poses", "8",
        "--output", template,
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    rows = list(csv.DictReader(io.StringIO(template.read_text(encoding="utf-8"))))
    assert len(rows) == 8
    # Candidates are on even grids of the workspace, in 33 steps or fewer a side.
    every = {repr(float(Fraction(200) + Fraction(200 * at, 64))) for at in range(65)}
    assert {row["pose_x [mm]"] for row in rows} <= every
    # L = 500 mm: at x = 200 or 400, y = 100 a carriage stands where 3, 4, 5 say.
    at_400 = {row["joint_nominal_d1 [mm]"] for row in rows if float(row["pose_x [mm]"]) == 400.0}
    y_400 = {row["pose_y [mm]"] for row in rows if float(row["pose_x [mm]"]) == 400.0}
    assert at_400 == {repr(float(y) + 300.0) for y in y_400}


def test_results_keep_their_digits(capsys: pytest.CaptureFixture[str]) -> None:
    """Within 1e-14 of what the functions return, and of most the very same double."""
    found = tp.budget(tp.load(PLANAR))["error"].values
    document = json.loads(call(capsys, "budget", PLANAR, "--format", "json").out)
    written = np.array(document["variables"]["error"]["values"])
    there = found != 0.0
    assert np.abs(written[there] / (1e3 * found[there]) - 1.0).max() <= 1e-14
    # Written in mm, so that the last bit may differ.
    assert np.mean(written[there] / 1e3 == found[there]) > 0.5
    assert document["accuracy"]["position"]["target"] == 0.5
