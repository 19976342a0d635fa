"""What went into a result, as tables: machine, condition, sources and parameters."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from truepose.files.shown_units import Shown, ShownUnits
from truepose.language import grouped, marked, say
from truepose.machine.parts import is_body
from truepose.reporting.display import MISSING, nearest_middle, number, pose_text
from truepose.reporting.result import in_file_units
from truepose.reporting.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from truepose.machine import Condition, Machine
    from truepose.machine.families.parameters import FamilyParameters
    from truepose.sources.deviation import Deviation, Source

MOST_DEVIATIONS = 60
TRIED = 1000
"""Poses tried, from the middle outwards, for one that the machine can reach."""


def machine(it: Machine) -> Table:
    """What the machine is: freedoms, closures, parameters, size."""
    rows = [
        (say("name"), it.name),
        (say("freedoms of the platform"), " ".join(it.dof)),
        (say("commanded"), " ".join(it.commanded)),
        *([] if it.family is None else [(say("family"), _family(it.family, it.shown))]),
        (say("drives"), ", ".join(f"{drive.name} ({drive.kind})" for drive in it.drives)),
        (
            say("struts (closures)"),
            f"{len(it.struts)}: " + ", ".join(strut.name for strut in it.struts),
        ),
        *(
            [(say("limbs"), ", ".join(f"{limb.name} ({limb.family})" for limb in it.limbs))]
            if it.limbs
            else []
        ),
        (say("parameters"), str(len(it.parameters))),
        (say("characteristic length"), it.shown.length.text(it.characteristic_length, 6)),
        (say("home"), pose_text(it.home, it.dof, it.shown)),
    ]
    return Table("machine", say("Machine"), ("", ""), tuple(rows), words=2)


def _family(parameters: FamilyParameters, shown: ShownUnits) -> str:
    """Its kind and its parameters; of those that the limbs differ in, their own."""
    texts = [parameters.family.kind]
    for key, values in parameters.family.values().items():
        unit = shown.angle if parameters.dimension(f"family.{key}") == "angle" else shown.length
        distinct = dict.fromkeys(values.reshape(-1).tolist())
        texts.append(f"{key} {', '.join(unit.text(value, 6) for value in distinct)}")
    return "; ".join(texts)


def condition(of: Machine) -> Table:
    """Temperatures, what acts on the tool, the accuracy asked and what `--set` changed."""
    it, asked, units = of.condition, of.accuracy, of.shown
    rows = [
        (say("reference temperature"), _degrees(it.reference_temperature, units)),
        (say("temperature"), _degrees(it.default_temperature, units)),
        *(
            (say("temperature of {part}", part=part), _degrees(value, units))
            for part, value in it.part_temperatures.items()
        ),
        *_log(it),
        *(
            (say("temperature gradient of {part}", part=part), _gradient(part, value))
            for part, value in it.gradients.items()
        ),
        (say("force on the tool"), _vector(it.force, units.force)),
    ]
    if any(it.moment):
        rows.append((say("moment on the tool"), _vector(it.moment, Shown("N m", 1.0))))
    if it.envelope is not None:
        across = (
            ""
            if it.envelope.normal is None
            else " " + say("across {normal}", normal=_vector(it.envelope.normal, Shown("", 1.0)))
        )
        force = say(
            "{force} in any direction{across}",
            force=units.force.text(it.envelope.force, 6),
            across=across,
        )
        rows.append((say("further force on the tool"), force))
    if any(it.acceleration):
        rows.append(
            (say("acceleration of the platform"), _vector(it.acceleration, Shown("m/s²", 1.0)))
        )
    rows += [(key, f"{value}") for key, value in it.source_keys.items()]
    if asked.target is not None:
        rows.append((say("accuracy asked"), asked.said("position")))
    if asked.angle_target is not None:
        rows.append((say("accuracy of angle asked"), asked.said("orientation")))
    rows += [(f"--set {key}", value) for key, value in of.settings.items()]
    return Table("condition", say("Condition"), ("", ""), tuple(rows), words=2)


def _log(it: Condition) -> list[tuple[str, str]]:
    """The temperature log, and the moment in it that a budget is for."""
    log = it.temperature_log
    if log is None:
        return []
    moment = (
        say("its last moment")
        if it.time is None
        else say("at {time} s", time=marked(f"{it.time:.10g}"))
    )
    return [(say("temperature log"), f"{log.name or say('given by the call')}, {moment}")]


def _gradient(part: str, value: tuple[float, float, float]) -> str:
    if is_body(part):
        return _vector(value, Shown("K/m", 1.0))
    gradient = marked(f"{value[0]:.6g}").replace("-", "\N{MINUS SIGN}")
    return say("{gradient} K/m along it", gradient=gradient)


def sources(it: Machine) -> Table:
    """The error sources of the file, and whether they act under this condition."""
    rows = [
        (source.name, say(source.doc), say("yes") if source.acts(it.condition) else say("no"))
        for source in _sources(it)
    ]
    return Table(
        "sources",
        say("Error sources found"),
        (say("source"), say("what it is"), say("acts here")),
        tuple(rows),
        words=3,
        note=say("A source of the file that does nothing under this condition is left out."),
    )


def acting(it: Machine) -> list[Source]:
    """The sources of the file that do something under its condition."""
    return [source for source in _sources(it) if source.acts(it.condition)]


def machine_data(it: Machine) -> dict[str, object]:
    """What the machine is, for programs, in file units."""
    length, unit = in_file_units(it, it.characteristic_length, "m")
    return {
        "name": it.name,
        "file": it.file,
        "hash": it.file_hash,
        "data_files": dict(it.data_files),
        "settings": dict(it.settings),
        "dof": list(it.dof),
        "commanded": list(it.commanded),
        "components": list(it.components),
        "joints": list(it.joints),
        "closures": list(it.closures),
        "parameters": len(it.parameters),
        "characteristic_length": {"value": length, "units": unit},
    }


def source_data(it: Machine) -> list[dict[str, object]]:
    """The sources and what they do at the usable pose nearest the middle, for programs."""
    deviations = {source.name: deviation for source, deviation in _deviations_at_middle(it)}
    listed: list[dict[str, object]] = []
    for source in _sources(it):
        entry: dict[str, object] = {
            "name": source.name,
            "doc": source.doc,
            "acts": source.acts(it.condition),
            "deviations": [],
        }
        if source.name in deviations:
            deviation = deviations[source.name]
            lower, upper = deviation.ends
            entry["deviations"] = [
                {
                    "parameter": it.parameters[parameter],
                    "units": in_file_units(it, 0.0, it.units[parameter])[1],
                    "shift": in_file_units(it, deviation.shift[0, at], it.units[parameter])[0],
                    "half": in_file_units(it, deviation.half[0, at], it.units[parameter])[0],
                    "lower": in_file_units(it, lower[0, at], it.units[parameter])[0],
                    "upper": in_file_units(it, upper[0, at], it.units[parameter])[0],
                }
                for at, parameter in enumerate(deviation.parameters)
            ]
        listed.append(entry)
    return listed


def _sources(it: Machine) -> tuple[Source, ...]:
    return cast("tuple[Source, ...]", it.sources)


def deviations(it: Machine) -> Table:
    """What each source does to which parameter, at the usable pose nearest the middle.

    The known shift and the unknown half band about it; parameters that move alike share a row.
    """
    alike: dict[tuple[str, str, str, str], list[str]] = {}
    rows: list[tuple[str, ...]] = []
    for source, deviation in _deviations_at_middle(it):
        rows += _quantities(it, source.name, deviation)
        for at in np.flatnonzero(~deviation.of_quantities):
            parameter = deviation.parameters[at]
            unit = it.shown.small(it.units[parameter])
            shift = float(deviation.shift[0, at])
            low, high = (number(float(ends[0, at]) * unit.per_si, 3) for ends in deviation.ends)
            band = f"{low} \N{HORIZONTAL ELLIPSIS} +{high}"
            if not deviation.half[0, at]:
                band = MISSING
            elif deviation.ends[0][0, at] == -deviation.ends[1][0, at]:
                band = f"\N{PLUS-MINUS SIGN}{high}"
            key = (source.name, number(shift * unit.per_si, 3), band, unit.label)
            alike.setdefault(key, []).append(it.parameters[parameter])
    rows += [(name, _listed(parameters), *others) for (name, *others), parameters in alike.items()]
    more = (
        " " + say("The first {count} of {every}.", count=MOST_DEVIATIONS, every=grouped(len(rows)))
        if len(rows) > MOST_DEVIATIONS
        else ""
    )
    return Table(
        "deviations",
        say("What the sources do to the parameters"),
        (say("source"), say("parameters"), say("known shift"), say("unknown band"), say("unit")),
        tuple(rows[:MOST_DEVIATIONS]),
        words=2,
        note=say("Actual minus nominal, at the usable pose nearest the middle of the workspace.")
        + more,
    )


def _quantities(it: Machine, source: str, deviation: Deviation) -> Iterator[tuple[str, ...]]:
    """Groups that are the deviation of something by itself, such as a radius: a row each."""
    for group, quantity in deviation.group_quantities.items():
        unit = it.shown.small(quantity.unit)
        half = number(quantity.half * unit.per_si, 3)
        yield (
            source,
            deviation.group_names[group],
            number(quantity.shift * unit.per_si, 3),
            f"\N{PLUS-MINUS SIGN}{half}" if quantity.half else MISSING,
            unit.label,
        )


def _listed(names: list[str]) -> str:
    """Names in words: all of a few, the first and the last of many."""
    if len(names) <= 3:
        return ", ".join(names)
    return say(
        "{first} … {last} ({count} parameters)",
        first=names[0],
        last=names[-1],
        count=len(names),
    )


def _deviations_at_middle(it: Machine) -> list[tuple[Source, Deviation]]:
    from truepose.runs.poses import PoseRun

    sources = acting(it)
    poses = it.poses() if sources else np.empty((0, len(it.commanded)))
    for index in nearest_middle(poses)[:TRIED]:
        for block in PoseRun(it, poses[[index]], it.condition):
            return [(source, source.deviation(it, it.condition, block)) for source in sources]
    return []


def parameters(it: Machine) -> Table:
    """Every parameter with its nominal value."""
    rows = []
    for name, value, unit in zip(it.parameters, it.nominal, it.units, strict=True):
        shown = it.shown.of(unit)
        rows.append((name, number(float(value) * shown.per_si, 6), shown.label))
    return Table(
        "parameters",
        say("Parameters"),
        (say("parameter"), say("nominal value"), say("unit")),
        tuple(rows),
    )


def _degrees(kelvin: float, units: ShownUnits) -> str:
    return marked(f"{float(units.temperature(kelvin)):.6g} {units.degree}")


def _vector(values: tuple[float, ...], unit: Shown) -> str:
    parts = [f"{axis} {value * unit.per_si:.6g}" for axis, value in zip("xyz", values, strict=True)]
    text = ", ".join(marked(part) for part in parts).replace("-", "\N{MINUS SIGN}")
    return f"{text} {unit.label}".rstrip()
