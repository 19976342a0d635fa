"""What the studio answers of a machine: each answer a function, pure, and JSON what it gives.

They call what the commands call, so that a number here is the number there. Numbers are SI; what
is infinite or not there is None.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from truepose.arrays import Floats
from truepose.error_budget.evaluate import evaluate
from truepose.errors import RequestError
from truepose.live.bundle import bundle, middle_pose
from truepose.machine import Condition, Machine
from truepose.reporting.live.part import machine_in_page
from truepose.runs.poses import Progress
from truepose.runs.quantities import quantities
from truepose.studio.settings import Settings
from truepose.uncertainty_analysis.shares import shares
from truepose.verdict.accuracy import accuracy
from truepose.verdict.answer import AFTER, BEFORE, Answer, Number
from truepose.verdict.witness import Witness, in_space

SEED = 0
"""Of the shares, as the report's: the same file gives the same numbers."""

MOST_PARAMETERS = 40
"""Rows of the shares that are told, the largest first."""

EDITS, POSE, CONDITION = "edits", "pose", "condition"
"""What of the settings an answer follows from."""

Value = dict[str, Any] | list[dict[str, Any]]


@dataclass(frozen=True)
class DroppedFile:
    """A file that was dropped on the page: its name and its bytes, held in memory."""

    name: str
    content: bytes


@dataclass(frozen=True)
class Question:
    """A machine with its edits in it, what is shown, and who is told how far it is.

    `options` and `files`: of tabs, by the number of each file. `folder`: that of the machine file,
    the only one from which a tab reads.
    """

    machine: Machine
    settings: Settings = field(default_factory=Settings)
    progress: Progress | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    files: Mapping[int, DroppedFile] = field(default_factory=dict)
    folder: Path = Path()

    @property
    def condition(self) -> Condition | None:
        """The condition shown; None where it is the file's."""
        shown = self.settings.condition
        return None if shown is None else shown.of(self.machine.condition)

    def pose(self) -> Floats:
        """(n_commanded,) the pose shown, SI. Raises as `middle_pose` does where none is said."""
        if self.settings.pose is None:
            return middle_pose(self.machine)
        return np.array(self.settings.pose, np.float64)


@dataclass(frozen=True)
class AnswerKind:
    """An answer: its name, what of the settings it follows from, and what gives it.

    `give` yields the value each time that more of it is there.
    """

    name: str
    follows: frozenset[str]
    give: Callable[[Question], Iterator[Value]]


def known(question: Question) -> dict[str, Any]:
    """The known error and the linear maximum at the pose shown, and the largest over the poses.

    Raises as `truepose.budget`, but for a pose that cannot be used: `status` says why.
    """
    machine, condition = question.machine, question.condition
    kinds = quantities(machine.components)
    over = evaluate(machine, None, condition, question.progress).dataset()
    pose = question.pose()
    value: dict[str, Any] = {
        "pose": pose.tolist(),
        "status": "ok",
        "error": None,
        "linear_maximum": None,
        "sources": [],
        "poses": int(over.sizes["pose"]),
        "left_out": int(over.sizes["left_out"]),
        "largest": {},
        "highest": {},
    }
    names = [str(name) for name in over["source"].values]
    highest = over["highest"].values
    errors = over["overall_error"].values
    numbers = over["pose"].values
    poses = np.stack([over[f"pose_{name}"].values for name in machine.commanded], axis=-1)
    for at, (kind, columns) in enumerate(kinds.items()):
        sizes = np.linalg.norm(errors[:, columns], axis=1)
        maximum = over["linear_maximum"].values[:, at]
        value["largest"][kind] = _peak(sizes, numbers, poses)
        value["highest"][kind] = _peak(maximum, numbers, poses)
    value["sources"] = [
        {"name": name, "error": None, "linear_maximum": None, "highest": _by(kinds, highest[row])}
        for row, name in enumerate(names)
    ]
    try:
        there = evaluate(machine, pose, condition).dataset()
    except RequestError as failure:
        if failure.problems[0].code != "no-pose-left":
            raise
        value["status"] = failure.problems[0].found or failure.problems[0].message
        return value
    value["error"] = _numbers(there["overall_error"].values[0])
    value["linear_maximum"] = _by(kinds, there["linear_maximum"].values[0])
    for row, source in enumerate(value["sources"]):
        source["error"] = _numbers(there["error"].values[0, row])
        source["linear_maximum"] = _by(kinds, there["largest"].values[0, row])
    return value


def machine_of_page(question: Question) -> dict[str, Any]:
    """What the page needs to answer by itself. Raises as `truepose.live.bundle`."""
    machine = question.machine
    return machine_in_page(machine, bundle(machine))


