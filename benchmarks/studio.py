"""What the studio costs: a value until its picture and its answer are there, and its messages."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import truepose as tp
from benchmarks.hexapod import MACHINE
from benchmarks.live_page import DRAGGED
from benchmarks.rows import Row

EDITS, TYPED_EDITS, STEPS = 32, 20, 60
ASKED_PICTURE_MS, ASKED_KNOWN_MS, ASKED_KILOBYTES = 30.0, 150.0, 60.0
LIMIT = 120.0
"""s; what does not answer until then never will."""

EVERYTHING = MACHINE.with_name("hexapod_all_sources.toml")
PART = MACHINE.parents[1] / "examples" / "part"
MEASURED, NOISE = 80, 5e-6  # poses; m

# Fields that both have: key, first value and what is added to it from edit to edit.
FIELDS = (
    ("condition.force.x", "{:.0f}", 100.0, 5.0),
    ("tolerance.strut.*.platform.*", "{:.4f}", 0.0003, 0.0001),
    ("strut.3.platform.z", "{:.3f}", 0.001, 0.001),
    ("condition.reference_temperature", "{:.1f}", 20.1, 0.1),
)

AT_REST = """() => document.querySelector("[data-studio=status]").dataset.state === "rest"
  && document.getElementById("live").dataset.settled === "yes"
  && document.getElementById("live").dataset.map === "fine" """
# `heard`: what the page's script did with messages of the studio, ms.
COUNTED = """
  globalThis.heard = 0;
  const own = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {...own, set(hear) {
    own.set.call(this, event => {
      const begun = performance.now();
      hear(event);
      globalThis.heard += performance.now() - begun;
    });
  }});"""
# What the script did from the value until its picture, ms, and how long that was on the clock.
TYPED = """async ([key, value]) => {
  const place = document.getElementById("live"), before = place.dataset.machines;
  const input = document.querySelector(`[data-key="${key}"] input`);
  const drawn = new Promise(done => new MutationObserver((_, observer) => {
    if (place.dataset.machines === before) return;
    observer.disconnect();
    done();
  }).observe(place, {attributes: true, attributeFilter: ["data-machines"]}));
  globalThis.heard = 0;
  const begun = performance.now();
  input.value = value;
  input.dispatchEvent(new Event("change"));
  const own = performance.now() - begun;
  await drawn;
  return [own + globalThis.heard, performance.now() - begun];
}"""

Edit = tuple[str, str]
Files = Mapping[str, bytes]


def measure() -> list[Row]:
    """Of the hexapod; of one with every source that there is for orientation."""
    from truepose.reporting.live import part

    browser = shutil.which("chromium")
    if browser is None or not part.is_built():
        print("studio: left out, it needs chromium and `make web`", file=sys.stderr)
        return []
    rows, told = [], {}
    for file, of in ((MACHINE, "the hexapod"), (EVERYTHING, "the hexapod with all sources")):
        asked = of == "the hexapod"
        with studio_of({file.name: file.read_bytes()}) as address:
            with window_of(address) as window:
                at_rest, busy = known(window)
            typed, steps = in_browser(browser, address)
        rows += [*page_rows(of, typed, steps, asked), *server_rows(of, at_rest, busy, asked)]
        told |= {f"`{kind}` of {of}": sizes for kind, sizes in visit(file).items()}
    kind = max(told, key=lambda kind: max(told[kind]))
    count = sum(map(len, told.values()))
    size = 1e-3 * max(told[kind])
    said = f"{count} messages of a visit with edits, every tab, a calibration; {kind}"
    row = Row("studio, largest message to the page", size, "kB", "at most", ASKED_KILOBYTES, said)
    return [*rows, row]


def page_rows(
    of: str, typed: Sequence[Sequence[float]], steps: Sequence[float], asked: bool
) -> list[Row]:
    """What the page did: `typed` script and clock, ms, of each edit; `steps` of a slider."""
    limit = ASKED_PICTURE_MS if asked else None
    script, clock = zip(*typed, strict=True)
    drawn = f"the machine comes anew; the longest {max(script):.0f} ms, {len(script)} edits; "
    drawn += f"on the clock {median(clock):.0f} ms"
    moved = f"{len(steps)} steps, a coarse map in each; the longest {max(steps):.0f} ms"
    return [
        Row(f"studio of {of}, a {what} to its picture, main thread, median", value, "ms",
            "at most", limit, detail)
        for what, value, detail in (
            ("field's value", median(script), drawn), ("slider's step", median(steps), moved),
        )
    ]  # fmt: skip


def server_rows(of: str, at_rest: Sequence[float], busy: Sequence[float], asked: bool) -> list[Row]:
    """What the server took: s of each edit at rest, and while answers of the one before come."""
    return [
        Row(
            f"studio of {of}, a value to its known error and linear maximum, median",
            1e3 * median(at_rest),
            "ms",
            "at most",
            ASKED_KNOWN_MS if asked else None,
            f"{len(at_rest)} edits at rest, the longest {1e3 * max(at_rest):.0f} ms; "
            f"{len(busy)} while the verdict of the one before came: {1e3 * median(busy):.0f} ms",
        )
    ]


# --- a studio, and windows of it


@contextmanager
def studio_of(files: Files) -> Iterator[str]:
    """Address of a studio of the first of some files in a folder of their own; it ends behind."""
    with tempfile.TemporaryDirectory() as name:
        folder, state = Path(name) / "machine", Path(name) / "state"
        folder.mkdir()
        for file, content in files.items():
            (folder / file).write_bytes(content)
        process = subprocess.Popen(
            [sys.executable, "-m", "truepose", "studio", next(iter(files)), "--no-open"],
            cwd=folder,
            env=os.environ | {"XDG_STATE_HOME": str(state)},
            stdout=subprocess.PIPE,
            text=True,
        )
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
        finally:
            process.terminate()
            process.wait(LIMIT)
            process.stdout.close()


@dataclass
class Window:
    """A window of a studio: what it says, and bytes of what it is told, by kind of message."""

    socket: Any
    sizes: dict[str, list[int]] = field(default_factory=dict)

    def say(self, **message: object) -> None:
        """A message of the page."""
        self.socket.send(json.dumps(message))

    def next(self) -> dict[str, Any]:
        """The next message."""
        text = self.socket.recv(timeout=LIMIT)
        message: dict[str, Any] = json.loads(text)
        kind = " ".join(filter(None, (message["type"], message.get("name"))))
        self.sizes.setdefault(kind, []).append(len(text.encode()))
        return message

    def until(self, kind: str, name: str | None = None, number: int = 0) -> dict[str, Any]:
        """The next message of a kind and name, of a state that is not earlier."""
        while True:
            message = self.next()
            if message["type"] != kind or message.get("name") != name:
                continue
            if message.get("number", 0) >= number:
                return message


@contextmanager
def window_of(address: str) -> Iterator[Window]:
    """A window that is open, and told everything."""
    from websockets.sync.client import connect

    socket = address.replace("http", "ws", 1).replace("/?", "/socket?")
    with connect(socket, origin=address.partition("/?")[0]) as connection:
        window = Window(connection)
        window.until("answer", "shares")
        yield window


def edits(count: int, begin: int = 0) -> list[Edit]:
    """So many edits of the fields by turns, each another value, from that number on."""
    made = []
    for at in range(begin, begin + count):
        key, form, first, step = FIELDS[at % len(FIELDS)]
        made.append((key, form.format(first + step * (at // len(FIELDS)))))
    return made


def known(window: Window) -> tuple[list[float], list[float]]:
    """Seconds until what is known, of edits at rest and of edits that follow on each other."""
    taken: tuple[list[float], list[float]] = ([], [])
    for series, times in enumerate(taken):
        for key, value in edits(EDITS, series * EDITS):
            begun = time.perf_counter()
            window.say(type="edit", edits=[[key, value]])
            number = window.until("state")["number"]
            window.until("answer", "known", number)
            times.append(time.perf_counter() - begun)
            window.until("answer", "machine" if series else "shares", number)
    return taken


def in_browser(browser: str, address: str) -> tuple[list[list[float]], list[float]]:
    """What the page did with edits, script and clock, and with steps of a slider, all in ms."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium: Any = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        seen = chromium.new_page()
        seen.add_init_script(COUNTED)
        seen.goto(address)
        typed = []
        for edit in edits(TYPED_EDITS, 2 * EDITS):
            seen.wait_for_function(AT_REST, timeout=1e3 * LIMIT)
            typed.append(seen.evaluate(TYPED, edit))
        seen.wait_for_function(AT_REST, timeout=1e3 * LIMIT)
        steps = seen.evaluate(DRAGGED, STEPS)
        chromium.close()
    return typed, [float(step) for step in steps]


