"""The tab of the part: what the machine makes of a program beside its file, feature by feature.

Program and features are files of the machine's folder; a program is read from the disk, for it may
be far larger than a message.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from truepose.errors import Problem, RequestError
from truepose.studio.answers import CONDITION, EDITS, Question, Value, finite
from truepose.studio.inside import to_read
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.evaluation import PartEvaluation
from truepose.workpiece.read import read_part

NAME = "part"
FOLLOWS = frozenset({EDITS, CONDITION})

PROGRAMS, FEATURES = (".ngc", ".nc", ".gcode", ".gco", ".g", ".tap", ".cnc"), (".toml",)
"""How names of such files end; any other name can be typed."""

MOST_FILES = 100
"""Of a kind that are listed."""

MOST_CHARACTERISTICS = 100
"""Quantities of features that are told, in the order of the part."""


def give(question: Question) -> Iterator[Value]:
    """Every toleranced quantity against its limits; which files there are where none is named.

    Raises `RequestError` (file-missing) and as `truepose.part`.
    """
    program, features = (_name(question, key) for key in ("program", "features"))
    if program is None:
        yield _beside(question.folder)
        return
    path = to_read(question.folder, program)
    asked = read_part(
        question.machine, path, None if features is None else to_read(question.folder, features)
    )
    condition = question.condition or question.machine.condition
    evaluation = evaluate_part(question.machine, asked, condition, progress=question.progress)
    rows = _rows(evaluation)
    yield {
        **_beside(question.folder),
        "points": evaluation.walked.points,
        "samples": evaluation.samples,
        "rows": rows[:MOST_CHARACTERISTICS],
        "left_out": max(0, len(rows) - MOST_CHARACTERISTICS),
    }


def _beside(folder: Path) -> dict[str, list[str]]:
    """Names of files that may be programs, or have features, in their order."""
    names = sorted(place.name for place in folder.iterdir() if place.is_file())
    by_ending = {
        key: [name for name in names if name.lower().endswith(endings)]
        for key, endings in (("programs", PROGRAMS), ("features_files", FEATURES))
    }
    return {key: names[:MOST_FILES] for key, names in by_ending.items()}


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
