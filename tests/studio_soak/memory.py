"""What a studio and its page hold in memory, from /proc and from Chromium's own counters."""

from __future__ import annotations

import os
import time
from collections import defaultdict
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

PROC = Path("/proc")
SIZES = ("server", "family", "heap", "process")
HEAD = "minute  server  with its children  page: heap  process  nodes  listeners   (MB)"


@dataclass(frozen=True)
class Reading:
    """Megabytes, at rest with the file as it was; `minute` from the beginning.

    `server`: what is resident of the process that serves. `family`: that with the processes that it
    started, what they share counted once. `heap`: of the page's scripts after a collection;
    `process`: what the page's processes have for themselves. `nodes`, `listeners`: of the page.
    """

    minute: float
    server: float
    family: float
    heap: float
    process: float
    nodes: int
    listeners: int

    def __str__(self) -> str:
        return (
            f"{self.minute:6.2f} {self.server:7.1f} {self.family:18.1f} {self.heap:11.1f} "
            f"{self.process:8.1f} {self.nodes:6d} {self.listeners:10d}"
        )


def read(begun: float, server: int, tools: Any) -> Reading:
    """A reading now. `server`: a process's number; `tools`: a DevTools session of the page."""
    for _ in range(2):  # what goes with the first one may have held more
        tools.send("HeapProfiler.collectGarbage")
    counted = {one["name"]: one["value"] for one in tools.send("Performance.getMetrics")["metrics"]}
    pages = [process for process in below(os.getpid()) if _is_renderer(process)]
    return Reading(
        minute=(time.monotonic() - begun) / 60.0,
        server=_megabytes(server, "Rss"),
        family=sum(_megabytes(process, "Pss") for process in (server, *below(server))),
        heap=counted["JSHeapUsedSize"] / 1e6,
        process=sum(_megabytes(page, "Private_Clean", "Private_Dirty") for page in pages),
        nodes=int(counted["Nodes"]),
        listeners=int(counted["JSEventListeners"]),
    )


def growth(readings: list[Reading], after: float) -> dict[str, float]:
    """By how many MB each grew from a minute to the end, readings being uneven.

    From the median of the first five readings to that of the last, which lie a little nearer to
    each other than that time: as if it went on at that rate over all of it.
    """
    later = [reading for reading in readings if reading.minute >= after]
    some = min(5, max(1, len(later) // 3))
    first, last = later[:some], later[-some:]

    def between(name: str) -> float:
        ends = (median(getattr(reading, name) for reading in part) for part in (last, first))
        return next(ends) - next(ends)

    apart = between("minute")
    longer = (later[-1].minute - after) / apart if apart > 0.0 else 1.0
    return {name: between(name) * longer for name in SIZES}


def below(process: int) -> list[int]:
    """The processes that a process started, and those that they did."""
    children: dict[int, list[int]] = defaultdict(list)
    for folder in PROC.glob("[0-9]*"):
        with suppress(OSError):  # it has ended meanwhile
            # The name before it, in brackets, may have anything in it.
            _, _, rest = (folder / "stat").read_text().rpartition(")")
            children[int(rest.split()[1])].append(int(folder.name))
    there, waiting = [], [process]
    while waiting:
        own = children[waiting.pop()]
        there += own
        waiting += own
    return there


def _is_renderer(process: int) -> bool:
    with suppress(OSError):
        return b"--type=renderer" in (PROC / str(process) / "cmdline").read_bytes()
    return False


def _megabytes(process: int, *names: str) -> float:
    """The sum of some lines of a process's smaps_rollup; 0 of one that has ended."""
    kilobytes = 0.0
    with suppress(OSError):
        for line in (PROC / str(process) / "smaps_rollup").read_text().splitlines():
            name, _, value = line.partition(":")
            if name in names:
                kilobytes += float(value.split()[0])
    return kilobytes * 1024 / 1e6
