"""The answers of `truepose.accuracy` for people and for programs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from truepose.language import grouped, marked, say
from truepose.reporting.display import MISSING, ROUNDING, number, pose_text
from truepose.reporting.result import in_file_units, pose_in_file_units
from truepose.reporting.result_words import word
from truepose.verdict.answer import AFTER, BEFORE, MET, NOT_MET, UNDECIDED, Answer, Number
from truepose.verdict.coverage import CONFIDENCE

if TYPE_CHECKING:
    from truepose.files.shown_units import Shown
    from truepose.machine import Machine

SI = {"position": "m", "orientation": "rad"}
MOST_DECIMALS = 6
"""Shown where fewer would make a number look as if it were the target."""

GAIN = 0.005
"""Part of an error below which compensation is said to gain nothing."""


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
        return say(
            "{quantity} {state}",
            quantity=word(self.answer.quantity),
            state=word(self.answer.state),
        )

    @property
    def word(self) -> str:
        """Met, NOT met, undecided, or not asked."""
        return say("not asked") if self.answer.answer is None else word(self.answer.answer)

    @property
    def colour(self) -> str:
        """Class of the answer: met, missed, open or none."""
        colours = {MET: "met", NOT_MET: "missed", UNDECIDED: "open"}
        return colours.get(self.answer.answer or "", "none")

    def amount(self, value: float, side: int = 0) -> str:
        """A size without its unit, rounded up for `side` 1, down for -1, else to nearest.

        With so many decimals that it does not look like the target where it is not, but for
        `ROUNDING`.
        """
        per_si, decimals = self.unit.per_si, self.unit.decimals
        asked = self.answer.asked
        if asked is not None and math.isclose(value, asked, rel_tol=ROUNDING):
            return number(asked * per_si, decimals)
        shown = value * per_si * (1.0 - side * 0.01 * ROUNDING)
        while True:
            text = number(shown + side * 0.5 * 10.0**-decimals, decimals)
            if asked is None or decimals == MOST_DECIMALS:
                return text
            if text != number(asked * per_si, decimals):
                return text
            decimals += 1

    def text(self, value: float, side: int = 0) -> str:
        """The same with its unit."""
        if not math.isfinite(value):
            return MISSING
        return f"{self.amount(value, side)} {self.unit.label}"

    @property
    def size(self) -> str:
        """The number that goes with the answer, with its unit, in words."""
        answer = self.answer
        if answer.coverage is not None:
            return self._share(answer.coverage.probability)
        if answer.answer == MET:
            return say("at most {value}", value=self.text(answer.bound.value, 1))
        if answer.not_assembled:
            led = answer.example is None or answer.example.commanded
            return (
                say("a machine that cannot be assembled")
                if led
                else say("a command that leads nowhere")
            )
        if answer.answer == UNDECIDED:
            return self._between(answer.witness.value, answer.bound.value)
        return self.text(answer.told.value)

    def _share(self, probability: float) -> str:
        """What so many of all machines keep, and how sure that is."""
        answer = self.answer
        share = marked(f"{100.0 * probability:.6g} %")
        if not math.isfinite(answer.linear.value):
            return say("fewer than {share} of all machines can be assembled", share=share)
        between = self._between(answer.witness.value, answer.bound.value)
        sure = say(
            "{confidence} % confidence: {between}",
            confidence=marked(f"{100.0 * CONFIDENCE:.6g}"),
            between=between,
        )
        return say(
            "{share} within {value} ({sure})",
            share=share,
            value=self.text(answer.linear.value),
            sure=sure,
        )

    def _between(self, least: float, most: float) -> str:
        """Two ends, each rounded away from the other."""
        if math.isinf(most):
            return say("{least} or more", least=self.text(least, -1))
        return say(
            "between {least} and {most}", least=self.amount(least, -1), most=self.text(most, 1)
        )

    @property
    def asked(self) -> str:
        """What is asked, as it was asked, and in the unit of the answer where that is another."""
        answer = self.answer
        if answer.asked is None:
            return MISSING
        said = self.machine.accuracy.said(answer.quantity)
        if said.rpartition(" ")[2].replace("u", "µ", 1) == self.unit.label:
            return said
        same = answer.asked * self.unit.per_si
        shown = f"{round(same, self.unit.decimals):.12g}"
        same_text = f"{same:.3g}" if shown == "0" else shown
        return marked(f"{said} ({same_text} {self.unit.label})")

    def at(self, of: Number) -> str:
        """The pose of a number."""
        return pose_text(of.pose, list(self.machine.commanded), self.machine.shown)

    @property
    def told(self) -> Number:
        """The number whose pose is told: of what is undecided the bound, which stands open."""
        return self.answer.bound if self.answer.answer == UNDECIDED else self.answer.told

    @property
    def line(self) -> str:
        """Answer, number, target, pose and what it rests on, in one line."""
        answer = self.answer
        size = self.size
        if answer.asked is not None:
            size = say("{size}, asked {asked}", size=size, asked=self.asked)
        return f"{self.name}: {size}, {self.basis}"

    @property
    def basis(self) -> str:
        """At which pose the number is, and what the answer rests on."""
        pose, on = self.at(self.told), self.answer.rests_on
        if self.answer.answer == UNDECIDED:
            return say("at {pose}; {why}", pose=pose, why=on)
        return say("at {pose}; rests on {on}", pose=pose, on=on)

    @property
    def witness(self) -> str:
        """Which machine the witness of a NOT met is, in words; empty where there is none.

        In which state and at which pose it is, the answer's line says.
        """
        answer = self.answer
        if answer.answer != NOT_MET or answer.example is None:
            return ""
        _, *causes = answer.example.words()
        return "; ".join(causes)


def told(machine: Machine, answers: Sequence[Answer]) -> tuple[Told, ...]:
    """The answers for people."""
    return tuple(Told(machine, answer) for answer in answers)


def where_answered(answers: Sequence[Answer]) -> str:
    """For which poses the answers are, in a sentence: a verdict is read as one on everything."""
    used, left_out = answers[0].poses_used, answers[0].poses_left_out
    if left_out == 0:
        return say(
            "At all {used} poses of the workspace; nothing is said between them.",
            used=grouped(used),
        )
    return say(
        "At {used} of the workspace's {every} poses ONLY: the machine cannot take the other "
        "{left_out}, and nothing is said of them, nor of what lies between.",
        used=grouped(used),
        every=grouped(used + left_out),
        left_out=grouped(left_out),
    )


def gains(answers: Sequence[Answer]) -> tuple[str, ...]:
    """What compensation does to each quantity, in a sentence; empty without both states."""
    sentences = []
    by = {(answer.state, answer.quantity): answer for answer in answers}
    for (state, quantity), before in by.items():
        after = by.get((AFTER, quantity))
        if state != BEFORE or after is None:
            continue
        sentences.append(_gain(quantity, before.linear.value, after.linear.value))
    return tuple(sentences)


def _gain(quantity: str, before: float, after: float) -> str:
    if not (math.isfinite(before) and math.isfinite(after)) or before == 0.0:
        return say("{quantity}: what compensation does cannot be said.", quantity=word(quantity))
    change = 1.0 - after / before
    if change >= GAIN:
        return say(
            "{quantity}: reduced by {change} % by compensation.",
            quantity=word(quantity),
            change=marked(f"{100.0 * change:.0f}"),
        )
    if change > -GAIN:
        return say(
            "{quantity}: nothing to gain by compensation: what is left is unknown.",
            quantity=word(quantity),
        )
    return say(
        "{quantity}: made {change} % larger by compensation: it corrects commanded freedoms "
        "by what is known, and what is not known or not commanded stood against that.",
        quantity=word(quantity),
        change=marked(f"{-100.0 * change:.0f}"),
    )


def as_data(machine: Machine, answer: Answer) -> dict[str, Any]:
    """An answer for programs, in the units of the machine's file.

    `pose`, `at`: of the number that goes with the answer (`Told.told`). Numbers that there are
    not are None: no bound, or a witness that cannot be assembled.
    """
    si = SI[answer.quantity]

    def of(value: float | None) -> float | None:
        if value is None or not math.isfinite(value):
            return None
        return in_file_units(machine, value, si)[0]

    pose = Told(machine, answer).told
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
        "poses_used": answer.poses_used,
        "poses_left_out": answer.poses_left_out,
        "example": answer.example.as_data()
        if answer.answer == NOT_MET and answer.example is not None
        else None,
    }


__all__ = ["AFTER", "BEFORE", "Told", "as_data", "gains", "told", "where_answered"]
