"""The kernel as a page has it, asked from Python through Node.js."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from node import node
from system_package import missing
from truepose.arrays import Floats

RUNNER = Path(__file__).parent / "web" / "runner.mjs"


class RefusedError(Exception):
    """A request that is refused: args are its code, message and place."""


class WebKernel:
    """A module that runs; requests by their names, replies as `ok` has them."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def line(self, text: str) -> str:
        """The answer to one line of text, whatever it is."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(text + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        assert answer, "the module trapped"
        return answer.rstrip("\n")

    def ask(self, op: str, times: int = 1, **values: Any) -> dict[str, Any]:
        """The reply to a request, which may be asked several times. Raises `RefusedError`."""
        request = json.dumps({"op": op, **values}, default=np.ndarray.tolist)
        reply = json.loads(self.line(request if times == 1 else f"* {times} {request}"))
        if "error" in reply:
            error = reply["error"]
            raise RefusedError(error["code"], error["message"], error["place"])
        answer: dict[str, Any] = reply["ok"]
        return answer

    @property
    def memory(self) -> int:
        """Bytes that the module has."""
        return int(self.line("memory"))


@contextmanager
def web_kernel() -> Iterator[WebKernel]:
    """The module that `make web` has built; skips where there is none, or no Node.js."""
    module = Path(str(files("truepose"))) / "_kernel.wasm.gz"
    if not module.exists():
        missing("there is no kernel for a page: make web")
    command = [node(), str(RUNNER), str(module)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
    ) as process:
        yield WebKernel(process)
        assert process.stdin is not None
        process.stdin.close()


def numbers(values: Any) -> Floats:
    """Numbers of a reply, NaN where it has null."""
    return np.array(values, np.float64)
