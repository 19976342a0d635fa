"""Tables of a part, and its sheet as CSV: what every feature will be, against its limits."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from truepose.files.dimensions import BY_UNIT
from truepose.language import grouped, marked, say
from truepose.reporting.result_words import word
from truepose.reporting.table import Table
from truepose.sources import not_included_text
from truepose.verdict.states import BEFORE
from truepose.workpiece.advice import advice, culprits
from truepose.workpiece.evaluation import (
    MET,
    NOT_MET,
    UNDECIDED,
    Characteristic,
    PartEvaluation,
    QuantityAnswer,
    StateAnswers,
)
from truepose.workpiece.features import Quantity
from truepose.workpiece.result import attributes

PROCESS = (
    "What the process adds (cutter, deflection of the tool, extrusion, clamping, wear) is not in "
    "it."
)
"""Stands in every file about a part."""

LEAST = 0.05
"""Of the small unit: what is shown as 0.0 and not named."""

ROUNDING = 1e-9
"""Of a programmed size, and m or rad: what is no difference from a limit."""

NAMED = 3
"""Sources that are named."""


def process() -> str:
    """What is not in it, in the language spoken; stands on every page about a part."""
    return say(
        "What the process adds (cutter, deflection of the tool, extrusion, clamping, wear) is not "
        "in it."
    )


def tables(evaluation: PartEvaluation) -> Iterator[Table]:
    """A table a state, then, but of one machine alone, who is to blame and what would mend it."""
    for answers in evaluation.states:
        yield _state(evaluation, answers)
    if evaluation.of_bands:
        yield _blame(evaluation)
    yield _operators(evaluation)


@dataclass(frozen=True)
class SummaryLine:
    """An answer in a line: its word, which colour that has (`met`, `missed`, `open`), its text."""

    word: str
    colour: str
    text: str


def summary(evaluation: PartEvaluation) -> list[SummaryLine]:
    """What a person is told first: how many quantities are good, and which are not."""
    lines = []
    for answers in evaluation.states:
        told = list(zip(evaluation.characteristics, answers.answers, strict=True))
        missed = [of for of, answer in told if answer.verdict == NOT_MET]
        unsure = [of for of, answer in told if answer.verdict == UNDECIDED]
        verdict, colour = (
            (NOT_MET, "missed") if missed else (UNDECIDED, "open") if unsure else (MET, "met")
        )
        text = say(
            "{state}: {good} of {every} quantities certainly within tolerance",
            state=word(answers.state.name),
            good=len(told) - len(missed) - len(unsure),
            every=len(told),
        )
        if missed:
            text += "; " + say("NOT met: {names}", names=_by_feature(missed))
        if unsure:
            text += "; " + say("undecided: {names}", names=_by_feature(unsure))
        of, answer = max(told, key=lambda one: one[1].out)
        if answer.out > 0.0:
            text += ". " + say(
                "Most often out: {name}, of {out} % of the machines",
                name=of.label,
                out=marked(f"{100.0 * answer.out:.3g}"),
            )
        elif missed and evaluation.of_bands:
            text += ". " + say(
                "Of {samples} machines simulated none is out, but a machine at the limits of its "
                "bands is",
                samples=grouped(evaluation.samples),
            )
        lines.append(SummaryLine(word(verdict), colour, text))
    return lines


def _by_feature(named: list[Characteristic]) -> str:
    """Such as "width (size, smallest; size, largest), corner (perpendicularity)"."""
    quantities: dict[str, list[str]] = {}
    for of in named:
        quantities.setdefault(of.feature.name, []).append(of.quantity.name)
    return ", ".join(f"{name} ({'; '.join(each)})" for name, each in quantities.items())


def _state(evaluation: PartEvaluation, answers: StateAnswers) -> Table:
    rows = tuple(
        _row(evaluation, of, answer)
        for of, answer in zip(evaluation.characteristics, answers.answers, strict=True)
    )
    header = (
        say("feature"),
        say("quantity"),
        say("verdict"),
        say("nominal"),
        say("limits"),
        say("in"),
        say("known"),
        say("{probability} % interval", probability=marked(f"{100.0 * evaluation.probability:g}")),
        "u",
        say("reached"),
        say("no machine beyond"),
        say("out"),
    )
    walked = evaluation.walked
    small = evaluation.shown.small_length
    note = say(
        "Verdict by the rule {rule}. {samples} machines that yours may be, seed {seed}, each goes "
        "to every point; alignment: {kind}. Deviations from nominal, of a form its value.",
        rule=evaluation.rule,
        samples=grouped(evaluation.samples),
        seed=evaluation.seed,
        kind=evaluation.alignment.kind,
    )
    if answers.state.name == BEFORE:
        note += " " + say(
            "Along the path the known error of the tool's place is at most {size} (line {line}).",
            size=small.text(walked.largest),
            line=walked.largest_line,
        )
    note += f" {process()}"
    missing = not_included_text(evaluation.machine, evaluation.condition)
    if missing:
        note += " " + say("Not included: {missing}.", missing=missing)
    good = sum(answer.verdict == MET for answer in answers.answers)
    return Table(
        f"part {answers.state.name}",
        say("The part {state}", state=word(answers.state.name)),
        header,
        rows,
        3,
        note,
        says=say(
            "{good} of {every} quantities are certainly within tolerance.",
            good=good,
            every=len(rows),
        ),
    )


def _row(evaluation: PartEvaluation, of: Characteristic, answer: QuantityAnswer) -> tuple[str, ...]:
    quantity, shown = of.quantity, evaluation.shown
    large, small = shown.of(quantity.si), shown.small(quantity.si)

    def off(value: float) -> str:
        if not math.isfinite(value):
            return say("no limit") if math.isinf(value) else say("none")
        scaled = round((value - quantity.nominal) * small.per_si, 1) + 0.0
        return marked(f"{scaled:{'' if quantity.is_form else '+'}.1f}")

    def ends(low: float, high: float) -> str:
        return f"{off(high)}" if quantity.is_form else f"{off(low)} .. {off(high)}"

    nominal = (
        "" if quantity.is_form else marked(f"{quantity.nominal * large.per_si:.10g} {large.label}")
    )
    above = ends(answer.above.lower, answer.above.upper)
    return (
        of.feature.name,
        quantity.name,
        word(answer.verdict),
        nominal,
        ends(quantity.lower, quantity.upper),
        small.label,
        off(answer.known),
        ends(*answer.interval),
        say("not stated")
        if quantity.is_form
        else marked(f"{answer.uncertainty * small.per_si:.1f}"),
        ends(answer.search.lower.value, answer.search.upper.value),
        above if answer.above.proven else say("{above} (not proven)", above=above),
        _share_out(answer.out, evaluation.samples),
    )


def _blame(evaluation: PartEvaluation) -> Table:
    rows = []
    before = next(one for one in evaluation.states if one.state.name == BEFORE)
    for at, of in enumerate(evaluation.characteristics):
        small = evaluation.shown.small(of.quantity.si)
        named = [
            f"{one.source} {_adds(one.known * small.per_si, one.half * small.per_si)}"
            + (" " + say("(most: {first})", first=one.first) if one.first else "")
            for one in culprits(before, at)[:NAMED]
            if (abs(one.known) + one.half) * small.per_si >= LEAST
        ]
        rows.append(
            (
                of.label,
                f"{', '.join(named)} {small.label}"
                if named
                else say("under {least} {unit}", least=marked(f"{LEAST:g}"), unit=small.label),
                mends(evaluation, at),
            )
        )
    note = say(
        "Each source alone: what it is known to add as commanded, and half the 95 % interval "
        "of what it leaves unknown, with the variable that does most of it. What is known "
        "holds in the condition of the machine file, its temperatures and forces: in another "
        "one compensation would put the error in."
    )
    return Table(
        "blame",
        say("What it comes from, and what would mend it"),
        (say("characteristic"), say("sources"), say("what would mend it")),
        tuple(rows),
        3,
        note,
    )


def _operators(evaluation: PartEvaluation) -> Table:
    rows = tuple(
        (of.label, of.quantity.operator, of.quantity.filter) for of in evaluation.characteristics
    )
    title = say("How each is evaluated")
    header = (say("characteristic"), say("operator"), say("filter"))
    return Table("operators", title, header, rows, 3)


def _adds(known: float, half: float) -> str:
    known, half = round(known, 1), round(half, 1)
    if not half:
        return marked(f"{known:+.1f}")
    return marked(f"{known:+.1f} ± {half:.1f}" if known else f"± {half:.1f}")


def _beyond(quantity: Quantity, programmed: float) -> bool:
    """Whether the program asks for what is out of tolerance: a limit itself is none."""
    room = ROUNDING * abs(quantity.nominal) + ROUNDING
    return not quantity.lower - room <= programmed <= quantity.upper + room


def _share_out(share: float, samples: int) -> str:
    """In percent. Of none of n it is below 3 / n with 95 % confidence (the rule of three)."""
    return marked(f"{100.0 * share:.3g} %" if share > 0.0 else f"< {300.0 / samples:.2g} %")


def mends(evaluation: PartEvaluation, at: int) -> str:
    """What would bring characteristic number `at` within its limits, in words."""
    of, programmed = evaluation.characteristics[at], evaluation.before().programmed[at]
    if _beyond(of.quantity, float(programmed)):
        unit = evaluation.shown.of(of.quantity.si)
        return say(
            "the program itself asks for {programmed}, out of tolerance: look at the lines, at "
            "side and at tool_radius",
            programmed=unit.text(float(programmed), 7),
        )
    suggested = advice(evaluation, at)
    if suggested is None:
        return say("nothing to mend")
    if suggested.why and not suggested.source:
        unproven = say(
            "nothing is found to be out, but there is no proof: {why}", why=suggested.why
        )
        return say("compensation: {then}", then=unproven) if suggested.compensation else unproven
    if suggested.compensation:
        return say("compensation: truepose gcode corrects the program")
    if suggested.aim:
        small = evaluation.shown.small(evaluation.characteristics[at].quantity.si)
        amount = marked(f"{abs(suggested.aim) * small.per_si:.1f} {small.label}")
        if suggested.aim > 0.0:
            program = say("program it {amount} larger", amount=amount)
        else:
            program = say("program it {amount} smaller", amount=amount)
        half = " " + say(
            "({amount} on the radius)",
            amount=marked(f"{abs(suggested.aim) * small.per_si / 2.0:.1f}"),
        )
        return say(
            "compensation, and the middle of the limits: {program}{half}",
            program=program,
            half=half if of.feature.kind == "circle" else "",
        )
    if not suggested.source:
        return say("no source's bands alone: compensate, then tighten several, or ask for less")
    # Rounded down: a little wider would be too wide.
    share = math.floor(1000.0 * suggested.narrowed) / 10.0
    values = {"source": suggested.source, "share": marked(f"{share:g}")}
    if suggested.state == BEFORE:
        narrowed = say(
            "all bands of the machine's {source} narrowed to {share} % of their width: better or "
            "measured parts",
            **values,
        )
    else:
        narrowed = say(
            "compensation, and all bands of the machine's {source} narrowed to {share} % of their "
            "width: better or measured parts",
            **values,
        )
    if not suggested.why:
        return narrowed
    return f"{narrowed}; {say('even then not proven: {why}', why=suggested.why)}"


SHEET = (
    "number",
    "feature",
    "quantity",
    "state",
    "nominal",
    "lower_limit",
    "upper_limit",
    "unit",
    "known",
    "standard_uncertainty",
    "interval_lower",
    "interval_upper",
    "reached_lower",
    "reached_upper",
    "bound_lower",
    "bound_upper",
    "proven",
    "probability_out",
    "verdict",
    "why",
    "operator",
    "filter",
    "mend",
)
"""Columns of the sheet, as a first-article report has a row for each characteristic."""


def sheet(evaluation: PartEvaluation) -> list[dict[str, Any]]:
    """A row for each characteristic and state, in the units of features file, else machine."""
    count = len(evaluation.characteristics)
    # What would mend it is of both states together, and is searched for.
    remedies = [mends(evaluation, at) if evaluation.of_bands else "" for at in range(count)]
    return [
        _sheet_row(evaluation, answers, at, remedies[at])
        for answers in evaluation.states
        for at in range(count)
    ]


def _sheet_row(
    evaluation: PartEvaluation,
    answers: StateAnswers,
    at: int,
    remedy: str,
) -> dict[str, Any]:
    of, answer = evaluation.characteristics[at], answers.answers[at]
    quantity = of.quantity
    unit = evaluation.units[BY_UNIT[quantity.si]]

    def told(value: float) -> float | None:
        return float(unit.to_file(value)) if math.isfinite(value) else None

    return {
        "number": at + 1,
        "feature": of.feature.name,
        "quantity": quantity.name,
        "state": answers.state.name,
        "nominal": told(quantity.nominal),
        "lower_limit": told(quantity.lower),
        "upper_limit": told(quantity.upper),
        "unit": unit.label,
        "known": told(answer.known),
        "standard_uncertainty": None if quantity.is_form else told(answer.uncertainty),
        "interval_lower": told(answer.interval[0]),
        "interval_upper": told(answer.interval[1]),
        "reached_lower": told(answer.search.lower.value),
        "reached_upper": told(answer.search.upper.value),
        "bound_lower": told(answer.above.lower),
        "bound_upper": told(answer.above.upper),
        "proven": answer.above.proven,
        "probability_out": answer.out,
        "verdict": answer.verdict,
        "why": answer.why,
        "operator": quantity.operator,
        "filter": quantity.filter,
        "mend": remedy,
    }


def csv_text(evaluation: PartEvaluation) -> str:
    """The sheet as CSV; empty cells where there is no number."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, SHEET, lineterminator="\n")
    writer.writeheader()
    writer.writerows(sheet(evaluation))
    return buffer.getvalue()


def json_text(evaluation: PartEvaluation) -> str:
    """The sheet and what it rests on as JSON."""
    return json.dumps(
        {
            "command": "part",
            "attributes": attributes(evaluation),
            "process": PROCESS,
            "characteristics": sheet(evaluation),
        },
        indent=1,
        ensure_ascii=False,
        allow_nan=False,
        default=str,
    )


__all__ = ["PROCESS", "csv_text", "json_text", "mends", "process", "sheet", "summary", "tables"]
