"""Measurements: what instruments read of a machine, row by row, ready to be fitted.

A row is one pose at which one instrument measured; an observation is one number of a row.
`read_csv.py` reads them from a file, `arrays.py` makes them from arrays, and `write_csv.py` writes
them.
"""

from __future__ import annotations

import dataclasses
import hashlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.instruments._base import Instrument
from truepose.calibration.observables import OBSERVABLES, is_parameter
from truepose.machine.condition import Condition
from truepose.representation import Facts, Represented


def unloaded_at_reference(condition: Condition) -> Condition:
    """The condition of a row that states none: at reference temperature, with an unloaded tool."""
    return dataclasses.replace(
        condition,
        default_temperature=condition.reference_temperature,
        part_temperatures={},
        gradients={},
        temperature_log=None,
        time=None,
        force=(0.0, 0.0, 0.0),
        moment=(0.0, 0.0, 0.0),
        envelope=None,
    )


@dataclass(frozen=True, eq=False, repr=False)
class Measurements(Represented):
    """What instruments read of a machine; SI, radians and kelvin.

    Rows: `joints` (n_row, n_joint) commanded; `placements` (n_row, 7) where the nominal machine
    then is, tool point and quaternion, at its home where a row needs no pose; `instrument`
    (n_row,) which of `instruments` measured; `conditions` (n_row,), equal ones the same object;
    `held_out` (n_row,): kept from the fit; `lines` (n_row,) of the file, 0 where there is none.
    `other_joints` and `other_placements`: the second pose of rows that are between two, in the
    others the first again; None where no row is. `numbers` (n_row,): of a selection, which rows of
    all these are, from 0; None of all.

    Observations: `row` (n_observation,) of each, `observable`: its index in `OBSERVABLES`, `strut`:
    which, of a parameter which parameter, or -1; `value` and standard `uncertainty`, above zero.
    """

    instruments: tuple[Instrument, ...]
    joints: Floats
    placements: Floats
    instrument: Indices
    conditions: tuple[Condition, ...]
    held_out: Flags
    row: Indices
    observable: Indices
    strut: Indices
    value: Floats
    uncertainty: Floats
    lines: Indices
    file: str = ""
    file_hash: str = ""
    other_joints: Floats | None = None
    other_placements: Floats | None = None
    numbers: Indices | None = None

    def _facts(self) -> Facts:
        yield "file", self.file or None
        yield "instruments", self.instruments
        yield "rows", self.n_row
        yield "kept from the fit", int(self.held_out.sum())
        yield "readings", self.n_observation

    @property
    def n_row(self) -> int:
        """How many rows there are."""
        return len(self.instrument)

    @property
    def n_observation(self) -> int:
        """How many numbers were measured."""
        return len(self.value)

    @property
    def row_numbers(self) -> Indices:
        """(n_row,) by which people know the rows, from 0: among all that were measured."""
        return np.arange(self.n_row) if self.numbers is None else self.numbers

    @property
    def posed(self) -> Flags:
        """(n_row,) whether the row was measured at a pose; a part's own dimensions are not."""
        flags = np.ones(self.n_row, np.bool_)
        flags[self.row[is_parameter(self.observable)]] = False
        return flags

    @property
    def between(self) -> Flags:
        """(n_row,) whether the row was measured between two poses."""
        flags = np.zeros(self.n_row, np.bool_)
        flags[self.row[self.observable == OBSERVABLES.index("separation")]] = True
        return flags

    def command(self, row: int) -> bytes:
        """What a row was commanded to, to the last digit: equal of equal commands only."""
        tables = [self.joints] + ([] if self.other_joints is None else [self.other_joints])
        return b"".join(table[row].tobytes() for table in tables)

    def with_second_poses(self) -> Measurements:
        """The second poses of rows between two as further rows, in their order, without readings.

        Every pose at which anything was measured is then the one pose of a row.
        """
        if self.other_joints is None or self.other_placements is None:
            return self
        rows = np.flatnonzero(self.between)
        return dataclasses.replace(
            self,
            joints=np.concatenate([self.joints, self.other_joints[rows]]),
            placements=np.concatenate([self.placements, self.other_placements[rows]]),
            instrument=np.concatenate([self.instrument, self.instrument[rows]]),
            conditions=self.conditions + tuple(self.conditions[row] for row in rows.tolist()),
            held_out=np.concatenate([self.held_out, self.held_out[rows]]),
            lines=np.concatenate([self.lines, self.lines[rows]]),
            other_joints=None,
            other_placements=None,
            numbers=np.concatenate([self.row_numbers, self.row_numbers[rows]]),
        )

    def observables(self, instrument: int) -> tuple[str, ...]:
        """Names of what an instrument, by its index, read in any row, in the order of the table."""
        read = self.observable[self.instrument[self.row] == instrument]
        return tuple(OBSERVABLES[number] for number in np.unique(read).tolist())

    @property
    def digest(self) -> str:
        """SHA-256 of the file's bytes, or of the numbers where there is no file."""
        if self.file_hash:
            return self.file_hash
        arrays = [self.joints, self.row, self.observable, self.strut, self.value, self.uncertainty]
        arrays += [] if self.other_joints is None else [self.other_joints]
        parts = b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)
        return hashlib.sha256(parts).hexdigest()

    def select(self, rows: ArrayLike) -> Measurements:
        """Only the rows where `rows` (n_row,) is true; the instruments stay as they are."""
        wanted = np.asarray(rows, np.bool_)
        if wanted.shape != (self.n_row,):
            raise ValueError(f"flags of shape {wanted.shape}, expected ({self.n_row},)")
        kept = wanted[self.row]
        number = np.cumsum(wanted) - 1
        return dataclasses.replace(
            self,
            joints=self.joints[wanted],
            placements=self.placements[wanted],
            instrument=self.instrument[wanted],
            conditions=tuple(self.conditions[row] for row in np.flatnonzero(wanted).tolist()),
            held_out=self.held_out[wanted],
            lines=self.lines[wanted],
            row=number[self.row[kept]].astype(np.intp),
            observable=self.observable[kept],
            strut=self.strut[kept],
            value=self.value[kept],
            uncertainty=self.uncertainty[kept],
            other_joints=_of_rows(self.other_joints, wanted),
            other_placements=_of_rows(self.other_placements, wanted),
            numbers=self.row_numbers[wanted],
        )

    def of_instrument(self, instrument: int) -> tuple[Measurements, Indices]:
        """The rows of one instrument, which is then the only one, and its observations (k,)."""
        own = self.instrument == instrument
        observations = np.flatnonzero(own[self.row])
        rows = self.select(own)
        return dataclasses.replace(
            rows,
            instruments=(self.instruments[instrument],),
            instrument=np.zeros(rows.n_row, np.intp),
        ), observations

    def with_values(self, value: ArrayLike, uncertainty: ArrayLike | None = None) -> Measurements:
        """The same with other values (n_observation,), and standard uncertainties where given.

        One uncertainty stands for all. Raises `ValueError` for other shapes, values that are not
        finite, and uncertainties that are not above zero.
        """
        values = np.array(value, np.float64)
        if values.shape != self.value.shape or not np.isfinite(values).all():
            raise ValueError(f"expected {self.n_observation} finite values")
        stated = self.uncertainty
        if uncertainty is not None:
            stated = np.broadcast_to(np.asarray(uncertainty, np.float64), values.shape).copy()
            if not (np.isfinite(stated) & (stated > 0.0)).all():
                raise ValueError("expected finite uncertainties above zero")
        return dataclasses.replace(self, value=values, uncertainty=stated)


def _of_rows(table: Floats | None, wanted: Flags) -> Floats | None:
    return None if table is None else table[wanted]
