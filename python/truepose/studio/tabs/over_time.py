"""The tab of the error over time, where the file has a temperature log."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.error_budget.over_time import over_time
from truepose.runs.quantities import quantities
from truepose.studio.answers import CONDITION, EDITS, POSE, Question, Value, finite

NAME = "over_time"
FOLLOWS = frozenset({EDITS, POSE, CONDITION})

MOST_TIMES = 300
"""Times that are told; of more, as many evenly chosen, and those of the largest errors."""


def give(question: Question) -> Iterator[Value]:
    """The error at the pose shown at the log's times; empty where the file has no log.

    Raises as `truepose.over_time`.
    """
    machine = question.machine
    if machine.condition.temperature_log is None:
        yield {}
        return
    result = over_time(machine, question.pose(), question.condition, progress=question.progress)
    times = result["time"].values
    errors = result["error"].values[:, 0]
    sizes = {
        kind: np.linalg.norm(errors[:, columns], axis=1)
        for kind, columns in quantities(machine.components).items()
    }
    chosen = _chosen(len(times), sizes.values())
    yield {
        "pose": question.pose().tolist(),
        "times": len(times),
        "time": [finite(value) for value in times[chosen]],
        "error": {kind: [finite(value) for value in of[chosen]] for kind, of in sizes.items()},
        "largest": {
            kind: {"value": finite(of.max()), "time": finite(times[int(of.argmax())])}
            for kind, of in sizes.items()
        },
        "temperature": {
            str(part): [finite(result["temperature"].values[row, at]) for row in (0, -1)]
            for at, part in enumerate(result["part"].values)
        },
    }


def _chosen(count: int, sizes: Iterable[Floats]) -> Indices:
    """Which of the times are told, in their order."""
    if count <= MOST_TIMES:
        return np.arange(count)
    largest = [int(of.argmax()) for of in sizes]
    evenly = np.linspace(0, count - 1, MOST_TIMES).round().astype(np.intp)
    return np.unique(np.concatenate([evenly, np.array(largest, np.intp)]))


__all__ = ["FOLLOWS", "NAME", "give"]
