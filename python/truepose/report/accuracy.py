"""The answers of `truepose.accuracy` for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from truepose.report.display import MISSING, number, pose_text
from truepose.report.result import in_file_units, pose_in_file_units
from truepose.verdict.answer import AFTER, BEFORE, MET, NOT_MET, UNDECIDED, Answer, Number

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.machine.shown_units import Shown

SI = {"position": "m", "orientation": "rad"}
MOST_DECIMALS = 6
"""Shown where fewer would make a number look as if it were the target."""

GAIN = 0.005
"""Part of an error below which compensation is said to gain nothing."""

ANSWERED = {MET: "met", NOT_MET: "NOT met", UNDECIDED: "undecided", None: "no accuracy asked"}


@dataclass(frozen=True)
class Told:
    """An answer as people read it, in their units."""

    machine: Machine
    answer: Answer

    @property
    def unit(self) -> Shown:
        """Unit in which people read the quantity."""
        return self.machine.shown.error(self.answer.quantity)

    @property
    def name(self) -> str:
        """The quantity and the state: "position before compensation"."""
        return f"{self.answer.quantity} {self.answer.state}"

    @property
    def word(self) -> str:
        """Met, NOT met, undecided, or that nothing is asked."""
        return ANSWERED[self.answer.answer]

    @property
    def colour(self) -> str:
        """Class of the answer: met, missed, open or none."""
        colours = {MET: "met", NOT_MET: "missed", UNDECIDED: "open"}
        return colours.get(self.answer.answer or "", "none")

    def amount(self, value: float, side: int = 0) -> str:
        """A size without its unit, rounded up for `side` 1, down for -1; a dash: there is none.

        With so many decimals that it does not look like the target where it is not.
        """
        if not math.isfinite(value):
            return MISSING
        shown, asked = value * self.unit.per_si, self.answer.asked
        decimals = self.unit.decimals
        while True:
            step = 10.0**-decimals
            text = number(shown + side * 0.5 * step * (1.0 - 1e-9), decimals)
            if asked is None or decimals == MOST_DECIMALS:
                return text
            if text != number(asked * self.unit.per_si, decimals) or value == asked:
                return text
            decimals += 1

    @property
    def size(self) -> str:
        """The number that goes with the answer, with its unit, in words."""
        answer, unit = self.answer, self.unit.label
        at_most = f"at most {self.amount(answer.bound.value, 1)} {unit}"
        if answer.coverage is not None:
            return f"{self.amount(answer.linear.value)} {unit}"
        if answer.answer == MET:
            return at_most
        if answer.not_assembled:
            led = answer.example is None or answer.example.commanded
            return "a machine that cannot be assembled" if led else "a command that leads nowhere"
        if answer.answer == NOT_MET:
            return f"{self.amount(answer.witness.value)} {unit}"
        if answer.answer == UNDECIDED:
            least = self.amount(answer.witness.value, -1)
            if math.isinf(answer.bound.value):
                return f"{least} {unit} or more"
            return f"between {least} and {self.amount(answer.bound.value, 1)} {unit}"
        return f"{self.amount(answer.linear.value)} {unit}"

    @property
    def asked(self) -> str:
        """What is asked, as it was asked, and in the unit of the answer where that is another."""
        answer = self.answer
        if answer.asked is None:
            return MISSING
        said = self.machine.accuracy.said(answer.quantity)
        if said.rpartition(" ")[2].replace("u", "µ", 1) == self.unit.label:
            return said
        unit = self.unit
        return f"{said} ({number(answer.asked * unit.per_si, unit.decimals)} {unit.label})"

    def at(self, of: Number) -> str:
        """The pose of a number."""
        return pose_text(of.pose, list(self.machine.commanded), self.machine.shown)

    @property
    def line(self) -> str:
        """Answer, number, target, pose and what it rests on, in one line."""
        answer = self.answer
        asked = "" if answer.asked is None else f", asked {self.asked}"
        which = answer.told
        if answer.answer == UNDECIDED:
            which = answer.bound
        return f"{self.name}: {self.size}{asked}, at {self.at(which)}; rests on {answer.rests_on}"

    @property
    def witness(self) -> str:
        """Which machine the witness of a NOT met is, in words; empty where there is none."""
        answer = self.answer
        if answer.answer != NOT_MET or answer.example is None:
            return ""
        return "; ".join(answer.example.words())


def told(machine: Machine, answers: Sequence[Answer]) -> tuple[Told, ...]:
    """The answers for people."""
    return tuple(Told(machine, answer) for answer in answers)


def gains(answers: Sequence[Answer]) -> tuple[str, ...]:
    """What compensation does to each quantity, in a sentence; empty without both states."""
    sentences = []
    by = {(each.state, each.quantity): each for each in answers}
    for (state, quantity), before in by.items():
        after = by.get((AFTER, quantity))
        if state != BEFORE or after is None:
            continue
        sentences.append(_gain(quantity, before.linear.value, after.linear.value))
    return tuple(sentences)


def _gain(quantity: str, before: float, after: float) -> str:
    if not (math.isfinite(before) and math.isfinite(after)) or before == 0.0:
        return f"{quantity}: what compensation does cannot be said."
    change = 1.0 - after / before
    if change >= GAIN:
        return f"{quantity}: compensation reduces the largest error by {100.0 * change:.0f} %."
    if change > -GAIN:
        return f"{quantity}: nothing to gain by compensation: what is left is unknown."
    return (
        f"{quantity}: compensation makes the largest error {-100.0 * change:.0f} % larger: it "
        "corrects commanded freedoms by what is known, and what is not known or not commanded "
        "stood against that."
    )


def as_data(machine: Machine, answer: Answer) -> dict[str, Any]:
    """An answer for programs, in the units of the machine's file.

    Numbers that there are not are None: no bound, or a witness that cannot be assembled.
    """
    si = SI[answer.quantity]

    def of(value: float | None) -> float | None:
        if value is None or not math.isfinite(value):
            return None
        return in_file_units(machine, value, si)[0]

    pose = answer.told
    return {
        "quantity": answer.quantity,
        "state": answer.state,
        "highest": of(answer.linear.value),
        "asked": of(answer.asked),
        "units": in_file_units(machine, 0.0, si)[1],
        "pose": pose.number,
        "at": pose_in_file_units(
            machine, dict(zip(machine.commanded, pose.pose.tolist(), strict=True))
        ),
        "met": answer.met,
        "not_assembled": int(answer.not_assembled),
        "answer": answer.answer,
        "witness": of(answer.witness.value),
        "linear": of(answer.linear.value),
        "bound": of(answer.bound.value),
        "rests_on": answer.rests_on,
        "example": None if answer.example is None else answer.example.as_data(),
    }


__all__ = ["AFTER", "BEFORE", "Told", "as_data", "gains", "told"]
