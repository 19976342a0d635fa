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
PATIENCE = 180_000
"""Milliseconds: there for what hangs; a busy machine is slow, and slowness is no fault here."""
# The browser looks for no updates and asks no service. WebGL is drawn by the processor, and
# nothing else goes through it: pages and canvases would take several times as long.
FLAGS = [
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
    "--disable-gpu",
]  # fmt: skip


@contextmanager
def opened_browser(profile: Path) -> Iterator[Any]:
    """The browser, with its profile in a folder; skips where it or playwright is missing."""
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
            args=FLAGS,
        )
        context.set_default_timeout(PATIENCE)
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


def serious_violations(page: Any) -> list[tuple[str, str]]:
    """What keeps people from reading or using a page, by axe: each rule, with the first place."""
    from axe_playwright_python.sync_playwright import Axe

    # Places where a rule holds are not listed: they take part of the time.
    violations = Axe().run(page, options={"resultTypes": ["violations"]}).response["violations"]
    return [
        (one["id"], one["nodes"][0]["html"][:200])
        for one in violations
        if one["impact"] in {"serious", "critical"}
    ]
