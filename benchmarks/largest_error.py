"""A budget with the largest error of every source and of all together, to one without."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from unittest import mock

import numpy as np

import truepose
from benchmarks.hexapod import load, workspace_poses
from benchmarks.rows import Row
from truepose.arrays import Floats, Indices
from truepose.error_budget import evaluate
from truepose.error_budget.largest import Largest
from truepose.machine import Machine
from truepose.sources import acting

COUNT = 1_000_000
ASKED = 1.5
REPEATS = 2


def measure() -> list[Row]:
    """Wall time of both, best of several in turn."""
    machine = load()
    (tolerance,) = (each for each in acting(machine) if each.name == "tolerance")
    segments = tolerance.bands.n_variable
    poses = workspace_poses(machine, COUNT)
    whole, without = float("inf"), float("inf")
    for _ in range(REPEATS):
        whole = min(whole, _budget(machine, poses))
        with _without():
            without = min(without, _budget(machine, poses))
    detail = (
        f"hexapod, {COUNT:,} poses, {segments} segments, position and orientation, each source and "
        f"all together: {whole:.2f} s, without: {without:.2f} s, {truepose.threads()} threads"
    )
    what = "budget with the largest errors, to one without"
    return [Row(what, whole / without, "x", "at most", ASKED, detail)]


def _budget(machine: Machine, poses: Floats) -> float:
    start = time.perf_counter()
    found = truepose.budget(machine, poses)
    seconds = time.perf_counter() - start
    if found.sizes["pose"] != len(poses):
        raise RuntimeError(f"{len(poses) - found.sizes['pose']} poses were left out")
    return seconds


@contextmanager
def _without() -> Iterator[None]:
    """No largest lengths, and no slopes of all sources together that they are made of."""

    def none(value: Floats, effects: Floats, domain: object, kinds: Sequence[Indices]) -> Largest:
        nothing = np.zeros((len(value), len(kinds)))
        return Largest(nothing, nothing, np.zeros((*nothing.shape, 3)))

    def together(machine: Machine, block: object, *rest: object) -> tuple[Floats, np.ndarray]:
        error, kinds = rest[-2], rest[-1]
        assert isinstance(error, np.ndarray)
        assert isinstance(kinds, list)
        return np.zeros((len(error), len(kinds))), np.full(len(error), evaluate.OK, np.uint8)

    with (
        mock.patch.object(evaluate, "largest", none),
        mock.patch.object(evaluate, "_together", together),
    ):
        yield
