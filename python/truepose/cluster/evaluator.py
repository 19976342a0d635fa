"""Who computes tasks: this process one after the other, or the workers that were asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Protocol

from truepose._kernel import instruction_set
from truepose.cluster.options import ClusterOptions

if TYPE_CHECKING:
    from truepose.cluster.in_worker import Function
    from truepose.cluster.workers import Workers

Tasks = Iterator[tuple[int, Any]]
"""A number of its own and an argument of each."""


class TaskEvaluator(Protocol):
    """What computes tasks."""

    def begun_with(self) -> str:
        """The instruction set that something new is begun with."""

    def results(self, function: Function, shared: Any, tasks: Tasks) -> Iterator[tuple[int, Any]]:
        """(number, `function(shared, own)`) of every task (number, own), as they come."""


class Here:
    """One task after the other in this process, on the instruction set in use."""

    def begun_with(self) -> str:
        """The instruction set in use."""
        return instruction_set()

    def results(self, function: Function, shared: Any, tasks: Tasks) -> Iterator[tuple[int, Any]]:
        """As `TaskEvaluator`."""
        for number, own in tasks:
            yield number, function(shared, own)


class OnWorkers:
    """Workers, to which it connects when they are first needed."""

    def __init__(self, options: ClusterOptions, stack: ExitStack) -> None:
        """`stack`: what ends the connection."""
        self._options, self._stack = options, stack
        self._workers: Workers | None = None

    def _connected(self) -> Workers:
        from truepose.cluster.workers import connected  # here, where it is needed: it takes long

        if self._workers is None:
            self._workers = self._stack.enter_context(connected(self._options))
        return self._workers

    def begun_with(self) -> str:
        """The least instruction set that this process and the workers present have.

        Raises `RequestError`: no-scheduler, no-worker.
        """
        return self._connected().begun_with()

    def results(
        self, function: Function, shared: Any, tasks: Tasks, instructions: str | None = None
    ) -> Iterator[tuple[int, Any]]:
        """As `TaskEvaluator`; `function` is one that a worker can import, all else can be pickled.

        `instructions`: by default those of `begun_with`. Raises `RequestError`: no-scheduler,
        no-worker, worker-lost, and what the function raises.
        """
        from truepose.cluster.hand_out import results

        workers = self._connected()
        chosen = workers.begun_with() if instructions is None else instructions
        return results(workers, function, shared, tasks, chosen)


@contextmanager
def evaluator_of(options: ClusterOptions | None) -> Iterator[TaskEvaluator]:
    """The evaluator that was asked for."""
    with ExitStack() as stack:
        yield Here() if options is None else OnWorkers(options, stack)


__all__ = ["Here", "OnWorkers", "TaskEvaluator", "Tasks", "evaluator_of"]
