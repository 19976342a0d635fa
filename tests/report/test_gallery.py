"""Live pages of the site, which share one kernel: from disk, and as a server gives them."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import truepose as tp
from browser import PATIENCE, Heard, opened_browser
from build_machine import MACHINES
from document_blocks import ROOT
from system_package import require_web_kernel
from truepose.machine.library import machines
from truepose.reporting.live import page, part

Capture = pytest.CaptureFixture[str]
SITE = ROOT / "docs" / "site"
pytestmark = pytest.mark.timeout(1200)
KINDS = ["planar_two_slider", "hexapod"]
SHOWN = """() => Object.fromEntries([...document.querySelectorAll(
  '#live [data-of]')].map(one => [one.dataset.of, one.textContent]))"""


class Quiet(SimpleHTTPRequestHandler):
    """Says nothing of what it gives."""

    def log_message(self, format: str, *given: object) -> None:  # noqa: A002 its name there
        """Nothing."""


@pytest.fixture(scope="module")
def live_pages() -> Iterator[Any]:
    """The module of docs/site that writes them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(SITE.parent))
        patch.syspath_prepend(str(SITE))
        import live_pages

        yield live_pages


@pytest.fixture(scope="module")
def gallery(live_pages: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    require_web_kernel()
    folder = tmp_path_factory.mktemp("gallery") / "live"
    live_pages.write(folder, KINDS)
    for kind in KINDS:
        text = page.html(tp.load(MACHINES / f"{kind}.toml"))
        (folder.parent / f"{kind}.html").write_text(text, encoding="utf-8")
    return Path(folder)


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with opened_browser(tmp_path_factory.mktemp("profile")) as context:
        yield context


@pytest.fixture(scope="module")
def served(gallery: Path) -> Iterator[str]:
    handler = partial(Quiet, directory=str(gallery.parent))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()
        thread.join()


def shown(browser: Any, address: str) -> tuple[dict[str, str], Heard]:
    """Everything that the page says when its worker has told everything."""
    visited = browser.new_page()
    heard = Heard()
    heard.listen(visited)
    visited.goto(address, wait_until="load")
    visited.wait_for_selector("html[data-live-ready=drawn]", timeout=PATIENCE)
    settled = "() => document.getElementById('live').dataset.settled === 'yes'"
    visited.wait_for_function(settled, timeout=PATIENCE)
    said: dict[str, str] = visited.evaluate(SHOWN)
    visited.close()
    return said, heard


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_says_the_same_with_the_kernel_beside_it(
    kind: str, gallery: Path, served: str, browser: Any
) -> None:
    alone, _ = shown(browser, (gallery.parent / f"{kind}.html").as_uri())
    assert len(alone) > 10
    for address in ((gallery / f"{kind}.html").as_uri(), f"{served}live/{kind}.html"):
        said, heard = shown(browser, address)
        assert said == alone
        assert heard.complaints == []
        folder = address.rsplit("/", 1)[0]
        asked = [url for url in heard.requests if not url.startswith(("data:", "blob:"))]
        assert sorted(asked) == sorted([address, f"{folder}/kernel.js"])


def test_one_file_has_the_kernel(gallery: Path) -> None:
    kernel = part.packed_kernel()
    assert [file.name for file in gallery.iterdir() if kernel in file.read_text()] == ["kernel.js"]
    for kind in KINDS:
        assert (gallery / f"{kind}.html").stat().st_size < 0.25 * len(kernel)


def test_a_page_with_its_kernel_beside_it_runs_no_other_script(gallery: Path) -> None:
    text = (gallery / "hexapod.html").read_text()
    (policy,) = [line for line in text.splitlines() if "Content-Security-Policy" in line]
    assert "strict-dynamic" not in policy
    assert "unsafe-inline'; script" in policy
    assert "script-src 'sha256-" in policy


def test_the_gallery_links_to_what_can_be_written(live_pages: Any, tmp_path: Path) -> None:
    import machine_pages

    entry = next(one for one in machines() if one.kind == "planar_two_slider")
    with_link, without = (
        machine_pages.section(entry, tmp_path, live=live) for live in (True, False)
    )
    assert 'href="live/planar_two_slider.html"' in with_link
    assert "live/" not in without


def test_the_site_of_a_release_has_live_pages(
    live_pages: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Capture
) -> None:
    import build

    monkeypatch.setattr(part, "kernel_file", lambda: tmp_path / "kernel.gz")
    passed = SimpleNamespace(refusal="")
    monkeypatch.setattr(build, "read_results", lambda _: passed)
    assert build.main(["--release", "--output", str(tmp_path / "site")]) == 1
    assert "the kernel for browsers was not built" in capsys.readouterr().err
    assert not (tmp_path / "site").exists()
