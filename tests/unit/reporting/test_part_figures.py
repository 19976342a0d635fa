"""The figures of a part: what they say is what they draw, and all views are of the same points."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest
from numpy.typing import NDArray

import truepose
from checked_figures import checked
from command_line import MACHINES
from truepose.reporting.page import PartShown
from truepose.reporting.part_page import DrawnPath
from truepose.reporting.part_page import shown as on_page
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.read import read_part

PART = Path(__file__).parents[3] / "examples" / "part"


@pytest.fixture(scope="module")
def shown() -> PartShown:
    machine = truepose.load(MACHINES / "linear_delta.toml")
    path = DrawnPath(machine)
    part = read_part(machine, PART / "square.ngc", PART / "square.toml")
    evaluation = evaluate_part(machine, part, machine.condition, sinks=[path], samples=200)
    return on_page(evaluation, path, "square.ngc")


def places(drawn: go.Scatter3d) -> NDArray[np.float64]:
    return np.stack([drawn.x, drawn.y, drawn.z], axis=-1).astype(np.float64)


def test_the_strips_come_first_and_say_how_many_are_within(shown: PartShown) -> None:
    strips, path = shown.figures
    assert (strips.name, path.name) == ("strips", "path")
    before, after = (sum(row[2] == "met" for row in table.rows) for table in shown.tables[:2])
    every = len(shown.tables[0].rows)
    assert f"{before} of {every} quantities are certainly within" in strips.says
    assert f"{after} after compensation" in strips.says
    zones = [shape for shape in checked(strips.figure).layout.shapes if shape.type == "rect"]
    assert len(zones) == every


def test_what_all_points_share_is_left_out_of_the_second_view(shown: PartShown) -> None:
    path = shown.figures[1]
    grey, known, apart, half = checked(path.figure).data
    factor, own = (
        float(number.replace(",", ""))
        for number in re.findall(r"([\d,]+) times as large", path.caption)
    )
    errors = (places(known) - places(grey)) / factor * 1e3
    sizes = np.linalg.norm(errors, axis=1)
    np.testing.assert_allclose(sizes, known.marker.color, atol=0.5)
    left = errors - errors.mean(axis=0)
    np.testing.assert_allclose((places(apart) - places(grey)) / own * 1e3, left, atol=0.5)
    np.testing.assert_allclose(np.linalg.norm(left, axis=1), apart.marker.color, atol=0.5)
    np.testing.assert_array_equal(places(half), places(grey))
    said = [float(number) for number in re.findall(r"([\d.]+) µm", path.says)]
    wanted = [sizes.max(), np.linalg.norm(errors.mean(axis=0)), np.linalg.norm(left, axis=1).max()]
    assert said == pytest.approx(wanted, rel=0.01)
    assert "<br>" in known.text[0], "a line each"
    assert "&lt;" not in known.text[0]
