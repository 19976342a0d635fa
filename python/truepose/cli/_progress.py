"""Progress of long work, on stderr and only where someone looks."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from truepose.cli._verbose import step

PATIENCE = 2.0
"""Seconds of work before a bar appears."""

LARGE = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
"""Above ten thousand, numbers are shown in these."""


@contextmanager
def progress(
    what: str, unit: str = "poses", *, first: str = ""
) -> Iterator[Callable[[int, int], None] | None]:
    """A function (done, total) that draws a bar, or None where stderr is no terminal.

    Beside the bar stand how many of what `unit`, the rate so far and the time left at that rate.
    A `total` below one is one that is not known yet. Before it comes a line that stays: how long
    all takes, where that is known, and what is done `first`, where that is said.
    """
    with step(what), _bar(what, unit, first) as report:
        yield report


@contextmanager
def _bar(what: str, unit: str, first: str) -> Iterator[Callable[[int, int], None] | None]:
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.fields[state]}"),
        console=Console(stderr=True),
        transient=True,
    )
    task = bar.add_task(what, total=None, state="")
    begun = time.monotonic()

    def report(done: int, total: int) -> None:
        seconds = time.monotonic() - begun
        if not bar.live.is_started and seconds > PATIENCE and (done < total or total < 1):
            bar.start()
            if first or (done >= 1 and total >= 1):
                bar.console.print(estimate(what, done, total, unit, seconds, first), markup=False)
        known = total if total >= 1 else None
        bar.update(task, completed=done, total=known, state=state(done, known, unit, seconds))

    try:
        yield report
    finally:
        bar.stop()


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """Show that work goes on whose length nobody knows, where someone looks and it takes long."""
    with step(what), _clock_running(what):
        yield


@contextmanager
def _clock_running(what: str) -> Iterator[None]:
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    bar = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        console=Console(stderr=True),
        transient=True,
    )
    bar.add_task(what, total=None)
    # The bar draws itself from a thread of its own while the kernel computes.
    timer = threading.Timer(PATIENCE, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()
        bar.stop()


def estimate(what: str, done: int, total: int, unit: str, seconds: float, first: str) -> str:
    """How long it takes: "shares: about 1:20 for 675 poses, the worst first; Ctrl-C ...".

    After `done` of `total`, if that is known, in `seconds`.
    """
    said = []
    if done >= 1 and total >= 1:
        said.append(f"about {clock(seconds / done * total)} for {_short(total)} {unit}")
    if first:
        said.append(f"{first} first; Ctrl-C gives what is done by then")
    return f"{what}: {', '.join(said)}"


def state(done: int, total: int | None, unit: str, seconds: float) -> str:
    """How far the work is after `seconds`: "1.2 M of 10 M samples, 300 k/s, 0:29 left"."""
    much = f"{_short(done)} of {_short(total)} {unit}" if total else f"{_short(done)} {unit}"
    if done < 1 or seconds <= 0.0:
        return much
    rate = done / seconds
    said = f"{much}, {_short(rate)}/s"
    if total is None or done >= total:
        return said
    return f"{said}, {clock((total - done) / rate)} left"


def _short(number: float) -> str:
    """Three digits: "9", "8192", "12.3 k", "1.2 M"."""
    if number >= 10_000:
        for size, letter in LARGE:
            if number >= size:
                return f"{number / size:.3g} {letter}"
    return f"{number:.0f}" if number >= 100 else f"{number:.3g}"


def clock(seconds: float) -> str:
    """Minutes and seconds, "0:29", or hours as well, "1:02:09"."""
    whole = round(seconds)
    minutes, rest = divmod(whole, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest:02}" if hours else f"{minutes}:{rest:02}"
