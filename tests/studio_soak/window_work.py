"""Random work by the socket: what a page may say, and what none does."""

from __future__ import annotations

import json
import random
import re
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from served_studio import LIMIT, ServedStudio
from truepose.studio.messages import MOST_SENT, SENT
from truepose.studio.tabs import TABS

NO_VALUES = ("", "wide", "5 N", "1e999", "[1, 2", "nan", '"x', "-" * 3000, "{ }", "1 furlong/s")
NO_MESSAGES = (
    "",
    "[]",
    '{"type": "edit"}',
    '{"type": 3}',
    "[" * 20_000,
    '{"type": "undo", "a": 1}',
)
NO_NAMES = ("../out.toml", "/tmp/out.toml", "a/b.toml", "out.txt", "", "x" * 5000)  # noqa: S108
NUMBER = re.compile(r"\d+(\.\d+)?")


@dataclass
class Sizes:
    """How many messages came, bytes of the largest, and those that are too large."""

    count: int = 0
    largest: int = 0
    faults: list[str] = field(default_factory=list)

    def take(self, text: str | bytes) -> None:
        """A message."""
        size = len(text if isinstance(text, bytes) else text.encode())
        self.count, self.largest = self.count + 1, max(self.largest, size)
        if size > MOST_SENT:
            self.faults.append(f"one of {size} bytes: {text[:80]!r}")

    def add(self, other: Sizes) -> None:
        """Those of another window, too."""
        self.count, self.largest = self.count + other.count, max(self.largest, other.largest)
        self.faults += other.faults


class SoakWindow:
    """A window that takes what it is told as it comes; the latest of each is kept.

    Every message is held against the schema and the largest size; `sizes.faults` has what was not
    so.
    """

    def __init__(self, studio: ServedStudio) -> None:
        at = f"ws://{studio.host}/socket?token={studio.token}"
        self._open = ExitStack()
        self._socket = self._open.enter_context(
            connect(at, origin=f"http://{studio.host}", open_timeout=LIMIT)  # type: ignore[arg-type]
        )
        self._heard = threading.Condition()
        self.state: dict[str, Any] = {}
        self.fields: dict[str, dict[str, Any]] = {}
        self.given: dict[str, dict[str, Any]] = {}
        self.told: dict[str, dict[str, Any]] = {}
        self.sizes = Sizes()
        self._thread = threading.Thread(target=self._hear, daemon=True)
        self._thread.start()

    def say(self, **message: Any) -> None:
        self._socket.send(json.dumps(message))

    def say_text(self, text: str) -> None:
        self._socket.send(text)

    def until(self, done: Callable[[], Any]) -> None:
        """Wait until something holds of what was told."""
        end = time.monotonic() + LIMIT
        with self._heard:
            while not done():
                left = end - time.monotonic()
                assert left > 0.0, f"not told in {LIMIT:.0f} s: {self.state}"
                self._heard.wait(left)

    def heard(self) -> None:
        """Wait until all that was said is taken: a difference is told in its turn."""
        with self._heard:
            self.told.pop("difference", None)
        self.say(type="difference")
        self.until(lambda: "difference" in self.told)

    def rest(self) -> None:
        """Wait until everything of the latest state is answered."""
        self.until(self._rests)

    def close(self, *, politely: bool = True) -> None:
        """Go, or drop the connection without a word."""
        if not politely:
            self._socket.socket.close()
        self._open.close()
        self._thread.join(LIMIT)

    def _rests(self) -> bool:
        number, holds = self.state.get("number"), self.state.get("holds", ())
        names = ("known", "machine", "verdict", "shares")
        return (
            number is not None
            and all(
                name in self.given and (self.given[name]["number"] == number or name in holds)
                for name in names
            )
            and self.fields != {}
        )

    def _hear(self) -> None:
        try:
            for text in self._socket:
                self._take(text)
        except (ConnectionClosed, OSError):
            return

    def _take(self, text: str | bytes) -> None:
        with self._heard:
            self.sizes.take(text)
            message = json.loads(text)
            try:
                SENT.validate_python(message)
            except ValueError as failure:
                self.sizes.faults.append(str(failure)[:500])
            kind = message["type"]
            self.told[kind] = message
            if kind == "state":
                self.state = message
            elif kind == "fields":
                if message["first"] == 0:
                    self.fields = {}
                self.fields |= {row["key"]: row for row in message["fields"]}
            elif kind == "answer":
                self.given[message["name"]] = message
            self._heard.notify_all()


