"""The form of a suspicion, and of the two ways in which one arises.

A *hypothesis* says what may be wrong: "if x and y were exchanged". It is tried on a copy, assessed,
and never kept. An *inspection* reads a suspicion off the data themselves: "row 7 is there twice".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.data_checks.nominal import Geometry, Placement
from truepose.calibration.data_checks.placement import Free, Readings, fit_instrument
from truepose.calibration.instruments._base import Instrument
from truepose.calibration.observables import UNITS, column_name

if TYPE_CHECKING:
    from truepose.calibration.measurements import Measurements
    from truepose.machine import Machine


ALLOWED = 3.0
"""Residuals, in what tolerances at their ends and noise give together, above which data are wrong.

Root mean square over an instrument. Tolerances at their ends are 1.7 standard deviations of a
uniform band, so this is about five of them."""

LESS = 5.0
"""How many times smaller a hypothesis must make the residual."""

TRIMMED = 0.1
"""Share of the largest residuals that does not count, before and after: outliers are not blunders
of the whole set, and a few must not hide one."""

REDUNDANT = 3
"""Observations beyond the fitted unknowns below which no hypothesis is tried. With fewer, data are
called far off where they are twice as far off as others may be."""


@dataclass(frozen=True)
class Suspicion:
    """What is suspected of the measurements. Nothing is repaired.

    `code`: its kind; `sentence`: for people; `instrument`: its name, "" for all; `where`: columns;
    `rows`: indices of the measurements' rows, and their `lines` in the file, where not all are
    meant. `before`, `after`: rms of what was read less what the nominal machine would show, SI
    `unit`, as the data are and as they would be under the hypothesis; `factor` = before / after
    (nan, where there is no hypothesis). `refuses`: whether a calibration from these data must not
    be offered before someone has looked.
    """

    code: str
    sentence: str
    instrument: str = ""
    where: tuple[str, ...] = ()
    rows: tuple[int, ...] = ()
    lines: tuple[int, ...] = ()
    before: float = float("nan")
    after: float = float("nan")
    factor: float = float("nan")
    unit: str = "m"
    refuses: bool = True


@dataclass(frozen=True, eq=False)
class Misfit:
    """How far readings are from a machine.

    `residual` (k,) SI; `quotients` (k,) residual over what is allowed; `column` (k,) number of the
    column of each; `reach`: by how much the readings vary as the machine moves, in what is allowed.
    """

    residual: Floats
    quotients: Floats
    column: Indices
    reach: float
    placement: Placement
    redundancy: int

    def size(self, trimmed: bool = True) -> float:
        """Root mean square of the quotients of the worst column, corrected for what was fitted.

        NaN where nothing is redundant. The worst column counts, so that five good columns do not
        hide a wrong sign of one angle.
        """
        if self.redundancy < 1:
            return float("nan")
        worst = max(
            _rms(self.quotients[self.column == column], trimmed)
            for column in np.unique(self.column)
        )
        return worst * math.sqrt(self.quotients.size / self.redundancy)


def _rms(values: Floats, trimmed: bool) -> float:
    count = values.size - (int(TRIMMED * values.size) if trimmed else 0)
    return float(np.sqrt(np.mean(np.sort(np.abs(values))[:count] ** 2)))


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What may be wrong, and how far the data are off if it is.

    `words`: what is assumed, "the readings x and y are exchanged"; `where`: the columns;
    `kept`: the observations that take part, None: all; `trimmed`: whether outliers are left out;
    `of_command`: whether it is what was commanded that would be wrong.
    """

    words: str
    where: tuple[str, ...]
    misfit: Misfit
    kept: Indices | None = None
    trimmed: bool = True
    rows: tuple[int, ...] = ()
    of_command: bool = False


@dataclass(frozen=True, eq=False)
class MeasuredColumn:
    """One measured column of an instrument; `observations` (m,): numbers among the instrument's."""

    name: str
    observable: int
    strut: int
    observations: Indices

    @property
    def unit(self) -> str:
        """Its SI unit."""
        return UNITS[self.observable]


