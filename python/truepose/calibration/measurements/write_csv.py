"""`Measurements` -> a file that is read back to the same numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.instruments import FRAME_FREEDOMS, REGISTRY, Frame, Instrument
from truepose.calibration.measurements.assembly_modes import HOME, OTHER, in_other_mode
from truepose.calibration.measurements.columns import TO, UNCERTAINTY, WRENCH, reading_columns
from truepose.calibration.measurements.measurements import Measurements
from truepose.calibration.measurements.read_csv import (
    ASSEMBLY_MODE,
    CHECK,
    FIT,
    INSTRUMENT,
    SET,
)
from truepose.calibration.observables import OBSERVABLES, si_unit
from truepose.errors import Problem, RequestError
from truepose.files.dimensions import BY_UNIT, DIMENSIONS
from truepose.files.units import FileUnit, meant, unit_of
from truepose.files.writing import replacing
from truepose.machine import Condition, Machine
from truepose.machine.condition import DEFAULT_PART


def write_measurements(path: str | Path, machine: Machine, measurements: Measurements) -> None:
    """Write measurements of a machine, in its units, as `read_measurements` reads them.

    The file is written whole or not at all. Joints stand in it, not poses. A row's condition must
    be one that a file can say: temperatures of parts, force and moment on the tool.

    Raises `RequestError` (bad-measurements, output-not-writable).
    """
    text = measurements_text(machine, measurements)
    with replacing(Path(path)) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def measurements_text(machine: Machine, measurements: Measurements) -> str:
    """What `write_measurements` writes. Raises `RequestError` (bad-measurements)."""
    head = [f"#: machine = {_quoted(machine.name)}"]
    for instrument in measurements.instruments:
        head += _declared(machine, instrument)
    columns = _Columns(machine)
    columns.words(INSTRUMENT, _names(measurements))
    for joint, drive in enumerate(machine.drives):
        commanded = np.where(measurements.posed, measurements.joints[:, joint], math.nan)
        columns.numbers(f"joint.{drive.name}", drive.coordinate, commanded)
        if measurements.other_joints is not None:
            between = measurements.between
            second = np.where(between, measurements.other_joints[:, joint], math.nan)
            columns.numbers(f"{TO}joint.{drive.name}", drive.coordinate, second)
    _readings(machine, measurements, columns)
    _conditions(machine, measurements, columns)
    other = in_other_mode(machine, measurements.joints, measurements.placements)
    if other.any():
        columns.words(ASSEMBLY_MODE, [OTHER if each else HOME for each in other.tolist()])
    columns.words(SET, [CHECK if held_out else FIT for held_out in measurements.held_out.tolist()])
    return "\n".join([*head, *columns.lines(), ""])


def _names(measurements: Measurements) -> list[str]:
    return [measurements.instruments[number].name for number in measurements.instrument.tolist()]


def _declared(machine: Machine, instrument: Instrument) -> list[str]:
    """The lines that declare one instrument."""
    kind = REGISTRY[instrument.kind]
    lines = [f"[instrument.{instrument.name}]", f'kind = "{instrument.kind}"']
    if kind.frame is not None and instrument.end == "base":
        lines.append(_frame(machine, instrument.frame))
    uncertain = any(instrument.target_uncertainty)
    if kind.has_target and (instrument.target_unknown or any(instrument.target) or uncertain):
        start = _texts(machine, instrument.target, "length")
        known = _texts(machine, instrument.target_uncertainty, "length")
        unknown_too = f"{{ start = {start}, unknown = true }}"
        with_uncertainty = f"{{ start = {start}, uncertainty = {known} }}" if uncertain else start
        lines.append(f"target = {unknown_too if instrument.target_unknown else with_uncertainty}")
    if instrument.bias_unknown:
        lines.append('bias = "unknown"')
    words = {observable: word for word, observable in kind.reads.items()} or {
        observable: observable for observable in kind.fixed
    }
    stated = []
    for observable, word in words.items():
        amount = instrument.uncertainty_of(observable)
        if amount is not None:
            (text,) = _quantity_texts(machine, [amount], BY_UNIT[si_unit(observable)])
            stated.append(f'"{word}" = {text}')
    if stated:
        lines.append(f"uncertainty = {{ {', '.join(stated)} }}")
    if "axis" in kind.keys:
        lines.append(f"axis = {list(map(float, instrument.axis))}")
        lines.append(f"zero = {list(map(float, instrument.zero))}")
        lines.append(f'end = "{instrument.end}"')
    return [f"#: {line}" for line in lines]


def _frame(machine: Machine, frame: Frame) -> str:
    """The line of a frame; its rotation as a quaternion, because angles would round it."""
    parts = []
    if any(frame.origin):
        parts.append(f"origin = {_texts(machine, frame.origin, 'length')}")
    if frame.rotation != Frame().rotation:
        parts.append(f"rotation = {_texts(machine, frame.rotation, 'ratio')}")
    if any(frame.unknown):
        flags = zip(FRAME_FREEDOMS, frame.unknown, strict=True)
        names = [f'"{name}"' for name, flag in flags if flag]
        parts.append(f"unknown = [{', '.join(names)}]")
    return f"frame = {{ {', '.join(parts)} }}" if parts else 'frame = "base"'


def _texts(machine: Machine, values: Iterable[float], dimension: str) -> str:
    return f"[{', '.join(_quantity_texts(machine, values, dimension))}]"


def _quantity_texts(machine: Machine, values: Iterable[float], dimension: str) -> list[str]:
    """Values as text with their unit."""
    unit = _unit(machine, dimension)
    numbers = _in_file(np.array(list(values), np.float64), unit)
    if dimension == "ratio":
        return [repr(number) for number in numbers.tolist()]
    return [f'"{number!r} {unit.label}"' for number in numbers.tolist()]


def _unit(machine: Machine, dimension: str) -> FileUnit:
    """The machine's unit where a header can name it, else that of SI."""
    unit = machine.file_units.get(dimension, FileUnit(DIMENSIONS[dimension].si))
    return unit if not set(unit.label) & set("()[],\n\"'") else _si(dimension)


