"""What `machine.plot()` puts into a notebook's cell, in a browser: the live page in a frame."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

import truepose as tp
from browser import Heard, opened_browser
from command_line import PLANAR
from live_visit import DRAWN, NUMBER, PATIENCE, SETTLED, STEP
from system_package import require_web_kernel
from truepose.reporting.live import part
from truepose.reporting.live.framed import HEIGHT, MOST
from truepose.reporting.shell import policy

FRAME = "() => Math.round(document.querySelector('iframe').getBoundingClientRect().height)"
CONTENT = "() => Math.ceil(document.body.getBoundingClientRect().height)"
SCROLLS = """() => document.documentElement.scrollHeight
  > document.documentElement.clientHeight + 1"""


def needs_kernel() -> None:
    require_web_kernel()


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    needs_kernel()
    with opened_browser(tmp_path_factory.mktemp("profile")) as context:
        yield context


@pytest.fixture(scope="module")
def bundle() -> dict[str, Any]:
    """What the notebook is given."""
    needs_kernel()
    shown: Any = tp.load(PLANAR).plot()
    return dict(shown._repr_mimebundle_())


def in_a_cell(bundle: dict[str, Any], folder: Path) -> str:
    """The address of a page in which the output of a cell stands, as notebooks put it in."""
    page = folder / "notebook.html"
    before = "<!doctype html><html lang=en><meta charset=utf-8><title>Notebook</title>"
    cell = f"<div class=output style='width: 900px'>{bundle['text/html']}</div><p>below</p>"
    page.write_text(before + cell, encoding="utf-8")
    return page.as_uri()


def test_the_live_page_stands_in_the_cell(
    browser: Any, bundle: dict[str, Any], tmp_path: Path
) -> None:
    page, heard = browser.new_page(), Heard()
    heard.listen(page)
    page.goto(in_a_cell(bundle, tmp_path))
    _, frame = page.frames
    frame.wait_for_function(DRAWN, timeout=PATIENCE)
    frame.wait_for_function(SETTLED, timeout=PATIENCE)
    machine = tp.load(PLANAR)
    home = machine.poses().mean(axis=0)
    error = tp.budget(machine, home)["overall_error"].values[0]
    shown = frame.evaluate(NUMBER, "before.known.position")
    assert shown == pytest.approx(float(np.linalg.norm(error)), abs=1e-12)
    # A slider works everything out in the frame too.
    frame.evaluate(STEP, ["pose.x", 250])
    frame.wait_for_function("() => document.getElementById('live').dataset.steps >= 2")
    moved = tp.budget(machine, [0.25, home[1]])["overall_error"].values[0]
    shown = frame.evaluate(NUMBER, "before.known.position")
    assert shown == pytest.approx(float(np.linalg.norm(moved)), abs=1e-12)
    assert heard.outside == []
    assert heard.complaints == []
    page.close()


def test_the_frame_is_as_high_as_its_page(
    browser: Any, bundle: dict[str, Any], tmp_path: Path
) -> None:
    page = browser.new_page()
    page.goto(in_a_cell(bundle, tmp_path))
    _, frame = page.frames
    frame.wait_for_function(DRAWN, timeout=PATIENCE)
    heights = []
    for width in (900, 500):
        page.evaluate(
            "width => { document.querySelector('.output').style.width = `${width}px`; }", width
        )
        page.wait_for_function(f"height => height !== ({FRAME})()", arg=(heights or [HEIGHT])[-1])
        frame.wait_for_function(f"() => !({SCROLLS})()", timeout=PATIENCE)
        heights.append(page.evaluate(FRAME))
        assert heights[-1] == frame.evaluate(CONTENT)
    assert heights[0] < heights[1] < MOST
    # Of what others say, also of what is no number, it does nothing.
    before = page.evaluate(FRAME)
    page.evaluate("() => window.postMessage({trueposeHeight: 300}, '*')")
    frame.evaluate("() => parent.postMessage({trueposeHeight: 'high'}, '*')")
    frame.evaluate("() => parent.postMessage(null, '*')")
    page.evaluate("() => new Promise(done => setTimeout(() => setTimeout(done)))")
    assert page.evaluate(FRAME) == before
    page.close()


def test_the_frame_reaches_nothing_and_has_its_policy(
    browser: Any, bundle: dict[str, Any], tmp_path: Path
) -> None:
    page = browser.new_page()
    page.goto(in_a_cell(bundle, tmp_path))
    assert page.locator("iframe").get_attribute("sandbox") == "allow-scripts"
    _, frame = page.frames
    frame.wait_for_function(DRAWN, timeout=PATIENCE)
    assert frame.evaluate("() => window.origin") == "null"
    reached = "() => { try { return parent.document.title; } catch (failure) { return null; } }"
    assert frame.evaluate(reached) is None
    fetched = "() => fetch('http://127.0.0.1:1/').then(() => 'fetched', one => one.message)"
    assert frame.evaluate(fetched) != "fetched"
    script = frame.evaluate("() => [...document.scripts].at(-1).textContent")
    written = frame.evaluate(
        "() => document.querySelector('meta[http-equiv=Content-Security-Policy]').content"
    )
    assert written == policy(script, live=True)
    assert "connect-src" not in written
    assert "default-src 'none'" in written
    page.close()


def test_without_a_kernel_for_browsers_the_figure_is_shown(bundle: dict[str, Any]) -> None:
    machine = tp.load(PLANAR)
    mime = "application/vnd.plotly.v1+json"
    assert mime not in bundle
    assert bundle["text/plain"] == repr(machine.plot())
    shown: Any = machine.plot()
    with patch.object(part, "KERNEL", "none.wasm.gz"):
        static = shown._repr_mimebundle_()
    assert static[mime] == shown.figure
    assert "<iframe" not in static["text/html"]
    # Nor has a machine with values of its own a live part, and a figure that is named is that.
    for other in (machine.replace({"strut.1.length": 0.501}).plot(), machine.plot("ranking")):
        told: Any = other
        assert mime in told._repr_mimebundle_()


def test_a_name_cannot_leave_the_frame(tmp_path: Path) -> None:
    needs_kernel()
    file = tmp_path / "m.toml"
    text = PLANAR.read_text(encoding="utf-8")
    named = "\"></iframe><script>alert('x')</script>&quot;"
    escaped = named.replace('"', '\\"')
    file.write_text(re.sub(r'(?m)^name = ".*"$', lambda _: f'name = "{escaped}"', text, count=1))
    shown: Any = tp.load(file).plot()
    html = shown._repr_mimebundle_()["text/html"]
    # Between double quotes anything is text.
    outside = re.sub(r'"[^"]*"', '""', html)
    assert (outside.count("<iframe"), outside.count("</iframe>")) == (1, 1)
    assert outside.count("<script>") == 1
    assert "alert" not in outside
