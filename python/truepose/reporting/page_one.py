"""Page one of the report: is it good enough, how far off, what is worst, what to do.

Each number is one of the tables' and of the commands', as they print it.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.language import grouped, say, say_counted
from truepose.reporting import inputs
from truepose.reporting.accuracy import Told, told
from truepose.reporting.display import MISSING, number
from truepose.reporting.how_far import cells, how_far
from truepose.reporting.result_words import word
from truepose.reporting.study import Study
from truepose.sources import REGISTRY
from truepose.verdict.answer import AFTER, BEFORE, MET, NOT_MET, UNDECIDED, Number
from truepose.verdict.tightening import Tightening

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

ROWS = {
    "known": "known",
    "sampled": "95 % of machines",
    "witness": "worst found",
    "linear": "worst, to first order",
    "bound": "proven bound",
}
"""What the rows of a dot plot are called; a number that no state has is left out."""

STATES = {BEFORE: "as commanded", AFTER: "compensated"}

ROOM = 1.08
"""Of the largest number: the end of a dot plot's scale."""


@dataclass(frozen=True)
class Judgement:
    """What holds in one state: its label, `word` of a `colour`, text, and what that rests on."""

    label: str
    word: str
    colour: str
    text: str = ""
    basis: str = ""


@dataclass(frozen=True)
class Verdict:
    """A question, its answer in a word and `colour` (met, missed, open, none), and why.

    `rows`: what is judged, empty where that is one thing, and the findings on it.
    """

    question: str
    word: str
    colour: str
    rows: tuple[tuple[str, tuple[Judgement, ...]], ...]


@dataclass(frozen=True)
class Dot:
    """A number in a row: its text, and where it lies on the scale, in percent."""

    text: str
    at: float


@dataclass(frozen=True)
class DotRow:
    """A number's name, and itself before and after compensation; None where there is none."""

    name: str
    before: Dot | None
    after: Dot | None


@dataclass(frozen=True)
class DotPlot:
    """How far off one quantity is: rows of dots on one scale from 0, and the target on it."""

    quantity: str
    unit: str
    target: Dot | None
    rows: tuple[DotRow, ...]


@dataclass(frozen=True)
class PageOne:
    """All of page one but the drawing of the machine."""

    verdicts: tuple[Verdict, ...]
    lines: tuple[tuple[str, str], ...]
    plots: tuple[DotPlot, ...]
    identification: tuple[tuple[str, str], ...]


def page_one(study: Study, part: PageOne | None = None) -> PageOne:
    """What page one says; `part`: what that of a part says, which then comes first."""
    verdicts = [machine_verdict(study)]
    if part is not None:
        verdicts = [*part.verdicts, *verdicts]
    if study.calibration is not None:
        verdicts = [_calibration_verdict(study), *verdicts]
    said = lines(study) if part is None else (*part.lines, *lines(study))
    return PageOne(tuple(verdicts), said, plots(study), identification(study))


def lines(study: Study) -> tuple[tuple[str, str], ...]:
    """What is worst, what to do, what is not included: a name with a sentence."""
    calibrated: tuple[tuple[str, str], ...] = ()
    names = say("What is worst"), say("What to do")
    if study.calibration is not None:
        names = say("As filed, what is worst"), say("As filed, what to do")
        calibrated = (_after_calibration(study.calibrated),)
    return (
        *calibrated,
        (names[0], _worst(study)),
        (names[1], to_do(study)),
        (say("Not included"), _not_included(study)),
    )


# --- is it good enough? --------------------------------------------------------------------------


def machine_verdict(study: Study) -> Verdict:
    """Whether the accuracy asked is kept, commanded as it is or corrected."""
    answers = told(study.machine, study.accuracy)
    before, after = (_overall(answers, state) for state in (BEFORE, AFTER))
    word, colour = _in_a_word(before, after)
    question = (
        say("Is the machine as filed good enough?")
        if study.calibration is not None
        else say("Is the machine good enough?")
    )
    quantities = dict.fromkeys(one.answer.quantity for one in answers)
    rows = tuple(
        (
            _judged(next(one for one in answers if one.answer.quantity == quantity)),
            tuple(_judgement(study, one) for one in answers if one.answer.quantity == quantity),
        )
        for quantity in quantities
    )
    return Verdict(question, word, colour, rows)


