"""A budget of all error sources against one of the founding paper's three, on the same machine."""

from __future__ import annotations

import time
from dataclasses import replace

import truepose
from benchmarks.hexapod import MACHINE, load, workspace_poses
from benchmarks.rows import Row
from truepose.machine import Machine
from truepose.sources import REGISTRY, acting

COUNT = 100_000
ASKED = 2.0
PAPER = ("tolerance", "thermal", "elastic")
REPEATS = 3


def measure() -> list[Row]:
    """CPU time of both budgets, best of several in turn, on one thread."""
    machine = truepose.load(MACHINE.with_name("hexapod_all_sources.toml"))
    three = replace(machine, sources=tuple(s for s in machine.sources if s.name in PAPER))
    if len(machine.sources) != len(REGISTRY) or len(three.sources) != len(PAPER):
        raise RuntimeError("these are not the sources meant")
    plain = load()
    if tuple(source.name for source in acting(plain)) != PAPER:
        raise RuntimeError("the plain hexapod has other sources than the paper's three")
    times = {id(each): float("inf") for each in (machine, three, plain)}
    for _ in range(REPEATS):
        for each in (machine, three, plain):
            times[id(each)] = min(times[id(each)], _budget(each))
    every, of_three, of_plain = (times[id(each)] for each in (machine, three, plain))
    detail = (
        f"hexapod_all_sources, {COUNT:,} poses, {len(REGISTRY)} sources: {every:.2f} s, "
        f"its {len(PAPER)}: {of_three:.2f} s; plain hexapod with {len(PAPER)}: {of_plain:.2f} s"
    )
    return [
        Row(
            "budget of all sources, to that of three",
            every / of_three,
            "x",
            "at most",
            ASKED,
            detail,
        ),
        Row("budget of all sources, a core", COUNT / every, "poses/s", "at least", None, detail),
    ]


def _budget(machine: Machine) -> float:
    poses = workspace_poses(machine, COUNT)
    start = time.process_time()
    results = truepose.budget(machine, poses)
    seconds = time.process_time() - start
    if results.sizes["pose"] != COUNT:
        raise RuntimeError(f"{COUNT - results.sizes['pose']} poses were left out")
    return seconds
