"""An answer: what is asked of one quantity in one state, whether it is met, and what says so."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from truepose.arrays import Floats
from truepose.lazy_names import of_the_package
from truepose.representation import Facts, Represented, facts_html
from truepose.verdict.states import AFTER, BEFORE, STATES

if TYPE_CHECKING:
    from truepose.machine import Machine
    from truepose.verdict.coverage import CoverageAnswer
    from truepose.verdict.witness import Witness

MET, NOT_MET, UNDECIDED = "met", "NOT met", "undecided"


@dataclass(frozen=True)
class Number:
    """A length, m, or an angle, rad, and the pose it is of: its number in the run, and itself, SI.

    `value` is inf where there is no such number: no bound, or no machine that can be assembled.
    """

    value: float
    number: int
    pose: Floats


@dataclass(frozen=True, repr=False)
class Answer(Represented):
    """One quantity in one state against what was asked of it.

    `answer`: `MET`, `NOT_MET` or `UNDECIDED`; None where nothing is `asked` (m or rad).
    `witness`: the largest error found of one machine inside the bands, solved exactly; `linear`:
    linear maximum; `bound`: proven not to be exceeded. Each is the largest over all poses; at a
    coverage they are the estimated quantile (linear) and the ends of its confidence interval.
    `rests_on`: what the answer rests on, in words. `example`: the witness as a machine; None where
    none was looked for. `coverage`: what was sampled, where the answer is at a coverage.
    `poses_used`: for how many poses it is the answer; `poses_left_out`: how many were asked for
    besides, which the machine cannot take, and of which nothing is said.
    """

    quantity: str
    state: str
    asked: float | None
    answer: str | None
    witness: Number
    linear: Number
    bound: Number
    rests_on: str
    example: Witness | None = None
    coverage: CoverageAnswer | None = None
    poses_used: int = 0
    poses_left_out: int = 0
    machine: Machine | None = field(default=None, compare=False)
    """Of which it is the answer, so that it can be told in its units."""

    def _facts(self) -> Facts:
        yield "quantity", self.quantity
        yield "state", self.state
        yield "answer", self.answer
        yield "asked", self.asked
        yield "witness", self.witness.value
        yield "linear maximum", self.linear.value
        yield "proven bound", self.bound.value
        yield "rests on", self.rests_on
        yield "poses used", self.poses_used
        yield "poses left out", self.poses_left_out

    def _repr_html_(self) -> str:
        """In the units of the machine, as the command says it."""
        if self.machine is None:
            return super()._repr_html_()
        return facts_html("Answer", of_the_package("facts_of_answer")(self))

    @property
    def met(self) -> bool | None:
        """True for met alone; None where nothing is asked."""
        return None if self.answer is None else self.answer == MET

    @property
    def told(self) -> Number:
        """The number that goes with the answer.

        Met: the bound. NOT met: the witness. Else the linear maximum; at a coverage the quantile.
        """
        if self.coverage is not None:
            return self.linear
        return {MET: self.bound, NOT_MET: self.witness}.get(self.answer or "", self.linear)

    @property
    def not_assembled(self) -> bool:
        """Whether the witness is a machine that cannot be assembled, or cannot be commanded so."""
        return math.isinf(self.witness.value)


class Answers(tuple[Answer, ...]):
    """Answers of one machine: a tuple, which a notebook shows as the command says it."""

    __slots__ = ()

    def _repr_html_(self) -> str:
        text: str = of_the_package("answers_html")(self[0].machine, self) if self else "<p>()</p>"
        return text


def met(answers: tuple[Answer, ...], state: str) -> bool | None:
    """Whether everything asked is met in one state; None where nothing is asked."""
    decided = [answer.met for answer in answers if answer.state == state and answer.met is not None]
    return all(decided) if decided else None


__all__ = [
    "AFTER",
    "BEFORE",
    "MET",
    "NOT_MET",
    "STATES",
    "UNDECIDED",
    "Answer",
    "Answers",
    "Number",
    "met",
]
