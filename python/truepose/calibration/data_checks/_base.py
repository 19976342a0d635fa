"""The form of a suspicion, and of the two ways in which one arises.

A *hypothesis* says what may be wrong: "if x and y were exchanged". It is tried on a copy, assessed,
and never kept. An *inspection* reads a suspicion off the data themselves: "row 7 is there twice".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.identification.placement import Placement, place_instrument
from truepose.calibration.identification.problem import row_shifts
from truepose.calibration.identification.unknowns import unknowns_of_instruments
from truepose.calibration.instruments import Instrument
from truepose.calibration.observables import UNITS, column_name

if TYPE_CHECKING:
    from truepose.calibration.measurements import Measurements
    from truepose.machine import Machine
    from truepose.runs.displacement import ParameterDeviation


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

    `residual` (k,) read less predicted, SI; `quotients` (k,) residual over what is allowed;
    `column` (k,) number of the column of each; `reach`: by how much the readings vary as the
    machine moves, in what is allowed.
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
class Supposed:
    """One instrument's `rows` as they would be, `scale` (k,) of what is allowed of each reading.

    `shifts`: what is known to move the machine's parameters from row to row. `roughly`: whether
    only the size of the misfit is asked, as it is of most hypotheses, which are wrong anyway.
    """

    machine: Machine
    rows: Measurements
    scale: Floats
    shifts: ParameterDeviation
    roughly: bool = False

    @cached_property
    def misfit(self) -> Misfit:
        """How far they are from the machine as filed.

        Raises `RequestError` (no-fit) where a pose of it cannot be solved.
        """
        weights = (self.rows.uncertainty / self.scale) ** 2
        return self.misfit_at(
            place_instrument(
                self.machine,
                self.rows,
                weights=weights,
                shifts=self.shifts,
                roughly=self.roughly,
            )
        )

    def misfit_at(self, placement: Placement) -> Misfit:
        """The same with the instrument there."""
        rows = self.rows
        residual = -placement.residual * rows.uncertainty
        column = rows.observable * 100_000 + rows.strut
        predicted = (rows.value - residual) / self.scale
        variances = [float(np.var(predicted[column == number])) for number in np.unique(column)]
        reach = math.sqrt(sum(variances))
        redundancy = residual.size - placement.rank
        return Misfit(residual, residual / self.scale, column, reach, placement, redundancy)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """What may be wrong, and the data as they would be then.

    `words`: what is assumed, "the readings x and y are exchanged"; `where`: the columns;
    `kept`: the observations that take part, None: all; `trimmed`: whether outliers are left out;
    `of_command`: whether it is what was commanded that would be wrong; `partial`: whether one of
    several columns that are alike would be otherwise than the rest, which nobody supposes of data
    that fit as they are.
    """

    words: str
    where: tuple[str, ...]
    supposed: Supposed
    kept: Indices | None = None
    trimmed: bool = True
    rows: tuple[int, ...] = ()
    of_command: bool = False
    partial: bool = False

    @property
    def misfit(self) -> Misfit:
        """How far the data are off if it is so."""
        return self.supposed.misfit


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
class Readings:
    """What one instrument read: (k,) each.

    `row` counts in all measurements; `scale` is what tolerances and noise allow.
    """

    row: Indices
    observable: Indices
    strut: Indices
    value: Floats
    scale: Floats


@dataclass(frozen=True, eq=False)
class View:
    """One instrument's part of the measurements, against the nominal machine.

    `own`: its rows alone, of which `observations` (k,) are the numbers among all `measurements`.
    `placement`: where it stands, None where no place was found. `readings_only`: whether what was
    commanded is beyond doubt.
    """

    machine: Machine
    measurements: Measurements
    own: Measurements
    observations: Indices
    readings: Readings
    placement: Placement | None
    readings_only: bool = False

    @classmethod
    def of(
        cls,
        machine: Machine,
        measurements: Measurements,
        number: int,
        allowed: Floats,
        placement: Placement | None = None,
    ) -> View:
        """Of the instrument of that number; `allowed` (n_observation,) of all readings, SI."""
        own, observations = measurements.of_instrument(number)
        readings = Readings(
            measurements.row[observations],
            own.observable,
            own.strut,
            own.value,
            allowed[observations],
        )
        return cls(machine, measurements, own, observations, readings, placement)

    @property
    def instrument(self) -> Instrument:
        """The one whose part it is."""
        return self.own.instruments[0]

    @cached_property
    def as_given(self) -> Misfit:
        """The misfit of the data as they are.

        With the instrument where it was placed; where that leaves more than is allowed, where the
        allowed residuals rather than the noise would have put it.
        """
        supposed = self.suppose()
        if self.placement is not None:
            misfit = supposed.misfit_at(self.placement)
            if not max(misfit.size(), misfit.size(trimmed=False)) > ALLOWED:
                return misfit
        return supposed.misfit

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

    def suppose(
        self,
        value: Floats | None = None,
        commanded: Measurements | None = None,
        kept: Indices | None = None,
        instrument: Instrument | None = None,
        uncertainty: Floats | None = None,
    ) -> Supposed:
        """Other values, other commands, a part of the data or a freer instrument.

        `uncertainty` (k,): of the other values, where it is another one too.
        """
        rows = self.own if commanded is None else commanded
        scale = self.readings.scale
        if instrument is not None:
            rows = replace(rows, instruments=(instrument,))
        if value is not None:
            rows = replace(rows, value=value)
        if uncertainty is not None:
            rows = replace(rows, uncertainty=uncertainty)
        if kept is not None:
            scale = scale[kept]
            rows = replace(
                rows,
                row=rows.row[kept],
                observable=rows.observable[kept],
                strut=rows.strut[kept],
                value=rows.value[kept],
                uncertainty=rows.uncertainty[kept],
            )
        roughly = value is not None or commanded is not None
        return Supposed(self.machine, rows, scale, self._shifts, roughly)

    @cached_property
    def as_displayed(self) -> Misfit:
        """The misfit against poses that a controller displays: no row is warm, none loaded."""
        none = np.empty(0, np.intp), np.zeros((1, 0))
        if not self._shifts[0].size:
            return self.as_given
        return Supposed(self.machine, self.own, self.readings.scale, none, True).misfit

    @cached_property
    def _shifts(self) -> ParameterDeviation:
        """What is known to move the machine's parameters from row to row."""
        return row_shifts(self.machine, self.own, unknowns_of_instruments(self.machine, self.own))

    def negated(self, columns: Sequence[MeasuredColumn], words: str) -> Hypothesis:
        """That some columns are of the other sign."""
        value = self.readings.value.copy()
        for column in columns:
            value[column.observations] *= -1.0
        return Hypothesis(words, tuple(column.name for column in columns), self.suppose(value))

    def other_command(
        self, commanded: Measurements | None, words: str, where: tuple[str, ...]
    ) -> Iterator[Hypothesis]:
        """That the machine was commanded otherwise; nothing where it cannot be there.

        Nor of rows between two poses, of which the other command is one.
        """
        if commanded is not None and not self.own.between.any():
            yield Hypothesis(words, where, self.suppose(commanded=commanded), of_command=True)

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

    def at_joints(self, joints: Floats) -> Measurements | None:
        """Its rows at other joints (n, n_joint); None: the machine has no pose there."""
        kernel = self.machine.kernel
        poses, status = kernel.forward(joints, status=True)
        if (status > 1).any():  # out of travel there is still a pose
            return None
        return replace(self.own, joints=joints, placements=kernel.placement_of(poses))

    def at_poses(self, poses: Floats) -> Measurements | None:
        """Its rows at other poses (n, n_commanded); None: the machine does not reach them."""
        joints, placements, status = self.machine.kernel.place(poses)
        if (status > 1).any():
            return None
        return replace(self.own, joints=joints, placements=placements)

    @cached_property
    def poses(self) -> Floats:
        """(n, n_commanded) the commanded poses, as the nominal machine has them."""
        columns = [self.machine.dof.index(freedom) for freedom in self.machine.commanded]
        poses: Floats = self.machine.kernel.pose_of(self.own.placements)[:, columns]
        return poses

    def numbers(self, rows: Iterable[int]) -> tuple[int, ...]:
        """Which they are of all that was measured, from 0."""
        numbers = self.measurements.row_numbers
        return tuple(int(numbers[row]) for row in rows)

    def lines(self, rows: Iterable[int]) -> tuple[int, ...]:
        """Their lines in the file; empty where there is none."""
        lines = tuple(int(self.measurements.lines[row]) for row in rows)
        return lines if all(lines) else ()

    def named_rows(self, rows: Iterable[int]) -> str:
        """Rows for people, "rows 3 and 7", from 1, or their lines where there is a file."""
        indices = list(rows)
        lines = self.lines(indices)
        word = "line" if lines else "row"
        numbers = [str(n) for n in (lines or [row + 1 for row in self.numbers(indices)])]
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
    where none of those without explains the data. `of_readings`: whether it takes "numbers" that
    were read for others, or their "columns", so that data of little variety may be explained either
    way.
    """

    code: str
    doc: str
    propose: Callable[[View], Iterator[Hypothesis]]
    free: bool = False
    of_readings: Literal["numbers", "columns"] | None = None


@dataclass(frozen=True)
class InspectionKind:
    """A registry's line: a kind of fault that shows in the data as such."""

    code: str
    doc: str
    inspect: Callable[[View], Iterator[Suspicion]]
