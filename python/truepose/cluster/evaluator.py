"""Who computes tasks: this process one after the other, or the workers that were asked for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from truepose.cluster.in_worker import Function
from truepose.cluster.options import ClusterOptions


def computed(
    cluster: ClusterOptions | None,
    function: Function,
    shared: Any,
    tasks: Iterator[tuple[int, Any]],
) -> Iterator[tuple[int, Any]]:
    """(number, `function(shared, own)`) of every task (number, own), as they come.

    `function` is one that a worker can import. On workers the instruction set is the least that
    this process and those present have. Raises `RequestError`: no-scheduler, no-worker,
    worker-lost, and what the function raises.
    """
    if cluster is None:
        for number, own in tasks:
            yield number, function(shared, own)
        return
    from truepose.cluster.hand_out import results
    from truepose.cluster.workers import connected

    with connected(cluster) as workers:
        yield from results(workers, function, shared, tasks, workers.begun_with())


__all__ = ["computed"]
