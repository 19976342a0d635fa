"""A circular test for people and as CSV: quantities, causes, where drives turn, readings."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from truepose.files.shown_units import Shown
from truepose.language import marked, say, say_counted
from truepose.reporting.display import column, number
from truepose.reporting.result import Result
from truepose.reporting.result_words import word
from truepose.reporting.table import Table

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

MOST_CAUSES = 12
"""Causes that are listed; files for programs have all."""

WITHIN, NOT_WITHIN = "within", "NOT within"


def tables(machine: Machine, result: xr.Dataset) -> Iterator[Table]:
    """Everything for people."""
    yield quantities(machine, result)
    if not result.attrs.get("within", 1):
        yield explanations(machine, result)
    if result.sizes["turn"]:
        yield turns(machine, result)
    if result.sizes["known_cause"]:
        yield causes(machine, result, "known")
    if result.sizes["uncertain_cause"]:
        yield causes(machine, result, "uncertain")


def summary(machine: Machine, result: xr.Dataset) -> list[tuple[str, str, str]]:
    """What is measured against what the model says: word, its colour (`COLOURS`) and a sentence."""
    if "reading" not in result.sizes:
        return []
    attrs = result.attrs
    percent = marked(f"{100.0 * attrs['probability']:.3g} %")
    share = 100.0 * float(attrs["share_as_far_off"])
    outside = say(
        "{share_outside} % of the readings are outside the {percent} band at their angle",
        share_outside=marked(f"{100.0 * float(attrs['share_outside']):.3g}"),
        percent=percent,
    )
    if attrs["within"]:
        return [
            (
                word(WITHIN),
                "met",
                say(
                    "{file}: as the model says; {share} % of its machines are as far off, or "
                    "farther; {outside}.",
                    file=attrs["measured_file"],
                    share=marked(f"{share:.3g}"),
                    outside=outside,
                ),
            )
        ]
    (first, *_), value, explained = (
        [str(name) for name in result["explanation"].values],
        _explained(machine, result, 0),
        100.0 * float(result["explained_share"].values[0]),
    )
    far = attrs["farthest"] > attrs["farthest_limit"]
    why = (
        say(
            "a reading is {farthest} standard uncertainties from the mean of the machines, of "
            "which {percent} stay below {farthest_limit}",
            farthest=marked(f"{attrs['farthest']:.3g}"),
            percent=percent,
            farthest_limit=marked(f"{attrs['farthest_limit']:.3g}"),
        )
        if far
        else say(
            "no machine of the model draws this: readings are {distance} standard uncertainties "
            "off (rms), {percent} of the machines stay below {distance_limit}",
            distance=marked(f"{attrs['distance']:.3g}"),
            percent=percent,
            distance_limit=marked(f"{attrs['distance_limit']:.3g}"),
        )
    )
    by_all = 100.0 * float(attrs["explained_within_bands"])
    return [
        (
            word(NOT_WITHIN),
            "missed",
            f"{attrs['measured_file']}: {why}; {outside}.",
        ),
        (
            "",
            "none",
            say(
                "{first} off by {value} besides would explain {explained} %.",
                first=first,
                value=value,
                explained=marked(f"{explained:.3g}"),
            ),
        ),
        (
            "",
            "none",
            say(
                "All that has a band explains {by_all} % while it stays plausible.",
                by_all=marked(f"{by_all:.3g}"),
            ),
        ),
    ]


def quantities(machine: Machine, result: xr.Dataset) -> Table:
    """The quantities of the standard."""
    unit = machine.shown.small_length
    percent = marked(f"{100.0 * result.attrs['probability']:.3g} %")
    known, after = (result["known"].values[at] * unit.per_si for at in (0, 1))
    spread = result["standard_uncertainty"].values[0] * unit.per_si
    ends = [result[name].values[0] * unit.per_si for name in ("lower", "upper")]
    header = [
        say("quantity"),
        say("known"),
        say("std. uncertainty"),
        say("{percent} from", percent=percent),
        say("to"),
    ]
    columns = [known, spread, *ends]
    header += [say("known after comp."), say("{percent} from", percent=percent), say("to")]
    columns += [after, *(result[name].values[1] * unit.per_si for name in ("lower", "upper"))]
    shown = [column(values, unit.decimals) for values in columns]
    if "reading" in result.sizes:
        measured, low, high = (
            result[name].values * unit.per_si for name in ("measured", "read_lower", "read_upper")
        )
        header += [say("measured"), say("as the model says")]
        inside = (low <= measured) & (measured <= high)
        shown += [
            column(measured, unit.decimals),
            tuple(say("yes") if fine else say("NO") for fine in inside),
        ]
    names = [str(name) for name in result["quantity_name"].values]
    radius = machine.shown.length.text(float(result.attrs["radius"]), 6)
    step, overshoot = (_angle(machine, float(result.attrs[name])) for name in ("step", "overshoot"))
    return Table(
        "circular test",
        say(
            "Circular test, {plane}, radius {radius}, {unit}",
            plane=result.attrs["plane"],
            radius=radius,
            unit=unit.label,
        ),
        tuple(header),
        tuple(zip(names, *shown, strict=True)),
        note=say(
            "{standard}. G by the narrowest ring (minimum zone), F about the least-squares "
            "centre of both paths; readings every {step}, after an overshoot of {overshoot}.\n"
            "{machines}, seed {seed}. A form is never negative, so that its interval can lie above "
            "what is known of it.",
            standard=result.attrs["standard"],
            step=step,
            overshoot=overshoot,
            machines=say_counted(
                "{count} machine", "{count} machines", int(result.attrs["samples"])
            ),
            seed=result.attrs["seed"],
        ),
    )


def causes(machine: Machine, result: xr.Dataset, kind: str) -> Table:
    """Who is to blame, ranked: of the `known` error, or of what is `uncertain`."""
    unit = machine.shown.small_length
    chosen = slice(0, MOST_CAUSES)
    names = [str(name) for name in result[f"{kind}_cause"].values]
    shown = [
        [*names[chosen]],
        column(result[f"{kind}_form"].values[chosen] * unit.per_si, unit.decimals),
        column(result[f"{kind}_radius"].values[chosen] * unit.per_si, unit.decimals),
        column(result[f"{kind}_share"].values[chosen] * 100.0, 1),
    ]
    header = [
        say("cause"),
        say("G(b) alone, {unit}", unit=unit.label),
        say("D alone, {unit}", unit=unit.label),
        say("share, %"),
    ]
    title = say("Causes of the known error")
    note = say(
        "As commanded. Share: of the sum of squares of F; causes that work against each "
        "other have shares beyond 100 % and below 0."
    )
    if kind == "known":
        header.append(say("looks like"))
        shown.append([str(shape) for shape in result["known_shape"].values[chosen]])
    else:
        header[0:3] = [
            say("not known"),
            say("form, {unit} rms", unit=unit.label),
            f"D, {unit.label}",
        ]
        title = say("What makes the test uncertain")
        note = say("Standard uncertainties, to first order. Share: of the variance of F.")
    more = len(names) - MOST_CAUSES
    if more > 0:
        note += "\n" + say_counted(
            "And {count} more cause: --output writes all.",
            "And {count} more causes: --output writes all.",
            more,
        )
    return Table(
        f"{kind} causes",
        title,
        tuple(header),
        tuple(zip(*shown, strict=True)),
        note=note,
    )


def turns(machine: Machine, result: xr.Dataset) -> Table:
    """Where drives turn round."""
    unit, turn = machine.shown.small_length, machine.shown.angle
    rows = []
    angles, steps = result["turn_angle"].values, result["turn_step"].values
    drives, ways = result["turn_drive"].values, result["turn_direction"].values
    for at in range(0, result.sizes["turn"], 2):
        there, back = (number(steps[at + way] * unit.per_si, unit.decimals) for way in (0, 1))
        rows.append((str(drives[at]), number(angles[at] * turn.per_si, 2), there, back))
    assert [str(way) for way in ways[:2]] == ["counter-clockwise", "clockwise"]
    return Table(
        "turns",
        say("Where drives turn round, and what the radius does there"),
        (
            say("drive"),
            say("at, {unit}", unit=turn.label),
            say("counter-clockwise, {unit}", unit=unit.label),
            say("clockwise, {unit}", unit=unit.label),
        ),
        tuple(rows),
        note=say(
            "The step of what is known, outwards positive: of play that friction leaves open, "
            "and of reversal in a table. Where a load presses the drive to one side there is "
            "none."
        ),
    )


def explanations(machine: Machine, result: xr.Dataset) -> Table:
    """Which parameter, off besides what the file says, would explain the readings."""
    rows = []
    for at, name in enumerate(result["explanation"].values[:MOST_CAUSES]):
        alike = [word for word in str(result["explanation_alike"].values[at]).split(", ") if word]
        named = ", ".join(alike[:3]) + (
            " " + say("and {count} more", count=len(alike) - 3) if len(alike) > 3 else ""
        )
        bands = float(result["explained_bands"].values[at])
        rows.append(
            (
                str(name),
                named,
                number(float(result["explained_share"].values[at]) * 100.0, 1),
                _explained(machine, result, at),
                number(bands, 1) if np.isfinite(bands) else say("no band"),
            )
        )
    return Table(
        "explanations",
        say("What would explain the difference from the known error"),
        (
            say("parameter"),
            say("this test cannot tell it from"),
            say("explains, %"),
            say("off by"),
            say("std. uncertainties"),
        ),
        tuple(rows),
        words=2,
        note=say(
            "Each alone, by least squares. --readings FILE.csv writes the readings for `truepose "
            "calibrate`, which finds parameters together."
        ),
    )


def _angle(machine: Machine, value: float) -> str:
    return machine.shown.angle.text(value).replace(" °", "°")


def _explained(machine: Machine, result: xr.Dataset, at: int) -> str:
    si = str(result["explanation_units"].values[at])
    unit: Shown = machine.shown.small(si)
    return f"{number(float(result['explained_value'].values[at]) * unit.per_si, 1)} {unit.label}"


def csv_text(result: Result) -> Iterator[str]:
    """A row for each state and quantity; each state, direction and angle; each reading."""
    known, spread = result.values("known"), result.values("standard_uncertainty")
    low, high = result.values("lower"), result.values("upper")
    length = known.unit()
    angles, ways = result.values("angle"), result.labels("direction")
    rows: list[list[object]] = [
        [
            "of",
            "state",
            "name",
            f"angle [{angles.unit()}]",
            f"known [{length}]",
            f"standard_uncertainty [{length}]",
            f"lower [{length}]",
            f"upper [{length}]",
            f"measured [{length}]",
        ]
    ]
    measured = "reading" in result.dataset.sizes
    read = result.values("measured").array if measured else None
    states, names = result.labels("state"), result.labels("quantity")
    for state, called in enumerate(states):
        for at, name in enumerate(names):
            values = [one.array[state, at] for one in (known, spread, low, high)]
            own = "" if read is None or state else read[at]
            rows.append(["quantity", called, name, "", *values, own])
    radial = [result.values(f"radial_{name}").array for name in ("known", "lower", "upper")]
    for state, called in enumerate(states):
        for way, name in enumerate(ways):
            for at, angle in enumerate(angles.array):
                middle, *ends = (values[state, way, at] for values in radial)
                rows.append(["radial deviation", called, name, angle, middle, "", *ends, ""])
    if measured:
        measured_radial = result.values("radial_measured").array
        there = result.values("reading_angle").array
        for name, angle, value in zip(
            result.labels("reading_direction"), there, measured_radial, strict=True
        ):
            rows.append(["reading", states[0], name, angle, "", "", "", "", value])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    yield text.getvalue()
