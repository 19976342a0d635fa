"""The page of a study: figures that plotly takes, drawn in a browser, and what they say."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from browser import Heard, opened_browser
from checked_figures import checked
from command_line import MACHINES, PLANAR
from truepose.machine import Machine
from truepose.reporting.variants_figures import figures
from truepose.reporting.variants_page import write
from truepose.studies.ranking import ranked

HEXAPOD = MACHINES / "hexapod.toml"
VARY = {"strut.*.stiffness": "30:120:4 N/um", "strut.*.material": "steel,invar,aluminium"}
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


@pytest.fixture(scope="module")
def made() -> tuple[Machine, xr.Dataset]:
    return tp.load(HEXAPOD), tp.study(HEXAPOD, VARY, quantities=["error", "verdict"])


def test_every_figure_is_one_that_plotly_takes(made: tuple[Machine, xr.Dataset]) -> None:
    drawn = figures(*made)
    assert [one.name for one in drawn] == ["response", "parallel", "pareto"]
    for one in drawn:
        assert checked(one.figure).data


def test_marks_and_sentences_are_the_numbers_of_the_study(
    made: tuple[Machine, xr.Dataset],
) -> None:
    machine, study = made
    response, parallel, front = figures(machine, study)
    unit = machine.shown.error("position")
    sizes = unit.per_si * study["linear_maximum"].sel(quantity="position").values
    marks = [one for one in response.figure.data if one["mode"] == "markers" and "text" in one]
    drawn = np.sort(np.concatenate([np.asarray(one["y"]) for one in marks]))
    assert drawn == pytest.approx(np.sort(np.concatenate([sizes, sizes])), rel=1e-4)
    low, high = map(float, NUMBER.findall(response.says.replace(",", ""))[:2])
    assert (low, high) == (round(float(sizes.min()), 1), round(float(sizes.max()), 1))
    best = int(ranked(study)[0])
    assert f"variant {best}," in parallel.says
    for word in study["setting"].values[best]:
        assert word in parallel.says
    *_, front_trace = front.figure.data
    turning = study["linear_maximum"].sel(quantity="orientation").values
    beaten = [
        any(
            a <= sizes[at] and b <= turning[at] and (a < sizes[at] or b < turning[at])
            for a, b in zip(sizes, turning, strict=True)
        )
        for at in range(sizes.size)
    ]
    assert len(front_trace["x"]) == beaten.count(False)


def test_which_variable_matters_is_what_the_medians_say(made: tuple[Machine, xr.Dataset]) -> None:
    machine, study = made
    unit = machine.shown.error("position")
    sizes = unit.per_si * study["linear_maximum"].sel(quantity="position").values
    spans = {}
    for at, key in enumerate(study["variable"].values):
        words = study["setting"].values[:, at]
        medians = [np.median(sizes[words == word]) for word in set(words)]
        spans[str(key)] = max(medians) - min(medians)
    most = max(spans, key=lambda key: spans[key])
    told = figures(machine, study)[0].says
    assert f"Most of it is {most}" in told
    assert f"differ by {spans[most]:.1f} " in told


def test_the_planar_machine_has_a_front_of_what_is_known() -> None:
    study = tp.study(PLANAR, {"strut.*.length": "500:520:5 mm"}, quantities=["error"])
    *_, front = figures(tp.load(PLANAR), study)
    assert front.figure.layout["xaxis"]["title"]["text"].startswith("known error")


def test_a_study_without_an_error_has_no_figure() -> None:
    machine = tp.load(PLANAR)
    vary = {"strut.*.length": "500,520 mm"}
    assert figures(machine, tp.study(PLANAR, vary, quantities=["shares"])) == []
    lost = {"strut.*.length": "100,120 mm"}
    assert figures(machine, tp.study(PLANAR, lost, quantities=["error"])) == []


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
        lines = page.locator("#figure-parallel .scatterlayer .js-line").count()
        text = page.inner_text("main")
    assert not heard.complaints
    assert heard.outside == []
    assert lines >= 2
    assert "The best is variant" in text