def _overall(answers: Sequence[Told], state: str) -> str | None:
    """The answer to all that is asked in one state; None where nothing is."""
    said = [one.answer.answer for one in answers if one.answer.state == state]
    decided = [answer for answer in said if answer is not None]
    if not decided:
        return None
    return next((answer for answer in (NOT_MET, UNDECIDED) if answer in decided), MET)


def _in_a_word(before: str | None, after: str | None) -> tuple[str, str]:
    if after is None and before is None:
        return say("No accuracy is asked"), "none"
    if before == MET and after == MET:
        return say("Yes, as it is"), "met"
    if after == MET:
        return say("Yes, with compensation"), "met"
    if before == MET:
        return say("Yes, but not with compensation"), "met"
    if UNDECIDED in (before, after):
        return say("Undecided"), "open"
    return say("No"), "missed"


def _judged(of: Told) -> str:
    """A quantity, and what is asked of it."""
    quantity = say(of.answer.quantity)
    if of.answer.asked is None:
        return quantity
    return say("{quantity}, asked {asked}", quantity=quantity, asked=of.asked)


def _judgement(study: Study, of: Told) -> Judgement:
    answer, label = of.answer, say(STATES[of.answer.state])
    if answer.coverage is not None or answer.answer is not None:
        word = of.size if answer.answer is None else f"{of.word}: {of.size}"
        return Judgement(label, word, of.colour, _most_machines(study, of), of.basis)
    # Nothing is judged: what was found and what is proven, as the dots have them.
    size = say(
        "{found} found, at most {proven}",
        found=of.text(answer.witness.value),
        proven=of.text(answer.bound.value, 1),
    )
    return Judgement(label, size, of.colour, basis=say("at {pose}", pose=of.at(answer.witness)))


def _most_machines(study: Study, of: Told) -> str:
    """Which error 95 % of all machines keep, beside a worst case; empty where that is not known."""
    row = next(
        (
            row
            for row in how_far(study)
            if (row.state, row.quantity) == (of.answer.state, of.answer.quantity)
        ),
        None,
    )
    worst = of.answer.coverage is None
    if row is None or not worst or not math.isfinite(row.sizes["sampled"]):
        return ""
    return say(
        "(95 % of machines: {size} {unit})",
        size=cells(study, row)["sampled"],
        unit=of.unit.label,
    )


def _calibration_verdict(study: Study) -> Verdict:
    attrs = study.calibrated.attrs
    accepted = bool(attrs["accepted"])
    sentence = str(attrs["answer"]).partition(": ")[2]
    word, colour = (say("Yes"), "met") if accepted else (say("No"), "missed")
    finding = Judgement("", "", colour, sentence[:1].upper() + sentence[1:])
    return Verdict(say("May the calibrated machine be used?"), word, colour, (("", (finding,)),))


def _after_calibration(result: xr.Dataset) -> tuple[str, str]:
    """What to do with the calibration, or what to measure first."""
    name = say("What to do")
    if result.attrs["accepted"]:
        return name, say(
            "Use the calibrated machine file, which truepose calibrate writes; what follows is "
            "the machine as filed."
        )
    remedy = json.loads(str(result.attrs["remedy"]) or "null")
    if remedy is None:
        return name, say("Do not use it, and look at what the measurements look like, below.")
    return name, say("Do not use it; measure first: {what}.", what=remedy["sentence"])


# --- what is worst, what to do -------------------------------------------------------------------


