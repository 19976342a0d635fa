"""Who is to blame for a quantity that is out of tolerance, and what would mend it.

Blame is each source alone: what it is known to add as commanded, and how far its unknown part
spreads the quantity. What mends it is looked for in this order: compensation; another size in the
program, which aims at the middle of the limits; the one source whose bands, made narrower, bring
the quantity within its limits with the least relative change; else nothing of one source alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.verdict.states import AFTER, BEFORE
from truepose.workpiece.evaluation import (
    MET,
    UNDECIDED,
    PartEvaluation,
    QuantityAnswer,
    StateAnswers,
)
from truepose.workpiece.worst import Interval, from_above

HALVINGS = 12
"""Of the interval in which the width of the bands is looked for: to a quarter of a thousandth."""

LEAST = 0.05
"""Share of its bands below which no source can be made: nobody makes rods twenty times better."""


@dataclass(frozen=True)
class Culprit:
    """A source, what it is known to add, and half the 95 % interval that it makes alone, SI.

    `first`: its variable that does most of that.
    """

    source: str
    known: float
    half: float
    first: str


@dataclass(frozen=True)
class Advice:
    """What would mend one characteristic.

    `compensation`: that does. Else `aim`, SI, by which the program should ask for more: it does
    with compensation. Else `source` with its bands `narrowed` to this share, in the `state` in
    which that is enough; no source where none is enough alone. `why`: why even then there is no
    proof; "" where there is one.
    """

    compensation: bool
    source: str
    narrowed: float
    state: str
    aim: float = 0.0
    why: str = ""


def culprits(answers: StateAnswers, at: int) -> list[Culprit]:
    """The sources of characteristic number `at`, the one that does most first."""
    listed = [
        Culprit(one.source, float(one.known[at]), float(one.half[at]), one.first[at])
        for one in answers.blame
    ]
    return sorted(listed, key=lambda one: -(abs(one.known) + one.half))


def advice(evaluation: PartEvaluation, at: int) -> Advice | None:
    """What mends characteristic number `at`; None where it is met, compensated or not.

    What is met as commanded, but not after compensation, can only be aimed better.
    """
    states = {one.state.name: one for one in evaluation.states}
    before, after = states[BEFORE].answers[at], states[AFTER].answers[at]
    if after.verdict == MET:
        return None if before.verdict == MET else Advice(True, "", 1.0, AFTER)
    both = states[BEFORE], states[AFTER]
    for answers in both if before.verdict != MET else ():
        if _is_unproven(evaluation, answers.answers[at], at):
            state, why = answers.state.name, answers.answers[at].above.why
            return Advice(state == AFTER, "", 1.0, state, why=why)
    aim = _aim(evaluation, after, at)
    if aim != 0.0:
        return Advice(False, "", 1.0, AFTER, aim)
    if before.verdict == MET:
        return None
    best = Advice(False, "", 0.0, AFTER)
    for answers in both:
        why = answers.answers[at].above.why if evaluation.rule == "worst-case" else ""
        for culprit in culprits(answers, at):
            if culprit.half > 0.0:
                share = _narrowed(evaluation, answers, at, culprit)
                if share > max(LEAST, best.narrowed):
                    best = Advice(False, culprit.source, share, answers.state.name, why=why)
        if best.source:
            break
    return best


def _is_unproven(evaluation: PartEvaluation, answer: QuantityAnswer, at: int) -> bool:
    """Whether nothing but a proof is missing."""
    of, above = evaluation.characteristics[at], answer.above
    within = not (of.breaks(above.lower) or of.breaks(above.upper))
    return answer.verdict == UNDECIDED and evaluation.rule == "worst-case" and within


def _aim(evaluation: PartEvaluation, after: QuantityAnswer, at: int) -> float:
    """By how much a size should be programmed otherwise to be met after compensation; 0: it isn't.

    The middle of the limits less the middle of what it may be, where that then fits between them.
    """
    quantity = evaluation.characteristics[at].quantity
    if quantity.is_form or not np.isfinite([quantity.lower, quantity.upper]).all():
        return 0.0
    proven = evaluation.rule != "worst-case"
    low, high = after.interval if proven else (after.above.lower, after.above.upper)
    if high - low >= quantity.upper - quantity.lower or not (proven or after.above.proven):
        return 0.0
    return 0.5 * (quantity.lower + quantity.upper) - 0.5 * (low + high)


def _narrowed(
    evaluation: PartEvaluation, answers: StateAnswers, at: int, culprit: Culprit
) -> float:
    """The largest share of a source's bands that is within the limits; 0 where none is."""
    if evaluation.rule == "iso-14253":
        return _narrowed_interval(evaluation, answers.answers[at], at, culprit)
    state = answers.state
    of = evaluation.characteristics[at]
    own = np.array(state.variables.sources, dtype=np.str_) == culprit.source

    def fits(share: float) -> bool:
        scale = np.where(own, share, 1.0)
        ends: Interval = from_above(
            state,
            answers.bounds,
            evaluation.alignment,
            of.forms,
            of.members,
            scale,
        )
        return not (of.breaks(ends.lower) or of.breaks(ends.upper))

    if not fits(0.0):
        return 0.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low


def _narrowed_interval(
    evaluation: PartEvaluation, answer: QuantityAnswer, at: int, culprit: Culprit
) -> float:
    """The same of the coverage interval, whose half widths of the sources add as squares."""
    quantity = evaluation.characteristics[at].quantity
    low, high = answer.interval
    half, middle = 0.5 * (high - low), 0.5 * (high + low)
    room = min(quantity.upper - middle, middle - quantity.lower)
    if quantity.is_form:
        half, room = high, quantity.upper
    rest = max(half**2 - culprit.half**2, 0.0)
    if room <= 0.0 or room**2 < rest:
        return 0.0
    return float(min(1.0, np.sqrt((room**2 - rest) / culprit.half**2)))


__all__ = ["Advice", "Culprit", "advice", "culprits"]