# --- a visit


def visit(file: Path) -> dict[str, list[int]]:
    """Bytes of all messages of a visit, by kind: edits, tabs, a part, a calibration."""
    from truepose.studio.tabs import TABS

    machine = tp.load(file)
    before, _, after = file.read_text("utf-8").rpartition("\ntemperature = ")  # of [condition]
    _, _, after = after.partition("\n")
    rows = "".join(f"{60 * at}, {20 + 0.02 * at:.2f}\n" for at in range(1000))
    files = {
        file.name: f"{before}\ntemperature_log = 'log.csv'\n{after}".encode(),
        "log.csv": f"time (s), default (degC)\n{rows}".encode(),
        **{of.name: of.read_bytes() for of in sorted(PART.iterdir())},
    }
    with studio_of(files) as address, window_of(address) as window:
        options: dict[str, dict[str, Any]] = {
            "part": {"program": "pocket.ngc", "features": "pocket.toml"},
            "calibration": {"file": dropped(address, measurements(machine)), "plan": 8},
        }
        number = 0
        for edit in edits(2 * len(FIELDS)):
            window.say(type="edit", edits=[edit])
            number = window.until("state")["number"]
        window.until("answer", "shares", number)
        for name in [*(TABS.keys() - {"calibration"}), "calibration"]:
            window.say(type="tab", name=name, options=options.get(name, {}))
            window.until("tab", name)
        while not window.until("tab", "calibration").get("value", {}).get("planned"):
            pass
        window.say(type="difference")
        window.until("difference")
        for kind in ("undo", "reset"):
            window.say(type=kind)
            window.until("state")
        for key in ("workspace.grid.x", "strut.1.base", "nothing.at_all"):
            window.say(type="edit", edits=[[key, "[" + "9, " * 1000 + "9]"]])
            window.until("refused")
    return window.sizes