def _worst(study: Study) -> str:
    """Which source dominates, and where the tool is farthest off."""
    first = study.by_rank[0]
    answers = told(study.machine, study.accuracy)
    farthest = next(one for one in answers if one.answer.state == BEFORE)
    return say(
        "Most of the error comes from the source {source}: {share} % of all sources' worst cases "
        "added up ({kind}). As commanded, the {quantity} is farthest off at {pose}.",
        source=study.sources[first],
        share=number(float(study.values("share")[first]) * 100.0, 1),
        kind=word(str(study.values("verdict")[first])),
        quantity=word(farthest.answer.quantity),
        pose=farthest.at(_shown(farthest)),
    )


def _shown(of: Told) -> Number:
    """The number that page one shows of an answer: where nothing is judged, what was found."""
    judged = of.answer.answer is not None or of.answer.coverage is not None
    return of.told if judged else of.answer.witness


def to_do(study: Study) -> str:
    """The next thing to do, in a sentence or two."""
    answers = told(study.machine, study.accuracy)
    before, after = (_overall(answers, state) for state in (BEFORE, AFTER))
    if before is None and after is None:
        return say(
            "Say which accuracy is needed: accuracy.target in the machine file; without it "
            "nothing can be judged."
        )
    if before == MET:
        return _nothing_to_do(after)
    if after == MET:
        return say(
            "Compensate: command the corrected coordinates (truepose gcode), or load the "
            "corrected parameters into the controller (truepose export)."
        )
    if (after, before) == (UNDECIDED, UNDECIDED) and study.tightening is None:
        return say(
            "Compensate. Whether that is enough is not proven: nothing that exceeds the "
            "accuracy was found, but the bands are too wide for a proof."
        )
    if study.tightening is None:
        return say(
            "Compensate, and ask for less or design anew: no single band of the machine is wide "
            "enough to matter."
        )
    return _tighten(study, study.tightening)


def _nothing_to_do(after: str | None) -> str:
    if after in (NOT_MET, UNDECIDED):
        return say("Nothing, and do not compensate: as commanded the accuracy is kept.")
    return say("Nothing: the accuracy asked is kept as commanded.")


def _tighten(study: Study, of: Tightening) -> str:
    values = {"band": of.band.shown, "parts": _parts(of), "width": _width(study, of)}
    reached = "; ".join(
        f"{word(one.answer.quantity)} {one.size}" for one in told(study.machine, of.answers)
    )
    if of.enough and all(answer.answer != UNDECIDED for answer in of.answers):
        return say(
            "Compensate, and make one band tighter: {band} ({parts}) {width}. Then it is good "
            "enough: {reached}.",
            reached=reached,
            **values,
        )
    if any(answer.answer == UNDECIDED for answer in of.answers):
        return say(
            "Compensate, and make one band tighter: {band} ({parts}) {width}. To first order that "
            "is enough; proven is it not: {reached}.",
            reached=reached,
            **values,
        )
    return say(
        "Compensate, and make several bands tighter or ask for less: no single one is enough. "
        "The best is {band} ({parts}) {width}; it reaches {reached}.",
        reached=reached,
        **values,
    )


def _parts(of: Tightening) -> str:
    return say_counted("{count} tolerance", "{count} tolerances alike", of.parts)


def _width(study: Study, of: Tightening) -> str:
    """From which width to which: of a band as the file has it, else as a share."""
    share = number(of.share * 100.0, 0)
    if not math.isfinite(of.width) or of.unit not in ("m", "rad"):
        return say("to {share} % of its width", share=share)
    unit = study.units.small(of.unit)
    half = 0.5 * of.width * unit.per_si
    places = unit.decimals
    return say(
        "from ±{wide} to ±{narrow} {unit}, {share} % of its width",
        wide=number(half, places),
        # Rounded down: a little wider would be too wide.
        narrow=number(math.floor(half * of.share * 10**places) / 10**places, places),
        unit=unit.label,
        share=share,
    )


