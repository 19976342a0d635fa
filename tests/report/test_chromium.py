"""The report in a real browser, from disk: no network, no error, and figures that show something.

Text that is right says nothing about pixels (a map can be one colour from edge to edge), so each
figure is photographed and the colours that carry its meaning are looked for.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import Any
from urllib.parse import urlparse
from urllib.request import url2pathname

import numpy as np
import pytest

import truepose
from browser import PATIENCE, Heard, opened_browser, serious_violations
from command_line import MACHINES
from made_measurements import made_measurements, poses_within
from sweeps import long, sweep
from truepose.calibration import write_measurements
from truepose.cli import run
from truepose.reporting.figures import (
    FIGURES,
    _style,
    calibration_correlation,
    calibration_unknowns,
    machine_drawing,
    tornado,
)

FIGURE_NAMES = [module.__name__.rpartition(".")[2] for module in FIGURES]
# What must be seen in each figure; a figure that is not named here must only not be blank.
COLOURS = {
    "machine_drawing": [machine_drawing.STRUT, machine_drawing.PLATFORM],
    "ranking": [_style.VERDICT_COLOURS["dominant"]],
    "source_errors": list(_style.SOURCE_COLOURS[:3]),
    "overall_error": [_style.BEFORE, _style.OVERALL],
    "before_after": [_style.BEFORE, _style.AFTER],
    "distribution": [_style.BEFORE],
    "coverage_ellipses": [_style.SOURCE_COLOURS[0]],
    "tornado": [tornado.COLOURS["first"], tornado.LINEAR],
    "calibration_residuals": [_style.BEFORE, _style.AFTER],
    "calibration_unknowns": [calibration_unknowns.DATA, _style.AFTER],
    "calibration_correlation": [calibration_correlation.SCALE[-1][1]],
    "internal_forces": [_style.BEFORE, _style.AFTER, *_style.SOURCE_COLOURS[:4]],
}
OVERCONSTRAINED = "overconstrained"
MACHINES_SHOWN = ["planar_two_slider", "hexapod", "rotary_delta", OVERCONSTRAINED]
LONG = {"rotary_delta"}
"""The others have every figure, those in space and those in a plane."""
ONLY_OVERCONSTRAINED = {
    module.__name__.rpartition(".")[2]
    for module in FIGURES
    if getattr(module, "NEEDS", None) == "strain"
}

MEASURED = "hexapod"
QUICK = "planar_two_slider"
ONLY_MEASURED = {
    module.__name__.rpartition(".")[2]
    for module in FIGURES
    if getattr(module, "NEEDS", None) == "calibration"
}

# In the page, so that no image library is needed: a picture -> how many pixels of which colour.
COUNT = """async ([data, colours]) => {
  const image = new Image();
  image.src = "data:image/png;base64," + data;
  await image.decode();
  const canvas = new OffscreenCanvas(image.width, image.height);
  const context = canvas.getContext("2d", {willReadFrequently: true});
  context.drawImage(image, 0, 0);
  const pixels = context.getImageData(0, 0, image.width, image.height).data;
  const wanted = colours.map(c => [1, 3, 5].map(i => parseInt(c.slice(i, i + 2), 16)));
  const near = wanted.map(() => 0), seen = new Set();
  // A little inside: what stands above may reach into the first row by part of a pixel.
  const corner = 4 * (6 * image.width + 6);
  const paper = pixels.slice(corner, corner + 3);
  let marked = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    const [r, g, b] = [pixels[i], pixels[i + 1], pixels[i + 2]];
    if (Math.max(...[r, g, b].map((value, k) => Math.abs(value - paper[k]))) > 20) marked++;
    seen.add((r >> 3 << 10) | (g >> 3 << 5) | b >> 3);
    wanted.forEach((w, k) => {
      if (Math.abs(r - w[0]) + Math.abs(g - w[1]) + Math.abs(b - w[2]) < 45) near[k]++;
    });
  }
  return {marked: 4 * marked / pixels.length, colours: seen.size, near, paper: [...paper]};
}"""


pytestmark = pytest.mark.timeout(1200)

TWO_FRAMES = "() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
WIDTHS = "() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]"


@dataclass(kw_only=True)
class Visit(Heard):
    """A page opened in the browser, and all that it asked for and complained of.

    `absent` are the figures that have no place on it.
    """

    page: Any
    absent: frozenset[str] = frozenset()

    def look(
        self,
        selector: str,
        colours: list[str],
        until: Callable[[dict[str, Any]], bool] = lambda _: True,
    ) -> dict[str, Any]:
        """Photograph one element: share of marked pixels, number of colours, pixels near each.

        Again until the picture is as `until` wants it, or the last after PATIENCE: on a
        busy machine a figure is drawn long after it is asked for.
        """
        place = self.page.locator(selector)
        last = monotonic() + PATIENCE / 1000
        while True:
            place.scroll_into_view_if_needed()
            self.page.evaluate(TWO_FRAMES)  # what came into view is drawn
            picture = base64.b64encode(place.screenshot()).decode()
            found: dict[str, Any] = self.page.evaluate(COUNT, [picture, colours])
            if until(found) or monotonic() > last:
                return found

    def wait_until(self, place: Any, expression: str, wanted: object) -> None:
        """Until the script `expression` says `wanted` of the element at `place`."""
        last = monotonic() + PATIENCE / 1000
        while (found := place.evaluate(expression)) != wanted and monotonic() < last:
            self.page.wait_for_timeout(100)
        assert found == wanted


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with opened_browser(tmp_path_factory.mktemp("profile")) as context:
        yield context


def visit(browser: Any, file: Path, figures: int) -> Visit:
    page = browser.new_page()
    seen = Visit(page=page)
    seen.listen(page)
    page.goto(file.as_uri(), wait_until="load")
    page.wait_for_selector("html[data-ready]")
    assert page.locator(".plotly-graph-div .main-svg").count() >= figures
    return seen


def measurements(beside: Path) -> Path:
    """Of a machine whose first drive is 50 um off, with 10 um of noise."""
    machine = truepose.load(MACHINES / f"{MEASURED}.toml")
    data = made_measurements(machine, "pose", poses_within(machine, 20), uncertainty=10e-6)
    name = f"drive.{machine.drives[0].name}.offset"
    at = machine.parameters.index(name)
    actual = machine.replace({name: machine.nominal[at] + 50e-6})
    shown = actual.forward(data.joints, machine.kernel.pose_of(data.placements)).ravel()
    noise = np.random.default_rng(0).normal(0.0, data.uncertainty)
    file = beside.with_name("measured.csv")
    write_measurements(file, machine, data.with_values(shown + noise))
    return file


@pytest.fixture(scope="module")
def opened(
    browser: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[str], Visit]]:
    """A function: the page of a machine, which is made and opened once and stays open."""
    pages: dict[str, Visit] = {}

    def page_of(machine: str) -> Visit:
        if machine not in pages:
            file = tmp_path_factory.mktemp("report") / f"{machine}.html"
            absent = write_report(machine, file)
            pages[machine] = visit(browser, file, len(FIGURE_NAMES) - len(absent))
            pages[machine].absent = frozenset(absent)
        return pages[machine]

    yield page_of
    for seen in pages.values():
        seen.page.close()


def write_report(name: str, file: Path) -> set[str]:
    """The page of a machine; returns the figures that have no place on it."""
    # A log, so that the figure over time is there; of all parts, at a temperature that rises.
    log = file.with_suffix(".csv")
    log.write_text("time (min),default (degC)\n0,20\n10,27\n60,30\n", encoding="utf-8")
    machine = str(MACHINES / f"{name}.toml")
    setting = f"condition.temperature_log={log}"
    measured = [] if name != MEASURED else ["--measurements", str(measurements(file))]
    data = ["--figure-data", str(file.with_suffix(""))]
    assert run(["report", machine, "--set", setting, "--output", str(file), *measured, *data]) == 0
    absent = set() if name == OVERCONSTRAINED else ONLY_OVERCONSTRAINED
    return absent if measured else absent | ONLY_MEASURED


def marks_of(machine: str) -> tuple[pytest.MarkDecorator, ...]:
    if machine in LONG:
        return sweep, long
    return () if machine == QUICK else (sweep,)


@pytest.fixture(params=[pytest.param(one, marks=marks_of(one)) for one in MACHINES_SHOWN])
def report(request: pytest.FixtureRequest, opened: Callable[[str], Visit]) -> Visit:
    seen = opened(request.param)
    seen.page.bring_to_front()  # a page in the background is not drawn
    return seen


def is_drawn(found: dict[str, Any], least: int = 60) -> bool:
    """Whether a picture shows something, and enough of each colour that was looked for."""
    enough = all(count > least for count in found["near"])
    return bool(found["marked"] > 0.005 and found["colours"] >= 12 and enough)


def pages_and_figures() -> Iterator[Any]:
    """Every figure on every page; in the quick suite those of one machine."""
    for machine in MACHINES_SHOWN:
        for name in FIGURE_NAMES:
            yield pytest.param(machine, name, marks=marks_of(machine))


@pytest.mark.parametrize(("report", "name"), list(pages_and_figures()), indirect=["report"])
def test_a_figure_is_not_blank(name: str, report: Visit) -> None:
    if name in report.absent:
        assert report.page.locator(f"#figure-{name}").count() == 0
        return
    found = report.look(f"#figure-{name}", COLOURS.get(name, []), is_drawn)
    assert is_drawn(found), found


def test_figures_follow_the_scheme_and_are_light_in_print(report: Visit) -> None:
    """By night figures are on dark paper, with all their colours; printed they are light."""
    names = [name for name in FIGURE_NAMES if name not in report.absent]
    dark = [int(_style.DARK[_style.PAPER][at : at + 2], 16) for at in (1, 3, 5)]

    def all_are_there(paper: list[int], colours: dict[str, str], least: int) -> None:
        def is_right(found: dict[str, Any]) -> bool:
            return found["paper"] == paper and is_drawn(found, least)

        for name in names:
            wanted = [colours.get(one, one) for one in COLOURS.get(name, [])]
            found = report.look(f"#figure-{name}", wanted, is_right)
            assert is_right(found), (name, found)

    opened = "() => [...document.querySelectorAll('details')].map(each => each.open)"
    before = report.page.evaluate(opened)
    try:
        report.page.emulate_media(color_scheme="dark")
        all_are_there(dark, _style.DARK, least=60)
        report.page.emulate_media(color_scheme="dark", media="print")
        report.page.evaluate("() => dispatchEvent(new Event('beforeprint'))")
        all_are_there([255, 255, 255], {}, least=15)  # of half as many pixels, thin lines too
        assert report.page.locator("details:not([open])").count() == 0
    finally:
        report.page.evaluate("() => dispatchEvent(new Event('afterprint'))")
        report.page.emulate_media(color_scheme="light", media="screen")
    assert report.page.evaluate(opened) == before
    assert report.complaints == []


@pytest.mark.parametrize("width", [1400, 400])
def test_nothing_serious_keeps_people_from_reading(width: int, report: Visit) -> None:
    """By day and by night. Of one width together: all figures are drawn anew for another one."""
    report.page.set_viewport_size({"width": width, "height": 900})
    try:
        for scheme in ("light", "dark"):
            report.page.emulate_media(color_scheme=scheme)
            report.page.evaluate(TWO_FRAMES)  # the page knows of its width
            wide, window = report.page.evaluate(WIDTHS)
            assert wide <= window, scheme
            assert serious_violations(report.page) == [], scheme
    finally:
        report.page.emulate_media(color_scheme="light")
        report.page.set_viewport_size({"width": 1200, "height": 900})


def test_the_contents_show_where_one_is(report: Visit) -> None:
    report.page.locator("#tables").scroll_into_view_if_needed()
    report.page.evaluate("() => document.getElementById('tables').scrollIntoView()")
    current = report.page.locator("nav a[aria-current]")
    report.page.wait_for_selector("nav a[href='#tables'][aria-current]")
    assert current.count() == 1


def test_figures_and_tables_are_saved_as_csv(report: Visit) -> None:
    """The bytes are those that Python writes, of the same figure: test_figure_data.py."""
    for place, first in (("#ranking", "trace"), ("#table-ranking", "source")):
        with report.page.expect_download() as waiting:
            report.page.locator(f"{place} button.csv").click()
        kind, count = re.findall(
            r"^(figure|table)-(\d+)-ranking.csv$", waiting.value.suggested_filename
        )[0]
        assert report.page.locator(f"{place} .count").inner_text().lower() == f"{kind} {count}"
        lines = Path(waiting.value.path()).read_text("utf-8").splitlines()
        assert first in lines[0].split(",")
        assert len(lines) > 2
    assert report.complaints == []


def test_the_maps_differ_from_place_to_place(report: Visit) -> None:
    found = report.look("#figure-workspace_maps", [])
    assert found["colours"] > 100, "one colour from edge to edge"


def test_the_maps_have_their_own_scales_or_one(report: Visit) -> None:
    """The buttons over the maps put all on one colour scale, and back."""
    place = report.page.locator("#figure-workspace_maps")
    scales = "element => element.data.map(each => each.coloraxis).filter(Boolean)"
    own = place.evaluate(scales)
    assert len(set(own)) > 1
    maps = "#figure-workspace_maps .cartesianlayer"  # not the buttons, which the pointer changes
    for button, wanted in ((1, ["coloraxis"] * len(own)), (0, own)):
        before = report.look(maps, [])
        place.locator(".updatemenu-button").nth(button).click()
        report.wait_until(place, scales, wanted)
        assert report.look(maps, [], before.__ne__) != before


def test_nothing_was_asked_from_the_network_and_nothing_went_wrong(report: Visit) -> None:
    assert report.outside == []
    assert len([url for url in report.requests if url.startswith("file:")]) == 1
    assert report.complaints == []


def test_nothing_is_wider_than_the_page(report: Visit) -> None:
    widths = report.page.evaluate(WIDTHS)
    assert widths[0] <= widths[1]


def test_the_buttons_give_what_the_command_writes(report: Visit) -> None:
    folder = Path(url2pathname(urlparse(report.page.url).path)).with_suffix("")
    written = {path.name.split("-", 2)[2]: path for path in folder.iterdir()}
    for button in ("#distribution .csv", "#workspace_maps .csv", "#table-compensation .csv"):
        with report.page.expect_download() as waiting:
            report.page.locator(button).click()
        name = button.split(" ")[0].removeprefix("#").removeprefix("table-")
        assert Path(waiting.value.path()).read_bytes() == written[f"{name}.csv"].read_bytes()


PART = Path(__file__).parents[2] / "examples" / "part"
PART_FIGURES = {
    # The path is grey, and the ends of the scale are on it and in its colour bar.
    "path": [_style.AXIS, _style.COLOUR_SCALE[0][1], _style.COLOUR_SCALE[-1][1]],
    "strips": [_style.BEFORE, _style.AFTER, "#DDE3EC"],
}


@pytest.fixture(scope="module", params=["part", "report"])
def part_page(
    request: pytest.FixtureRequest, browser: Any, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Visit]:
    """The delta's square: its own page, and the report that has it too."""
    file = tmp_path_factory.mktemp("part") / "page.html"
    machine = str(MACHINES / "linear_delta.toml")
    program, features = str(PART / "square.ngc"), ["--features", str(PART / "square.toml")]
    if request.param == "part":
        command = ["part", machine, program, *features, "--samples", "200"]
        assert run([*command, "--output", str(file)]) == 1  # a width is NOT met
        figures = len(PART_FIGURES)
    else:
        assert run(["report", machine, "--part", program, *features, "--output", str(file)]) == 0
        figures = len(FIGURE_NAMES) - len(ONLY_MEASURED | ONLY_OVERCONSTRAINED)
    seen = visit(browser, file, figures)
    seen.page.bring_to_front()
    yield seen
    seen.page.close()


