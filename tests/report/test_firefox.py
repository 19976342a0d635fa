"""The live part in Firefox: it shows what it shows in Chromium, whose numbers are the package's."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import truepose as tp
from browser import opened_browser
from command_line import MACHINES
from firefox import Firefox, opened_firefox
from live_visit import DRAWN, PATIENCE, QUICK, SHOWN, LiveVisit, moved
from sweeps import thinned
from system_package import require_web_kernel
from truepose.cli import run

TEXTS = """() => {
  const texts = {}, live = document.getElementById("live");
  for (const place of live.querySelectorAll("td[data-of], p[data-of], [data-live]")) {
    if (!place.querySelector("[data-of], [data-live]")) {
      texts[place.dataset.of || place.dataset.live] = place.textContent;
    }
  }
  for (const slider of live.querySelectorAll(".live-slider")) {
    texts[slider.dataset.of] = [...slider.querySelectorAll("input")].map(input => input.value);
  }
  texts.order = [...live.querySelectorAll("tr[data-of]")].map(row => row.dataset.of);
  return texts;
}"""
CANVASES = ("machine", "map", "distribution")


@pytest.fixture(scope="module")
def firefox(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Firefox]:
    require_web_kernel()
    with opened_firefox(tmp_path_factory.mktemp("firefox")) as tab:
        yield tab


@pytest.fixture(scope="module")
def chromium(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with opened_browser(tmp_path_factory.mktemp("chromium")) as context:
        yield context.new_page()


def short_page(machine: Path, file: Path) -> None:
    """The live page of a machine, but that it draws 10 000 machines at random and not 500 000."""
    assert run(["live", str(machine), "--output", str(file)]) == 0
    text = file.read_text(encoding="utf-8")
    assert text.count("SAMPLES = 500000") == 1
    file.write_text(text.replace("SAMPLES = 500000", "SAMPLES = 10000"), encoding="utf-8")


def shown(visit: LiveVisit) -> dict[str, Any]:
    """All that it says when it is through, by its places."""
    visit.settle()
    texts: dict[str, Any] = visit.page.evaluate(TEXTS)
    assert texts
    return texts


@pytest.mark.parametrize("name", thinned(SHOWN, QUICK))
def test_it_shows_what_it_shows_in_chromium(
    name: str, firefox: Firefox, chromium: Any, tmp_path: Path
) -> None:
    file = tmp_path / f"{name}.html"
    machine = MACHINES / f"{name}.toml"
    short_page(machine, file)
    own, other = (LiveVisit(page=page, machine=tp.load(machine)) for page in (firefox, chromium))
    heard = firefox.goto(file.as_uri())
    chromium.goto(file.as_uri(), wait_until="load")
    for visit in (own, other):
        visit.page.wait_for_function(DRAWN, timeout=PATIENCE)
    before = shown(own)
    assert before == shown(other)
    pixels = [own.pixels(canvas) for canvas in CANVASES]

    for visit in (own, other):
        moved(visit)
        visit.slide("pose.x", 0.443)
        visit.slide("temperature", 0.817)
    after = shown(own)
    assert after == shown(other)
    for line in ("known", "likely", "found", "proven"):
        place = f"before.{line}.position"
        assert re.match(r"\d[\d.,]* µ", after[place]), place
        assert after[place] != before[place], place
    for canvas, drawn in zip(CANVASES, pixels, strict=True):
        assert own.pixels(canvas) != drawn, canvas

    assert heard.outside == []
    assert heard.complaints == []


def test_what_a_page_asks_for_and_complains_of_is_heard(firefox: Firefox, tmp_path: Path) -> None:
    file = tmp_path / "loud.html"
    file.write_text(
        "<script src='https://example.invalid/a.js'></script><script>"
        "const text = \"fetch('https://example.invalid/b').catch(() => console.error('lost'))\";"
        "new Worker(URL.createObjectURL(new Blob([text])));"
        "nothing()</script>"
    )
    heard = firefox.goto(file.as_uri())
    last = "() => new Promise(done => setTimeout(() => done(true), 50))"
    for _ in range(200):
        firefox.evaluate(last)
        if "lost" in heard.complaints:
            break
    assert heard.outside == ["https://example.invalid/a.js", "https://example.invalid/b"]
    assert any("nothing" in complaint for complaint in heard.complaints)
    assert "lost" in heard.complaints
    with pytest.raises(AssertionError, match="away"):
        firefox.evaluate("() => { throw new Error('away'); }")
