"""What the live part of a page costs in Chromium: a slider's step, until it is there, its size."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks.hexapod import MACHINE
from benchmarks.rows import Row

STEPS, ROUNDS = 60, 5
ASKED_STEP_MS, ASKED_READY_MS, ASKED_MEGABYTES = 30.0, 300.0, 0.7

DRAGGED = """async steps => {
  const place = document.getElementById("live"), taken = [];
  const range = place.querySelector('[data-of="pose.x"] input[type=range]');
  const [low, high] = [Number(range.min), Number(range.max)];
  for (let step = 0; step < steps; step++) {
    const before = place.dataset.steps;
    range.value = low + (high - low) * (0.35 + 0.3 * step / steps);
    range.dispatchEvent(new Event("input"));
    while (place.dataset.steps === before) await new Promise(done => setTimeout(done, 2));
    taken.push(Number(place.dataset.step));
  }
  return taken;
}"""


def measure() -> list[Row]:
    """The hexapod's live page, from disk."""
    import truepose as tp
    from truepose.reporting.live import page, part

    browser = shutil.which("chromium")
    if browser is None or not part.is_built():
        print("live_page: left out, it needs chromium and `make web`", file=sys.stderr)
        return []
    machine = tp.load(MACHINE)
    live = part.live_of(machine)
    size = sum(
        len(text.encode())
        for text in (live.kernel, live.setting, live.worker, live.script, live.style)
    )
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "live.html"
        page.write_text(page.html(machine), file)
        steps, ready = _in_browser(browser, file)
    return [
        Row(
            "live page of the hexapod, a slider's step on the main thread, median",
            median(steps),
            "ms",
            "at most",
            ASKED_STEP_MS,
            f"{len(steps)} steps, a coarse map in each; the longest {max(steps):.0f} ms",
        ),
        Row(
            "live page of the hexapod, from its first byte until it is drawn",
            min(ready),
            "ms",
            "at most",
            ASKED_READY_MS,
            f"the least of {len(ready)}; the median {median(ready):.0f} ms",
        ),
        Row(
            "live part of a report, size in the page",
            1e-6 * size,
            "MB",
            "at most",
            ASKED_MEGABYTES,
            f"{1e-6 * len(live.kernel):.2f} MB of it the kernel, as gzip in base85",
        ),
    ]


def _in_browser(browser: str, file: Path) -> tuple[list[float], list[float]]:
    """Milliseconds of each step, and until the page was ready, in a fresh page each."""
    from playwright.sync_api import sync_playwright

    ready: list[float] = []
    with sync_playwright() as playwright:
        chromium: Any = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        for _ in range(ROUNDS):
            seen = chromium.new_page()
            seen.goto(file.as_uri())
            seen.wait_for_selector("html[data-live-ready=drawn]", timeout=60_000)
            ready.append(float(seen.locator("#live").get_attribute("data-ready")))
            steps = seen.evaluate(DRAGGED, STEPS)
            seen.close()
        chromium.close()
    return [float(step) for step in steps], ready
