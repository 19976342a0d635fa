"""The tab of the part: what the machine makes of a program beside its file, feature by feature.

Program and features are files of the machine's folder; a program is read from the disk, for it may
be far larger than a message.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from truepose.errors import Problem, RequestError
from truepose.studio.answers import CONDITION, EDITS, Question, Value, finite
from truepose.studio.inside import to_read
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.evaluation import PartEvaluation
from truepose.workpiece.read import read_part

NAME = "part"
FOLLOWS = frozenset({EDITS, CONDITION})

MOST_CHARACTERISTICS = 100
"""Quantities of features that are told, in the order of the part."""


def give(question: Question) -> Iterator[Value]:
    """Every toleranced quantity against its limits; empty where no program is named.

    Raises `RequestError` (file-missing) and as `truepose.part`.
    """
    program, features = (_name(question, key) for key in ("program", "features"))
    if program is None:
        yield {}
        return
    path = to_read(question.folder, program)
    asked = read_part(
        question.machine, path, None if features is None else to_read(question.folder, features)
    )
    condition = question.condition or question.machine.condition
    evaluation = evaluate_part(question.machine, asked, condition, progress=question.progress)
    rows = _rows(evaluation)
    yield {
        "points": evaluation.walked.points,
        "samples": evaluation.samples,
        "rows": rows[:MOST_CHARACTERISTICS],
        "left_out": max(0, len(rows) - MOST_CHARACTERISTICS),
    }


def _name(question: Question, key: str) -> str | None:
    name = question.options.get(key)
    if name is None or isinstance(name, str):
        return name
    raise RequestError(
        Problem("bad-argument", f"{key}: expected the name of a file", found=str(name)[:80])
    )


def _rows(evaluation: PartEvaluation) -> list[dict[str, Any]]:
    """One for each quantity, with what holds in each state."""
    rows = []
    for at, characteristic in enumerate(evaluation.characteristics):
        quantity = characteristic.quantity
        states = []
        for state in evaluation.states:
            answer = state.answers[at]
            states.append(
                {
                    "state": state.state.name,
                    "verdict": str(answer.verdict),
                    "why": str(answer.why),
                    "known": finite(answer.known),
                    "interval": [finite(end) for end in answer.interval],
                    "bound": [finite(answer.above.lower), finite(answer.above.upper)],
                }
            )
        rows.append(
            {
                "feature": characteristic.feature.name,
                "quantity": quantity.name,
                "unit": quantity.si,
                "nominal": finite(quantity.nominal),
                "limits": [finite(quantity.lower), finite(quantity.upper)],
                "states": states,
            }
        )
    return rows


__all__ = ["FOLLOWS", "NAME", "give"]
