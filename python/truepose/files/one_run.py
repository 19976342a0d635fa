"""The files of one run: what it reads and what it writes, which are never the same.

A command states its outputs before any work is done, and every file is noted as it is read; so a
data file that a machine file names is as safe as the machine file itself, whoever reads it. Outside
of a run, in Python, nothing is noted: who names a file there knows it.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path

from truepose.errors import Fault, RequestError


@dataclass
class _Files:
    """Of one run, links followed; `outputs` by what they were asked for with."""

    inputs: list[Path] = field(default_factory=list)
    outputs: dict[str, Path] = field(default_factory=dict)


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
    run.outputs[asked_with] = Path(os.path.realpath(path))


def reads(path: Path) -> None:
    """Note an input. Raises `RequestError` (output-is-input) where it is to be written over."""
    run = _RUN.get()
    if run is None:
        return
    for asked_with, output in run.outputs.items():
        if _same(path, output):
            raise _over_input(output, f"{path}, of {asked_with}")
    run.inputs.append(Path(os.path.realpath(path)))


def require_not_read(path: Path) -> None:
    """Refuse an output that this run has read. Raises `RequestError` (output-is-input)."""
    run = _RUN.get()
    if run is not None and any(_same(path, read) for read in run.inputs):
        raise _over_input(path, str(path))


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
    if os.path.realpath(one) == os.path.realpath(other):
        return True
    try:
        return one.samefile(other)
    except (OSError, ValueError):
        return False


def _refusal(code: str, message: str, path: Path, found: str, expected: str) -> RequestError:
    return RequestError(Fault(code, message, found=found, expected=expected).at(str(path)))
