"""The tabs of a studio's page: what they show of their answers, and that keys reach them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import PLANAR
from served_studio import ServedStudio, studio_of
from studio_visit import PATIENCE, Visit, visited

PROGRAM = """G21 G90 G94 F900
G0 X300 Y200
(feature: front, straightness 0.1)
G1 X340 Y210
(end)
"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[ServedStudio, Path]]:
    """A machine with a temperature log, and a program beside it."""
    folder = tmp_path_factory.mktemp("tabs")
    rows = "\n".join(f"{60 * n}, {20 + 10 * np.sin(n / 200):.3f}" for n in range(1000))
    (folder / "log.csv").write_text(f"time (s), default (degC)\n{rows}\n")
    text = PLANAR.read_text().replace("\ntemperature = 35", '\ntemperature_log = "log.csv"')
    (folder / "m.toml").write_text(text)
    (folder / "front.ngc").write_text(PROGRAM)
    with studio_of(folder / "m.toml", folder / "state") as one:
        yield one, folder


def panel(visit: Visit, name: str) -> Any:
    visit.page.locator(f"#tab-{name}").click()
    return visit.page.locator(f"[data-tab={name}]")


def test_the_tab_of_the_budget_is_that_of_the_function(visit: Visit, served: Any) -> None:
    panel(visit, "budget").locator("tbody tr").first.wait_for(timeout=PATIENCE)
    budget = tp.budget(tp.load(served[1] / "m.toml"))
    for at, name in enumerate(budget["source"].values):
        highest = float(budget["highest"].values[at, 0])
        assert visit.number(f"budget.{name}.position") == pytest.approx(highest, rel=1e-12)


def test_the_error_over_time_is_drawn_where_there_is_a_log(visit: Visit) -> None:
    tab = panel(visit, "over_time")
    tab.get_by_text("largest").wait_for(timeout=PATIENCE)
    assert tab.get_by_text("no temperature log").is_hidden()
    pixels = "() => document.querySelector('[data-tab=over_time] canvas').toDataURL()"
    before = visit.page.evaluate(pixels)
    at = tab.get_by_text("largest").inner_text()
    visit.set("strut.1.expansion", "9e-5 1/K")
    assert tab.get_by_text("largest").inner_text() != at
    assert visit.page.evaluate(pixels) != before
    visit.set("strut.1.expansion", "1.1e-5 1/K")
    assert tab.get_by_text("largest").inner_text() == at
    assert visit.page.evaluate(pixels) == before
    assert tab.locator("select option").count() == 1


def test_without_a_log_the_tab_says_so_and_that_is_no_fault(browser: Any, tmp_path: Path) -> None:
    (tmp_path / "m").mkdir()
    (tmp_path / "m" / "m.toml").write_bytes(PLANAR.read_bytes())
    with (
        studio_of(tmp_path / "m" / "m.toml", tmp_path / "state") as studio,
        visited(browser, studio, tmp_path / "m") as visit,
    ):
        tab = panel(visit, "over_time")
        tab.get_by_text("The file has no temperature log").wait_for(timeout=PATIENCE)
        assert tab.locator(".problem").inner_text() == ""
        assert tab.locator("canvas").is_hidden()
        tab = panel(visit, "part")
        tab.get_by_text("no program").wait_for(timeout=PATIENCE)


def test_programs_of_the_folder_are_named(visit: Visit) -> None:
    tab = panel(visit, "part")
    tab.get_by_text("Programs there: front.ngc.").wait_for(timeout=PATIENCE)
    assert tab.locator("datalist option").first.get_attribute("value") == "front.ngc"
    tab.locator("input").first.fill("front.ngc")
    tab.locator("button").click()
    tab.locator("tbody th").wait_for(timeout=PATIENCE)
    assert tab.locator("tbody th").inner_text() == "front"


def test_every_tab_is_reached_by_arrow_keys(visit: Visit) -> None:
    visit.page.locator("[role=tab][aria-selected=true]").focus()
    every = visit.page.locator("[role=tab]").count()
    seen = []
    for _ in range(every):
        visit.page.keyboard.press("ArrowRight")
        seen.append(visit.page.evaluate("() => document.activeElement.id"))
        panels = visit.page.locator("[role=tabpanel]:not([hidden])")
        assert panels.count() == 1
        assert panels.get_attribute("aria-labelledby") == seen[-1]
    assert len(set(seen)) == every
    visit.rest()
