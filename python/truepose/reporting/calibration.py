"""The tables of a calibration: what is suspected, what was found, how sure, what to do next."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.acceptance.sentences import listed, quantity, sentence
from truepose.calibration.identification.robust import OUTLIER
from truepose.files.shown_units import Shown, ShownUnits
from truepose.language import marked, say
from truepose.reporting.display import MISSING, decimals_for, number, where_highest
from truepose.reporting.result_words import word
from truepose.reporting.table import Table
from truepose.reporting.tables import MOST_LISTED

if TYPE_CHECKING:
    import xarray as xr

    from truepose.reporting.result import Result

MOST_UNKNOWNS = 100
"""Rows of the table of unknowns; those whose tolerance says least of what was found go first."""
BAR = 10
"""Characters of a full bar."""
FEW = 0.1
"""Share of the readings up to which those that do not fit are odd ones."""
FOLDED = 0.05
"""Below this share of the measurements in a value it is told with all its like in one row."""
RESTS = 0.5
"""Below this share of the measurements in a value it rests on its tolerance."""


def tables(result: xr.Dataset, units: ShownUnits) -> list[Table]:
    """All that there is to say, in the order of the terminal, where the last is seen first."""
    return _there(
        suspicions(result),
        outliers(result),
        unknowns(result, units),
        instruments(result, units),
        undetermined(result),
        residuals(result, units),
        tool(result, units),
        warning_lines(result),
        next_measurement(result, units),
    )


def of_page(result: xr.Dataset, units: ShownUnits) -> list[Table]:
    """The same for the page, where the first are seen first."""
    return _there(
        suspicions(result),
        undetermined(result),
        next_measurement(result, units),
        warning_lines(result),
        tool(result, units),
        residuals(result, units),
        unknowns(result, units, bars=False),
        instruments(result, units),
        outliers(result),
    )


def _there(*every: Table | None) -> list[Table]:
    return [table for table in every if table is not None]


def json_attribute(result: xr.Dataset, name: str) -> Any:
    """An attribute that holds JSON; None where there is nothing."""
    text = str(result.attrs[name])
    return json.loads(text) if text else None


def suspicions(result: xr.Dataset) -> Table | None:
    """What the measurements look like before anything is fitted."""
    rows = [
        (
            suspicion["code"],
            say("yes") if suspicion["refuses"] else say("no"),
            suspicion["sentence"],
        )
        for suspicion in json_attribute(result, "suspicions")
    ]
    if not rows:
        return None
    return Table(
        "suspicions",
        say("What the measurements look like"),
        (say("suspicion"), say("refused for it"), say("why")),
        tuple(rows),
        words=3,
        note=say("Suspected, not repaired: the fit below is of the measurements as they are."),
    )


def outliers(result: xr.Dataset) -> Table | None:
    """Readings that do not fit, the worst first."""
    every = json_attribute(result, "outliers")
    if not every:
        return None
    in_file = any(row["line"] for row in every)
    rows = [
        (
            row["instrument"],
            row["what"],
            str(row["line"] if in_file else row["row"]),
            number(row["sigmas"], 1),
        )
        for row in every[:MOST_LISTED]
    ]
    note = say("They count less in the fit, unless the robust loss is switched off.")
    if not odd_readings(result).any():
        note = say(
            "{count} of {every} readings: these are no odd ones, the data or the model "
            "are wrong as a whole.",
            count=len(every),
            every=result.attrs["observations"],
        )
    if len(every) > len(rows):
        note += " " + say(
            "{count} more are in the files for programs.", count=len(every) - len(rows)
        )
    return Table(
        "outliers",
        say("Readings that do not fit"),
        (
            say("instrument"),
            say("reading"),
            say("line") if in_file else say("row"),
            say("standard deviations"),
        ),
        tuple(rows),
        words=2,
        note=note,
    )


def unknowns(result: xr.Dataset, shown_in: ShownUnits, *, bars: bool = True) -> Table:
    """What was found of the machine, and how much of it the measurements say, with bars of text."""
    values = {
        name: result[name].values
        for name in (
            "value", "standard_uncertainty", "prior_uncertainty", "data_share", "nominal",
            "identified",
        )
    }  # fmt: skip
    units = [str(unit) for unit in result["unknown_units"].values]
    folded = _folded(result)
    shown = _shown(result, folded)
    rows = []
    for at in shown:
        unit = units[at]
        share = float(values["data_share"][at])
        rows.append(
            (
                str(result["unknown_label"].values[at]),
                _flag_words(_flag(result, at))[0],
                _value(float(values["nominal"][at]), unit, shown_in),
                _value(float(values["identified"][at]), unit, shown_in),
                signed(float(values["value"][at]), unit, shown_in),
                _uncertainty(float(values["prior_uncertainty"][at]), unit, shown_in),
                _uncertainty(float(values["standard_uncertainty"][at]), unit, shown_in),
                f"{bar(share)} {100.0 * share:4.0f}" if bars else f"{100.0 * share:.0f}",
            )
        )
    more = result.sizes["unknown"] - len(rows) - len(folded)
    if folded:
        few = say("less than {percent}", percent=marked(f"{100.0 * FOLDED:.0f}"))
        label = (
            say("{count} others rest on their tolerances", count=len(folded))
            if rows
            else say("{count} unknowns rest on their tolerances", count=len(folded))
        )
        rows.append((label, "", "", "", "", "", "", few))
    note = say(
        "±: standard uncertainty. From the data: how much of the value the measurements say; "
        "the rest is its tolerance."
    )
    flags = dict.fromkeys(flag for flag in (_flag(result, at) for at in shown) if flag)
    note += "".join(f" {sentence(flag)}: {meaning}." for flag, meaning in map(_flag_words, flags))
    if more:
        note += " " + say("{count} more are in the files for programs.", count=more)
    return Table(
        "unknowns",
        say("What was found"),
        (
            "", "", say("nominal"), say("identified"), say("change"),
            say("± before"), say("± after"), say("from the data, %"),
        ),
        tuple(rows),
        words=2,
        note=note,
    )  # fmt: skip


def _folded(result: xr.Dataset) -> list[int]:
    """Unknowns told in one row: of what was measured next to nothing is in them.

    None that is open, less certain than its tolerance or off it, and one alone is told as it is.
    """
    rest = [
        at
        for at, share in enumerate(result["data_share"].values.tolist())
        if share < FOLDED and _flag(result, at) == "mostly tolerance"
    ]
    return rest if len(rest) > 1 else []


def _shown(result: xr.Dataset, folded: Sequence[int]) -> list[int]:
    """Unknowns with a row of their own, in their order."""
    own = np.setdiff1d(np.arange(result.sizes["unknown"]), np.asarray(folded, np.intp))
    order = np.argsort(-result["data_share"].values[own], kind="stable")[:MOST_UNKNOWNS]
    return sorted(own[order].tolist())


def _flag(result: xr.Dataset, at: int) -> str:
    off = abs(float(result["value"].values[at]) - float(result["prior_mean"].values[at]))
    half = float(result["prior_half"].values[at])
    after = float(result["standard_uncertainty"].values[at])
    if not math.isfinite(after):
        return "open"
    if after > float(result["prior_uncertainty"].values[at]):
        return "less certain"
    if math.isfinite(half) and off > half:
        return "off tolerance"
    if float(result["data_share"].values[at]) < RESTS:
        return "mostly tolerance"
    return ""


def _flag_words(flag: str) -> tuple[str, str]:
    """A flag for people, and what it means."""
    words = {
        "": ("", ""),
        "open": (say("open"), say("nothing determines it")),
        "less certain": (
            say("less certain"),
            say("the tolerance says more than the measurements"),
        ),
        "off tolerance": (say("off tolerance"), say("the value is not within its tolerance")),
        "mostly tolerance": (
            say("mostly tolerance"),
            say("the measurements say less than half of the value"),
        ),
    }
    return words[flag]


def bar(share: float) -> str:
    """A share as a bar of blocks."""
    filled = round(BAR * share) if math.isfinite(share) else 0
    return "█" * filled + "░" * (BAR - filled)


def _value(value: float, unit: str, units: ShownUnits) -> str:
    if not math.isfinite(value):
        return MISSING
    if unit not in ("m", "rad", "1"):
        return quantity(value, unit, 4)
    shown = units.of(unit)
    return f"{number(value * shown.per_si, 4)} {shown.label}".rstrip()


def signed(value: float, unit: str, units: ShownUnits) -> str:
    """A change with its sign: "+0.456 mm", "−12.0 µm"."""
    if not math.isfinite(value):
        return MISSING
    text = quantity(value, unit, 3, units)
    return text if value <= 0.0 else f"+{text}"


def _uncertainty(value: float, unit: str, units: ShownUnits) -> str:
    return say("open") if math.isinf(value) else quantity(value, unit, units=units)


def instruments(result: xr.Dataset, units: ShownUnits) -> Table | None:
    """Where the instruments stand, their targets, what they add."""
    values = result["instrument_value"].values
    if not values.size:
        return None
    rows = [
        (
            str(result["instrument_unknown_label"].values[at]),
            signed(float(value), str(result["instrument_unknown_units"].values[at]), units),
            _uncertainty(
                float(result["instrument_uncertainty"].values[at]),
                str(result["instrument_unknown_units"].values[at]),
                units,
            ),
        )
        for at, value in enumerate(values)
    ]
    return Table(
        "instruments",
        say("What was found of the instruments"),
        ("", say("from where it was looked for"), say("uncertainty")),
        tuple(rows),
        note=say("Open: moving the instrument does what moving the whole machine does."),
    )


def undetermined(result: xr.Dataset) -> Table | None:
    """What could not be determined, in sentences."""
    rows = [(f"{sentence(direction)}.",) for direction in json_attribute(result, "undetermined")]
    if not rows:
        return None
    condition = float(result.attrs["condition_number"])
    ranks = {"rank": result.attrs["rank"], "every": result.sizes["unknown"]}
    if math.isfinite(condition):
        seen = say(
            "Rank of the identification Jacobian: {rank} of {every}, condition number {condition}.",
            condition=marked(f"{condition:.3g}"),
            **ranks,
        )
    else:
        seen = say("Rank of the identification Jacobian: {rank} of {every}.", **ranks)
    return Table(
        "undetermined",
        say("What could not be determined"),
        ("",),
        tuple(rows),
        note=seen,
    )


def residuals(result: xr.Dataset, shown_in: ShownUnits) -> Table:
    """Root mean squares of what was read less what was predicted, for each instrument and unit."""
    instrument = result["row_instrument"].values[result["observation_row"].values]
    units = result["observation_units"].values
    names = result["observation_what"].values
    sigma = result["uncertainty"].values
    named = odd_readings(result)
    rows = []
    for name, unit in dict.fromkeys(zip(instrument.tolist(), units.tolist(), strict=True)):
        mine = (instrument == name) & (units == unit)
        scale = Shown("", 1.0) if unit == "1" else shown_in.small(unit)
        factor, shown = scale.per_si, scale.label
        what = listed(list(dict.fromkeys(_without_strut(name) for name in names[mine].tolist())))
        mine &= ~named
        sizes = [
            rms(result[key].values[mine] * (sigma[mine] if normalised else 1.0)) * factor
            for key, normalised in (
                ("residual_before", False),
                ("residual_after", False),
                ("held_out_before", True),
                ("held_out_after", True),
            )
        ]
        places = 6 if unit == "1" else decimals_for([size for size in sizes if size == size], 4)
        rows.append(
            (
                str(name),
                f"{what}, {shown}".rstrip(", "),
                str(int(mine.sum())),
                number(rms(sigma[mine]) * factor, places),
                *(number(size, places) for size in sizes),
                number(rms(result["normalised_after"].values[mine]), 2),
            )
        )
    kind, folds = result.attrs["validation"], result.attrs["folds"]
    how = {
        "none": say("Too few rows to hold any out."),
        "folds": say(
            "Held out: each of {folds} folds of the rows predicted by the others.", folds=folds
        ),
        "stated set": say("Held out: the rows that the file keeps from the fit."),
    }[kind]
    before = say("Before: the machine as filed, the instruments placed as fits it best.")
    note = f"{how} {before}"
    if named.any():
        note += " " + say("Without the readings named as not fitting.")
    return Table(
        "residuals",
        say("Measurements against the machine, root mean square"),
        (
            say("instrument"), say("readings"), say("number"), say("stated"),
            say("before"), say("after"), say("held out, before"), say("held out, after"),
            say("after / stated"),
        ),
        tuple(rows),
        words=2,
        note=note,
        says=say(
            "{instrument}: the residuals go from {before} to {after} ({what}).",
            instrument=rows[0][0], before=rows[0][4], after=rows[0][5], what=rows[0][1],
        ),
    )  # fmt: skip


def odd_readings(result: xr.Dataset) -> np.ndarray:
    """(n_observation,) readings that do not fit, where they are few: none where many do not."""
    sizes = result["standardised"].values
    flags: np.ndarray = np.abs(sizes) >= OUTLIER
    return flags if flags.sum() <= FEW * np.isfinite(sizes).sum() else np.zeros_like(flags)


def _without_strut(what: str) -> str:
    """A reading without its strut: "strut.a1.length" is a length."""
    return what.split(".", 2)[2] if what.startswith("strut.") else what


def rms(values: Floats) -> float:
    """Root mean square of those that are there; NaN where none is."""
    there = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(there**2))) if there.size else float("nan")


def tool(result: xr.Dataset, units: ShownUnits) -> Table:
    """Standard uncertainty at the tool before and after, over the workspace."""
    rows = []
    names = [str(name) for name in result["quantity"].values]
    for at, name in enumerate(names):
        unit = units.error(name)
        rows.append(
            (
                f"{word(name)}, {unit.label}",
                *_of_tool(
                    result["tool_size_before"].values[:, at] * unit.per_si,
                    result["tool_size_after"].values[:, at] * unit.per_si,
                ),
            )
        )
    for at, component in enumerate(result["component"].values):
        unit = units.error(str(component))
        before, after = (
            result[f"tool_{when}"].values[:, at] * unit.per_si for when in ("before", "after")
        )
        rows.append((f"{component}, {unit.label}", *_of_tool(before, after)))
    note = say("Standard uncertainty of where the tool is, over the poses of the workspace.")
    if result.attrs["relative"]:
        note += " " + say(
            "Where the machine as a whole stands in the instrument's frame is not in it."
        )
    return Table(
        "tool",
        say("Uncertainty of the tool"),
        (
            "",
            say("worst before"),
            say("worst after"),
            say("rms before"),
            say("rms after"),
            say("after / before"),
        ),
        tuple(rows),
        note=note,
        says=say(
            "At the worst pose the standard uncertainty ({quantity}) goes from {before} to "
            "{after}.",
            quantity=rows[0][0],
            before=rows[0][1],
            after=rows[0][2],
        ),
    )


def _of_tool(before: Floats, after: Floats) -> tuple[str, ...]:
    sizes = [_worst(before), _worst(after), _rms_or_open(before), _rms_or_open(after)]
    places = decimals_for([size for size in sizes if math.isfinite(size)], 4)
    ratio = sizes[1] / sizes[0] if sizes[0] > 0.0 and math.isfinite(sizes[1]) else float("nan")
    return (
        *(say("open") if math.isinf(size) else number(size, places) for size in sizes),
        number(ratio, 2),
    )


def _worst(sizes: Floats) -> float:
    if np.isnan(sizes).all():
        return float("nan")
    return (
        float(sizes[where_highest(sizes)]) if np.isfinite(sizes).all() else float(np.nanmax(sizes))
    )


def _rms_or_open(sizes: Floats) -> float:
    return float("inf") if np.isinf(sizes).any() else rms(sizes)


def warning_lines(result: xr.Dataset) -> Table | None:
    """Warnings."""
    rows = [
        (f"{sentence(warning['sentence'])}.",) for warning in json_attribute(result, "warnings")
    ]
    return Table("heed", say("Warnings"), ("",), tuple(rows)) if rows else None


def next_measurement(result: xr.Dataset, units: ShownUnits) -> Table | None:
    """The cheapest measurement that would turn the verdict."""
    remedy = json_attribute(result, "remedy")
    if remedy is None:
        return None
    note = ""
    then = [
        say(
            "its {quantity} known to {size}",
            quantity=word(what),
            size=quantity(remedy[name], unit, units=units),
        )
        for what, name, unit in (
            ("position", "position", "m"),
            ("orientation", "rotation", "rad"),
        )
        if remedy[name]
    ]
    if then:
        note = say("With it the tool would have {known} at the worst pose.", known=listed(then))
    rows = ((f"{sentence(remedy['sentence'])}.",),)
    return Table("next", say("Recommended next measurement"), ("",), rows, note=note)


def csv_text(result: Result) -> Iterator[str]:
    """One row for each unknown, in the machine file's units; those of instruments last."""
    found = result.dataset
    names = [name for name in result.variables() if found[name].dims == ("unknown",)]
    columns = {name: result.values(name) for name in names}
    instrument = {
        "value": result.values("instrument_value"),
        "standard_uncertainty": result.values("instrument_uncertainty"),
    }
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(["of", "unknown", "label", "units", *names])
    for at, name in enumerate(found["unknown"].values.tolist()):
        cells = [_cell(columns[column].array[at]) for column in names]
        unit = _unit(columns["value"], at)
        writer.writerow(["machine", name, found["unknown_label"].values[at], unit, *cells])
    for at, name in enumerate(found["instrument_unknown"].values.tolist()):
        cells = [
            _cell(instrument[column].array[at]) if column in instrument else "" for column in names
        ]
        unit = _unit(instrument["value"], at)
        label = found["instrument_unknown_label"].values[at]
        writer.writerow(["instrument", name, label, unit, *cells])
    yield buffer.getvalue()


def _unit(values: Any, at: int) -> str:
    return str(values.unit(at) if values.mixed else values.units[0])


def _cell(value: Any) -> str:
    return repr(float(value)) if math.isfinite(value) else ""