def _not_included(study: Study) -> str:
    """Sources that the file does not name, and what no budget has."""
    absent = [kind.name for kind in REGISTRY if kind.name not in study.sources]
    parts = str(study.budget.attrs["not_included"])
    said = []
    if absent:
        said.append(say("not in the machine file: {sources}", sources=", ".join(absent)))
    if parts:
        said.append(say("not known: {parts}", parts=parts))
    left_out = int(study.budget.attrs["poses_left_out"])
    if left_out:
        said.append(
            say_counted(
                "{count} pose that the machine cannot take",
                "{count} poses that the machine cannot take",
                left_out,
            )
        )
    said.append(say("what lies between the poses; wear, and what the process adds"))
    text = "; ".join(said)
    return f"{text[:1].upper()}{text[1:]}."


# --- how far -------------------------------------------------------------------------------------


def plots(study: Study) -> tuple[DotPlot, ...]:
    """A dot plot for each quantity."""
    rows = how_far(study)
    kinds = dict.fromkeys(row.quantity for row in rows)
    return tuple(_plot(study, kind) for kind in kinds)


def _plot(study: Study, kind: str) -> DotPlot:
    unit = study.units.error(kind)
    states = {row.state: row for row in how_far(study) if row.quantity == kind}
    asked = {"position": study.machine.accuracy.target}.get(
        kind, study.machine.accuracy.angle_target
    )
    known = [size for row in states.values() for size in row.sizes.values() if math.isfinite(size)]
    end = max([*known, asked or 0.0]) * ROOM or 1.0
    texts = {state: cells(study, row) for state, row in states.items()}

    def dot(state: str, name: str) -> Dot | None:
        size = states[state].sizes[name] if state in states else math.nan
        return Dot(texts[state][name], 100.0 * size / end) if math.isfinite(size) else None

    rows = [DotRow(say(ROWS[name]), dot(BEFORE, name), dot(AFTER, name)) for name in ROWS]
    # The linear maximum stands for the worst machine only where none was looked for.
    seen = any(math.isfinite(row.sizes["witness"]) for row in states.values())
    hidden = say(ROWS["linear"]) if seen else say(ROWS["witness"])
    target = None
    if asked is not None:
        target = Dot(study.machine.accuracy.said(kind), 100.0 * asked / end)
    return DotPlot(
        kind,
        unit.label,
        target,
        tuple(row for row in rows if row.name != hidden and (row.before or row.after)),
    )


# --- of what -------------------------------------------------------------------------------------


def of_machine(machine: Machine) -> tuple[tuple[str, str], ...]:
    """Which machine, as a certificate says it: a name and a text for each that is known."""
    condition = "; ".join(f"{name} {text}" for name, text in inputs.condition(machine).rows)
    rows = [
        (say("machine"), machine.name),
        (say("serial number"), machine.serial),
        (say("state of"), machine.date),
        (say("machine file"), machine.file),
        ("SHA-256", machine.file_hash),
        (say("conditions"), condition),
    ]
    return tuple((name, text) for name, text in rows if text)


def identification(study: Study) -> tuple[tuple[str, str], ...]:
    """What the numbers are of: a name with a text."""
    attrs = study.budget.attrs
    evaluated = say_counted("{count} pose evaluated", "{count} poses evaluated", study.n_pose)
    measured: tuple[tuple[str, str], ...] = ()
    if study.calibration is not None:
        of = study.calibration.attrs
        measured = (
            (say("measurements"), str(of["measurements"])),
            ("SHA-256", str(of["measurements_hash"])),
        )
    return (
        *of_machine(study.machine),
        *measured,
        (say("workspace"), evaluated),
        (say("by"), f"truepose {attrs['truepose_version']}, {say('seed')} {_seed(study)}"),
    )


def _seed(study: Study) -> str:
    sampled = study.monte_carlo
    seed = study.budget.attrs["seed"] if sampled is None else sampled.attrs["seed"]
    return MISSING if seed == "none" else grouped(int(np.asarray(seed)))


__all__ = [
    "Dot",
    "DotPlot",
    "DotRow",
    "Judgement",
    "PageOne",
    "Verdict",
    "lines",
    "of_machine",
    "page_one",
]
