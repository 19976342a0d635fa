"""Tables of how sure an error is: sampled, proven, worst case, and whose share it is.

Each is made from one Dataset of `truepose.monte_carlo`, `bounds`, `worst_case` or `shares`, as
the functions return it. In the units for people (`truepose.files.shown_units`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance.sentences import listed
from truepose.language import grouped, marked, say, say_counted
from truepose.reporting.display import (
    MISSING,
    column,
    decimals_for,
    nearest_middle,
    pose_text,
    where_highest,
)
from truepose.reporting.reading import at_text, components, percent_text, quantities, worst_pose
from truepose.reporting.result_words import word
from truepose.reporting.study import Study
from truepose.reporting.table import Table
from truepose.reporting.tables import MOST_LISTED
from truepose.reporting.variance_shares import shares
from truepose.runs.poses import not_assembled_text, reason_text

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

PROVEN = "proven"


def rounded(values: Floats, senses: Sequence[int]) -> tuple[str, ...]:
    """Numbers of one row as `column` shows them, each rounded up (+1), down (-1) or to nearest (0).

    A proof that is rounded the wrong way is none.
    """
    places = decimals_for(values)
    scaled, ways = values * 10.0**places, np.asarray(senses)
    whole = np.where(ways > 0, np.ceil(scaled), np.where(ways < 0, np.floor(scaled), scaled))
    return column(whole / 10.0**places, places)


def spread_over(poses: Floats, axes: list[int]) -> list[int]:
    """Indices of at most 25 of `poses` (n, n_coordinate), spread over their middle planes.

    `axes` are the coordinates over which ellipses are drawn, at most three. Over two of them five
    by five poses nearest to an even grid, over each pair of three three by three, the other
    coordinates nearest to the middle of their ranges.
    """
    if len(poses) == 0 or not axes:
        return [int(pose) for pose in nearest_middle(poses)[:1]]
    span = np.ptp(poses, axis=0)
    middle = poses[nearest_middle(poses)[0]]
    scaled = (poses - middle) / np.where(span > 0, span, 1.0)
    low, high = scaled.min(axis=0), scaled.max(axis=0)
    pairs = [(0, 1), (0, 2), (1, 2)] if len(axes) > 2 else [tuple(range(len(axes)))]
    count = 3 if len(axes) > 2 else 5
    chosen: dict[int, None] = {}
    for pair in pairs:
        shown = [axes[at] for at in pair]
        steps = [np.linspace(low[at], high[at], count) for at in shown]
        for place in np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, len(shown)):
            target = np.zeros(poses.shape[1])
            target[shown] = place
            off = ((scaled - target) ** 2).sum(axis=1).round(9)
            chosen[int(np.argmin(off))] = None
    return sorted(chosen)


def _named(machine: Machine, name: str) -> str:
    """A component or quantity with its unit for people."""
    return f"{word(name)}, {machine.shown.error(name).label}"


def sampled(machine: Machine, result: xr.Dataset) -> list[Table]:
    """What the samples say at the pose where the position is farthest off, and over all poses."""
    pose = worst_pose(result, "magnitude_upper")
    tables = [_sampled_at(machine, result, pose)]
    if result.sizes["pose"] > 1:
        tables.append(_sampled_over(machine, result))
    return tables


def _sampled_at(machine: Machine, result: xr.Dataset, pose: int) -> Table:
    names = components(result)
    ends = ("lower", "upper", "shortest_lower", "shortest_upper", "minimum", "maximum")
    kinds = ("mean", "standard_deviation", *ends)
    values = np.stack([result[kind].values[pose] for kind in kinds], axis=-1)
    rows = [
        (_named(machine, name), *column(row * machine.shown.error(name).per_si))
        for name, row in zip(names, values, strict=True)
    ]
    for at, name in enumerate(quantities(result)):
        mean, upper, most = (
            result[f"magnitude_{kind}"].values[pose, at] for kind in ("mean", "upper", "maximum")
        )
        cells = [mean, np.nan, np.nan, upper, np.nan, upper, np.nan, most]
        scaled = np.array(cells) * machine.shown.error(name).per_si
        rows.append((_named(machine, name), *column(scaled)))
    percent = percent_text(float(result.attrs["probability"]))
    return Table(
        "sampled",
        say("Sampled error, {percent} coverage intervals", percent=percent),
        (
            "",
            say("mean"),
            say("standard deviation"),
            say("{percent} from", percent=percent),
            say("to"),
            say("shortest from"),
            say("to"),
            say("least sample"),
            say("largest sample"),
        ),
        tuple(rows),
        says=say(
            "{percent} of the samples have an error ({quantity}) of at most {size}.",
            percent=percent,
            quantity=word(quantities(result)[0]),
            size=_error_text(machine, result, "magnitude_upper", pose),
        ),
        note=say(
            "At {pose}, where the position is farthest off. {percent} of the samples lie in this "
            "coverage interval, as many below as above it; the shortest interval with as many is "
            "beside it. Of a magnitude, as many lie below its end. ",
            pose=at_text(machine, result, pose),
            percent=percent,
        )
        + _drawn(result, pose),
    )


def _error_text(machine: Machine, result: xr.Dataset, name: str, pose: int) -> str:
    """A number of the first quantity at a pose, with its unit, as the tables have it."""
    unit = machine.shown.error(quantities(result)[0])
    (text,) = column(np.array([float(result[name].values[pose, 0]) * unit.per_si]))
    return f"{text} {unit.label}"


def _drawn(result: xr.Dataset, pose: int) -> str:
    """How many samples, how drawn, and how many of them the machine could not follow."""
    count, failed = int(result["samples"].values[pose]), int(result["failed"].values[pose])
    values = {"count": grouped(count), "seed": result.attrs["seed"]}
    if result.attrs["sampling"] == "sobol":
        text = say("{count} scrambled Sobol points, seed {seed}.", **values)
    else:
        text = say("{count} samples, seed {seed}.", **values)
    if result.attrs.get("digits"):
        digits = say_counted("{count} digit", "{count} digits", int(result.attrs["digits"]))
        text += " " + say(
            "As many as make {digits} of the standard deviation stable (JCGM 101, 7.9).",
            digits=digits,
        )
    if failed:
        text += " " + say(
            "{lost}: they count as beyond both ends of every interval, and are in no mean, "
            "standard deviation or extreme.",
            lost=not_assembled_text(failed, count + failed),
        )
    if result.attrs.get("interrupted"):
        text += " " + say("Interrupted: fewer than were asked for.")
    return text


def _sampled_over(machine: Machine, result: xr.Dataset) -> Table:
    names = components(result)
    far = np.maximum(np.abs(result["lower"].values), np.abs(result["upper"].values))
    spread = result["standard_deviation"].values
    most = np.maximum(np.abs(result["minimum"].values), np.abs(result["maximum"].values))
    rows = []
    for at, name in enumerate(names):
        pose = where_highest(far[:, at])
        sizes = np.array([spread[:, at].max(), far[pose, at], most[:, at].max()])
        cells = column(sizes * machine.shown.error(name).per_si)
        rows.append((_named(machine, name), at_text(machine, result, pose), *cells))
    for at, name in enumerate(quantities(result)):
        upper = result["magnitude_upper"].values[:, at]
        pose = where_highest(upper)
        largest = result["magnitude_maximum"].values[:, at].max()
        cells = column(np.array([np.nan, upper[pose], largest]) * machine.shown.error(name).per_si)
        rows.append((_named(machine, name), at_text(machine, result, pose), *cells))
    return Table(
        "sampled_over",
        say("Sampled error over {count} poses", count=grouped(result.sizes["pose"])),
        (
            "",
            say("farthest at"),
            say("highest standard deviation"),
            say("farthest of {percent}", percent=percent_text(float(result.attrs["probability"]))),
            say("farthest sample"),
        ),
        tuple(rows),
        words=2,
        says=say(
            "{percent} of the samples have an error ({quantity}) of at most {size} at any of these "
            "poses.",
            percent=percent_text(float(result.attrs["probability"])),
            quantity=word(quantities(result)[0]),
            size=_error_text(
                machine,
                result,
                "magnitude_upper",
                where_highest(result["magnitude_upper"].values[:, 0]),
            ),
        ),
        note=say("Farthest: the end of the coverage interval that is farther from zero.")
        + _lost(result),
    )


def _lost(result: xr.Dataset) -> str:
    """How many samples could not be assembled anywhere, and where too many for an interval."""
    lost = str(result.attrs.get("not_assembled", "none"))
    if lost == "none":
        return ""
    none = int(np.isnan(result["magnitude_upper"].values[:, 0]).sum())
    where = (
        say_counted(
            "at {count} pose so many that no interval is left",
            "at {count} poses so many that no interval is left",
            none,
        )
        if none
        else ""
    )
    return " " + (
        say("Of all samples {lost}; {where}.", lost=lost, where=where)
        if none
        else say("Of all samples {lost}.", lost=lost)
    )


def bounds(machine: Machine, result: xr.Dataset) -> list[Table]:
    """What is proven: at poses or over a region, and where nothing could be."""
    if "pose" not in result.sizes:
        return [_region(machine, result)]
    tables = [_bounds_at(machine, result, worst_pose(result, "magnitude"))]
    unproven = _unproven(machine, result)
    return tables if unproven is None else [*tables, unproven]


def _bounds_at(machine: Machine, result: xr.Dataset, pose: int) -> Table:
    rows = []
    for at, name in enumerate(components(result)):
        ends = [result[f"{kind}lower"].values[pose, at] for kind in ("", "reached_")]
        tops = [result[f"{kind}upper"].values[pose, at] for kind in ("reached_", "")]
        linear = result["linear"].values[pose, at]
        row = np.array([ends[0], ends[1], tops[0], tops[1], linear])
        cells = rounded(row * machine.shown.error(name).per_si, (-1, 1, -1, 1, 0))
        rows.append((_named(machine, name), *cells))
    for at, name in enumerate(quantities(result)):
        size = [result[f"{kind}magnitude"].values[pose, at] for kind in ("reached_", "")]
        row = np.array([np.nan, np.nan, *size, np.nan]) * machine.shown.error(name).per_si
        rows.append((_named(machine, name), *rounded(row, (0, 0, -1, 1, 0))))
    return Table(
        "bounds",
        say("Proven bounds"),
        (
            "",
            say("never below"),
            say("reached"),
            say("reached"),
            say("never above"),
            say("linear worst case"),
        ),
        tuple(rows),
        says=say(
            "No machine inside the bands has an error ({quantity}) of more than {size} here.",
            quantity=word(quantities(result)[0]),
            size=f"{rows[len(components(result))][4]} "
            f"{machine.shown.error(quantities(result)[0]).label}",
        ),
        note=say(
            "At {pose}, where the position's bound is highest. For every deviation inside the "
            "bands the tool is there and nowhere else, and its error between these ends, "
            "rounding included; the error that is reached shows how much of the bound is used.",
            pose=at_text(machine, result, pose),
        )
        + _taken_to_end(result),
    )


def _taken_to_end(result: xr.Dataset) -> str:
    """Where bounds take distributions without ends to end, as a sentence; nothing without any."""
    where = result.attrs.get("truncate", "none")
    if where == "none":
        return ""
    kinds = listed([entry.split(":")[0] for entry in str(result.attrs["unbounded"]).split("; ")])
    if where == "as stated":
        return " " + say(
            "Deviations without ends are taken at their stated k sigma: {kinds}.", kinds=kinds
        )
    return " " + say(
        "Deviations without ends ({kinds}) are taken to end at {where} standard deviations.",
        kinds=kinds,
        where=marked(f"{where:g}"),
    )


def _unproven(machine: Machine, result: xr.Dataset) -> Table | None:
    """Poses without a proof and why; None where all have one."""
    status = np.array([str(code) for code in result["status"].values])
    lost = np.flatnonzero(status != PROVEN)
    if lost.size == 0:
        return None
    rows = [
        (at_text(machine, result, int(pose)), unproven_text(status[pose]))
        for pose in lost[:MOST_LISTED]
    ]
    more = (
        " " + say("The first {count} are listed.", count=MOST_LISTED)
        if lost.size > MOST_LISTED
        else ""
    )
    return Table(
        "unproven",
        say(
            "Poses without a proof: {count} of {every}",
            count=grouped(lost.size),
            every=grouped(status.size),
        ),
        (say("pose"), say("status")),
        tuple(rows),
        words=2,
        note=say("No bound is given where none is proven.") + more,
    )


def _region(machine: Machine, result: xr.Dataset) -> Table:
    rows = []
    for name, bound, reached, where in region_answers(result):
        per_si = machine.shown.error(name).per_si
        least = abs(reached) * per_si
        most = abs(bound) * per_si
        gap = 100.0 * (most / least - 1.0) if least > 0 else np.nan
        cells = rounded(np.array([most, least]), (1, -1))
        rows.append(
            (
                _named(machine, name),
                pose_text(where, machine.commanded, machine.shown)
                if np.isfinite(where).all()
                else MISSING,
                *cells,
                *column(np.array([gap]), 1),
            )
        )
    name, bound, reached, _ = region_answers(result)[0]
    asked = float(result.attrs["gap"])
    open_ = (
        ""
        if bound <= reached * (1.0 + asked)
        else (" " + say("The gap asked, {percent}, was not reached.", percent=percent_text(asked)))
    )
    status = str(result["status"].values)
    proof = (
        say(
            "Proven over the whole region, cut into {boxes} boxes.",
            boxes=grouped(int(result["boxes"].values)),
        )
        if status == PROVEN
        else say("Not proven: {why}.", why=_unproven_where(machine, result))
    )
    return Table(
        "region",
        say("Proven bounds over a region"),
        ("", say("reached at"), say("nowhere more than"), say("reached"), say("gap, %")),
        tuple(rows),
        words=2,
        note=proof
        + (" " + say("Interrupted.") if result.attrs.get("interrupted") else "")
        + open_
        + " "
        + say("Every pose in the region, not only those of a grid; the error's sign left out.")
        + _taken_to_end(result),
    )


def interrupted_bounds(result: xr.Dataset) -> str:
    """What bounds hold for that were stopped before their end."""
    if "pose" in result.sizes:
        return say(
            "Interrupted after {count}, those of the largest first-order deviation: the bounds "
            "are of these.",
            count=say_counted("{count} pose", "{count} poses", result.sizes["pose"]),
        )
    boxes = int(result["boxes"].values)
    if str(result["status"].values) == PROVEN:
        percent = math.ceil(1000.0 * float(result.attrs["gap_reached"])) / 10.0
        so_far = say(
            "the bounds hold over the whole region, and lie up to {percent} % above what is "
            "reached",
            percent=marked(str(percent)),
        )
    else:
        open_parts = int(result["part_magnitude"].isnull().any("quantity").sum())
        so_far = say(
            "of {count} of the region nothing is proven yet, so that there are no bounds over "
            "the whole",
            count=say_counted("{count} part", "{count} parts", open_parts),
        )
    return say(
        "Interrupted after {boxes}: {so_far}. Where the result was written to a "
        ".nc file (--output), --resume goes on from there.",
        boxes=say_counted("{count} box", "{count} boxes", boxes),
        so_far=so_far,
    )


def region_answers(result: xr.Dataset) -> list[tuple[str, float, float, Floats]]:
    """Name, bound, what is reached and where (n_commanded,), of every component and quantity.

    Of a component's two ends the one that is farther from zero.
    """
    answers: list[tuple[str, float, float, Floats]] = []
    for at, name in enumerate(quantities(result)):
        size, reached = (float(result[f"{k}magnitude"].values[at]) for k in ("", "reached_"))
        answers.append((name, size, reached, np.asarray(result["where_magnitude"].values[at])))
    for at, name in enumerate(components(result)):
        low, high = float(result["lower"].values[at]), float(result["upper"].values[at])
        side = "upper" if not abs(low) > abs(high) else "lower"
        reached = float(result[f"reached_{side}"].values[at])
        bound = high if side == "upper" else low
        where = result["where" if side == "upper" else "where_lower"].values[at]
        answers.append((name, bound, reached, np.asarray(where)))
    return answers


def _unproven_where(machine: Machine, result: xr.Dataset) -> str:
    """Why a region has no proof, and a pose of it where that is so."""
    reason = unproven_text(str(result["status"].values))
    pose = np.asarray(result["where_unproven"].values)
    if not np.isfinite(pose).all():
        return reason
    return say(
        "{reason} at {pose}", reason=reason, pose=pose_text(pose, machine.commanded, machine.shown)
    )


def sentence(machine: Machine, result: xr.Dataset) -> str:
    """A region's answer in words."""
    name, bound, reached, where = region_answers(result)[0]
    if str(result["status"].values) != PROVEN or not np.isfinite(bound):
        return say(
            "No bound is proven over this region: {why}.",
            why=_unproven_where(machine, result),
        )
    unit = machine.shown.error(name)
    most, least = rounded(np.array([bound, reached]) * unit.per_si, (1, -1))
    values = {
        "most": f"{most} {unit.label}",
        "least": f"{least} {unit.label}",
        "pose": pose_text(where, machine.commanded, machine.shown),
    }
    if name == "position":
        return say(
            "Nowhere in this region does the tool deviate more than {most}; {least} is reached "
            "at {pose}.",
            **values,
        )
    return say(
        "Nowhere in this region does the tool turn more than {most}; {least} is reached at {pose}.",
        **values,
    )


