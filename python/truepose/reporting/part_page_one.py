"""Page one of a part: is it good, what is worst on it, what to do."""

from __future__ import annotations

import math

from truepose.language import grouped, say
from truepose.reporting import part
from truepose.reporting.display import number
from truepose.reporting.page_one import Judgement, PageOne, Verdict, of_machine
from truepose.verdict.states import BEFORE
from truepose.workpiece.advice import culprits
from truepose.workpiece.evaluation import (
    MET,
    NOT_MET,
    Characteristic,
    PartEvaluation,
    QuantityAnswer,
    StateAnswers,
)
from truepose.workpiece.result import attributes


def part_page_one(evaluation: PartEvaluation, program: str) -> PageOne:
    """What page one says of the part that a `program` makes."""
    attrs = attributes(evaluation)
    return PageOne(
        (_verdict(evaluation),),
        lines(evaluation),
        (),
        (
            (say("program"), program),
            *of_machine(evaluation.machine),
            (say("rule"), str(attrs["rule"])),
            (
                say("by"),
                f"truepose {attrs['truepose_version']}, {say('seed')} {attrs['seed']}, "
                + say("{count} machines drawn", count=grouped(evaluation.samples)),
            ),
        ),
    )


def lines(evaluation: PartEvaluation) -> tuple[tuple[str, str], ...]:
    """What is worst on the part, and what to do: a name with a sentence."""
    answers, at = _worst(evaluation)
    return (
        (say("What is worst on the part"), _told(evaluation, answers, at)),
        (say("What to do for the part"), _to_do(evaluation, at)),
    )


def _verdict(evaluation: PartEvaluation) -> Verdict:
    told = part.summary(evaluation)
    colours = [line.colour for line in told]
    if colours[0] == "met":
        word, colour = say("Yes, as it is"), "met"
    elif colours[-1] == "met":
        word, colour = say("Yes, with compensation"), "met"
    elif "open" in colours:
        word, colour = say("Undecided"), "open"
    else:
        word, colour = say("No"), "missed"
    findings = tuple(Judgement("", line.word, line.colour, line.text) for line in told)
    return Verdict(say("Is the part good?"), word, colour, (("", findings),))


def _worst(evaluation: PartEvaluation) -> tuple[StateAnswers, int]:
    """The characteristic that uses most of its tolerance, and the state in which it does.

    After compensation where one is not met there, else as commanded.
    """
    for answers in reversed(evaluation.states):
        if answers is evaluation.states[0] or any(one.verdict != MET for one in answers.answers):
            uses = [
                _use(of, answer)
                for of, answer in zip(evaluation.characteristics, answers.answers, strict=True)
            ]
            return answers, uses.index(max(uses))
    raise AssertionError


def _use(of: Characteristic, answer: QuantityAnswer) -> float:
    """Which part of its tolerance a machine was found to use; 0 where nothing is asked."""
    nominal, quantity = of.quantity.nominal, of.quantity
    uses = [0.0]
    for reached, limit in (
        (answer.search.upper.value, quantity.upper),
        (answer.search.lower.value, quantity.lower),
    ):
        room = limit - nominal
        if math.isfinite(room) and room != 0.0 and math.isfinite(reached):
            uses.append((reached - nominal) / room)
    return max(uses)


def _told(evaluation: PartEvaluation, answers: StateAnswers, at: int) -> str:
    of, answer = evaluation.characteristics[at], answers.answers[at]
    first = culprits(evaluation.before(), at)
    return say(
        "{characteristic}. One machine inside the bands uses {use} % of its tolerance {state}, "
        "95 % of them at most {interval} %. Most of it comes from {source}.",
        characteristic=of.label,
        use=number(100.0 * _use(of, answer), 0),
        interval=number(100.0 * _used_by_interval(of, answer), 0),
        state=say("as commanded") if answers.state.name == BEFORE else say("after compensation"),
        source=first[0].source if first else say("nothing"),
    )


def _used_by_interval(of: Characteristic, answer: QuantityAnswer) -> float:
    """The same of the coverage interval."""
    nominal, uses = of.quantity.nominal, [0.0]
    for end, limit in zip(answer.interval, (of.quantity.lower, of.quantity.upper), strict=True):
        room = limit - nominal
        if math.isfinite(room) and room != 0.0:
            uses.append((end - nominal) / room)
    return max(uses)


def _to_do(evaluation: PartEvaluation, at: int) -> str:
    """What would mend the worst, and how many others have to be mended."""
    first = evaluation.states[0].answers
    if all(answer.verdict == MET for answer in first):
        return say("Nothing: every quantity is certainly within its tolerance.")
    text = part.mends(evaluation, at)
    text = f"{text[:1].upper()}{text[1:]}."
    after = [one for one in evaluation.states[-1].answers if one.verdict == NOT_MET]
    if len(after) > 1:
        others = say(
            "{count} quantities are not met after compensation: the table of causes says what "
            "would mend each.",
            count=len(after),
        )
        return f"{text} {others}"
    return text


__all__ = ["lines", "part_page_one"]
