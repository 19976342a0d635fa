"""The course of a soak: random work, readings of memory, and what the commands say at its end."""

from __future__ import annotations

import hashlib
import random
import signal
import time
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import truepose as tp
from benchmarks.studio import measurements
from browser import opened_browser
from served_studio import ServedStudio, free_port, started
from studio_soak.memory import Reading, read
from studio_soak.numbers import OfCommands, differences
from studio_soak.outcome import WARMING, Outcome
from studio_soak.page_work import NUMBER, PATIENCE, PageWork
from studio_soak.window_work import WindowWork

MACHINES = Path(__file__).parents[2] / "machines"
HEXAPOD = MACHINES / "hexapod.toml"
OTHERS = ("planar_two_slider", "linear_delta", "hexapod_all_sources")
"""Machines that the file becomes besides."""

ENDED = 128 + signal.SIGTERM
"""Exit code of a studio that was told to end."""
SLIGHTLY = 1e-3
"""By which share values are other ones at the end: by more a machine may not reach its poses."""
SHOWN = [
    f"{place}.{kind}"
    for place in (
        "before.known", "before", "after", "studio.known",
        "studio.largest.known", "studio.largest.linear",
        "workspace.before.found", "workspace.after.proven",
    )
    for kind in ("position", "orientation")
]  # fmt: skip
"""Where the page has numbers that are the same whenever nothing is changed."""
READINGS = 12
"""At least so many; in an hour one a minute."""
PROGRAM = "G21 G90 G94 F900\nG0 X0 Y0 Z500\nG1 X20 Y10\nG1 X-20\n"

# Each with how often it is done.
WINDOW_WORK = {
    "edit": 12, "drag": 3, "take_back": 2, "refused": 4, "show": 6, "history": 5, "reset": 2,
    "tab": 4, "drop": 3, "forget": 1, "difference": 2, "save": 3, "nonsense": 2, "again": 2,
    "several": 1, "strangers": 1, "report": 0.3,
}  # fmt: skip
PAGE_WORK = {
    "type": 12, "refused": 4, "step": 4, "slide": 8, "click": 14, "choose": 2, "map": 3, "find": 2,
    "difference": 1, "save": 2, "drop": 3, "part": 1, "cut": 2, "look": 1, "second": 1,
}  # fmt: skip
FILE_WORK = {"file": 3}
COUNTED = {
    f"{where}.{name}": often
    for where, work in (("window", WINDOW_WORK), ("page", PAGE_WORK), ("disk", FILE_WORK))
    for name, often in work.items()
}