def _si(dimension: str) -> FileUnit:
    wanted = DIMENSIONS[dimension]
    return unit_of(wanted.si, wanted)


def _in_file(values: Floats, unit: FileUnit) -> Floats:
    """Numbers in a file's unit which are, read back, the same in SI, where there are such.

    Where the next double is a number of few digits, it is that one.
    """
    computed = unit.to_file_exactly(values)
    result = computed
    for neighbour in (-math.inf, math.inf):
        for step in (1, 2):
            near = computed
            for _ in range(step):
                near = np.nextafter(near, neighbour)
            result = np.where(unit.to_si(result) == values, result, near)
    result = np.where(unit.to_si(result) == values, result, computed)
    few = meant(result)
    return np.where(np.abs(few - result) <= np.spacing(np.abs(result)), few, result)


class _Columns:
    """Columns of a file, cells as text."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._names: list[str] = []
        self._cells: list[list[str]] = []

    def words(self, name: str, cells: list[str]) -> None:
        """A column of words."""
        self._names.append(name)
        self._cells.append(cells)

    def numbers(self, name: str, dimension: str, values: Floats) -> None:
        """A column of numbers (n_row,), SI; NaN is a blank cell."""
        unit = _unit(self._machine, dimension)
        self._names.append(name if dimension == "ratio" else f"{name} ({unit.label})")
        blank = np.isnan(values)
        numbers = _in_file(np.where(blank, 1.0, values), unit).tolist()
        self._cells.append(
            ["" if no else repr(number) for number, no in zip(numbers, blank.tolist(), strict=True)]
        )

    def lines(self) -> list[str]:
        """The header and a line for each row."""
        return [", ".join(row) for row in [self._names, *zip(*self._cells, strict=True)]]


def _readings(machine: Machine, measurements: Measurements, columns: _Columns) -> None:
    """The columns of readings, each with its uncertainties."""
    kinds = [REGISTRY[instrument.kind] for instrument in measurements.instruments]
    instrument_of = measurements.instrument[measurements.row]
    written: set[tuple[str, int]] = set()
    for name, reading in reading_columns(machine).items():
        if (reading.word, reading.strut) in written:
            continue  # a group's: what is measured of it stands under its member's name
        written.add((reading.word, reading.strut))
        value = np.full(measurements.n_row, math.nan)
        stated = np.full(measurements.n_row, math.nan)
        silent = True
        for number, kind in enumerate(kinds):
            observable = kind.reads.get(reading.word)
            if observable is None and reading.word in kind.fixed:
                observable = reading.word
            if observable is None:
                continue
            which = (
                (instrument_of == number)
                & (measurements.observable == OBSERVABLES.index(observable))
                & (measurements.strut == reading.strut)
            )
            rows = measurements.row[which]
            stated[rows] = measurements.uncertainty[which]
            if reading.word in kind.reads:
                value[rows] = measurements.value[which]
                silent = silent and not which.any()
            elif np.any(measurements.value[which] != 0.0):
                raise RequestError(
                    _bad(
                        "value",
                        f"a value other than 0 of {measurements.instruments[number].name}",
                        f"zeros: an instrument of kind {kind.name} has no column of readings",
                    )
                )
        if not silent:
            columns.numbers(name, reading.dimension, value)
        if not np.isnan(stated).all():
            columns.numbers(name + UNCERTAINTY, reading.dimension, stated)


def _conditions(machine: Machine, measurements: Measurements, columns: _Columns) -> None:
    """The columns of temperatures and loads, those that say something."""
    posed = measurements.posed
    conditions = measurements.conditions
    reference = machine.condition.reference_temperature
    for condition in {id(condition): condition for condition in conditions}.values():
        lost = _lost(machine, condition)
        if lost is not None:
            raise RequestError(_bad("conditions", lost, "temperatures, force and moment only"))
    defaults = np.array([condition.default_temperature for condition in conditions])
    if (defaults != reference).any():
        of_poses = np.where(posed, defaults, math.nan)
        columns.numbers(f"temperature.{DEFAULT_PART}", "temperature", of_poses)
    named = dict.fromkeys(part for condition in conditions for part in condition.part_temperatures)
    for part in named:
        values = [condition.part_temperatures.get(part, math.nan) for condition in conditions]
        of_poses = np.where(posed, np.array(values), math.nan)
        columns.numbers(f"temperature.{part}", "temperature", of_poses)
    wrenches = np.array([condition.wrench for condition in conditions]).reshape(-1, 6)
    for component, (name, dimension) in enumerate(WRENCH.items()):
        if wrenches[:, component].any():
            columns.numbers(name, dimension, np.where(posed, wrenches[:, component], math.nan))


def _lost(machine: Machine, condition: Condition) -> str | None:
    """What a condition says that no column can; None where nothing."""
    of_machine = machine.condition
    lost = {
        "gradients of temperature": bool(condition.gradients),
        "a temperature log": condition.temperature_log is not None,
        "an envelope of forces": condition.envelope is not None,
        "another reference temperature": condition.reference_temperature
        != of_machine.reference_temperature,
        "another gravity": condition.gravity != of_machine.gravity,
        "another acceleration": condition.acceleration != of_machine.acceleration,
        "other keys of error sources": condition.source_keys != of_machine.source_keys,
    }
    return next((phrase for phrase, there in lost.items() if there), None)


def _quoted(text: str) -> str:
    """A TOML basic string."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'


def _bad(path: str, found: str, expected: str) -> Problem:
    return Problem(
        "bad-measurements",
        f"{path}: a file of measurements cannot say this",
        path=path,
        found=found,
        expected=expected,
    )