@dataclass(frozen=True, eq=False)
class View:
    """One instrument's part of the measurements, against the nominal machine.

    `observations` (k,): its own among the measurements'; `geometry`: of all rows; `readings`: what
    it read, with `scale` (k,) what tolerances and noise allow.
    """

    machine: Machine
    measurements: Measurements
    instrument: Instrument
    observations: Indices
    geometry: Geometry
    readings: Readings

    @cached_property
    def as_given(self) -> Misfit:
        """The misfit of the data as they are."""
        return self.assess()

    @cached_property
    def columns(self) -> tuple[MeasuredColumn, ...]:
        """The measured columns, in the order of the observables."""
        key = self.readings.observable * 100_000 + self.readings.strut
        columns = []
        for number in np.unique(key):
            observations = np.flatnonzero(key == number)
            observable = int(self.readings.observable[observations[0]])
            strut = int(self.readings.strut[observations[0]])
            name = self._name(observable, strut)
            columns.append(MeasuredColumn(name, observable, strut, observations))
        return tuple(columns)

    def _name(self, observable: int, strut: int) -> str:
        return column_name(self.machine, observable, strut)

    def column(self, observable: str) -> MeasuredColumn | None:
        """The column of an observable that is of no strut."""
        return next((column for column in self.columns if column.name == observable), None)

    @property
    def column_names(self) -> tuple[str, ...]:
        """Names of the measured columns."""
        return tuple(column.name for column in self.columns)

    @cached_property
    def rows(self) -> Indices:
        """(m,) rows of the measurements in which it read something, in their order."""
        return np.unique(self.readings.row)

    @cached_property
    def table(self) -> Indices | None:
        """(m, n_column) places among the observations; None where rows differ in columns."""
        counts = [column.observations.size for column in self.columns]
        if set(counts) != {self.rows.size}:
            return None
        return self.by_row(self.columns)

    def by_row(self, columns: Sequence[MeasuredColumn]) -> Indices:
        """(m, n) places of columns of as many rows among the observations, in the rows' order."""
        row = self.readings.row
        ordered = [c.observations[np.argsort(row[c.observations])] for c in columns]
        return np.stack(ordered, axis=1)

    def assess(
        self,
        value: Floats | None = None,
        geometry: Geometry | None = None,
        kept: Indices | None = None,
        free: Free | None = None,
    ) -> Misfit:
        """The misfit of other values, other poses, a part of the data or a freer instrument."""
        readings = self.readings
        if value is not None:
            readings = replace(readings, value=value)
        if kept is not None:
            readings = readings.kept(kept)
        placement, residual, fitted = fit_instrument(
            self.geometry if geometry is None else geometry,
            self.instrument,
            readings,
            free or Free.stated(self.instrument),
            roughly=value is not None or geometry is not None,
        )
        column = readings.observable * 100_000 + readings.strut
        predicted = (readings.value - residual) / readings.scale
        variances = [float(np.var(predicted[column == number])) for number in np.unique(column)]
        reach = math.sqrt(sum(variances))
        redundancy = residual.size - fitted
        return Misfit(residual, residual / readings.scale, column, reach, placement, redundancy)

    def negated(self, columns: Sequence[MeasuredColumn], words: str) -> Hypothesis:
        """That some columns are of the other sign."""
        value = self.readings.value.copy()
        for column in columns:
            value[column.observations] *= -1.0
        return Hypothesis(words, tuple(column.name for column in columns), self.assess(value))

    def other_command(
        self, geometry: Geometry | None, words: str, where: tuple[str, ...]
    ) -> Iterator[Hypothesis]:
        """That the machine was commanded to another geometry; nothing where it cannot be there.

        Nor of rows between two poses, of which the other geometry is one.
        """
        if geometry is not None and not self.measurements.between[self.rows].any():
            yield Hypothesis(words, where, self.assess(geometry=geometry), of_command=True)

    def rms(self, misfit: Misfit, hypothesis: Hypothesis, unit: str) -> float:
        """Of the residuals of one SI unit, of those observations that a hypothesis keeps."""
        observable = self.readings.observable
        residual = misfit.residual
        if hypothesis.kept is not None:
            observable = observable[hypothesis.kept]
            if residual.size != observable.size:
                residual = residual[hypothesis.kept]
        of_unit = residual[np.array(UNITS)[observable] == unit]
        return _rms(of_unit, hypothesis.trimmed) if of_unit.size else 0.0

    def geometry_at_joints(self, joints: Floats) -> Geometry | None:
        """The nominal machine at other joints (n_row, n_joint); None: it has no pose there."""
        kernel = self.machine.kernel
        poses, _ = kernel.forward(joints, status=True)
        if not np.isfinite(poses).all():
            return None
        return Geometry.of(kernel, joints, kernel.placement_of(poses))

    def geometry_at_poses(self, poses: Floats) -> Geometry | None:
        """The nominal machine at other poses (n_row, n_commanded); None: it does not reach them."""
        joints, placements, status = self.machine.kernel.place(poses)
        if (status > 1).any():  # out of travel there is still a pose
            return None
        return Geometry.of(self.machine.kernel, joints, placements)

    @cached_property
    def poses(self) -> Floats:
        """(n_row, n_commanded) the commanded poses, as the nominal machine has them."""
        columns = [self.machine.dof.index(freedom) for freedom in self.machine.commanded]
        poses: Floats = self.machine.kernel.pose_of(self.measurements.placements)[:, columns]
        return poses

    def lines(self, rows: Iterable[int]) -> tuple[int, ...]:
        """Their lines in the file; empty where there is none."""
        lines = tuple(int(self.measurements.lines[row]) for row in rows)
        return lines if all(lines) else ()

    def named_rows(self, rows: Iterable[int]) -> str:
        """Rows for people, "rows 3 and 7", from 1, or their lines where there is a file."""
        indices = list(rows)
        lines = self.lines(indices)
        word = "line" if lines else "row"
        numbers = [str(number) for number in (lines or [row + 1 for row in indices])]
        shown = numbers[:6] + ([f"{len(numbers) - 6} more"] if len(numbers) > 6 else [])
        return f"{word}{'s' if len(numbers) > 1 else ''} {listed(shown)}"

    def format(self, value: float, unit: str) -> str:
        """For people, in the machine file's unit: "0.12 mm"."""
        if unit == "1":
            return f"{value:.3g}"
        declared = self.machine.file_units["length" if unit == "m" else "angle"]
        return f"{float(declared.to_file(value)):.3g} {declared.label}"


def listed(words: Iterable[str]) -> str:
    """Words in a row: "a, b and c"."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


@dataclass(frozen=True)
class HypothesisKind:
    """A registry's line: a kind of blunder that a hypothesis shows.

    `propose(view)` yields what to try; `free`: it has numbers of its own to fit, and is asked only
    where none of those without explains the data.
    """

    code: str
    doc: str
    propose: Callable[[View], Iterator[Hypothesis]]
    free: bool = False


@dataclass(frozen=True)
class InspectionKind:
    """A registry's line: a kind of fault that shows in the data as such."""

    code: str
    doc: str
    inspect: Callable[[View], Iterator[Suspicion]]