class Course:
    """A soak that runs."""

    def __init__(
        self,
        folder: Path,
        studio: ServedStudio,
        browser: Any,
        machine: Path,
        seed: int,
        spoiled: str,
    ) -> None:
        self.file, self.studio, self.chance = folder / "m.toml", studio, random.Random(seed)  # noqa: S311
        self.original = machine.read_bytes()
        self.hash = hashlib.sha256(self.original).hexdigest()
        others = [(MACHINES / f"{name}.toml").read_bytes() for name in OTHERS]
        self.others = [content for content in others if content != self.original]
        measured = measurements(tp.load(machine))
        self.page = PageWork(browser, studio, self.chance, measured, spoiled)
        self.window = WindowWork(studio, self.chance, measured)
        self.at_first: dict[str, float | None] = {}
        self.wrong: list[str] = []
        self.done: Counter[str] = Counter()
        self.readings: list[Reading] = []
        self.begun = time.monotonic()

    def work(self, until: float, *, foreign: bool) -> None:
        """Random work until a second; `foreign`: the file may become another machine's, too."""
        names, often = list(COUNTED), list(COUNTED.values())
        while time.monotonic() - self.begun < until:
            (name,) = self.chance.choices(names, often)
            where, _, what = name.partition(".")
            if where == "disk":
                self.on_disk(foreign=foreign)
            else:
                getattr({"window": self.window, "page": self.page}[where], what)()
            self.done[name] += 1
            self.wait()

    def wait(self) -> None:
        """Mostly not at all; else a moment, or until everything is answered."""
        which = self.chance.random()
        if which < 0.05:
            self.window.window.rest()
        elif which < 0.5:
            time.sleep(self.chance.expovariate(2.0))

    def on_disk(self, *, foreign: bool) -> None:
        """The file changes under the studio, becomes no machine's, or goes; and is read again."""
        kinds = ["touched", "broken", "gone", *(["other"] if foreign else [])]
        kind = self.chance.choice(kinds)
        before = self.window.window.state["file"]["hash"]
        if kind == "gone":
            self.file.unlink()
        elif kind == "broken":
            # Without its end alone it might be a machine's still.
            cut = self.original[: self.chance.randrange(len(self.original))]
            self.file.write_bytes(cut + b"\n]]\n")
        elif kind == "touched":
            self.file.write_bytes(self.original + b"# by somebody else\n")
        else:
            self.file.write_bytes(self.chance.choice(self.others))
        if kind == "other":
            self._read_again(before)
            self.work(time.monotonic() - self.begun + 3.0, foreign=False)
        else:
            self.window.window.until(lambda: self.window.window.state["file"]["changed"])
            if kind != "touched":  # is refused; a touched one would have the page loaded again
                self.window.window.say(type="reload")
                self.window.window.heard()
        self.restore()

    def restore(self) -> None:
        """The file as it was, and read again where another one was."""
        self.file.write_bytes(self.original)
        window = self.window.window
        if window.state["file"]["hash"] != self.hash:
            self._read_again(window.state["file"]["hash"])
        window.until(lambda: not window.state["file"]["changed"])
        if self.chance.random() < 0.5:
            window.say(type="reload", edits=self.chance.choice(("keep", "drop")))
            window.heard()

    def _read_again(self, before: str) -> None:
        """Read a file with other bytes; pages are loaded anew then."""
        window = self.window.window
        self.page.page.evaluate("() => { globalThis.ofBefore = true; }")
        window.say(type="reload", edits="drop")
        window.until(lambda: window.state["file"]["hash"] != before)
        self.page.page.wait_for_function(
            "() => !globalThis.ofBefore && document.documentElement.dataset.studioReady === 'yes'",
            timeout=PATIENCE,
        )

    def run(self, seconds: float, told: Callable[[Reading], None]) -> None:
        """All of it: warming up, when other machines come too; the rest; those again."""
        every = min(60.0, seconds / READINGS)
        at = every
        while at <= seconds + 1e-6:
            self.work(at, foreign=at <= WARMING * seconds + 1e-6)
            told(self.take_reading())
            at += every
        for _ in range(3):
            self.on_disk(foreign=True)

    def calm(self) -> None:
        """The file's own numbers in every window, all answered, nothing held."""
        window = self.window.window
        self.page.calm()
        for file in window.state["files"]:
            window.say(type="forget", file=file["file"])
        window.say(type="tab", name=None)
        window.say(type="reset")
        window.say(type="show", pose=None, condition=None)
        window.until(
            lambda: all(not window.state[key] for key in ("edits", "pose", "condition", "files"))
        )
        window.rest()
        self.page.rest()

    def take_reading(self) -> Reading:
        """A reading, with everything as it was; the page's numbers too."""
        self.calm()
        shown = {name: self.page.page.evaluate(NUMBER, name) for name in SHOWN}
        self.at_first = self.at_first or shown
        if shown != self.at_first:
            self.wrong.append(f"at rest as in the file {shown}, at first {self.at_first}")
        self.readings.append(read(self.begun, self.studio.process.pid, self.page.tools))
        return self.readings[-1]

    def compare(self) -> None:
        """Hold the numbers of studio and page against the commands' for the saved file."""
        self.calm()
        window, page = self.window.window, self.page.page
        # Some are refused, some the same key's, and of some machines a page has no quick numbers.
        drawn = "() => document.documentElement.dataset.liveReady === 'drawn'"
        while len(window.state["edits"]) < 3 or not page.evaluate(drawn):
            if len(window.state["edits"]) >= 3:
                window.say(type="reset")
            self.window.edit(SLIGHTLY)
            self.page.type(SLIGHTLY)
            self.page.rest()
            window.heard()
        window.rest()
        self.page.rest()
        name = "at_the_end.toml"
        window.say(type="save", name=name, replace=True)
        window.until(lambda: window.told.get("saved", {}).get("name") == name)
        self.wrong += differences(
            OfCommands.of(self.file.with_name(name)),
            {key: message.get("value") for key, message in window.given.items()},
            lambda of: page.evaluate(NUMBER, of),
        )


def soak(
    folder: Path,
    seconds: float,
    seed: int,
    *,
    machine: Path = HEXAPOD,
    told: Callable[[Reading], None] = lambda _: None,
    spoiled: str = "",
    environment: Mapping[str, str] | None = None,
) -> Outcome:
    """Run it in a folder.

    `spoiled`: a script for the page that spoils it, `environment` of the server: to see it noticed.
    """
    own, said = folder / "machine", folder / "said.txt"
    own.mkdir()
    (own / "m.toml").write_bytes(machine.read_bytes())
    (own / "part.ngc").write_text(PROGRAM)
    with (
        said.open("w") as stderr,
        opened_browser(folder / "profile") as browser,
    ):
        port = ("--port", str(free_port()))
        studio = started(own / "m.toml", folder / "state", *port, stderr=stderr, more=environment)
        try:
            course = Course(own, studio, browser, machine, seed, spoiled)
            course.run(seconds, told)
            course.compare()
            course.window.leave(course.window.window)
            course.page.page.close()
            code, _ = studio.end(signal.SIGTERM)
        finally:
            if studio.process.poll() is None:
                studio.process.kill()
                studio.process.wait()
            if studio.process.stdout is not None:
                studio.process.stdout.close()
    sizes, page = course.window.sizes, course.page
    return Outcome(
        minutes=course.readings[-1].minute,
        readings=course.readings,
        done=course.done,
        messages=sizes.count,
        largest=sizes.largest,
        page_messages=page.sizes.count,
        page_largest=page.sizes.largest,
        faults=[
            *sizes.faults,
            *page.sizes.faults,
            *([f"it ended with {code}"] if code != ENDED else []),
        ],
        complaints=page.heard.complaints,
        said=said.read_text(),
        wrong=course.wrong,
    )
