"""A page as PDF, printed by a browser that is installed, without a window and without a network.

The browser is told what to do through a pipe (`--remote-debugging-pipe`, the Chrome DevTools
Protocol, https://chromedevtools.github.io/devtools-protocol), which no other program can speak
into; it has a profile of its own that is removed afterwards, and gets the page through the pipe.
"""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from truepose.errors import Problem, RequestError
from truepose.files.writing import replacing

BROWSER = "TRUEPOSE_BROWSER"
"""Variable of the environment: the browser to use, a name or a path."""

PROGRAMS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
    *("microsoft-edge", "microsoft-edge-stable", "brave-browser"),
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
)
"""Where a browser is looked for, in this order."""

PAPERS = {"A4": (210 / 25.4, 297 / 25.4), "Letter": (8.5, 11.0)}
"""Width and height in inches."""

PATIENCE = 180.0
"""Seconds after which a browser is given up that has not printed."""

# It asks no service for anything; spatial figures are drawn by the processor, the same everywhere.
_FLAGS = (
    *("--headless", "--remote-debugging-pipe", "--no-first-run", "--no-default-browser-check"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
    *("--disable-extensions", "--disable-default-apps", "--disable-quic", "--mute-audio"),
    *("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--force-color-profile=srgb"),
    *("--password-store=basic", "--use-mock-keychain", "--disable-dev-shm-usage"),
)
_HEARS, _SAYS = 3, 4
"""The file descriptors at which the browser hears and says."""
_FREE = 10
"""Descriptors from here on are none of those."""


def installed_browser(environment: Mapping[str, str] = os.environ) -> str:
    """The browser that prints: that of `TRUEPOSE_BROWSER`, else the first that is installed.

    Raises `RequestError` (no-browser) where there is none.
    """
    wanted = environment.get(BROWSER)
    for name in (wanted,) if wanted else PROGRAMS:
        found = shutil.which(name)
        if found is not None and hasattr(os, "posix_spawn"):
            return found
    raise RequestError(
        Problem(
            "no-browser",
            "a PDF is printed by a browser, and none was found",
            found=wanted or "none of " + ", ".join(n for n in PROGRAMS if "/" not in n),
            expected="Chromium, Google Chrome or Microsoft Edge, on Linux or macOS",
            hint="install one (apt-get install chromium), or name it: "
            f"{BROWSER}=/path/to/chrome; or write FILE.html, open it and print it",
        )
    )


def unprotected() -> bool:
    """Whether the browser runs without its sandbox: as root it starts in no other way."""
    return os.geteuid() == 0


def write(page: str, path: Path, paper: str = "A4", browser: str | None = None) -> None:
    """Print a page, its HTML, to a PDF file, whole or not at all.

    `paper` is one of `PAPERS`. Raises `RequestError` (no-browser, browser-failed).
    """
    content = printed(page, paper, browser or installed_browser())
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def printed(page: str, paper: str, browser: str) -> bytes:
    """The PDF file of a page."""
    width, height = PAPERS[paper]
    with _started(browser) as speaking:
        speaking.open_page()
        frame = speaking.ask("Page.getFrameTree")["frameTree"]["frame"]["id"]
        speaking.ask("Page.setDocumentContent", frameId=frame, html=page)
        speaking.wait_for("document.documentElement.dataset.ready", "drawn")
        answer = speaking.ask(
            "Page.printToPDF",
            paperWidth=width,
            paperHeight=height,
            preferCSSPageSize=True,
            printBackground=True,
            displayHeaderFooter=False,
            generateTaggedPDF=True,
            generateDocumentOutline=True,
        )
        return base64.b64decode(answer["data"])


class _Browser:
    """A browser that runs: what it is asked, and what it answers."""

    def __init__(self, name: str, hears: int, says: int) -> None:
        self._name = name
        self._hears, self._says = hears, says
        self._count = 0
        self._session: str | None = None
        self._heard = b""
        self._until = time.monotonic() + PATIENCE

    def open_page(self) -> None:
        """An empty page, of which all later questions are."""
        target = self.ask("Target.createTarget", url="about:blank#print")["targetId"]
        answer = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self._session = answer["sessionId"]

    def ask(self, method: str, **parameters: Any) -> Any:
        """The result of a command of the protocol."""
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters}
        if self._session is not None:
            message["sessionId"] = self._session
        self._send(json.dumps(message).encode() + b"\0")
        while True:
            answer = json.loads(self._next())
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise self.failed(answer["error"].get("message", "an error"))
                return answer["result"]

    def wait_for(self, expression: str, wanted: str) -> None:
        """Until an expression has a value, which is to be the one wanted."""
        while True:
            answer = self.ask("Runtime.evaluate", expression=expression)
            value = answer["result"].get("value")
            if value == wanted:
                return
            if value is not None:
                raise self.failed("the figures could not be drawn")
            self._seconds_left()
            time.sleep(0.05)

    def failed(self, how: str) -> RequestError:
        """That the browser did not do it."""
        return RequestError(
            Problem(
                "browser-failed",
                "the browser did not print the page",
                found=f"{self._name}: {how}",
                expected="a browser that starts and prints",
                hint=f"try another one, {BROWSER}=/path/to/chrome; or write FILE.html, open it "
                "and print it",
            )
        )

    def _send(self, message: bytes) -> None:
        rest = memoryview(message)
        while rest:
            _, ready, _ = select.select([], [self._hears], [], self._seconds_left())
            if ready:
                try:
                    rest = rest[os.write(self._hears, rest) :]
                except BrokenPipeError:
                    raise self.failed("it ended at once") from None

    def _next(self) -> bytes:
        """The next message."""
        while b"\0" not in self._heard:
            ready, _, _ = select.select([self._says], [], [], self._seconds_left())
            if ready:
                more = os.read(self._says, 1 << 20)
                if not more:
                    raise self.failed("it ended before it was done")
                self._heard += more
        message, _, self._heard = self._heard.partition(b"\0")
        return message

    def _seconds_left(self) -> float:
        left = self._until - time.monotonic()
        if left <= 0:
            raise self.failed(f"it was not done after {PATIENCE:.0f} s")
        return left


