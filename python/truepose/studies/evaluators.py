"""Who evaluates the blocks of a study: this process, or the workers of a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from itertools import chain
from typing import Protocol

from truepose.cluster.evaluator import Here, OnWorkers
from truepose.cluster.options import ClusterOptions
from truepose.studies.block import Arrays, BlockTask, evaluate_block, evaluate_part

Blocks = Iterator[tuple[int, Arrays]]
"""The number and the arrays of each block, in any order."""


class BlockEvaluator(Protocol):
    """What evaluates tasks."""

    def begun_with(self) -> str:
        """The instruction set that a new study is begun with."""

    def evaluate(self, tasks: Iterator[BlockTask], told: Callable[[int], None]) -> Blocks:
        """Evaluate tasks of one study; `told` is called with how many variants more are done."""


class Local(Here):
    """One block after the other in this process."""

    def evaluate(self, tasks: Iterator[BlockTask], told: Callable[[int], None]) -> Blocks:
        """As `BlockEvaluator`."""
        for task in tasks:
            yield task.number, evaluate_block(task, lambda _: told(1))


class OnCluster(OnWorkers):
    """Whole blocks on workers."""

    def evaluate(self, tasks: Iterator[BlockTask], told: Callable[[int], None]) -> Blocks:
        """As `BlockEvaluator`. Raises `RequestError` as `OnWorkers.results`."""
        first = next(tasks, None)
        if first is None:
            return
        shared = replace(first, variants=())
        lengths: dict[int, int] = {}

        def own() -> Iterator[tuple[int, tuple[tuple[str, ...], ...]]]:
            for task in chain([first], tasks):
                lengths[task.number] = len(task.variants)
                yield task.number, task.variants

        for number, arrays in self.results(evaluate_part, shared, own(), first.instruction_set):
            yield number, arrays
            told(lengths.pop(number))


@contextmanager
def evaluator_of(options: ClusterOptions | None) -> Iterator[BlockEvaluator]:
    """The evaluator that was asked for."""
    if options is None:
        yield Local()
        return
    with ExitStack() as stack:
        yield OnCluster(options, stack)


__all__ = ["BlockEvaluator", "Local", "OnCluster", "evaluator_of"]
