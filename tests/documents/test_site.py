"""The site, built once with warnings as errors: nothing leaves the disk, links hold, search finds.

It takes minutes and is therefore in `make test-all` only.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

from browser import Heard, opened_browser, serious_violations
from document_blocks import ROOT
from sweeps import sweep

pytestmark = [sweep, pytest.mark.timeout(3600)]

WIDTHS = [390, 820, 1400]
# Pages of each part; the first has figures that are drawn by the script.
LOOKED_AT = [
    "docs/gallery/questions.html",
    "docs/gallery/machines.html",
    "docs/tutorials/paper.html",
    "docs/trust.html",
    "docs/method.html",
    "docs/machine_file.html",
    "docs/interface.html",
    "index.html",
]
SEARCHED = {"ball bar": "measurements", "backlash": "sources/backlash", "M665": "parameters"}


class Anchors(HTMLParser):
    """What a page links to and what it can be linked at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.names: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.names |= {name for key in ("id", "name") if (name := given.get(key))}
        key = {"a": "href", "link": "href", "img": "src", "script": "src"}.get(tag)
        if key and (link := given.get(key)):
            self.links.append(link)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the site, built from this tree."""
    output = tmp_path_factory.mktemp("built") / "site"
    build = [sys.executable, ROOT / "docs" / "site" / "build.py", "--output", output]
    run = subprocess.run(build, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-6000:]
    assert "WARNING" not in run.stderr
    return output


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with opened_browser(tmp_path_factory.mktemp("profile")) as context:
        yield context


def test_every_link_holds(site: Path) -> None:
    pages = {page: Anchors(page.read_text("utf-8")) for page in site.rglob("*.html")}
    assert len(pages) > 80
    broken = []
    for page, anchors in pages.items():
        for link in anchors.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            fragment = unquote(parts.fragment)
            if not target.exists() or (
                fragment and target in pages and fragment not in pages[target].names
            ):
                broken.append(f"{page.relative_to(site)}: {link}")
    assert not broken


def test_nothing_comes_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        loaded = [
            link
            for link in Anchors(page.read_text("utf-8").replace("<a ", "<ignored ")).links
            if urlsplit(link).scheme in {"http", "https"} or link.startswith("//")
        ]
        assert not loaded, page


@pytest.mark.parametrize("name", LOOKED_AT)
def test_a_page_stays_on_the_disk_and_fits_its_window(name: str, site: Path, browser: Any) -> None:
    page, heard = browser.new_page(), Heard()
    heard.listen(page)
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 900})
        page.goto((site / name).as_uri(), wait_until="load")
        sizes = "() => [document.documentElement.scrollWidth, document.documentElement.clientWidth]"
        wide, window = page.evaluate(sizes)
        assert wide <= window, f"{name} at {width} px"
    for place in page.locator(".plotly-figure").all():
        place.locator(".main-svg").first.wait_for(state="attached")
    if name == LOOKED_AT[0]:
        assert page.locator(".plotly-figure").count() >= 2
    assert heard.outside == []
    assert heard.complaints == []
    page.close()


@pytest.mark.parametrize(("words", "found"), SEARCHED.items())
def test_search_finds(words: str, found: str, site: Path, browser: Any) -> None:
    page, heard = browser.new_page(), Heard()
    heard.listen(page)
    page.goto((site / "search.html").as_uri() + f"?q={words}")
    page.locator("#search-results ul.search li a").first.wait_for()
    page.wait_for_timeout(1000)
    results = page.locator("#search-results ul.search li a").evaluate_all(
        "all => all.map(a => a.href)"
    )
    assert any(found in link for link in results), results
    assert heard.outside == []
    page.close()


@pytest.mark.parametrize("name", LOOKED_AT)
def test_nothing_serious_keeps_people_from_reading(name: str, site: Path, browser: Any) -> None:
    page = browser.new_page()
    page.goto((site / name).as_uri(), wait_until="load")
    assert serious_violations(page) == []
    page.close()