@contextmanager
def _started(program: str) -> Iterator[_Browser]:
    """A browser for a while, which is ended on the way out, Ctrl-C included; its profile goes."""
    with tempfile.TemporaryDirectory(
        prefix="truepose-browser-", ignore_cleanup_errors=True
    ) as profile:
        hears, ours_out = _pipe()
        ours_in, says = _pipe()
        flags = [*_FLAGS, f"--user-data-dir={profile}"]
        if unprotected():
            flags.append("--no-sandbox")
        try:
            process = _spawned([program, *flags], hears, says)
        except OSError as failure:
            for each in (ours_out, ours_in):
                os.close(each)
            browser = _Browser(program, ours_out, ours_in)
            raise browser.failed(failure.strerror or str(failure)) from failure
        finally:
            for each in (hears, says):
                os.close(each)
        os.set_blocking(ours_out, False)
        try:
            yield _Browser(program, ours_out, ours_in)
        finally:
            for each in (ours_out, ours_in):
                os.close(each)
            _end(process)


def _pipe() -> tuple[int, int]:
    """A pipe, both ends above the descriptors that the browser has."""
    import fcntl  # Windows has none

    ends = os.pipe()
    moved = tuple(fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, _FREE) for end in ends)
    for end in ends:
        os.close(end)
    return moved[0], moved[1]


def _spawned(command: list[str], hears: int, says: int) -> int:
    """A process in a group of its own, which Ctrl-C of the terminal does not reach."""
    return os.posix_spawn(
        command[0],
        command,
        os.environ,
        file_actions=[
            (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0),
            (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0),
            (os.POSIX_SPAWN_OPEN, 2, os.devnull, os.O_WRONLY, 0),
            (os.POSIX_SPAWN_DUP2, hears, _HEARS),
            (os.POSIX_SPAWN_DUP2, says, _SAYS),
        ],
        setpgroup=0,
    )


def _end(process: int) -> None:
    """Ask the browser to end, and make it where it does not; it is waited for."""
    for how, seconds in ((signal.SIGTERM, 3.0), (signal.SIGKILL, 10.0)):
        with suppress(ProcessLookupError):
            os.killpg(process, how)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if os.waitpid(process, os.WNOHANG)[0]:
                with suppress(ProcessLookupError):
                    os.killpg(process, signal.SIGKILL)  # what it started
                return
            time.sleep(0.02)


__all__ = ["BROWSER", "PAPERS", "installed_browser", "printed", "unprotected", "write"]
