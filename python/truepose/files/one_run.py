"""The files of one run: what it reads and what it writes, which are never the same.

A command states its outputs before any work is done, and every file is noted as it is read; so a
data file that a machine file names is as safe as the machine file itself, whoever reads it. Outside
of a run, in Python, nothing is noted: who names a file there knows it.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from truepose.errors import Fault, RequestError

STDIN = Path("<stdin>")
"""What standard input is called, in messages and where a file names what it was made from."""


@dataclass(frozen=True)
class Content:
    """What a file held when it was read: how many bytes, and their SHA-256."""

    size: int
    sha256: str


@dataclass
class _Files:
    """Of one run, links followed; `outputs` by what they were asked for with.

    `written`: outputs that have their names; `of_pipes`: what came out of pipes, and of standard
    input, if that is an input too; `contents`: what was read, in that order.
    """

    inputs: list[Path] = field(default_factory=list)
    outputs: dict[str, Path] = field(default_factory=dict)
    written: list[Path] = field(default_factory=list)
    of_pipes: dict[Path, bytes] = field(default_factory=dict)
    stdin: bool = False
    contents: dict[Path, Content] = field(default_factory=dict)


_RUN: ContextVar[_Files | None] = ContextVar("files of one run", default=None)


@contextmanager
def one_run() -> Iterator[None]:
    """What is read and written inside belongs together."""
    token = _RUN.set(_Files())
    try:
        yield
    finally:
        _RUN.reset(token)


def will_write(path: Path, asked_with: str) -> None:
    """State an output, asked for with "--output" say.

    Raises `RequestError` (output-is-input, output-twice).
    """
    run = _RUN.get()
    if run is None:
        return
    require_not_read(path)
    for other, taken in run.outputs.items():
        if _same(path, taken):
            raise _refusal(
                "output-twice",
                f"{other} and {asked_with} would be written to the same file",
                path,
                f"{path} for both",
                "a file for each",
            )
    run.outputs[asked_with] = real_path(path)


def reads(path: Path) -> None:
    """Note an input. Raises `RequestError` (output-is-input) where it is to be written over."""
    run = _RUN.get()
    if run is None:
        return
    for asked_with, output in run.outputs.items():
        if _same(path, output):
            raise _over_input(output, f"{path}, of {asked_with}")
    run.inputs.append(real_path(path))


def will_read_stdin() -> Path:
    """State that standard input, given as "-", is an input -> what it is called from here on.

    Raises `RequestError` (stdin-twice): what came out of it for one input is gone for another.
    """
    run = _RUN.get()
    if run is not None:
        if run.stdin:
            raise RequestError(
                Fault(
                    "stdin-twice",
                    "standard input cannot be two files of one command",
                    found="- twice",
                    expected="- once, and the names of files",
                ).at()
            )
        run.stdin = True
    return STDIN


def is_stdin(path: Path) -> bool:
    """Whether a path means standard input: that was given, and is not the name of a file."""
    run = _RUN.get()
    return run is not None and run.stdin and path == STDIN


def inputs() -> tuple[Path, ...]:
    """What this run has read, or wanted to, links followed."""
    run = _RUN.get()
    return () if run is None else tuple(dict.fromkeys(run.inputs))


def has_read(path: Path, content: bytes) -> None:
    """Note what an input held."""
    run = _RUN.get()
    if run is not None:
        run.contents[path] = Content(len(content), hashlib.sha256(content).hexdigest())


def contents() -> dict[Path, Content]:
    """What the inputs of this run held, in the order in which they were read."""
    run = _RUN.get()
    return {} if run is None else dict(run.contents)


@contextmanager
def once_more() -> Iterator[None]:
    """What this run does once more, with the same outputs: what it reads is read anew."""
    run = _RUN.get()
    token = _RUN.set(_Files() if run is None else _Files(outputs=dict(run.outputs)))
    try:
        yield
    finally:
        _RUN.reset(token)


def require_not_read(path: Path) -> None:
    """Refuse an output that this run has read. Raises `RequestError` (output-is-input)."""
    run = _RUN.get()
    if run is not None and any(_same(path, read) for read in run.inputs):
        raise _over_input(path, str(path))


def has_written(path: Path) -> None:
    """Note that an output has its name now."""
    run = _RUN.get()
    if run is not None:
        run.written.append(path)


def written() -> tuple[Path, ...]:
    """Outputs of this run that have their names."""
    run = _RUN.get()
    return () if run is None else tuple(run.written)


def once(path: Path, read: Callable[[], bytes]) -> bytes:
    """What came out of a pipe, which a run reads once however often it asks."""
    run = _RUN.get()
    if run is None:
        return read()
    if path not in run.of_pipes:
        run.of_pipes[path] = read()
    return run.of_pipes[path]


def real_path(path: Path) -> Path:
    """The path with links followed, as far as the system can; where a file is written."""
    try:
        return Path(os.path.realpath(path))
    except (OSError, ValueError):
        return path


def _over_input(path: Path, found: str) -> RequestError:
    return _refusal(
        "output-is-input",
        "the output would write over a file that is read",
        path,
        found,
        "another file",
    )


def _same(one: Path, other: Path) -> bool:
    """Whether both names are of one file, by links too, or would be."""
    if real_path(one) == real_path(other):
        return True
    try:
        return one.samefile(other)
    except (OSError, ValueError):
        return False


def _refusal(code: str, message: str, path: Path, found: str, expected: str) -> RequestError:
    return RequestError(Fault(code, message, found=found, expected=expected).at(str(path)))
