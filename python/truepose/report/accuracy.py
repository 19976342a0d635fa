"""The accuracy asked in the machine file against what the machine can do."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from truepose.report.display import Array, number, pose_text, where_highest
from truepose.report.result import in_file_units, pose_in_file_units
from truepose.report.study import Study

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.machine.shown_units import Shown, ShownUnits

BEFORE, AFTER = "before compensation", "after compensation"


@dataclass(frozen=True)
class Answer:
    """One quantity against what was asked of it, SI. `asked` is None where nothing is asked.

    `number` is that of its worst pose in the poses asked for, `pose` has the pose by freedom.
    `units` are those for people, `asked_text` is what is asked as it was asked. `broken` counts
    poses of the run at which nothing is met, whatever `highest` is: some machine inside the bands
    cannot be assembled there (`truepose.budget.poses.broken`).
    """

    quantity: str
    state: str
    highest: float
    asked: float | None
    number: int
    pose: Mapping[str, float]
    units: ShownUnits
    asked_text: str = ""
    broken: int = 0

    def as_data(self, machine: Machine) -> dict[str, Any]:
        """The answer for programs, in the units of the machine's file."""
        si = "m" if self.quantity == "position" else "rad"
        highest, units = in_file_units(machine, self.highest, si)
        asked = None if self.asked is None else in_file_units(machine, self.asked, si)[0]
        return {
            "quantity": self.quantity,
            "state": self.state,
            "highest": highest if math.isfinite(highest) else None,
            "asked": asked,
            "units": units,
            "pose": self.number,
            "at": pose_in_file_units(machine, self.pose),
            "met": self.met,
            "not_assembled": self.broken,
        }

    @property
    def at(self) -> str:
        """The worst pose for people."""
        return pose_text(list(self.pose.values()), list(self.pose), self.units)

    @property
    def met(self) -> bool | None:
        """Whether the accuracy asked is kept; None where none is asked."""
        return None if self.asked is None else bool(self.highest <= self.asked) and not self.broken

    @property
    def amount(self) -> str:
        """The highest for people, without its unit."""
        return number(self.highest * self.unit.per_si, self.unit.decimals)

    @property
    def unit(self) -> Shown:
        """Unit in which people read the quantity."""
        return self.units.error(self.quantity)


def answers(study: Study) -> tuple[Answer, ...]:
    """Position, and orientation where the platform turns: before and after compensation.

    The highest is over all poses, of the length of the error vector whose components are each at
    the most that all sources together can do.
    """
    states = [(BEFORE, study.overall_worst)]
    if study.compensation is not None:
        states.append((AFTER, study.remaining_worst))
    accuracy = study.machine.accuracy
    found = []
    for state, worst in states:
        broken = len(study.broken(corrected=state == AFTER))
        sizes = [("position", study.position_norm(worst), accuracy.target)]
        if study.rotations:
            sizes.append(("orientation", study.rotation_norm(worst), accuracy.angle_target))
        found += [_answer(study, name, state, size, asked, broken) for name, size, asked in sizes]
    return tuple(found)


def _answer(
    study: Study, quantity: str, state: str, size: Array, asked: float | None, broken: int
) -> Answer:
    worst = where_highest(size)
    number = int(study.numbers[worst])
    pose = dict(zip(study.machine.commanded, study.poses[worst].tolist(), strict=True))
    said = study.machine.accuracy.said(quantity)
    return Answer(
        quantity, state, float(size[worst]), asked, number, pose, study.units, said, broken
    )


def met(found: tuple[Answer, ...], state: str) -> bool | None:
    """Whether everything asked is kept in one state; None where nothing is asked."""
    verdicts = [answer.met for answer in found if answer.state == state and answer.met is not None]
    return all(verdicts) if verdicts else None
