"""A studio in a process of its own, as `truepose studio` starts it, and windows that ask it."""

from __future__ import annotations

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any
from urllib.parse import quote

from websockets.sync.client import ClientConnection, connect

from truepose.studio.messages import MOST_SENT, SENT

LIMIT = 240.0
"""s; what does not answer until then never will."""


def free_port() -> int:
    """A port that no process has now."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@dataclass
class ServedStudio:
    """A studio that runs: its process, and where it is."""

    process: subprocess.Popen[str]
    address: str
    said: str = ""

    @property
    def port(self) -> int:
        return int(re.findall(r":(\d+)/", self.address)[0])

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"

    @property
    def token(self) -> str:
        return self.address.partition("token=")[2]

    def get(
        self,
        path: str,
        method: str = "GET",
        body: bytes | None = None,
        headers: dict[str, str] | None = None,
    ) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body of an answer; `Host` is the studio's where none is given."""
        given = {"Host": self.host} | (headers or {})
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=LIMIT)
        try:
            connection.putrequest(method, path, skip_host=True)
            for name, value in given.items():
                connection.putheader(name, value)
            if body is not None and "Content-Length" not in given:
                connection.putheader("Content-Length", str(len(body)))
            connection.endheaders(body)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()
        finally:
            connection.close()

    def post(self, name: str, content: bytes) -> Any:
        """Drop a file, as the page does."""
        path = f"/files?token={self.token}&name={quote(name)}"
        origin = {"Origin": f"http://{self.host}"}
        return json.loads(self.get(path, "POST", content, origin)[2])

    @contextmanager
    def window(self) -> Iterator[Window]:
        """A window, and all that it is told."""
        at = f"ws://{self.host}/socket?token={self.token}"
        with connect(at, origin=f"http://{self.host}", open_timeout=LIMIT) as one:  # type: ignore[arg-type]
            yield Window(one)

    def end(self, number: int = signal.SIGINT) -> tuple[int, str]:
        """End it by a signal; its exit code, and what it said on stderr."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        _, err = self.process.communicate(timeout=LIMIT)
        return self.process.returncode, self.said + (err or "")


@dataclass
class Window:
    """One window. Every message that it is told is one of the schema, and small enough."""

    socket: ClientConnection
    told: list[dict[str, Any]] = field(default_factory=list)

    def say(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def edit(self, key: str, value: str | None) -> None:
        self.say(type="edit", edits=[[key, value]])

    def next(self) -> dict[str, Any]:
        text = self.socket.recv(timeout=LIMIT)
        assert isinstance(text, str)
        assert len(text.encode()) <= MOST_SENT
        message: dict[str, Any] = json.loads(text)
        SENT.validate_python(message)
        self.told.append(message)
        return message

    def until(self, kind: str, **of: Any) -> dict[str, Any]:
        """The next message of a type, with these values."""
        while True:
            message = self.next()
            if message["type"] == kind and all(message.get(k) == v for k, v in of.items()):
                return message


def started(
    file: Path,
    state: Path,
    *options: str,
    stderr: int | IO[str] = subprocess.PIPE,
    more: Mapping[str, str] | None = None,
) -> ServedStudio:
    """Start a studio of a machine file, whose state is kept in a folder of its own.

    `stderr`: where what it says goes; `more`: of its environment.
    """
    environment = os.environ | {
        "XDG_STATE_HOME": str(state),
        "TRUEPOSE_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        **(more or {}),
    }
    process = subprocess.Popen(
        [sys.executable, "-m", "truepose", "studio", file.name, "--no-open", *options],
        cwd=file.parent,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        _, err = process.communicate(timeout=LIMIT)
        raise AssertionError(err)
    return ServedStudio(process, line.strip())


@contextmanager
def studio_of(file: Path, state: Path, *options: str) -> Iterator[ServedStudio]:
    """A studio that is ended whatever happens."""
    studio = started(file, state, *options)
    try:
        yield studio
    finally:
        if studio.process.poll() is None:
            studio.process.kill()
            studio.process.wait(LIMIT)
        for pipe in (studio.process.stdout, studio.process.stderr):
            if pipe is not None:
                pipe.close()