def verdict(question: Question) -> Iterator[list[dict[str, Any]]]:
    """The verdict over the workspace, as commanded, then with what holds compensated.

    Raises as `truepose.accuracy`.
    """
    told: list[dict[str, Any]] = []
    for state in (BEFORE, AFTER):
        answers = accuracy(
            question.machine,
            None,
            question.condition,
            states=(state,),
            progress=question.progress,
        )
        told = [*told, *map(_answer, answers)]
        yield told


def shares_at_pose(question: Question) -> dict[str, Any]:
    """Which parameter and source the spread at the pose shown comes from.

    Raises as `truepose.shares`.
    """
    result = shares(
        question.machine,
        question.pose(),
        question.condition,
        seed=SEED,
        progress=question.progress,
    )
    parameters = _shares_of(result, "parameter", "")
    return {
        "standard_deviation": _numbers(result["standard_deviation"].values[0]),
        "parameters": parameters[:MOST_PARAMETERS],
        "left_out": max(0, len(parameters) - MOST_PARAMETERS),
        "sources": _shares_of(result, "source", "source_"),
    }


def _shares_of(result: Any, dim: str, begins: str) -> list[dict[str, Any]]:
    """The shares along a dimension, the largest total in any component first."""
    names = [str(name) for name in result[dim].values]
    columns = {
        name: result[begins + name].values[0]
        for name in ("first", "total", "linear", "shapley")
        if begins + name in result.data_vars
    }
    size = np.nan_to_num(columns["total"]).max(axis=1, initial=0.0)
    return [
        {"name": names[row], **{name: _numbers(of[row]) for name, of in columns.items()}}
        for row in np.argsort(-size, kind="stable").tolist()
    ]


def _answer(answer: Answer) -> dict[str, Any]:
    return {
        "quantity": answer.quantity,
        "state": answer.state,
        "asked": answer.asked,
        "answer": answer.answer,
        "witness": _number(answer.witness),
        "linear": _number(answer.linear),
        "bound": _number(answer.bound),
        "rests_on": answer.rests_on,
        "poses_used": answer.poses_used,
        "poses_left_out": answer.poses_left_out,
        "example": None if answer.example is None else _example(answer.example),
    }


def _example(witness: Witness) -> dict[str, Any]:
    """The witness as a machine: its causes in the command's words, and where it stands."""
    _, *causes = witness.words()
    drawn: dict[str, Any] = {"centres": None, "moved": None}
    if witness.error is not None and witness.joint_centres is not None:
        drawn["centres"] = witness.joint_centres.tolist()
        drawn["moved"] = in_space(witness.machine.components, witness.error, "xyz").tolist()
    return {"causes": causes, "status": witness.status, **drawn}


def _number(number: Number) -> dict[str, Any]:
    return {
        "value": finite(number.value),
        "number": number.number,
        "pose": _numbers(number.pose),
    }


def _peak(values: Floats, numbers: Any, poses: Floats) -> dict[str, Any]:
    """The largest of `values` (n,), which pose of the run it is at, and that pose."""
    at = int(np.nanargmax(values))
    return {
        "value": finite(values[at]),
        "number": int(numbers[at]),
        "pose": _numbers(poses[at]),
    }


def _by(kinds: Mapping[str, Any], values: Floats) -> dict[str, float | None]:
    """Numbers by quantity."""
    return dict(zip(kinds, _numbers(values), strict=True))


def _numbers(values: Any) -> list[float | None]:
    return [finite(value) for value in np.asarray(values, np.float64).tolist()]


def finite(value: Any) -> float | None:
    """A number that JSON can hold; None for what is infinite or not there."""
    number = float(value)
    return number if math.isfinite(number) else None


def _once(give: Callable[[Question], dict[str, Any]]) -> Callable[[Question], Iterator[Value]]:
    def told(question: Question) -> Iterator[Value]:
        yield give(question)

    return told


KNOWN, MACHINE, VERDICT, SHARES = "known", "machine", "verdict", "shares"

ANSWERS: tuple[AnswerKind, ...] = (
    AnswerKind(KNOWN, frozenset({EDITS, POSE, CONDITION}), _once(known)),
    AnswerKind(MACHINE, frozenset({EDITS}), _once(machine_of_page)),
    AnswerKind(VERDICT, frozenset({EDITS, CONDITION}), verdict),
    AnswerKind(SHARES, frozenset({EDITS, POSE, CONDITION}), _once(shares_at_pose)),
)
"""In the order in which they are given: the quickest first."""


def changed(before: Settings, after: Settings) -> frozenset[str]:
    """Which of edits, pose and condition differ."""
    return frozenset(
        name for name in (EDITS, POSE, CONDITION) if getattr(before, name) != getattr(after, name)
    )


__all__ = [
    "ANSWERS",
    "AnswerKind",
    "DroppedFile",
    "Question",
    "changed",
    "known",
    "machine_of_page",
    "shares_at_pose",
    "verdict",
]
