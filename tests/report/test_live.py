"""The live part in a real browser: its numbers are the package's, and its pixels follow.

Nothing is asked from outside, and where the browser lacks what it takes, the report stays static.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from browser import Heard, opened_browser, serious_violations
from command_line import MACHINES
from live_visit import PATIENCE, QUICK, SHOWN, STEP, WORD, LiveVisit, moved
from sweeps import long_member, sweep, thinned
from system_package import require_web_kernel
from truepose.cli import run

pytestmark = pytest.mark.timeout(1200)

REPORTED = MACHINES / "planar_two_slider.toml"

IN_THE_CI = {*QUICK, "hexapod"}
"""In the plane and in space: for the page itself, whose words and controls are alike for all."""
of_pages = pytest.mark.parametrize(
    "live",
    [
        pytest.param(name, marks=() if name in QUICK else sweep)
        if name in IN_THE_CI
        else long_member(name)
        for name in SHOWN
    ],
    indirect=True,
)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    require_web_kernel()
    with opened_browser(tmp_path_factory.mktemp("profile")) as context:
        yield context


def opened(browser: Any, file: Path, machine: tp.Machine) -> LiveVisit:
    page = browser.new_page()
    seen = LiveVisit(page=page, machine=machine)
    seen.listen(page)
    page.goto(file.as_uri(), wait_until="load")
    page.wait_for_selector("html[data-live-ready=drawn]", timeout=PATIENCE)
    return seen


@pytest.fixture(scope="module")
def pages(
    browser: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[str], LiveVisit]]:
    """A function: the live page of a machine, which is made and opened once and stays open."""
    seen: dict[str, LiveVisit] = {}

    def page_of(name: str) -> LiveVisit:
        if name not in seen:
            file = tmp_path_factory.mktemp("live") / f"{name}.html"
            machine = MACHINES / f"{name}.toml"
            assert run(["live", str(machine), "--output", str(file)]) == 0
            seen[name] = opened(browser, file, tp.load(machine))
        return seen[name]

    yield page_of
    for visit in seen.values():
        visit.page.close()


@pytest.fixture(params=thinned(SHOWN, QUICK))
def live(request: pytest.FixtureRequest, pages: Callable[[str], LiveVisit]) -> LiveVisit:
    visit = pages(request.param)
    visit.page.bring_to_front()
    visit.page.locator("[data-live=reset]").click()
    return visit


def test_numbers_are_those_of_the_package(live: LiveVisit) -> None:
    pose, condition = moved(live)
    budget = tp.budget(live.machine, [pose], condition=condition)
    corrected = tp.compensate(live.machine, [pose], condition=condition)
    components = list(live.machine.components)

    def shown(name: str) -> list[float | None]:
        return [live.number(f"{name}.{component}") for component in components]

    known = budget["overall_error"].values[0]
    scale = max(abs(known).max(), 1e-9)
    np.testing.assert_allclose(shown("before"), known, atol=1e-9 * scale + 1e-13, rtol=0)
    for at, source in enumerate(budget["source"].values):
        wanted = budget["error"].values[0, at]
        np.testing.assert_allclose(shown(str(source)), wanted, atol=1e-9 * scale + 1e-13, rtol=0)
    rest = corrected["residual_middle"].values[0]
    np.testing.assert_allclose(shown("after"), rest, atol=1e-9 * scale + 1e-12, rtol=0)
    lengths = [at for at, name in enumerate(components) if name in "xyz"]
    size = float(np.linalg.norm(known[lengths]))
    assert live.number("before.known.position") == pytest.approx(size, rel=1e-9)
    reach = float(budget["linear_maximum"].values[0, 0])
    assert live.number("before.reach.position") == pytest.approx(reach, rel=0.02)


def test_the_bound_and_the_witness_are_those_of_the_package(live: LiveVisit) -> None:
    pose, condition = moved(live)
    live.settle()
    bounds = tp.bounds(live.machine, [pose], condition=condition)
    proven = float(bounds["magnitude"].values[0, 0])
    assert live.number("before.proven.position") == pytest.approx(proven, rel=1e-6)
    found, likely = (live.number(f"before.{name}.position") for name in ("found", "likely"))
    assert found is not None
    assert likely is not None
    assert likely <= found * (1 + 1e-9) <= proven * (1 + 1e-6)


@of_pages
def test_the_verdict_is_computing_and_then_what_is_proven_or_found(live: LiveVisit) -> None:
    setting = live.setting
    words, target = setting["words"]["verdicts"], setting["bundle"]["target"]
    unit = setting["bundle"]["units"]["temperature"]
    reference = setting["bundle"]["reference_temperature"] / unit["si"] - unit["offset"]
    for name in {variable["group"] for variable in setting["bundle"]["variables"]}:
        live.step(f"tolerance.{name}", 0.001)
    seen = live.page.evaluate(
        f"""reference => {{
          ({STEP})(["temperature", reference]);
          return new Promise(done => requestAnimationFrame(() => done(({WORD})("after"))));
        }}""",
        reference,
    )
    assert seen == words["computing"]
    live.settle()
    assert live.word("after") == words["met"]
    for quantity, asked in target.items():
        proven = live.number(f"after.proven.{quantity}")
        assert proven is not None
        assert proven <= asked
    # So hot that the machine at its known deviations is too far off.
    live.step("temperature", 900.0)
    assert live.word("before") == words["missed"]
    live.settle()
    assert live.word("before") == words["missed"]


@of_pages
def test_pixels_follow(live: LiveVisit) -> None:
    live.settle()
    name = live.machine.commanded[0]
    before = {canvas: live.pixels(canvas) for canvas in ("machine", "map", "distribution")}
    bundle = live.setting["bundle"]
    unit = bundle["units"]["length"]
    live.step(f"pose.{name}", (bundle["workspace"]["home"][0] + 0.01) / unit["si"])
    live.settle()
    for canvas, pixels in before.items():
        assert live.pixels(canvas) != pixels, canvas
    if not live.setting["planar"]:
        turned = live.pixels("machine")
        live.page.locator("[data-live=machine]").press("ArrowLeft")
        assert live.pixels("machine") != turned


@of_pages
def test_the_scale_of_the_map_stays_until_it_is_asked(live: LiveVisit) -> None:
    def ends() -> list[str]:
        return [live.page.locator(f"[data-live={end}]").inner_text() for end in ("low", "high")]

    before = ends()
    live.step("temperature", 60.0)
    assert ends() == before
    assert live.page.locator("[data-live=beyond]").is_visible()
    live.page.locator("[data-live=fit]").click()
    assert ends() != before
    live.page.locator("[data-live=reset]").click()
    live.page.locator("[data-live=fit]").click()
    assert ends() == before


@of_pages
def test_out_of_reach_is_said_and_not_drawn(live: LiveVisit) -> None:
    words = live.setting["words"]
    unit = live.setting["bundle"]["units"]["length"]
    live.step("pose.x", 30.0 / unit["si"])
    said = live.page.locator("[data-live=outside]").inner_text()
    assert said in words["statuses"].values()
    assert live.word("before") == said
    assert live.number("before.known.position") is None
    assert live.number("after.proven.position") is None
    assert live.page.locator("[data-live=outside]").is_visible()
    live.page.locator("[data-live=reset]").click()
    live.settle()
    assert live.page.locator("[data-live=outside]").is_hidden()


def test_nothing_was_asked_and_nothing_went_wrong(live: LiveVisit) -> None:
    assert live.outside == []
    assert len([url for url in live.requests if url.startswith("file:")]) == 1
    assert live.complaints == []


@of_pages
@pytest.mark.parametrize("width", [1400, 400])
def test_nothing_serious_keeps_people_from_using_it(width: int, live: LiveVisit) -> None:
    live.page.set_viewport_size({"width": width, "height": 900})
    try:
        for scheme in ("light", "dark"):
            live.page.emulate_media(color_scheme=scheme)
            wide, window = live.page.evaluate(
                "() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
            )
            assert wide <= window, scheme
            assert serious_violations(live.page) == [], scheme
    finally:
        live.page.emulate_media(color_scheme="light")
        live.page.set_viewport_size({"width": 1200, "height": 900})


def test_a_source_that_is_not_live_is_named_and_nothing_judged(
    pages: Callable[[str], LiveVisit],
) -> None:
    live = pages("hexapod_all_sources")
    live.page.bring_to_front()
    notes = live.page.locator("[data-live=not-live] li").all_inner_texts()
    lacking = [one for one in live.setting["bundle"]["sources"] if not one["live"]]
    assert lacking
    assert len(notes) == len(lacking)
    for note, source in zip(notes, lacking, strict=True):
        assert source["name"] in note
        assert source["why"] in note
    live.settle()
    assert live.word("before") == live.word("after") == live.setting["words"]["verdicts"]["none"]


def test_in_another_language_why_is_said_in_it(browser: Any, tmp_path: Path) -> None:
    file, machine = tmp_path / "live.html", MACHINES / "hexapod_all_sources.toml"
    assert run(["live", str(machine), "--language", "de", "--output", str(file)]) == 0
    live = opened(browser, file, tp.load(machine))
    notes = live.page.locator("[data-live=not-live] li").all_inner_texts()
    lacking = [one for one in live.setting["bundle"]["sources"] if not one["live"]]
    assert lacking
    for note, source in zip(notes, lacking, strict=True):
        assert source["name"] in note
        assert source["why"] not in note
        assert live.setting["sources"][source["name"]]["why"] in note
    title = live.page.locator("tr[data-of=thermal] th").get_attribute("title")
    assert title == live.setting["sources"]["thermal"]["doc"]
    assert "Wärmeausdehnung" in str(title)
    assert live.complaints == []
    live.page.close()


@pytest.fixture(scope="module")
def report_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("report") / "report.html"
    assert run(["report", str(REPORTED), "--output", str(file)]) == 0
    return file


@pytest.mark.parametrize("lacking", ["WebAssembly", "Worker"])
def test_without_what_it_needs_the_report_stays_static(
    lacking: str, browser: Any, report_file: Path
) -> None:
    page = browser.new_page()
    heard = Heard()
    heard.listen(page)
    page.add_init_script(f"delete globalThis.{lacking}")
    page.goto(report_file.as_uri(), wait_until="load")
    page.wait_for_selector("html[data-ready=drawn]", timeout=PATIENCE)
    assert page.locator("#live-absent").is_visible()
    assert page.locator(".live-body").is_hidden()
    assert page.locator(".plotly-graph-div .main-svg").count() > 5
    assert heard.complaints == []
    page.close()


def test_the_report_has_it_and_paper_has_not(browser: Any, report_file: Path) -> None:
    live = opened(browser, report_file, tp.load(REPORTED))
    live.page.wait_for_selector("html[data-ready=drawn]", timeout=PATIENCE)
    live.settle()
    assert live.page.locator("nav a[href='#live']").count() == 1
    assert live.number("before.known.position") is not None
    live.page.emulate_media(media="print")
    assert live.page.locator("#live").is_hidden()
    live.page.emulate_media(media="screen")
    assert live.outside == []
    assert live.complaints == []
    live.page.close()
