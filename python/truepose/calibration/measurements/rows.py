"""What was measured, by columns -> `Measurements`: every row checked, every reading in its place.

The reader of files and the maker from arrays both end here, so that both refuse the same.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.instruments import REGISTRY, Instrument, Kind
from truepose.calibration.instruments._base import moved
from truepose.calibration.measurements.assembly_modes import (
    NO_OTHER_MODE,
    stand_in_other_modes,
)
from truepose.calibration.measurements.columns import (
    UNCERTAINTY,
    WRENCH,
    MeasurementRows,
    ReadingColumn,
    Report,
    reading_columns,
)
from truepose.calibration.measurements.commanded_poses import commanded_poses
from truepose.calibration.measurements.measurements import Measurements, unloaded_at_reference
from truepose.calibration.observables import OBSERVABLES
from truepose.errors import Fault
from truepose.files.wording import counted, one_of
from truepose.machine import Condition, Machine
from truepose.machine.condition import DEFAULT_PART

ABOVE_ZERO = ("length", "distance", "separation")
"""Observables that no instrument reads as zero or less."""

UNIT_LENGTH = 0.01
"""How far a direction's length may be from 1: more than noise does, less than a slip."""


def measurements_in(
    machine: Machine, instruments: Sequence[Instrument], rows: MeasurementRows, report: Report
) -> Measurements:
    """Measurements from rows; of no use where something was reported on the way."""
    placed = commanded_poses(machine, instruments, rows, report)
    for row in stand_in_other_modes(machine, rows.other_mode, placed.joints, placed.placements):
        report(NO_OTHER_MODE, row=row, column="assembly_mode")
    conditions = _conditions(machine, rows, report)
    columns = reading_columns(machine)
    observed = _Observations(machine, instruments, rows, report, columns)
    for number in range(len(instruments)):
        observed.of_instrument(number)
    table = observed.table()
    framed = [
        _with_frame(machine, instrument, number, rows, table)
        for number, instrument in enumerate(instruments)
    ]
    return Measurements(
        instruments=tuple(framed),
        joints=placed.joints,
        placements=placed.placements,
        instrument=rows.instrument,
        conditions=conditions,
        held_out=rows.held_out,
        row=table.row,
        observable=table.observable,
        strut=table.strut,
        value=table.value,
        uncertainty=table.uncertainty,
        lines=rows.lines,
        other_joints=placed.other_joints,
        other_placements=placed.other_placements,
    )


@dataclass
class _Table:
    """Observations, sorted by row, strut and observable; all (n_observation,)."""

    row: Indices
    observable: Indices
    strut: Indices
    value: Floats
    uncertainty: Floats


def _with_frame(
    machine: Machine, instrument: Instrument, number: int, rows: MeasurementRows, table: _Table
) -> Instrument:
    """The instrument with what is to be found of its frame, if that is what it reads of one."""
    rule = REGISTRY[instrument.kind].frame
    if instrument.name not in rows.whole or rule is None:
        return instrument
    of_instrument = rows.instrument[table.row] == number
    read = [OBSERVABLES[code] for code in np.unique(table.observable[of_instrument]).tolist()]
    frame = dataclasses.replace(instrument.frame, unknown=rule(read, machine.components))
    return dataclasses.replace(instrument, frame=frame)


def _conditions(machine: Machine, rows: MeasurementRows, report: Report) -> tuple[Condition, ...]:
    """(n_row,) the condition of each row; equal ones are the same object."""
    unloaded = unloaded_at_reference(machine.condition)
    for part, values in rows.temperatures.items():
        column = f"temperature.{part}"
        for row in np.flatnonzero((values <= 0.0) & ~rows.spoilt(column)).tolist():
            report(
                Fault(
                    "not-positive",
                    "a temperature is above absolute zero",
                    found=report.shown(column, row),
                    expected="a temperature above absolute zero",
                ),
                row=row,
                column=column,
            )
    names = [*rows.temperatures, *WRENCH]
    blank = np.full(rows.n_row, math.nan)
    columns = [*rows.temperatures.values(), *(rows.wrench.get(name, blank) for name in WRENCH)]
    table: list[list[float]] = np.stack(columns, axis=1).tolist()
    known: dict[tuple[tuple[str, float], ...], Condition] = {}
    result = []
    for values_of_row in table:
        stated = {
            name: value
            for name, value in zip(names, values_of_row, strict=True)
            if math.isfinite(value) and (value > 0.0 if name not in WRENCH else value != 0.0)
        }
        if stated.get(DEFAULT_PART) == unloaded.reference_temperature:
            del stated[DEFAULT_PART]  # as where a row says nothing
        key = tuple(stated.items())
        if key not in known:
            known[key] = _condition(unloaded, stated)
        result.append(known[key])
    return tuple(result)


