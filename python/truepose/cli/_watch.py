"""Do something again whenever a file that it reads changes, until Ctrl-C.

Files are looked at every `PAUSE`: that needs no library, and works where a system tells of no
changes (network folders, containers). What is read is noted by the run itself (`files.one_run`), so
a data file that a machine file names is watched too, also one that is not there yet.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

import click

from truepose.cli._ending import BAD_INPUT, ending
from truepose.cli._problems import show_problems
from truepose.errors import TrueposeError
from truepose.files.one_run import inputs, once_more

PAUSE = 0.2
"""Seconds between two looks at the files."""

State = dict[Path, tuple[int, int, int] | None]
"""Of every file: when it was changed, its size and its number; None where there is none."""


def watched(work: Callable[[], int], file: Path, *, as_json: bool) -> int:
    """Call `work` now and whenever `file`, or what it read besides, changes.

    Ends by Ctrl-C -> the exit code of the last time, told on stderr. Where `work` fails, that is
    told, and counts like a failed command; the next change starts it again. Ctrl-C before it was
    done once raises `KeyboardInterrupt`.
    """
    code: int | None = None
    known: set[Path] = {file}
    try:
        while True:
            before = _state(known)
            click.clear()
            with once_more():
                code = _done(work, as_json=as_json)
                now = set(inputs()) | {file}
            # A file that is broken for a moment names no others, and they are watched all the same.
            known = known | now if code == BAD_INPUT else now
            names = ", ".join(sorted({path.name for path in known}))
            moment = time.strftime("%H:%M:%S")
            click.echo(f"{moment}, exit code {code}; watching {names}; Ctrl-C ends.", err=True)
            sys.stdout.flush()
            _wait({**_state(known), **before})
    except KeyboardInterrupt:
        if code is None:
            raise
        return code


def _done(work: Callable[[], int], *, as_json: bool) -> int:
    try:
        return work()
    except TrueposeError as failure:
        show_problems(failure, as_json=as_json)
        return BAD_INPUT
    except BrokenPipeError:
        raise
    except Exception as failure:
        return ending(failure)


def _wait(since: State) -> None:
    """Until a file is another than it was, and then until it stays as it is for a moment."""
    while (now := _state(since)) == since:
        time.sleep(PAUSE)
    while True:
        time.sleep(PAUSE)
        later = _state(since)
        if later == now:
            return
        now = later


def _state(files: set[Path] | State) -> State:
    return {file: _of(file) for file in files}


def _of(file: Path) -> tuple[int, int, int] | None:
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino
