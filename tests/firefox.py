"""A headless Firefox that asks no service for anything, and what a page in it asked for.

Playwright drives a Firefox of its own, which it would download. The one that the system has speaks
WebDriver BiDi (https://w3c.github.io/webdriver-bidi/) over a socket, of which tests need six
commands.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from browser import Heard
from system_package import missing

PATIENCE = 180.0
"""Seconds: a busy machine is slow, and slowness is no fault here."""

PREFERENCES = {
    # What is asked of the network goes nowhere: no proxy listens there.
    "network.proxy.type": 1,
    **{
        f"network.proxy.{scheme}{end}": value
        for scheme in ("http", "ssl")
        for end, value in (("", "127.0.0.1"), ("_port", 9))
    },
}
LISTENING = re.compile(r"^WebDriver BiDi listening on (ws://\S+)$", re.M)
HEARD = ["log.entryAdded", "network.beforeRequestSent"]

# Values go there and back as JSON: the protocol's own form of them is many words.
ASKED = "async text => JSON.stringify(await ({function})(JSON.parse(text)) ?? null)"
AWAITED = """async argument => {{
  while (!await ({function})(argument)) await new Promise(done => setTimeout(done, 20));
}}"""


@dataclass
class Firefox:
    """A tab; of Playwright's page it has what tests of live pages ask for."""

    socket: Any
    heard: Heard = field(default_factory=Heard)
    _asked: int = 0
    _context: str = ""

    def open(self) -> None:
        """Begin a session in the tab that is there, and listen."""
        self._command("session.new", capabilities={})
        self._context = self._command("browsingContext.getTree")["contexts"][0]["context"]
        self._command("session.subscribe", events=HEARD)

    def goto(self, url: str) -> Heard:
        """Go to a page; returns what is heard from now on, of it and its workers."""
        self.heard = Heard()
        self._command("browsingContext.navigate", context=self._context, url=url, wait="complete")
        return self.heard

    def evaluate(self, function: str, argument: object = None, timeout: float = PATIENCE) -> Any:
        """What a function says of an argument in the page, or what its promise is kept with.

        Raises `AssertionError` where it throws, `TimeoutError` where it takes longer.
        """
        said = self._command(
            "script.callFunction",
            timeout,
            functionDeclaration=ASKED.format(function=function),
            arguments=[{"type": "string", "value": json.dumps(argument)}],
            target={"context": self._context},
            awaitPromise=True,
        )
        if said["type"] == "exception":
            raise AssertionError(said["exceptionDetails"]["text"])
        return json.loads(said["result"]["value"])

    def wait_for_function(self, function: str, *, arg: object = None, timeout: float) -> None:
        """Until a function says yes; `timeout` in milliseconds. Raises as `evaluate` does."""
        self.evaluate(AWAITED.format(function=function), arg, timeout / 1000)

    def close(self) -> None:
        """Close the browser."""
        self._command("browser.close")

    def _command(self, method: str, timeout: float = PATIENCE, **parameters: Any) -> Any:
        """What a command answers; what the browser tells in between is heard."""
        self._asked += 1
        self.socket.send(json.dumps({"id": self._asked, "method": method, "params": parameters}))
        last = monotonic() + timeout
        while True:
            told = json.loads(self.socket.recv(timeout=max(0.0, last - monotonic())))
            if told["type"] == "event":
                self._hear(told["method"], told["params"])
            elif told["id"] == self._asked:
                assert told["type"] == "success", told
                return told["result"]

    def _hear(self, event: str, said: dict[str, Any]) -> None:
        if event == "network.beforeRequestSent":
            self.heard.requests.append(said["request"]["url"])
        elif event == "log.entryAdded" and said["level"] == "error":
            self.heard.complaints.append(said["text"])


@contextmanager
def opened_firefox(profile: Path) -> Iterator[Firefox]:
    """The browser, with its profile in a folder; skips where it or websockets is missing."""
    try:
        from websockets.sync.client import connect
    except ImportError:
        missing("websockets is not installed: pip install 'truepose[dev]'")
    program = shutil.which("firefox-esr") or shutil.which("firefox")
    if program is None:
        missing("firefox is not installed: apt-get install firefox-esr")
    lines = (
        f"user_pref({json.dumps(key)}, {json.dumps(PREFERENCES[key])});" for key in PREFERENCES
    )
    (profile / "user.js").write_text("\n".join(lines), encoding="utf-8")
    log = profile / "firefox.log"
    with log.open("w") as written:
        process = subprocess.Popen(
            [program, "--headless", "--no-remote", "--remote-debugging-port", "0",
             "--profile", str(profile)],
            env=os.environ | {"HOME": str(profile), "MOZ_CRASHREPORTER_DISABLE": "1"},
            stdin=subprocess.DEVNULL,
            stdout=written,
            stderr=written,
        )  # fmt: skip
    try:
        with connect(f"{_address(process, log)}/session", max_size=None) as socket:
            firefox = Firefox(socket)
            firefox.open()
            yield firefox
            firefox.close()
        process.wait(PATIENCE)
    finally:
        process.kill()
        process.wait()


def _address(process: subprocess.Popen[bytes], log: Path) -> str:
    """Where it listens, as it says when it is ready."""
    last = monotonic() + PATIENCE
    while (found := LISTENING.search(log.read_text(errors="replace"))) is None:
        assert process.poll() is None, log.read_text(errors="replace")
        assert monotonic() < last, log.read_text(errors="replace")
        sleep(0.05)
    return found[1]
