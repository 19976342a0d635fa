"""A walk over poses in parts, here or by the workers of a cluster, with the same numbers.

A part is some whole blocks of the run. What is made of a part depends on the part alone, and parts
are handed on in their order: who made which, and when, changes no bit of what follows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

from truepose.cluster.evaluator import TaskEvaluator
from truepose.runs.poses import BLOCK, PoseRun, Travel

MOST_BLOCKS = 256
"""Blocks of a part at most: long enough for handing it out to cost little beside it."""

FEWEST_PARTS = 32
"""Parts of a run at least, as far as it has blocks: for workers to end at about the same time."""

T = TypeVar("T")
S = TypeVar("S")


@dataclass(frozen=True)
class RunPart:
    """The poses of a run from number `start` to before `stop`, and how a path comes to them."""

    start: int
    stop: int
    travel: Travel | None


def in_parts(
    run: PoseRun,
    make: Callable[[S, RunPart], T],
    shared: S,
    evaluator: TaskEvaluator,
    told: Callable[[int], None],
) -> Iterator[T]:
    """What `make(shared, part)` gives of every part of a run, in the order of the parts.

    `told` is called with how many poses are done. Raises as the evaluator does.
    """
    total = len(run.poses)
    blocks = -(-total // BLOCK)
    n_pose = BLOCK * max(1, min(MOST_BLOCKS, blocks // FEWEST_PARTS))
    starts = range(0, total, n_pose)

    def parts() -> Iterator[tuple[int, RunPart]]:
        for number, (start, travel) in enumerate(zip(starts, run.arrivals(starts), strict=True)):
            yield number, RunPart(start, min(start + n_pose, total), travel)

    def made() -> Iterator[tuple[int, T]]:
        done = 0
        for number, result in evaluator.results(make, shared, parts()):
            done += min(n_pose, total - starts[number])
            told(done)
            yield number, result

    return in_order(made())


def in_order(numbered: Iterator[tuple[int, Any]]) -> Iterator[Any]:
    """What is numbered from 0, however it comes, by its numbers; what is early waits."""
    early: dict[int, Any] = {}
    due = 0
    for number, result in numbered:
        early[number] = result
        while due in early:
            yield early.pop(due)
            due += 1


__all__ = ["RunPart", "in_order", "in_parts"]
