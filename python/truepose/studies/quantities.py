"""What a study keeps of a variant: some numbers of each result, a quantity a class.

Each number is the command's on the file so set: `truepose budget`, `truepose check`. To add one,
write its class and name it in `REGISTRY`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.error_budget.evaluate import Evaluation
from truepose.error_budget.largest import lengths
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.runs.dataset import Schema, Variable
from truepose.runs.quantities import quantities
from truepose.sources import REGISTRY as SOURCES
from truepose.verdict.accuracy import answers, at_quick_coverage
from truepose.verdict.answer import STATES
from truepose.verdict.states import Population

SOURCE_NAMES = tuple(source.name for source in SOURCES)
"""Of every study the same ones: which of them act may differ from variant to variant."""

_OF_STATE = ("variant", "state", "quantity")


@dataclass(frozen=True, eq=False)
class EvaluatedVariant:
    """A variant with its budget; what else quantities ask for is computed once."""

    machine: Machine
    evaluation: Evaluation

    @cached_property
    def population(self) -> Population:
        """Its poses in either state."""
        return Population(self.machine)

    @cached_property
    def kinds(self) -> Mapping[str, Any]:
        """Position and orientation, as far as the platform has them, with their components."""
        return quantities(self.machine.components)


class StudiedQuantity(ABC):
    """One or several variables of a study. `doc`: what it is, for people; `quick`: by default."""

    name: ClassVar[str]
    doc: ClassVar[str]
    quick: ClassVar[bool]
    schema: ClassVar[Schema]

    @staticmethod
    @abstractmethod
    def of(variant: EvaluatedVariant) -> dict[str, np.ndarray]:
        """Its variables of one variant, without the dim variant."""


class LargestError(StudiedQuantity):
    """The largest errors over the poses, as `truepose budget` has them."""

    name = "error"
    doc = "largest known error and linear maximum over the poses"
    quick = True
    schema: ClassVar[Schema] = {
        "known": Variable(
            ("variant", "quantity"), "quantity", "largest known error over poses, all sources"
        ),
        "linear_maximum": Variable(
            ("variant", "quantity"), "quantity", "largest linear maximum over poses, all sources"
        ),
    }

    @staticmethod
    def of(variant: EvaluatedVariant) -> dict[str, np.ndarray]:
        """Each (quantity,)."""
        rows = variant.evaluation.run.rows.arrays
        known = lengths(rows["overall_error"], list(variant.kinds.values()))
        return {"known": known.max(axis=0), "linear_maximum": rows["linear_maximum"].max(axis=0)}


class AccuracyVerdict(StudiedQuantity):
    """The verdict before and after compensation, as `truepose check` gives it."""

    name = "verdict"
    doc = "met, NOT met or undecided, before and after compensation, and the numbers it rests on"
    quick = True
    schema: ClassVar[Schema] = {
        "answer": Variable(
            _OF_STATE, "1", "met, NOT met or undecided; empty if nothing is asked", str
        ),
        "witness": Variable(_OF_STATE, "quantity", "largest error found of one machine"),
        "linear": Variable(_OF_STATE, "quantity", "linear maximum, at a coverage the quantile"),
        "bound": Variable(_OF_STATE, "quantity", "proven not to be exceeded"),
    }

    @staticmethod
    def of(variant: EvaluatedVariant) -> dict[str, np.ndarray]:
        """Each (state, quantity)."""
        given = [answers(variant.population, state) for state in STATES]

        def numbers(name: str) -> Floats:
            return np.array([[getattr(one, name).value for one in row] for row in given])

        words = [[one.answer or "" for one in row] for row in given]
        sizes = {name: numbers(name) for name in ("witness", "linear", "bound")}
        return {"answer": np.array(words, object), **sizes}


class SourceShares(StudiedQuantity):
    """How the sources compare, as `truepose budget` has it."""

    name = "shares"
    doc = "share of each source, and the largest error that it alone can make"
    quick = True
    schema: ClassVar[Schema] = {
        "share": Variable(
            ("variant", "source"), "1", "highest position error over the sum of all sources'"
        ),
        "highest": Variable(
            ("variant", "source", "quantity"),
            "quantity",
            "highest linear maximum of the source over poses",
        ),
    }

    @staticmethod
    def of(variant: EvaluatedVariant) -> dict[str, np.ndarray]:
        """(source,) and (source, quantity); 0 of a source that does not act."""
        share = np.zeros(len(SOURCE_NAMES))
        highest = np.zeros((len(SOURCE_NAMES), len(variant.kinds)))
        over_all = variant.evaluation.over_all
        for at, source in enumerate(variant.evaluation.run.sources):
            share[SOURCE_NAMES.index(source.name)] = over_all["share"][at]
            highest[SOURCE_NAMES.index(source.name)] = over_all["highest"][at]
        return {"share": share, "highest": highest}


class Coverage95(StudiedQuantity):
    """What 95 % of all machines stay below at the worst poses, as page one of the report says."""

    name = "coverage"
    doc = "error that 95 % of all machines stay below at the worst poses, by Monte Carlo: slower"
    quick = False
    schema: ClassVar[Schema] = {
        "coverage_95": Variable(
            _OF_STATE, "quantity", "error that 95 % of all machines stay below at the worst pose"
        )
    }

    @staticmethod
    def of(variant: EvaluatedVariant) -> dict[str, np.ndarray]:
        """(state, quantity)."""
        values = [
            [
                at_quick_coverage(variant.population, state, kind).linear.value
                for kind in variant.kinds
            ]
            for state in STATES
        ]
        return {"coverage_95": np.array(values)}


class Kinematics(StudiedQuantity):
    """How far the machine is from singularities and from the ends of its travel."""

    name = "kinematics"
    doc = "worst conditioning over the poses, and the least share of a travel that is left"
    quick = False
    schema: ClassVar[Schema] = {
        "conditioning": Variable(
            ("variant",), "1", "worst over poses: smallest to largest singular value, scaled"
        ),
        "travel_left": Variable(
            ("variant",), "1", "share of a drive's travel to its nearer end, least over poses"
        ),
    }

    @staticmethod
    def of(variant: EvaluatedVariant) -> dict[str, np.ndarray]:
        """Each a number, of the nominal machine at the poses that it has."""
        machine = variant.machine
        poses = np.delete(machine.poses(), variant.evaluation.run.left_out.sorted()[0], axis=0)
        joints = machine.inverse(poses)
        ends = np.array([drive.travel for drive in machine.drives])
        spare = np.minimum(joints - ends[:, 0], ends[:, 1] - joints) / (ends[:, 1] - ends[:, 0])
        return {
            "conditioning": np.array(machine.conditioning(poses).min()),
            "travel_left": np.array(spare.min()),
        }


REGISTRY: tuple[type[StudiedQuantity], ...] = (
    LargestError,
    AccuracyVerdict,
    SourceShares,
    Coverage95,
    Kinematics,
)

QUICK_NAMES = tuple(one.name for one in REGISTRY if one.quick)
"""What is computed where nobody says what."""


def chosen(names: Sequence[str]) -> tuple[type[StudiedQuantity], ...]:
    """The quantities of these names, in the order of the registry.

    Raises `RequestError` (unknown-choice).
    """
    known = {one.name: one for one in REGISTRY}
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        raise RequestError(
            Problem(
                "unknown-choice",
                "there is no such quantity of a study",
                found=", ".join(map(str, unknown)) or "none",
                expected=one_of(known),
                hint=did_you_mean(str(unknown[0]), known) if unknown else None,
            )
        )
    return tuple(one for name, one in known.items() if name in names)


__all__ = [
    "QUICK_NAMES",
    "REGISTRY",
    "SOURCE_NAMES",
    "EvaluatedVariant",
    "Kinematics",
    "StudiedQuantity",
    "chosen",
]
