"""`--verbose`: what a command did, on what, and how long each step took, on stderr.

A command says its steps where it takes them (`step`; every `progress` is one) and what it found
(`say`); without the option both cost nothing. What it prints on stdout stays what it is.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import click

from truepose.files.one_run import contents, is_stdin

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

_LOG = "truepose.verbose"
"""Key in the context's shared `meta`: there with `--verbose`."""

_DURATION = 10
"""Columns of a duration."""


@dataclass
class _Log:
    """Of one run: when it began, how deep in steps it is, and what was told already."""

    begun: float = field(default_factory=time.perf_counter)
    depth: int = 0
    in_steps: float = 0.0
    told: set[str] = field(default_factory=set)


def _begin(context: click.Context, _: click.Parameter, asked: bool) -> None:
    if asked and not context.resilient_parsing and _LOG not in context.meta:
        context.meta[_LOG] = _Log()
        context.call_on_close(_end)


verbose_option = click.option(
    "--verbose",
    "-v",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_begin,
    help="Say on stderr what is done, on what, and how long it takes.",
)


def _log() -> _Log | None:
    context = click.get_current_context(silent=True)
    log = None if context is None else context.meta.get(_LOG)
    return log if isinstance(log, _Log) else None


def say(text: str) -> None:
    """What is worth knowing, once."""
    log = _log()
    if log is not None and text not in log.told:
        log.told.add(text)
        click.echo(f"{'':{_DURATION}}  {'  ' * log.depth}{text}", err=True)


@contextmanager
def step(what: str) -> Iterator[None]:
    """Something that takes its time; within another one, it is part of that."""
    log = _log()
    if log is None:
        yield
        return
    begun = time.perf_counter()
    log.depth += 1
    how = ", not finished"
    try:
        yield
        how = ""
    finally:
        _say_files()
        log.depth -= 1
        seconds = time.perf_counter() - begun
        if log.depth == 0:
            log.in_steps += seconds
        click.echo(f"{_shown(seconds)}  {'  ' * log.depth}{what}{how}", err=True)


def say_machine(machine: Machine) -> None:
    """What was made of a machine file, and what computes with it."""
    if _log() is None:
        return
    from truepose._kernel import instruction_set, threads
    from truepose.files.wording import counted
    from truepose.sources import acting
    from truepose.version import version

    say(f"truepose {version()}, {instruction_set()}, {counted(threads(), 'thread')}")
    _say_files()
    rows = {"drive": machine.drives, "strut": machine.struts, "guide": machine.guides}
    parts = [counted(len(row), name) for name, row in rows.items() if row]
    parts.append(counted(len(machine.parameters), "parameter"))
    say(f"machine {machine.name}: {', '.join(parts)}")
    if machine.settings:
        say("settings: " + ", ".join(f"{key}={text}" for key, text in machine.settings.items()))
    if machine.workspace is not None:
        say(f"workspace: {counted(machine.workspace.n_pose, 'pose')}")
    names = [source.name for source in acting(machine)]
    say(f"sources: {', '.join(names) or 'none that acts'}")


def say_result(result: xr.Dataset) -> None:
    """What a result is of: its poses, samples and seed, as far as it has them."""
    if _log() is None:
        return
    from truepose.files.wording import counted

    parts = [counted(result.sizes["pose"], "pose")] if "pose" in result.sizes else []
    if result.sizes.get("left_out"):
        parts.append(f"{counted(result.sizes['left_out'], 'pose')} left out")
    if "samples" in result and result["samples"].ndim <= 1:
        parts.append(f"{int(result['samples'].sum()):,} samples")
    if result.attrs.get("seed", "none") != "none":
        parts.append(f"seed {result.attrs['seed']}")
    if parts:
        say(f"result: {', '.join(parts)}")


def say_file(path: Path) -> None:
    """A file that others open and read, in any size."""
    if _log() is None or is_stdin(path):
        return
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
        say(f"read {path}: {file.tell():,} bytes, SHA-256 {digest}")


def _say_files() -> None:
    """What was read since this was asked last."""
    for path, content in contents().items():
        say(f"read {path}: {content.size:,} bytes, SHA-256 {content.sha256}")


def _end() -> None:
    log = _log()
    if log is None:
        return
    _say_files()
    seconds = time.perf_counter() - log.begun
    rest = _shown(max(seconds - log.in_steps, 0.0)).strip()
    click.echo(f"{_shown(seconds)}  in all, {rest} of it loading packages and printing", err=True)


def _shown(seconds: float) -> str:
    text = f"{seconds:.3f} s" if seconds < 100.0 else f"{seconds:.0f} s"
    return f"{text:>{_DURATION}}"
