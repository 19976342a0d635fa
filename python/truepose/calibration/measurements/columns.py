"""The columns of measurements, and what stood in them before anything of it is checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.observables import OF_PARAMETERS, parameter_column
from truepose.errors import Fault
from truepose.files.dimensions import BY_UNIT
from truepose.machine import Machine
from truepose.sources.tolerance import bands_of

TO = "to."
"""How the columns of the other pose begin, where a row is between two."""

UNCERTAINTY = ".uncertainty"
"""How the column of standard uncertainties of another column ends."""

ALIKE = 1e-9
"""Sizes that differ by less than this share of themselves are one size, written twice."""

SINGLE = {"x": "length", "y": "length", "z": "length"} | dict.fromkeys("abc", "angle")
SINGLE["distance"] = "length"
"""Dimension of the columns that are not of one strut."""

OF_A_STRUT = {"length": "length"} | {f"direction.{axis}": "ratio" for axis in "xyz"}
OF_A_STRUT["angle"] = "angle"
"""Dimension of a strut's columns, by the end of their name."""

WRENCH = {f"force.{axis}": "force" for axis in "xyz"} | {
    f"moment.{axis}": "moment" for axis in "xyz"
}
"""Dimension of the columns of what acts on the tool."""


@dataclass(frozen=True)
class ReadingColumn:
    """A column of readings: what a kind calls it (`length`), its dimension, and which strut.

    Of a parameter, which parameter.
    """

    word: str
    dimension: str
    strut: int = -1


def reading_columns(machine: Machine) -> dict[str, ReadingColumn]:
    """Every column that readings of a machine can have, in the order of a file."""
    columns = {word: ReadingColumn(word, dimension) for word, dimension in SINGLE.items()}
    for number, strut in enumerate(machine.struts):
        for word, dimension in OF_A_STRUT.items():
            columns[f"strut.{strut.name}.{word}"] = ReadingColumn(word, dimension, number)
    own = {parameter_column(name): number for number, name in enumerate(machine.parameters)}
    of_groups = {parameter_column(group): first for group, first in sized_groups(machine).items()}
    for column, number in (own | of_groups).items():
        unit = machine.units[number]
        columns[column] = ReadingColumn(OF_PARAMETERS[unit], BY_UNIT[unit], number)
    return columns


def sized_groups(machine: Machine) -> dict[str, int]:
    """Groups of tolerances whose members are of one size, each with one of these parameters.

    They move together: who has measured one has measured all.
    """
    bands = bands_of(machine)
    groups: dict[str, int] = {}
    for number, group in ({} if bands is None else bands.group_names).items():
        assert bands is not None
        members = np.flatnonzero(bands.groups == number)
        nominal = machine.nominal[bands.parameters[members]]
        half = bands.signed_half[0][members]
        alike = [np.ptp(sizes) <= ALIKE * np.abs(sizes).max() for sizes in (half, nominal)]
        if all(alike):
            groups[group] = int(bands.parameters[members[0]])
    return groups


@dataclass
class MeasurementRows:
    """What was given, by columns (n_row,), SI, a blank cell NaN, before anything of it is checked.

    Either `commands` (n_row, n_commanded) or `joints` (n_row, n_joint); of what is measured between
    two poses `to_commands` or `to_joints` likewise, the other pose. `instrument`: which, or -1
    where that is not known. `temperatures` by part, `wrench` by `force.x`, ... `unreadable`: cells
    with a problem already. `whole`: names of instruments whose frame is wholly to be found.
    """

    instrument: Indices
    readings: Mapping[str, Floats]
    uncertainties: Mapping[str, Floats]
    held_out: Flags
    lines: Indices
    commands: Floats | None = None
    joints: Floats | None = None
    to_commands: Floats | None = None
    to_joints: Floats | None = None
    temperatures: Mapping[str, Floats] = field(default_factory=dict)
    wrench: Mapping[str, Floats] = field(default_factory=dict)
    unreadable: Mapping[str, Flags] = field(default_factory=dict)
    whole: frozenset[str] = frozenset()
    other_mode: Flags | None = None
    """(n_row,) rows that are stated to be in another assembly mode than that of home."""

    @property
    def n_row(self) -> int:
        """How many rows there are."""
        return len(self.instrument)

    def spoilt(self, column: str) -> Flags:
        """(n_row,) whether a cell of a column has a problem already."""
        return self.unreadable.get(column, np.zeros(self.n_row, np.bool_))

    def filled(self, column: str) -> Flags:
        """(n_row,) whether something stands in a column of readings, be it readable or not."""
        values = self.readings.get(column)
        if values is None:
            return np.zeros(self.n_row, np.bool_)
        return ~np.isnan(values) | self.spoilt(column)


class Report(Protocol):
    """Where problems go, with their place as the source of the rows knows it."""

    def __call__(self, fault: Fault, *, row: int | None = None, column: str | None = None) -> None:
        """Note a problem of a row (from 0), a column, or the whole."""

    def shown(self, column: str, row: int) -> str:
        """A number as it was given, with its unit."""