def measurements(machine: tp.Machine) -> bytes:
    """Positions of the tool, of a machine whose joints are elsewhere, at poses of the workspace."""
    random = np.random.default_rng(1)
    table = tp.budget(machine)
    poses = np.stack([table[f"pose_{name}"].values for name in machine.commanded], axis=-1)
    chosen = poses[random.permutation(len(poses))[:MEASURED]]
    off = {f"strut.{strut.name}.platform.x": NOISE for strut in machine.struts}
    at = [machine.parameters.index(name) for name in off]
    real = machine.replace(dict(zip(off, (machine.nominal[at] + NOISE).tolist(), strict=True)))
    read = real.forward(machine.inverse(chosen))[:, :3]
    read = read + random.normal(0.0, NOISE, read.shape)
    head = [f"command.{name} ({'m' if name in 'xyz' else 'rad'})" for name in machine.commanded]
    head += [f"{name} (m)" for name in "xyz"]
    rows = [*np.hstack([chosen, read]).tolist()]
    lines = [
        f'#: machine = "{machine.name}"',
        "#: [instrument.tracker]",
        '#: kind = "position"',
        '#: frame = "base"',
        f'#: uncertainty = "{1e6 * NOISE:.0f} um"',
        ", ".join(head),
        *(", ".join(map(repr, row)) for row in rows),
    ]
    return "\n".join(lines).encode()


def dropped(address: str, content: bytes) -> int:
    """The number that a dropped file has."""
    origin = address.partition("/?")[0]
    request = urllib.request.Request(  # noqa: S310 a server of this computer's
        address.replace("/?", "/files?") + "&name=measured.csv",
        content,
        {"Origin": origin},
    )
    with urllib.request.urlopen(request, timeout=LIMIT) as answer:  # noqa: S310
        return int(json.load(answer)["file"])