def against_target(machine: Machine, result: xr.Dataset) -> list[str]:
    """A region's answer to the accuracy asked, a sentence for each quantity that has a target."""
    asked = {"position": machine.accuracy.target, "orientation": machine.accuracy.angle_target}
    sentences = []
    for name, bound, reached, _ in region_answers(result):
        target = asked.get(name)
        if target is None:
            continue
        unit = machine.shown.error(name)
        said = say(
            "Accuracy asked, {quantity}: {asked}:",
            quantity=word(name),
            asked=machine.accuracy.said(name),
        )
        proven = str(result["status"].values) == PROVEN
        if reached > target:
            sentences.append(say("{said} NOT met: what is reached exceeds it.", said=said))
        elif proven and bound <= target:
            sentences.append(say("{said} met, everywhere in the region.", said=said))
        elif not proven:
            sentences.append(say("{said} undecided, for no bound is proven.", said=said))
        else:
            (least,) = rounded(np.array([reached]) * unit.per_si, (-1,))
            sentences.append(
                say(
                    "{said} undecided, for between {least} and the bound nothing is known; a "
                    "smaller --gap looks closer.",
                    said=said,
                    least=f"{least} {unit.label}",
                )
            )
    return sentences


def unproven_text(status: str) -> str:
    """Why there is no proof, for people."""
    means = {
        "box_too_wide": say("the bands are too wide for a proof"),
        "near_singular": say("too near a singularity for a proof"),
    }
    return means.get(status) or reason_text(status)


IN_SHORT = ("shares_parameter_position", "shares_parameter_orientation", "lacking")
"""Names of the tables that the report prints as well; the page has them all."""


def in_short(study: Study) -> list[Table]:
    """What the report prints of these results."""
    return [table for table in tables(study) if table.name in IN_SHORT]


def tables(study: Study) -> list[Table]:
    """All that the report's page shows of these results."""
    shown: list[Any] = []
    for result, of in (
        (study.monte_carlo, sampled),
        (study.bounds, bounds),
        (study.shares, shares),
    ):
        if result is not None:
            shown += of(study.machine, result)
    lacking = {
        "monte_carlo": say("sampled answer"),
        "ellipses": say("coverage ellipse"),
        "bounds": say("proven bound"),
        "worst_case": say("worst case"),
        "shares": say("shares"),
    }
    rows = tuple((lacking[name], why) for name, why in study.missing.items() if name in lacking)
    if rows:
        shown.append(
            Table("lacking", say("What could not be said, and why"), ("", ""), rows, words=2)
        )
    return shown
