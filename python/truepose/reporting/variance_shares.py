"""Whose fault the spread is: tables and numbers of a result of `truepose.shares`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.language import grouped, marked, say, say_counted
from truepose.reporting.alike import with_ties, worth_tightening
from truepose.reporting.display import column, is_position, where_highest
from truepose.reporting.reading import at_text, components, position_of
from truepose.reporting.result_words import word
from truepose.reporting.table import Table
from truepose.reporting.tables import MOST_LISTED
from truepose.uncertainty_analysis.shares import first_to_tighten

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine


@dataclass(frozen=True)
class Blame:
    """Shares of the position's variance at one pose, largest first.

    `kinds` has for `first`, `total`, `linear` and, where inputs are correlated, `shapley` a share
    of each name (n_name,), `confidence` the half width of the first two's intervals.
    """

    names: tuple[str, ...]
    kinds: dict[str, Floats]
    confidence: dict[str, Floats]


def blame(result: xr.Dataset, pose: int, of: str = "parameter", part: str = "position") -> Blame:
    """Who makes how much of the variance of a vector at one pose.

    The shares of the components, weighted with their variances (Lamboni, Monod & Makowski 2011,
    "Multivariate sensitivity analysis to measure global contribution of input factors in dynamic
    models", equation 11). `of` is "parameter" or "source", `part` "position" or "orientation".
    """
    names = components(result)
    among = [at for at, name in enumerate(names) if is_position(name) == (part == "position")]
    variance = np.asarray(result["standard_deviation"].values)[pose, among] ** 2
    total = float(variance.sum())
    weight = variance / total if total > 0 else np.zeros_like(variance)
    before = "" if of == "parameter" else "source_"

    def weighted(name: str) -> Floats:
        values = np.asarray(result[before + name].values)[pose][:, among]
        return np.asarray(np.where(weight > 0, values, 0.0) @ weight)

    kinds = [kind for kind in ("first", "total", "linear", "shapley") if before + kind in result]
    values = {kind: weighted(kind) for kind in kinds}
    # Components are estimated from the same samples: their errors may all have one sign.
    half = {
        kind: weighted(f"{kind}_confidence")
        for kind in kinds
        if f"{before}{kind}_confidence" in result
    }
    order = np.argsort(-values["shapley" if "shapley" in values else "total"], kind="stable")
    labels = [str(name) for name in result[of].values]
    return Blame(
        tuple(labels[at] for at in order),
        {kind: column[order] for kind, column in values.items()},
        {kind: column[order] for kind, column in half.items()},
    )


def spread_pose(result: xr.Dataset) -> int:
    """Index of the pose at which the position of the tool spreads most."""
    among = position_of(result)
    return where_highest(np.linalg.norm(result["standard_deviation"].values[:, among], axis=1))


def parts_of(result: xr.Dataset) -> list[str]:
    """Position, orientation or both: what the components of a result are of."""
    lengths = [is_position(name) for name in components(result)]
    return ["position"] * any(lengths) + ["orientation"] * (not all(lengths))


def shares(machine: Machine, result: xr.Dataset) -> list[Table]:
    """Who makes the spread, by parameter and by source, where it is largest."""
    pose = spread_pose(result)
    parts = parts_of(result)
    tables = [
        with_ties(
            _shares(machine, result, pose, "parameter", part),
            blame(result, pose, "parameter", part),
            part,
            at_text(machine, result, pose),
        )
        for part in parts
    ]
    return [*tables, *(_shares(machine, result, pose, "source", part) for part in parts)]


def _shares(machine: Machine, result: xr.Dataset, pose: int, of: str, part: str) -> Table:
    who = blame(result, pose, of, part)
    header, cells = [say("source") if of == "source" else say("parameter")], []
    for kind, title in (
        ("first", say("first, %")),
        ("total", say("total, %")),
        ("linear", say("linear, %")),
        ("shapley", say("Shapley, %")),
    ):
        if kind not in who.kinds:
            continue
        header.append(title)
        cells.append(column(100.0 * who.kinds[kind], 2))
        if kind in who.confidence:
            header.append("±")
            cells.append(column(100.0 * who.confidence[kind], 2))
    rows = tuple(zip(who.names, *cells, strict=True))
    rows = rows[: worth_tightening(who)] if of == "parameter" else rows
    more = ""
    if of == "parameter" and len(rows) > MOST_LISTED:
        more = " " + say(
            "The {count} largest of {every}.", count=MOST_LISTED, every=grouped(len(rows))
        )
        rows = rows[:MOST_LISTED]
    first = ""
    if of == "parameter" and rows:
        first = " " + say("To be tightened first: {name}.", name=who.names[0])
        if part == parts_of(result)[0] and result.sizes["pose"] > 1:
            name, share = first_to_tighten(result)
            first += " " + say(
                "Over all {count} poses together: {name}, {share} % of the variance.",
                count=grouped(result.sizes["pose"]),
                name=name,
                share=marked(f"{100 * share:.1f}"),
            )
    failed = int(result["failed"].values[pose])
    lost = (
        " "
        + say_counted(
            "At this pose {count} base sample could not be assembled: the shares are those of "
            "the machines that could.",
            "At this pose {count} base samples could not be assembled: the shares are those of "
            "the machines that could.",
            failed,
        )
        if failed
        else ""
    )
    return Table(
        f"shares_{of}_{part}",
        _title(of, part),
        tuple(header),
        rows,
        says=say(
            "{name} makes most of the variance ({quantity}): {share} % in total.",
            name=who.names[0],
            quantity=word(part),
            share=rows[0][header.index(say("total, %"))],
        )
        if rows
        else "",
        note=say(
            "At {pose}, where the tool spreads most, of the variances of all components "
            "together. First: what would go if this one were known; total: what would stay if "
            "all others were; linear: to first order.",
            pose=at_text(machine, result, pose),
        )
        + first
        + more
        + lost,
    )


def _title(of: str, part: str) -> str:
    titles = {
        ("parameter", "position"): say("Shares of the position's variance, by parameter"),
        ("parameter", "orientation"): say("Shares of the orientation's variance, by parameter"),
        ("source", "position"): say("Shares of the position's variance, by source"),
        ("source", "orientation"): say("Shares of the orientation's variance, by source"),
    }
    return titles[of, part]
