"""A headless Chromium that asks no service for anything, and what a page in it asked for."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from system_package import missing

CHROMIUM = shutil.which("chromium") or "/usr/bin/chromium"
# The browser looks for no updates and asks no service; WebGL is drawn by the processor.
FLAGS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
]  # fmt: skip


@contextmanager
def opened_browser(profile: Path, *, live: bool = False) -> Iterator[Any]:
    """The browser, with its profile in a folder; skips where it or playwright is missing.

    `live`: canvases do not go through WebGL, by which each step of a live page takes seconds.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is not installed: pip install 'truepose[dev]'")
    if not Path(CHROMIUM).exists():
        missing("chromium is not installed: apt-get install chromium")
    with sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            profile,
            executable_path=CHROMIUM,
            headless=True,
            viewport={"width": 1200, "height": 900},
            args=[*FLAGS, "--disable-gpu" if live else "--use-angle=swiftshader"],
        )
        yield context
        context.close()


@dataclass
class Heard:
    """What a page asked for and complained of."""

    requests: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    def listen(self, page: Any) -> None:
        """From now on."""
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on(
            "console",
            lambda message: (
                self.complaints.append(message.text) if message.type == "error" else None
            ),
        )

    @property
    def outside(self) -> list[str]:
        """Requests that did not stay on the disk."""
        return [url for url in self.requests if not url.startswith(("file:", "data:", "blob:"))]
