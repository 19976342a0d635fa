"""What sources leave unknown, for a bundle: variables, and the columns that they move as laws."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from truepose.live.laws import LiveLaw, at_rest, play
from truepose.machine import Condition, Machine
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock, Source
from truepose.sources._play import DeadZone
from truepose.sources._stiffness import lacking
from truepose.uncertainty_analysis.known_shifts import (
    LARGE,
    PROBING,
    NoLawError,
    expanding,
    terms,
    warmed,
)
from truepose.uncertainty_analysis.sampler import Random, described
from truepose.verdict.tightening import band_of


def unknown(block: PoseBlock, laws: Sequence[LiveLaw]) -> dict[str, Any]:
    """`variables`, `columns`, `copula` and `directions` of a bundle, of all sources together.

    Raises `NoLawError` where a half width follows from the pose by no law of a strut's length, or,
    but for dead zones, from what a page's sliders change: temperatures and the wrench.
    """
    rest = at_rest(block)
    steady = [law.source for law in laws if not law.dead_zones]
    bands = _variables(rest, rest.condition, steady)
    for condition in _conditions(block, steady):
        _require_same(bands, _variables(block, condition, steady))
    every = _variables(rest, rest.condition, [law.source for law in laws])
    drawn = Random(every, 0)
    linked = drawn.copula.linked.tolist()
    return {
        "variables": [
            {
                "name": name,
                "source": source,
                "group": _group(name, source),
                "stream": int(stream),
                "number": int(number),
                "distribution": {
                    key: value
                    for key, value in described(distribution, 0, 0).items()
                    if key not in ("stream", "number")
                },
            }
            for name, source, stream, number, distribution in zip(
                every.names,
                every.sources,
                every.streams,
                every.numbers,
                every.distributions,
                strict=True,
            )
        ],
        "columns": _columns(block, every, laws),
        "copula": {"members": linked, "factor": drawn.copula.factor.tolist()} if linked else None,
        "directions": [members.tolist() for members in every.directions],
    }


def _group(name: str, source: str) -> str:
    """What is made tighter together with a variable, as page one names it.

    A variable that is named with its source, since another source has the like, is so grouped.
    """
    band = band_of(name, source).name
    prefix = f"{source}: "
    return prefix + band.removeprefix(prefix) if name.startswith(prefix) else band


def correlated_student(unknown: Mapping[str, Any]) -> bool:
    """Whether a variable is correlated that the kernel cannot draw so: Student's distribution."""
    members = (unknown["copula"] or {"members": []})["members"]
    variables = unknown["variables"]
    return any(variables[at]["distribution"]["kind"] == "student-t" for at in members)


def _variables(block: PoseBlock, condition: Condition, sources: Sequence[Source]) -> Variables:
    acting = [source for source in sources if source.acts(condition)]
    return variables_at(block.machine, replace(block, condition=condition), acting)


def _conditions(block: PoseBlock, sources: Sequence[Source]) -> list[Condition]:
    """What sliders may come to: warmer parts, a wrench either way, and the file's own."""
    machine, cold = block.machine, block.condition
    conditions = [warmed(block, [LARGE] * len(expanding(machine))), machine.condition]
    if yields_unsaid(machine, sources):
        return conditions
    for newtons in (PROBING[0], -PROBING[1]):
        arm = newtons * machine.characteristic_length
        conditions.append(cold.replace(force=(newtons,) * 3, moment=(arm,) * 3))
    return conditions


def yields_unsaid(machine: Machine, sources: Iterable[Source]) -> bool:
    """Whether something is to give way and nobody says how stiff it is: a page takes no wrench."""
    yields = any(getattr(source, "yields_under", None) == "tool" for source in sources)
    return yields and bool(lacking(machine.drives, machine.struts, machine.limbs, ""))


def _require_same(one: Variables, other: Variables) -> None:
    """Raise `NoLawError` where the bands are others in another condition."""
    same = (
        one.names == other.names
        and np.array_equal(one.columns, other.columns)
        and np.allclose(one.half_width, other.half_width, rtol=1e-12, atol=0.0)
    )
    if not same:
        raise NoLawError("has bands that follow from the temperature or the wrench")


def _columns(block: PoseBlock, every: Variables, laws: Sequence[LiveLaw]) -> list[dict[str, Any]]:
    zones = {law.source.name: iter(_open(block, law)) for law in laws}
    columns = []
    for at, (parameter, variable) in enumerate(
        zip(every.columns.tolist(), every.variable_of.tolist(), strict=True)
    ):
        (law,) = terms(block, every.columns[at : at + 1], every.half_width[:, at : at + 1])
        half = [law.constant, law.slope, law.strut]
        column: dict[str, Any] = {"parameter": parameter, "variable": variable, "half": half}
        source = every.sources[variable]
        zone = next(zones[source], None)
        if zone is not None:
            column["play"] = play(zone, source)
        columns.append(column)
    return columns


def _open(block: PoseBlock, law: LiveLaw) -> list[DeadZone]:
    """The source's dead zones that have any width, as its columns with a band are in order."""
    if not law.dead_zones:
        return []
    rest = at_rest(block)
    banded = law.source.deviation(block.machine, rest.condition, rest).banded
    return [law.dead_zones[at] for at in banded.tolist()]


__all__ = ["correlated_student", "unknown", "yields_unsaid"]
