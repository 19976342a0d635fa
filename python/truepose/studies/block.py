"""Blocks of variants: what they are handed, and what comes back, with no other trace.

A block may be evaluated in any process that has this version of truepose and the instruction set
that the study was planned with: the numbers are the same to the last bit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from truepose.cluster.instruction_sets import computing_with
from truepose.errors import PoseError, Problem, RequestError, TrueposeError
from truepose.files.wording import counted
from truepose.machine import Machine
from truepose.runs.dataset import Schema, Variable
from truepose.runs.poses import (
    SkippedPoses,
    faults_text,
    no_pose_left,
    pose_in_words,
    reason_text,
    required_sources,
)
from truepose.runs.quantities import quantities
from truepose.studies.base_machine import BaseMachine, evaluated
from truepose.studies.constraints import Constraints
from truepose.studies.quantities import SOURCE_NAMES, EvaluatedVariant, Kinematics, chosen
from truepose.verdict.answer import STATES

NOT_COMPUTED, OK, INFEASIBLE, FAILED = "not computed", "ok", "infeasible", "failed"
DEFECT = "defect"
"""Code of a variant on which this program itself fails."""

Arrays = dict[str, np.ndarray]

STATUS: Schema = {
    "status": Variable(("variant",), "1", "ok, infeasible, failed or not computed", str),
    "reach": Variable(("variant",), "1", "share of the base file's poses that the variant has"),
    "poses_lost": Variable(("variant",), "1", "poses of the base file it does not have", np.int64),
    "first_lost": Variable(
        ("variant",), "1", "number of the first pose lost in the file's poses, -1 of none", np.int64
    ),
    "code": Variable(
        ("variant",), "1", "code of what a variant fails by, or of its constraint", str
    ),
    "reason": Variable(("variant",), "1", "why a variant is infeasible or failed", str),
}
"""What every study has of every variant."""

FILL: Mapping[type, Any] = {np.float64: np.nan, np.int64: -1, np.bool_: False, str: ""}
"""What stands where nothing is known, by the type of a variable."""


@dataclass(frozen=True, eq=False)
class BlockTask:
    """Some variants that are evaluated together: `variants` are the settings of each.

    `number`: which block it is; `quantities`: names of what is computed of each; `constraints`:
    without which a variant is infeasible; `instruction_set`: what computes.
    """

    number: int
    base: BaseMachine
    variants: tuple[tuple[str, ...], ...]
    quantities: tuple[str, ...]
    constraints: Constraints
    instruction_set: str

    def of(self, number: int, variants: tuple[tuple[str, ...], ...]) -> BlockTask:
        """The same of other variants."""
        return replace(self, number=number, variants=variants)


def schema_of(names: tuple[str, ...]) -> Schema:
    """The variables of a study of such quantities."""
    schema = dict(STATUS)
    for quantity in chosen(names):
        schema |= quantity.schema
    return schema


def lengths_of(components: tuple[str, ...]) -> dict[str, int]:
    """Length of each dim but that of the variants."""
    return {
        "state": len(STATES),
        "quantity": len(quantities(components)),
        "source": len(SOURCE_NAMES),
    }


def empty_arrays(names: tuple[str, ...], components: tuple[str, ...], count: int) -> Arrays:
    """The variables of `count` variants of which nothing is known yet."""
    lengths = lengths_of(components) | {"variant": count}
    arrays: Arrays = {}
    for name, variable in schema_of(names).items():
        dtype = object if variable.dtype is str else variable.dtype
        arrays[name] = np.full([lengths[dim] for dim in variable.dims], FILL[variable.dtype], dtype)
    arrays["status"][:] = NOT_COMPUTED
    return arrays


def evaluate_block(task: BlockTask, told: Callable[[int], None] | None = None) -> Arrays:
    """Every variable of `schema_of` for the variants of a block, (n_variant, ...), SI.

    The same from the same task wherever it runs. `told` is called with how many are done. Raises as
    `computing_with`.
    """
    arrays = empty_arrays(task.quantities, task.base.components, len(task.variants))
    with computing_with(task.instruction_set):
        for row, settings in enumerate(task.variants):
            for name, value in evaluate_variant(task, settings).items():
                arrays[name][row] = value
            if told is not None:
                told(row + 1)
    return arrays


def evaluate_part(shared: BlockTask, variants: tuple[tuple[str, ...], ...]) -> Arrays:
    """The same of a task that is sent in two parts: what all have, and its own variants."""
    return evaluate_block(replace(shared, variants=variants))


def evaluate_variant(task: BlockTask, settings: tuple[str, ...]) -> dict[str, Any]:
    """What there is of one variant: its status, and the numbers of one that is ok."""
    values: dict[str, Any] = {}
    try:
        for part in _parts(task, settings):
            values |= part
    except TrueposeError as failure:
        first, more = failure.problems[0], len(failure.problems) - 1
        detail = f" ({first.found})" if first.found else ""
        others = f", and {counted(more, 'more problem')}" if more else ""
        return _failed(values, first.code, f"{first.message}{detail}{others}")
    except (PoseError, ArithmeticError, LookupError, TypeError, ValueError) as failure:
        # One variant of many: the others are wanted all the same, and it is told.
        return _failed(values, DEFECT, f"{type(failure).__name__}: {failure}")
    return values


def _failed(values: Mapping[str, Any], code: str, reason: str) -> dict[str, Any]:
    """No number of a variant that failed on the way is kept."""
    known = {name: value for name, value in values.items() if name in STATUS}
    return {**known, "status": FAILED, "code": code, "reason": " ".join(reason.split())}


def _parts(task: BlockTask, settings: tuple[str, ...]) -> Iterator[dict[str, Any]]:
    """The variables of one variant, one after the other."""
    base = task.base
    machine = base.machine(settings)
    if (machine.commanded, machine.components) != (base.commanded, base.components):
        raise RequestError(
            Problem(
                "bad-poses",
                "the variant takes no poses of the base file",
                found=f"a machine that is commanded in {', '.join(machine.commanded)}",
                expected=", ".join(base.commanded),
            )
        )
    skipped, evaluation = evaluated(machine)
    reach = reach_of(base, machine, skipped)
    yield reach
    if task.constraints.loses_reach(reach["reach"]):
        yield {"status": INFEASIBLE}
        return
    if evaluation is None:
        required_sources(machine, machine.condition)  # raises: without one there is no budget
        raise no_pose_left(machine, machine.poses(), skipped.counts(), of_file=True)
    variant = EvaluatedVariant(machine, evaluation)
    if task.constraints.needs_kinematics:
        kinematics = Kinematics.of(variant)
        yield kinematics
        if broken := task.constraints.broken(kinematics):
            yield {**broken, "status": INFEASIBLE}
            return
    for quantity in chosen(task.quantities):
        yield quantity.of(variant)
    yield {"status": OK}


def reach_of(base: BaseMachine, machine: Machine, skipped: SkippedPoses) -> dict[str, Any]:
    """Which share of the poses of the base a variant has, and which it lost first, and why.

    `skipped`: what its budget leaves out of the poses of the study.
    """
    assert base.has is not None
    assert base.numbers is not None
    indices, status = skipped.sorted()
    lost = base.has[indices]
    count, asked = int(lost.sum()), int(base.has.sum())
    values: dict[str, Any] = {"reach": (asked - count) / asked, "poses_lost": count}
    if count:
        first = int(indices[lost][0])
        pose, word = machine.poses()[first], str(status[lost][0])
        because = faults_text(machine, machine.kernel.explain(pose))
        values["first_lost"] = int(base.numbers[first])
        values["reason"] = (
            f"{count} of {counted(asked, 'pose')} lost, the first {pose_in_words(machine, pose)}: "
            f"{reason_text(word)}{f' ({because})' if because else ''}"
        )
    return values


__all__ = [
    "FAILED",
    "INFEASIBLE",
    "NOT_COMPUTED",
    "OK",
    "STATUS",
    "Arrays",
    "BlockTask",
    "empty_arrays",
    "evaluate_block",
    "evaluate_part",
    "schema_of",
]
