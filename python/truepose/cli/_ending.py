"""How the program ends where something goes wrong that is no problem of a command's input."""

from __future__ import annotations

import errno
import os
import sys
import traceback
from contextlib import suppress
from pathlib import Path

import click

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells count it (128 + SIGINT)."""
PIPE_CLOSED = 141
"""Exit code when the reader of our output went away (128 + SIGPIPE)."""
BAD_INPUT = 2
DEFECT = 70
"""Exit code after a defect of this program (EX_SOFTWARE of sysexits.h)."""

TRACEBACK = "TRUEPOSE_TRACEBACK"
"""Variable of the environment: where it is set, a defect is told with its traceback."""

_OF_A_STREAM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EBADF)
"""What the system says of an output that takes no more."""


class PipeClosedError(Exception):
    """The reader of our output went away; click itself would leave with exit code 1."""


def ending(failure: BaseException) -> int:
    """The exit code of a failure that no command handles, told in a sentence on stderr."""
    if isinstance(failure, BrokenPipeError | PipeClosedError):
        _print_nowhere()
        return PIPE_CLOSED
    if isinstance(failure, OSError) and not failure.filename and failure.errno in _OF_A_STREAM:
        _print_nowhere()
        return refused_output(failure.strerror or str(failure))
    if isinstance(failure, MemoryError):
        say("Error: there is not enough memory for this; ask for fewer poses or samples.")
        return BAD_INPUT
    if os.environ.get(TRACEBACK):
        say("".join(traceback.format_exception(failure)))
    say(_sentence(failure))
    return DEFECT


def refused_output(reason: str) -> int:
    """The exit code where what is printed cannot be written, told like any problem."""
    from truepose.errors import Problem

    problem = Problem(
        "output-not-writable",
        "what is printed cannot be written",
        found=reason,
        expected="a standard output that is open and has room",
        hint="to print nothing: > /dev/null",
    )
    say(str(problem))
    return BAD_INPUT


def say(text: str) -> None:
    """Print on stderr, if that takes anything."""
    with suppress(OSError):
        click.echo(text, err=True)


def _print_nowhere() -> None:
    """Python flushes stdout once more at exit; that goes nowhere."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _sentence(failure: BaseException) -> str:
    """What to tell of a defect, and whom."""
    from truepose.version import version

    frames = traceback.extract_tb(failure.__traceback__)
    package = str(Path(__file__).parent.parent)
    own = [frame for frame in frames if frame.filename.startswith(package)]
    place = ""
    if own:
        name = Path(own[-1].filename).relative_to(Path(package).parent).as_posix()
        place = f" in {name}, line {own[-1].lineno}"
    what = " ".join(str(failure).split())
    shown = what if len(what) <= 200 else what[:197] + "..."
    return (
        f"Error: this is a defect of truepose {version()}, not of your input: "
        f"{type(failure).__name__}{f' ({shown})' if shown else ''}{place}. Please report this "
        f"sentence and your command to the project that you have truepose from; with "
        f"{TRACEBACK}=1 set it says more."
    )
