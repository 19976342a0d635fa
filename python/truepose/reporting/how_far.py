"""How far off the tool can be, over the whole workspace: the known numbers side by side."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from truepose.language import grouped, say, say_counted
from truepose.reporting.accuracy import AFTER, BEFORE
from truepose.reporting.display import MISSING
from truepose.reporting.result_words import word
from truepose.reporting.study import Study
from truepose.reporting.table import Table
from truepose.reporting.uncertainty_tables import rounded

NUMBERS = {
    "known": "known",
    "sampled": "95 %",
    "witness": "witness",
    "linear": "linear maximum",
    "bound": "proven bound",
}
"""The numbers, by rising caution."""


@dataclass(frozen=True)
class HowFar:
    """One quantity in one state: m or rad by the names of `NUMBERS`, NaN where there is none."""

    quantity: str
    state: str
    sizes: Mapping[str, float]


def how_far(study: Study) -> list[HowFar]:
    """Every quantity before and after compensation.

    At a coverage the verdict's own numbers are of that, and of the worst case the linear maximum is
    known alone.
    """
    rows = []
    worst_cases = _linear_maxima(study)
    sampled = {(answer.state, answer.quantity): answer for answer in study.sampled}
    for answer in study.accuracy:
        share = sampled.get((answer.state, answer.quantity))
        worst = answer.coverage is None
        sizes = {
            "known": _known(study, answer.state, answer.quantity),
            "sampled": math.nan if share is None else share.linear.value,
            "witness": answer.witness.value if worst else math.nan,
            "linear": answer.linear.value if worst else worst_cases[answer.state][answer.quantity],
            "bound": answer.bound.value if worst else math.nan,
        }
        finite = {name: size if math.isfinite(size) else math.nan for name, size in sizes.items()}
        rows.append(HowFar(answer.quantity, answer.state, finite))
    return rows


def _known(study: Study, state: str, quantity: str) -> float:
    """The largest error over all poses with every source as it is known, m or rad."""
    errors = (
        study.values("overall_error") if state == BEFORE else study.compensated("residual_middle")
    )
    size = study.position_norm if quantity == "position" else study.rotation_norm
    return float(np.nanmax(size(errors)))


def _linear_maxima(study: Study) -> Mapping[str, Mapping[str, float]]:
    """By state and quantity, m and rad: the largest over all poses."""
    return {
        state: {
            str(quantity): float(np.nanmax(result["linear_maximum"].values[:, at]))
            for at, quantity in enumerate(result["quantity"].values)
        }
        for state, result in ((BEFORE, study.budget), (AFTER, study.compensation))
        if result is not None
    }


def share_note(study: Study) -> str:
    """What 95 % is, and how it was found."""
    said = say(
        "95 %: so many of all machines stay below it at the worst pose, sampled, solved exactly"
    )
    coverages = [answer.coverage for answer in study.sampled if answer.coverage is not None]
    if not coverages:
        return f"{said}."
    draws = max(coverage.draws for coverage in coverages)
    sampled = {coverage.sampled for coverage in coverages}
    poses = say_counted("{count} pose", "{count} poses", coverages[0].poses)
    values = {"draws": grouped(draws), "sampled": grouped(max(sampled)), "poses": poses}
    if len(sampled) > 1:
        return f"{said}: {say('{draws} machines at up to {sampled} of {poses}.', **values)}"
    return f"{said}: {say('{draws} machines at {sampled} of {poses}.', **values)}"


def cells(study: Study, row: HowFar) -> Mapping[str, str]:
    """The numbers of a row by name, as people read them: a bound is rounded up."""
    unit = study.units.error(row.quantity)
    sizes = np.array([row.sizes[name] * unit.per_si for name in NUMBERS])
    texts = rounded(sizes, [int(name == "bound") for name in NUMBERS])
    return dict(zip(NUMBERS, texts, strict=True))


def _most(study: Study, row: HowFar) -> str:
    """How far off the first quantity is before compensation: the worst that is known."""
    texts, unit = cells(study, row), study.units.error(row.quantity)
    name = "witness" if math.isfinite(row.sizes["witness"]) else "linear"
    return say(
        "The {quantity} can be {size} {unit} off {state}.",
        quantity=word(row.quantity),
        size=texts[name],
        unit=unit.label,
        state=word(row.state),
    )


def table(study: Study) -> Table:
    """The same as a table."""
    rows = []
    for row in how_far(study):
        unit = study.units.error(row.quantity)
        texts = cells(study, row).values()
        rows.append((word(row.quantity), word(row.state), *texts, unit.label))
    first, *_ = how_far(study)
    return Table(
        "how_far",
        say("How far off can the tool be?"),
        ("", "", *(word(name) for name in NUMBERS.values()), ""),
        tuple(rows),
        words=2,
        says=_most(study, first),
        note=say(
            "The largest over all poses. {share} {missing}: there is no such number.",
            share=share_note(study),
            missing=MISSING,
        ),
    )


__all__ = ["AFTER", "BEFORE", "NUMBERS", "HowFar", "cells", "how_far", "table"]