class WindowWork:
    """What is done by the socket, each a method; by chance alone."""

    def __init__(self, studio: ServedStudio, chance: random.Random, measured: bytes) -> None:
        self.studio, self.chance, self.measured = studio, chance, measured
        self.window = SoakWindow(studio)
        self.window.until(lambda: self.window.fields)
        self.sizes = Sizes()

    def leave(self, window: SoakWindow, *, politely: bool = True) -> None:
        """Close a window, and keep what is to be told of it."""
        window.close(politely=politely)
        self.sizes.add(window.sizes)

    def edit(self, spread: float = 0.01) -> None:
        """Another value of some fields at once, by some share of each."""
        keys = self.chance.sample(sorted(self.window.fields), self.chance.choice((1, 1, 1, 3)))
        self.window.say(type="edit", edits=[[key, self._near(key, spread)] for key in keys])

    def drag(self) -> None:
        """A slider of a field that is dragged: many values, one step."""
        key = self.chance.choice(sorted(self.window.fields))
        for step in range(self.chance.randrange(5, 40)):
            self.window.say(type="edit", edits=[[key, self._near(key)]], joins=step > 0)

    def take_back(self) -> None:
        """An edit goes, if there is one."""
        edits = self.window.state["edits"]
        if edits:
            self.window.say(type="edit", edits=[[self.chance.choice(edits)[0], None]])

    def refused(self) -> None:
        """A value that no field takes, or no field's."""
        key = self.chance.choice([*sorted(self.window.fields), "nothing.at_all"])
        self.window.say(type="edit", edits=[[key, self.chance.choice(NO_VALUES)]])

    def show(self) -> None:
        """Another pose, temperature or load; some out of reach, some of no machine."""
        names = self.window.state["machine"]["commanded"]
        pose = [self.chance.gauss(0.0, 0.05 if name in "xyz" else 0.02) for name in names]
        home = self.window.given.get("known", {}).get("value")
        if home is not None and self.chance.random() < 0.8:
            pose = [own + 0.3 * by for own, by in zip(home["pose"], pose, strict=False)]
        if self.chance.random() < 0.05:
            pose = pose[1:]
        parts = self.chance.choice(
            ({}, {"strut.1": 300.0 + self.chance.random()}, {"nothing": 1.0})
        )
        wrench = [self.chance.gauss(0.0, 100.0) for _ in range(6)]
        condition = {"temperature": parts, "wrench": wrench}
        said = {"pose": pose, "condition": self.chance.choice((None, condition))}
        self.window.say(type="show", **said)

    def history(self) -> None:
        """Back and forth."""
        for _ in range(self.chance.randrange(1, 6)):
            self.window.say(type=self.chance.choice(("undo", "undo", "redo")))

    def reset(self) -> None:
        """All back."""
        self.window.say(type="reset")

    def tab(self) -> None:
        """A tab, with options that fit or do not."""
        name = self.chance.choice((*TABS, None, "nothing"))
        files = [one["file"] for one in self.window.state["files"]]
        options: dict[str, Any] = {}
        if name == "calibration" and files:
            options = {"file": self.chance.choice(files), "plan": self.chance.choice((3, 0, 5))}
        elif name == "part":
            options = {"program": self.chance.choice(("part.ngc", "../part.ngc", "none.ngc"))}
        self.window.say(type="tab", name=name, options=options)

    def drop(self) -> None:
        """A file of measurements, one cut short, or none at all."""
        size = self.chance.choice((10, 1000, 3_000_000))
        content = self.chance.choice(
            (
                self.measured,
                self.measured[: self.chance.randrange(2000)],
                self.chance.randbytes(size),
            )
        )
        self.studio.post(f"dropped {self.chance.randrange(9)}.csv", content)

    def forget(self) -> None:
        """A dropped file goes."""
        self.window.say(type="forget", file=self.chance.randrange(1, 9))

    def difference(self) -> None:
        """The difference to the file."""
        self.window.say(type="difference")

    def save(self) -> None:
        """Under a name of the folder, or of another."""
        good = self.chance.random() < 0.7
        name = f"saved_{self.chance.randrange(4)}.toml" if good else self.chance.choice(NO_NAMES)
        self.window.say(type="save", name=name[:200], replace=self.chance.random() < 0.8)

    def nonsense(self) -> None:
        """What is no message."""
        self.window.say_text(self.chance.choice(NO_MESSAGES))

    def again(self) -> None:
        """The window goes, politely or not, and comes again."""
        self.leave(self.window, politely=self.chance.random() < 0.5)
        self.window = SoakWindow(self.studio)
        self.window.until(lambda: self.window.fields)

    def several(self) -> None:
        """More windows come, say something, and go."""
        windows = [SoakWindow(self.studio) for _ in range(self.chance.randrange(1, 4))]
        for window in windows:
            window.until(lambda window=window: window.state)
            window.say(type="tab", name=self.chance.choice(list(TABS)))
        for window in windows:
            self.leave(window, politely=self.chance.random() < 0.5)

    def strangers(self) -> None:
        """Requests that get nothing."""
        for path in ("/", f"/?token={self.studio.token[:-1]}", "/files?token=x", "/x"):
            status, _, _ = self.studio.get(path, self.chance.choice(("GET", "POST")), b"x")
            if status != 403:
                self.sizes.faults.append(f"{path} got {status}")

    def report(self) -> None:
        """The report of what is set: it is a page, or why there is none is said."""
        status, _, body = self.studio.get(f"/report?token={self.studio.token}")
        if status not in (200, 422) or not body:
            self.sizes.faults.append(f"/report got {status}")

    def _near(self, key: str, spread: float = 0.01) -> str:
        """A value close to the one that a field has; of a word another one."""
        row = self.window.fields[key]
        if row["choices"]:
            return str(self.chance.choice(row["choices"]))
        factor = 1.0 + self.chance.gauss(0.0, spread)

        def other(number: re.Match[str]) -> str:
            return f"{float(number[0]) * factor:.6g}"

        return NUMBER.sub(other, row["file"] or row["text"], count=1)
