"""The page of an allocation: figures that plotly takes, in a browser, and the command's numbers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from browser import Heard, opened_browser
from checked_figures import checked
from command_line import call
from designs import file_with
from truepose.design.cost_curve import CostCurve, cost_curve
from truepose.design.result import Allocation
from truepose.reporting import allocation as words
from truepose.reporting.allocation_figures import curve_figures, figures
from truepose.reporting.allocation_page import write, write_curve

Capture = pytest.CaptureFixture[str]
HEXAPOD_TARGET = "accuracy.target=0.15 mm"


@pytest.fixture(scope="module")
def hexapod(tmp_path_factory: pytest.TempPathFactory) -> Allocation:
    path = file_with(tmp_path_factory.mktemp("hexapod"), "hexapod")
    return tp.allocate(tp.load(path, [HEXAPOD_TARGET]))


@pytest.fixture(scope="module")
def curve(tmp_path_factory: pytest.TempPathFactory) -> CostCurve:
    machine = tp.load(file_with(tmp_path_factory.mktemp("planar"), "planar_two_slider"))
    return cost_curve(machine, [1e-4, 4.5e-4, 5.5e-4])


def test_every_figure_is_one_that_plotly_takes(hexapod: Allocation, curve: CostCurve) -> None:
    assert [one.name for one in figures(hexapod)] == ["made_of", "binding"]
    assert [one.name for one in curve_figures(curve)] == ["curve"]
    for one in [*figures(hexapod), *curve_figures(curve)]:
        assert checked(one.figure).data


def test_bars_are_the_contributions(hexapod: Allocation) -> None:
    made_of, _ = figures(hexapod)
    units = hexapod.machine.shown
    drawn = np.concatenate([np.asarray(bars["x"]) for bars in made_of.figure.data])
    parts = [
        [one.before if name == "as filed" else one.after for one in hexapod.contributions
         if one.quantity == kind]
        for kind in ("position", "orientation")
        for name in ("as filed", "designed")
    ]  # fmt: skip
    scales = [
        units.error(kind).per_si for kind in ("position", "position", "orientation", "orientation")
    ]
    expected = np.concatenate([np.array(p) * s for p, s in zip(parts, scales, strict=True)])
    assert drawn == pytest.approx(expected, rel=1e-4)
    most = max(
        (one for one in hexapod.contributions if one.quantity == "position"),
        key=lambda one: abs(one.after),
    )
    assert most.name in made_of.says
    assert f"{most.after * units.error('position').per_si:.1f} " in made_of.says


def test_marks_are_errors_over_their_limits(hexapod: Allocation) -> None:
    _, binding = figures(hexapod)
    shares = [100.0 * one.error / one.limit for one in hexapod.worst_poses[:24]]
    marks = {
        int(name): float(share)
        for trace in binding.figure.data
        for name, share in zip(trace["y"], trace["x"], strict=True)
    }
    assert [marks[number] for number in range(1, len(shares) + 1)] == pytest.approx(
        shares, rel=1e-4
    )
    assert max(shares) <= 100.0
    assert f"{shares[0]:.4g} %" in binding.says


def test_the_curve_is_of_the_targets_that_can_be_kept(curve: CostCurve) -> None:
    (drawn,) = curve_figures(curve)
    assert curve.points[0].cost == float("inf"), "the finest target is out of reach"
    bounds, costs = drawn.figure.data
    kept = curve.points[1:]
    assert list(costs["x"]) == pytest.approx([450.0, 550.0])
    assert list(costs["y"]) == pytest.approx([one.cost for one in kept], rel=1e-6)
    assert list(bounds["y"]) == pytest.approx([one.lower_bound for one in kept], rel=1e-6)


def test_a_curve_without_any_design_says_so(tmp_path: Path) -> None:
    machine = tp.load(file_with(tmp_path, "planar_two_slider"))
    nothing = cost_curve(machine, [1e-5])
    assert curve_figures(nothing) == []
    write_curve(nothing, tmp_path / "page.html")
    assert "No target can be kept" in (tmp_path / "page.html").read_text(encoding="utf-8")


def test_the_page_says_what_the_command_says(hexapod: Allocation, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    write(hexapod, file)
    heard = Heard()
    with opened_browser(tmp_path / "profile") as context:
        page = context.new_page()
        heard.listen(page)
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready=drawn]")
        text = re.sub(r"\s+", " ", page.inner_text("main"))
        order = page.locator("#figure-binding .yaxislayer-above .ytick text").all_text_contents()
    assert not heard.complaints
    assert heard.outside == []
    for sentence in words.sentences(hexapod):
        assert sentence in text
    for table in words.tables(hexapod):
        for row in table.rows:
            assert re.sub(r"\s+", " ", " ".join(row)) in text
    numbers = [int(number) for number in order]
    assert numbers == sorted(numbers, reverse=True), "from below: the worst first, on top"


def test_the_command_writes_both(tmp_path: Path, capsys: Capture) -> None:
    machine = file_with(tmp_path, "planar_two_slider")
    page = tmp_path / "page.html"
    told = call(capsys, "allocate", machine, "--report", page)
    assert told.code == 0
    first = told.out.splitlines()[0]
    assert first in page.read_text(encoding="utf-8")
    assert f"wrote {page}" in told.err
    other = tmp_path / "curve.html"
    told = call(capsys, "allocate", machine, "--curve", "0.45 mm:0.55 mm:2", "--report", other)
    assert told.code == 0
    assert "Cost against target" in other.read_text(encoding="utf-8")
    told = call(capsys, "allocate", machine, "--report", tmp_path / "page.pdf")
    assert (told.code, told.codes) == (2, ["output-ending"])
