"""The page of a circular test: figures that plotly takes, drawn in a browser, and its numbers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from browser import Heard, opened_browser
from checked_figures import checked
from machine_texts import load_text
from made_circular import CENTRE, PLAY, Truth, readings_text, with_keys
from truepose.machine import Machine
from truepose.machine_tests.circular_result import MEASURED, SCHEMA
from truepose.reporting.circular_page import write
from truepose.reporting.polar_plot import MIDDLE, REACH, figures

RADIUS = 0.05
DRAWN = 1e-4
"""Of the figure's unit: a figure has five digits of what it draws."""
PAGE = Path(__file__).parents[2] / "docs" / "circular_test.md"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Machine, xr.Dataset]:
    folder = tmp_path_factory.mktemp("machine")
    play = f'backlash = {{ play = "{1e3 * PLAY} mm", threshold = "5 kN" }}'
    machine = load_text(folder, with_keys(drive=play))
    file = folder / "readings.csv"
    file.write_text(readings_text(Truth((12e-4, 0.0), PLAY), RADIUS, np.zeros((2, 180))))
    place = {"x": CENTRE[0], "y": CENTRE[1]}
    return machine, tp.circular_test(machine, RADIUS, place, measured=file, samples=200)


def test_every_figure_is_one_that_plotly_takes(made: tuple[Machine, xr.Dataset]) -> None:
    drawn = figures(*made)
    assert [one.title for one in drawn] == [
        "Polar plot, before compensation",
        "Polar plot, after compensation",
    ]
    for one in drawn:
        assert len(checked(one.figure).data) > 10


def test_deviations_are_drawn_outwards_to_scale(made: tuple[Machine, xr.Dataset]) -> None:
    """The farthest of all that is drawn is at the reach, and readings are where they were read."""
    machine, result = made
    before, after = figures(machine, result)
    traces = {trace.get("name"): trace for trace in before.figure.data}
    known = result["radial_known"].values[0, 0]
    readings = result["radial_measured"].values
    most = max(
        float(np.abs(values).max())
        for values in (readings, result["radial_lower"].values[0], result["radial_upper"].values[0])
    )
    line = traces["counter-clockwise"]
    radius = np.hypot(np.asarray(line["x"]), np.asarray(line["y"]))[:-1]
    assert radius == pytest.approx(MIDDLE + REACH * known / most, abs=DRAWN)
    there = traces["measured, counter-clockwise"]
    radius = np.hypot(np.asarray(there["x"]), np.asarray(there["y"]))
    ways = result["reading_direction"].values == "counter-clockwise"
    assert radius == pytest.approx(MIDDLE + REACH * readings[ways] / most, abs=DRAWN)
    assert not [trace for trace in after.figure.data if "measured" in (trace.get("name") or "")]


def test_the_page_is_drawn_without_a_complaint(
    made: tuple[Machine, xr.Dataset], tmp_path: Path
) -> None:
    file = tmp_path / "page.html"
    write(*made, file)
    heard = Heard()
    with opened_browser(tmp_path / "profile") as context:
        page = context.new_page()
        heard.listen(page)
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready=drawn]")
        lines = page.locator("#figure-polar-0 .scatterlayer .js-line").count()
        text = page.inner_text("main")
    assert not heard.complaints
    assert heard.outside == []
    assert lines > 10
    assert "NOT within" in text
    assert "strut.1.length" in text


def test_the_documentation_has_every_variable() -> None:
    rows = re.findall(r"^\| (\w+) \| ([\w, ]+) \| .+ \| (.+) \|$", PAGE.read_text("utf-8"), re.M)
    said = {name: (dims, text) for name, dims, text in rows if name != "variable"}
    every = {**SCHEMA, **MEASURED}
    assert said == {
        name: (", ".join(variable.dims), variable.long_name) for name, variable in every.items()
    }