def _condition(unloaded: Condition, stated: Mapping[str, float]) -> Condition:
    if not stated:
        return unloaded
    loads = [stated.get(name, 0.0) for name in WRENCH]
    temperatures = {part: value for part, value in stated.items() if part not in WRENCH}
    return unloaded.replace(temperature=temperatures, force=loads[:3], moment=loads[3:])


class _Observations:
    """Readings of one instrument after the other, checked, as observations."""

    def __init__(
        self,
        machine: Machine,
        instruments: Sequence[Instrument],
        rows: MeasurementRows,
        report: Report,
        columns: Mapping[str, ReadingColumn],
    ) -> None:
        self.machine = machine
        self.instruments = instruments
        self.rows = rows
        self.report = report
        self.columns = columns
        self._blocks: list[tuple[Indices, int, int, Floats, Floats]] = []

    def table(self) -> _Table:
        """All observations."""
        if not self._blocks:
            none = np.empty(0, np.intp)
            return _Table(none, none, none, np.empty(0), np.empty(0))
        row = np.concatenate([rows for rows, *_ in self._blocks])
        observable = np.concatenate([np.full(len(r), o, np.intp) for r, o, *_ in self._blocks])
        strut = np.concatenate([np.full(len(r), s, np.intp) for r, _, s, *_ in self._blocks])
        value = np.concatenate([values for *_, values, _ in self._blocks])
        stated = np.concatenate([stated for *_, stated in self._blocks])
        order = np.lexsort((observable, strut, row))
        return _Table(row[order], observable[order], strut[order], value[order], stated[order])

    def of_instrument(self, number: int) -> None:
        """Check the rows of one instrument, and add what they observe."""
        instrument = self.instruments[number]
        kind = REGISTRY[instrument.kind]
        own_rows = self.rows.instrument == number
        if not own_rows.any():
            # A row of an unknown instrument may be meant to be its.
            if (self.rows.instrument >= 0).all():
                self.report(
                    Fault(
                        "no-rows",
                        f"no row is of the instrument {instrument.name}",
                        found="nothing",
                        expected=f'a row with "{instrument.name}" in the column instrument',
                    )
                )
            return
        self._refuse_unwanted(instrument, kind, own_rows)
        own = {name: column for name, column in self.columns.items() if column.word in kind.reads}
        if kind.poses == 0:
            self._refuse_conditions(own_rows)
            self._refuse_doubled(own_rows, own)
        self._require(instrument, kind, own_rows, own)
        self._check_signs(kind, own_rows, own)
        if any(word.startswith("direction") for word in kind.reads):
            self._check_directions(own_rows)
        for name, reading in own.items():
            filled = own_rows & self.rows.filled(name)
            values = self.rows.readings.get(name, np.zeros(self.rows.n_row))
            if kind.optional:
                filled, values = own_rows, np.where(self.rows.filled(name), values, 0.0)
            observable = kind.reads[reading.word]
            self._add(instrument, name, observable, reading.strut, filled, values)
        for observable in kind.fixed:
            if moved(observable, self.machine.components):
                zero = np.zeros(self.rows.n_row)
                self._add(instrument, observable, observable, -1, own_rows, zero)

    def _add(
        self,
        instrument: Instrument,
        column: str,
        observable: str,
        strut: int,
        filled: Flags,
        values: Floats,
    ) -> None:
        rows = np.flatnonzero(filled)
        if not rows.size:
            return
        if observable in ("a", "b", "c", "angle"):
            values = within_a_turn(values)
        stated = self._stated(instrument, column, observable, filled)
        number = OBSERVABLES.index(observable)
        self._blocks.append((rows, number, strut, values[rows], stated[rows]))

    def _stated(
        self, instrument: Instrument, column: str, observable: str, filled: Flags
    ) -> Floats:
        """(n_row,) standard uncertainties: the row's own, else the instrument's."""
        name = column + UNCERTAINTY
        of_row = self.rows.uncertainties.get(name, np.full(self.rows.n_row, math.nan))
        spoilt = self.rows.spoilt(name)
        for row in np.flatnonzero(filled & (of_row <= 0.0) & ~spoilt).tolist():
            self.report(
                Fault(
                    "not-positive",
                    "a standard uncertainty is above zero",
                    found=self.report.shown(name, row),
                    expected="a standard uncertainty above zero",
                    hint="a reading without uncertainty would outweigh all others",
                ),
                row=row,
                column=name,
            )
        stated = instrument.uncertainty_of(observable)
        if stated is not None:
            return np.where(np.isnan(of_row), stated, of_row)
        lacking = np.flatnonzero(filled & np.isnan(of_row) & ~spoilt)
        if lacking.size:
            self.report(
                Fault(
                    "no-uncertainty",
                    f"nothing says how uncertain {column} of {instrument.name} is, "
                    f"in {counted(lacking.size, 'row')}",
                    found="no standard uncertainty",
                    expected=f"an uncertainty of the instrument, or a column {name}",
                ),
                row=int(lacking[0]),
                column=column,
            )
        return of_row

    def _refuse_unwanted(self, instrument: Instrument, kind: Kind, own_rows: Flags) -> None:
        words = one_of(kind.reads) if kind.reads else "no column of readings"
        for name in self.rows.readings:
            reading = self.columns[name]
            if reading.word in kind.reads:
                continue
            for row in np.flatnonzero(own_rows & self.rows.filled(name)).tolist():
                self.report(
                    Fault(
                        "unwanted-value",
                        f"the instrument of this row, {instrument.name}, does not read this",
                        found=self._shown(name, row),
                        expected=f"an empty cell; the kind {kind.name} reads {words}",
                    ),
                    row=row,
                    column=name,
                )
        for name, values in self.rows.uncertainties.items():
            column = name.removesuffix(UNCERTAINTY)
            read = own_rows & self.rows.filled(column)
            if kind.optional and self.columns[column].word in kind.reads:
                read = own_rows
            if column in kind.fixed and moved(column, self.machine.components):
                read = own_rows
            for row in np.flatnonzero(own_rows & ~read & ~np.isnan(values)).tolist():
                self.report(
                    Fault(
                        "unwanted-value",
                        "an uncertainty of what the row does not have",
                        found=self.report.shown(name, row),
                        expected=f"an empty cell, or a value in the column {column}",
                    ),
                    row=row,
                    column=name,
                )

    def _refuse_doubled(self, own_rows: Flags, own: Mapping[str, ReadingColumn]) -> None:
        """A group and its member in one row: two readings of one parameter."""
        first: dict[int, str] = {}
        for name, reading in own.items():
            if name not in self.rows.readings:
                continue
            other = first.setdefault(reading.strut, name)
            both = own_rows & self.rows.filled(name) & self.rows.filled(other)
            for row in np.flatnonzero(both).tolist() if other != name else ():
                self.report(
                    Fault(
                        "excluding-columns",
                        f"the row has this in the column {other} too",
                        found=self._shown(name, row),
                        expected="one of the two, or a row for each",
                    ),
                    row=row,
                    column=name,
                )

    def _refuse_conditions(self, own_rows: Flags) -> None:
        """Temperatures and loads of what is measured by itself."""
        temperatures = self.rows.temperatures
        stated = {f"temperature.{part}": values for part, values in temperatures.items()}
        reference = self.machine.condition.reference_temperature
        for name, values in (stated | dict(self.rows.wrench)).items():
            usual = 0.0 if name in WRENCH else reference
            other = own_rows & ~np.isnan(values) & (values != usual)
            for row in np.flatnonzero(other).tolist():
                self.report(
                    Fault(
                        "unwanted-value",
                        "a parameter is what it is at the reference temperature, without loads",
                        found=self.report.shown(name, row),
                        expected="an empty cell, and the value at the reference temperature",
                    ),
                    row=row,
                    column=name,
                )

    def _shown(self, column: str, row: int) -> str:
        if self.rows.spoilt(column)[row]:
            return "something"
        return self.report.shown(column, row)

    def _require(
        self, instrument: Instrument, kind: Kind, own_rows: Flags, own: Mapping[str, ReadingColumn]
    ) -> None:
        """Whether every row of the instrument has the readings that its kind must have."""
        if kind.least == 0 or kind.optional:
            return
        if kind.least is None:
            for name, reading in own.items():
                if moved(kind.reads[reading.word], self.machine.components):
                    self._require_column(instrument, name, own_rows)
            return
        used = [name for name in own if (own_rows & self.rows.filled(name)).any()]
        if not used:
            some = one_of(own, limit=8)
            self.report(
                Fault(
                    "missing-column",
                    f"nothing is read by the instrument {instrument.name}, of kind {kind.name}",
                    found="no value in its rows",
                    expected=f"a column of readings: {some}",
                ),
                row=int(np.flatnonzero(own_rows)[0]),
            )
            return
        if kind.most is not None and len(used) > kind.most:
            self.report(
                Fault(
                    "unwanted-value",
                    f"the instrument {instrument.name} reads {len(used)} columns",
                    found=", ".join(used),
                    expected=f"at most {kind.most} of {', '.join(kind.reads)} of kind {kind.name}",
                    hint='an instrument that reads x, y and z is of kind "position"',
                ),
                row=int(np.flatnonzero(own_rows & self.rows.filled(used[kind.most]))[0]),
                column=used[kind.most],
            )
        empty = own_rows & ~np.any([self.rows.filled(name) for name in used], axis=0)
        for row in np.flatnonzero(empty).tolist():
            self.report(
                Fault(
                    "empty-cell",
                    f"the row has no reading of the instrument {instrument.name}",
                    found="nothing",
                    expected=f"a value in a column of {', '.join(used[:8])}",
                ),
                row=row,
            )

    def _require_column(self, instrument: Instrument, name: str, own_rows: Flags) -> None:
        if name not in self.rows.readings:
            self.report(
                Fault(
                    "missing-column",
                    f"there is no column {name}, which the instrument {instrument.name} "
                    f"of kind {instrument.kind} needs",
                    found="no such column",
                    expected=f"{name}, as the platform moves in it",
                )
            )
            return
        for row in np.flatnonzero(own_rows & ~self.rows.filled(name)).tolist():
            self.report(
                Fault(
                    "empty-cell",
                    f"the instrument of this row, {instrument.name}, needs a value",
                    found="nothing",
                    expected="a number",
                ),
                row=row,
                column=name,
            )

    def _check_signs(self, kind: Kind, own_rows: Flags, own: Mapping[str, ReadingColumn]) -> None:
        for name, reading in own.items():
            values = self.rows.readings.get(name)
            if values is None or kind.reads[reading.word] not in ABOVE_ZERO:
                continue
            for row in np.flatnonzero(
                own_rows & (values <= 0.0) & ~self.rows.spoilt(name)
            ).tolist():
                self.report(
                    Fault(
                        "not-positive",
                        "a length is above zero",
                        found=self.report.shown(name, row),
                        expected="a length above zero",
                    ),
                    row=row,
                    column=name,
                )

    def _check_directions(self, own_rows: Flags) -> None:
        """The three components of a strut's direction: all or none, and of length one."""
        for strut in self.machine.struts:
            names = [f"strut.{strut.name}.direction.{axis}" for axis in "xyz"]
            filled = np.array([own_rows & self.rows.filled(name) for name in names])
            for component, name in enumerate(names):
                for row in np.flatnonzero(filled.any(axis=0) & ~filled[component]).tolist():
                    self.report(
                        Fault(
                            "empty-cell" if name in self.rows.readings else "missing-column",
                            "a direction has three components",
                            found="nothing",
                            expected="a number",
                        ),
                        row=row,
                        column=name,
                    )
            good = filled.all(axis=0) & ~np.any([self.rows.spoilt(name) for name in names], axis=0)
            if not good.any():
                continue
            vectors = np.stack([self.rows.readings[name] for name in names], axis=1)
            length = np.linalg.norm(vectors, axis=1)
            for row in np.flatnonzero(good & (np.abs(length - 1.0) > UNIT_LENGTH)).tolist():
                self.report(
                    Fault(
                        "not-a-direction",
                        f"the direction of strut {strut.name} is no unit vector",
                        found=f"a vector of length {length[row]:.6g}",
                        expected=f"a length of 1, within {UNIT_LENGTH:g}",
                    ),
                    row=row,
                    column=names[0].removesuffix(".x"),
                )


def within_a_turn(angles: Floats) -> Floats:
    """Angles in rad, any shape, from -pi to pi, where the kernel has them; others unchanged."""
    with np.errstate(invalid="ignore"):
        turned = angles - 2.0 * math.pi * np.round(angles / (2.0 * math.pi))
    return np.where(np.abs(angles) > math.pi, turned, angles)