@pytest.mark.parametrize("name", PART_FIGURES)
def test_a_figure_of_the_part_is_not_blank(name: str, part_page: Visit) -> None:
    found = part_page.look(f"#figure-{name}", PART_FIGURES[name], is_drawn)
    assert is_drawn(found), found


def test_the_path_shows_how_well_it_is_known(part_page: Visit) -> None:
    """The menu over the path hides the known error and shows another view, and back."""
    place = part_page.page.locator("#figure-path")
    shown = """element => (element.data ? element : element.querySelector(".js-plotly-plot"))
        .data.map(trace => trace.visible !== false)"""
    assert place.evaluate(shown) == [True, True, False, False]
    views = [[True, *(other == view for other in range(3))] for view in range(3)]
    for number, wanted in ((1, views[1]), (2, views[2]), (0, views[0])):
        before = part_page.look("#figure-path", [])
        place.locator(".updatemenu-header").click()
        place.locator(".updatemenu-dropdown-button").nth(number).click()
        part_page.wait_until(place, shown, wanted)
        assert part_page.look("#figure-path", [], before.__ne__) != before


def test_the_page_of_a_part_needs_no_network(part_page: Visit) -> None:
    assert part_page.outside == []
    assert part_page.complaints == []


def test_a_blank_figure_would_be_seen(browser: Any, tmp_path: Path) -> None:
    file = tmp_path / "blank.html"
    file.write_text(
        "<div id='blank' style='width:600px;height:300px;background:white'></div>"
        "<div id='plain' style='width:600px;height:300px;background:#440154'></div>"
        "<script src='https://example.invalid/a.js'></script><script>nothing()</script>"
    )
    page = browser.new_page()
    seen = Visit(page=page)
    seen.listen(page)
    page.goto(file.as_uri())
    blank = seen.look("#blank", ["#0072B2"])
    assert blank == {"marked": 0, "colours": 1, "near": [0], "paper": [255, 255, 255]}
    plain = seen.look("#plain", [])
    assert (plain["marked"], plain["colours"], plain["paper"]) == (0, 1, [0x44, 0x01, 0x54])
    assert "https://example.invalid/a.js" in seen.requests
    assert any("nothing" in complaint for complaint in seen.complaints)
    page.close()
