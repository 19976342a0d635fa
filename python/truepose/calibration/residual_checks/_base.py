"""What is left of the readings after a fit, and what further columns would take of it.

Whether the residuals r hold a pattern g that no unknown explains is asked by adding it to the
equations of the fit (added variables: Cook & Weisberg, Residuals and Influence in Regression, 1982,
2.4; Rao's score test): with J the whitened, weighted derivatives, C the fit's covariance and G the
whitened pattern,

    M = G^T G - G^T J C J^T G,    size = -M^-1 G^T r,    T = (G^T r)^T M^-1 (G^T r),

J C J^T as Q Q^T, Q an orthonormal basis of the equations, and T over its degrees of freedom and the
mean square that it leaves is compared with Fisher's F. What the machine's unknowns take for the
pattern moves the tool by S C J^T G size.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.acceptance.tool_uncertainty import Tool, ToolUncertainty
from truepose.calibration.identification.equations import Equations
from truepose.calibration.identification.fit import Fit
from truepose.calibration.identification.frames import moved_frame
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.robust import OUTLIER
from truepose.calibration.instruments import Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import UNITS
from truepose.machine import Machine
from truepose.probability.f_distribution import f_tail

ALARM = 2e-4
"""Probability of a false alarm, of each kind, over all its tests of one instrument."""

SEEN = 1e-6
"""Share of a pattern that the unknowns leave over, below which nothing can be said of it."""

SPARE = 4.0
"""Degrees of freedom that must be left."""

STEP = 1e-5
"""m and rad of differences."""

LEAST_GIVEN_UP = 4
"""Readings that were given up, from which they may be more than single mistakes."""

RESTORED = 0.8
"""Share of them that a pattern must explain."""

COVERAGE = 1.0
"""Standard uncertainties of the tool beyond which a pattern is too much of what is stated of it:
with one half of that taken up by an error that is not noise, the rest does not cover the noise."""


@dataclass(frozen=True, eq=False)
class Pattern:
    """What was found in the residuals of one instrument.

    `sizes` (k,): of each column, 0 in what cannot be seen; `probability`: of as much by chance.
    `moved`: m, by how much the tool is then off, at most; `beyond`: whether that is more than is
    stated of it.
    """

    sizes: Floats
    probability: float
    moved: float
    beyond: bool


@dataclass(frozen=True, eq=False)
class Left:
    """What a fit leaves: `residual` (m,) over the stated uncertainties, and their `weights`.

    `basis` (m, r): readings' part of an orthonormal basis of the fit's equations, `root` (n, r)
    what the unknowns do along it: J root is `basis`, root root^T the covariance C as the stated
    uncertainties have it. `freedom` of the residuals.
    """

    weights: Floats
    residual: Floats
    basis: Floats
    root: Floats
    freedom: float

    @classmethod
    def of(cls, fitted: Fit) -> Left:
        """As it was fitted."""
        return replace(cls._with_weights(fitted, fitted.weights), freedom=fitted.freedom)

    @classmethod
    def with_given_up(cls, fitted: Fit, number: int) -> Left | None:
        """With the readings of an instrument that the fit gave up, as one linear step has it.

        What was given up for wrong may be right of an instrument that stands elsewhere. None where
        too few were given up for that.
        """
        back = given_up(fitted, number)
        if back.sum() < LEAST_GIVEN_UP:
            return None
        return cls._with_weights(fitted, np.where(back, 1.0, fitted.weights))

    @classmethod
    def _with_weights(cls, fitted: Fit, weights: Floats) -> Left:
        """What other weights leave, to first order about the fit.

        From an orthonormal basis: of a pattern that the unknowns take up but for a hundredth, the
        difference of two products with a covariance would be rounding.
        """
        factor = np.sqrt(weights)
        known = Prior.of(fitted.unknowns, tolerances=fitted.use_prior)
        prior = Prior(fitted.birge * known.rows, known.mean)
        slope = factor[:, np.newaxis] * fitted.jacobian
        determined = Equations.of(slope, prior, fitted.unknowns).root
        orthonormal, upper = np.linalg.qr(np.vstack([slope, prior.rows]) @ determined)
        root = np.linalg.solve(upper.T, determined.T).T
        away = prior.rows @ (fitted.values - prior.mean)
        step = -root @ (orthonormal.T @ np.concatenate([factor * fitted.residual, away]))
        basis = orthonormal[: factor.size]
        leverage = np.sum(basis**2, axis=1)
        freedom = float(np.sum((1.0 - leverage)[weights > 0.0]))
        return cls(weights, fitted.residual + fitted.jacobian @ step, basis, root, freedom)


def given_up(fitted: Fit, number: int) -> Flags:
    """(m,) readings of an instrument that were given up, of rows that could be placed."""
    data = fitted.measurements
    flags: Flags = (fitted.weights == 0.0) & (data.instrument[data.row] == number)
    return flags & ~fitted.unplaced[data.row]


@dataclass(frozen=True, eq=False)
class ResidualsView:
    """The residuals of one instrument after the fit.

    `own` (k,): its observations. `tool` and `after`: effects of the machine's unknowns at the tool,
    and how uncertain it is stated to be. `left`: what the readings differ by, of all instruments.
    """

    machine: Machine
    fitted: Fit
    tool: Tool
    after: ToolUncertainty
    number: int
    left: Left

    @property
    def data(self) -> Measurements:
        """All that was fitted."""
        return self.fitted.measurements

    @property
    def instrument(self) -> Instrument:
        """The one whose residuals these are."""
        return self.data.instruments[self.number]

    @cached_property
    def own(self) -> Indices:
        """(k,) its observations among all."""
        return np.flatnonzero(self.data.instrument[self.data.row] == self.number)

    @cached_property
    def rows(self) -> Indices:
        """(n,) its rows, in the order of the file."""
        return np.unique(self.data.row[self.own])

    @cached_property
    def place(self) -> Indices:
        """(k,) which of its rows each observation is of."""
        return np.searchsorted(self.rows, self.data.row[self.own])

    @cached_property
    def _factor(self) -> Floats:
        return np.sqrt(self.left.weights[self.own])

    @cached_property
    def _basis(self) -> Floats:
        return self.left.basis[self.own]

    @cached_property
    def _left(self) -> Floats:
        return self._factor * self.left.residual[self.own]

    @cached_property
    def _squares(self) -> float:
        """Of all residuals, weighted."""
        return float(np.sum(self.left.weights * self.left.residual**2))

    @cached_property
    def by_frame(self) -> Floats:
        """(k, 6) what moves of the frame do to the readings, over their uncertainties."""

        def moved(axis: int, size: float) -> Instrument:
            frame = moved_frame(self.instrument.frame, size * np.eye(6)[axis])
            return replace(self.instrument, frame=frame)

        return self._by_difference(6, moved)

    @cached_property
    def by_target(self) -> Floats:
        """(k, 3) what moves of the target on the platform do to them."""

        def moved(axis: int, size: float) -> Instrument:
            target = np.array(self.instrument.target) + size * np.eye(3)[axis]
            return replace(self.instrument, target=(target[0], target[1], target[2]))

        return self._by_difference(3, moved)

    def _by_difference(self, count: int, moved: Callable[[int, float], Instrument]) -> Floats:
        columns = [
            (self._residual(moved(axis, STEP)) - self._residual(moved(axis, -STEP))) / (2.0 * STEP)
            for axis in range(count)
        ]
        table = np.stack(columns, axis=1)
        table[np.abs(table) < SEEN * np.abs(table).max(initial=0.0)] = 0.0
        return table

    def _residual(self, instrument: Instrument) -> Floats:
        instruments = list(self.data.instruments)
        instruments[self.number] = instrument
        there = replace(self.data, instruments=tuple(instruments))
        problem = IdentificationProblem(
            self.machine, there, self.fitted.unknowns, self.fitted.problem.shifts
        )
        residual: Floats = problem.residual(self.fitted.values)[self.own]
        return residual

    @cached_property
    def by_column(self) -> Floats:
        """(k, n_column) what a constant in each measured column does to it."""
        key = self.data.observable[self.own] * 100_000 + self.data.strut[self.own]
        columns = np.unique(key)
        table: Floats = (key[:, np.newaxis] == columns) / self._uncertainty[:, np.newaxis]
        return table

    @cached_property
    def _uncertainty(self) -> Floats:
        return self.data.uncertainty[self.own]

    @property
    def by_place(self) -> Floats:
        """(k, n) moves of its frame, or constants where it has none."""
        return self.by_frame if self.by_frame.any() else self.by_column

    def pattern(self, columns: Floats, tests: int = 1) -> Pattern | None:
        """The `columns` (k, n) in the residuals, one of so many `tests`; None where not seen."""
        whitened = self._factor[:, np.newaxis] * columns
        return self.pattern_of(
            whitened.T @ whitened, self._basis.T @ whitened, whitened.T @ self._left, tests
        )

    def steps(self, columns: Floats) -> Iterator[tuple[int, Floats, Floats, Floats]]:
        """(row, squares, products with the basis, with the residuals) of columns from there on.

        For every row but the first, added up from the last one.
        """
        whitened = self._factor[:, np.newaxis] * columns
        n = self.rows.size
        squares = np.zeros((n, columns.shape[1], columns.shape[1]))
        products = np.zeros((n, self._basis.shape[1], columns.shape[1]))
        left = np.zeros((n, columns.shape[1]))
        np.add.at(squares, self.place, whitened[:, :, np.newaxis] * whitened[:, np.newaxis, :])
        np.add.at(products, self.place, self._basis[:, :, np.newaxis] * whitened[:, np.newaxis, :])
        np.add.at(left, self.place, whitened * self._left[:, np.newaxis])
        for table in (squares, products, left):
            table[:] = np.cumsum(table[::-1], axis=0)[::-1]
        for row in range(1, n):
            yield row, squares[row], products[row], left[row]

    def pattern_of(
        self, squares: Floats, products: Floats, left: Floats, tests: int
    ) -> Pattern | None:
        """The same from sums: G^T G (k, k), Q^T G (r, k), G^T r (k,); Q: basis of the equations."""
        length = np.sqrt(np.diagonal(squares))
        if not (length > 0.0).any():
            return None
        length = np.where(length > 0.0, length, 1.0)
        normal = squares - products.T @ products
        values, vectors = np.linalg.eigh(normal / np.outer(length, length))
        seen = values > SEEN
        count = int(seen.sum())
        spare = self.left.freedom - count
        if count == 0 or spare < SPARE:
            return None
        along = vectors[:, seen].T @ (left / length)
        statistic = float(np.sum(along**2 / values[seen]))
        mean = max(1.0, (self._squares - statistic) / spare)
        probability = min(1.0, tests * f_tail(statistic / count / mean, count, spare))
        sizes = -(vectors[:, seen] @ (along / values[seen])) / length
        change = self.left.root @ (products @ sizes)
        return Pattern(sizes, probability, *self.tool_moved(change))

    def explains_given_up(self, pattern: Pattern, columns: Floats) -> bool:
        """Whether what was given up fits with `columns` (k, n) of a pattern's sizes."""
        change = self.left.root @ (self._basis.T @ (self._factor * (columns @ pattern.sizes)))
        slope = self.fitted.jacobian[self.own]
        left = self.left.residual[self.own] + columns @ pattern.sizes - slope @ change
        back = given_up(self.fitted, self.number)[self.own]
        fits = np.abs(left[back]) < OUTLIER * self.fitted.birge
        return bool(fits.mean() >= RESTORED)

    def tool_moved(self, change: Floats) -> tuple[float, bool]:
        """m by which other unknowns move the tool at most; whether that is too much."""
        return self.tool.displacement(change, self.after, COVERAGE)

    def hidden(self, columns: Floats, size: float) -> tuple[float, bool]:
        """m by which so large a column, not seen in the residuals, moves the tool; if beyond.

        Of the columns (k, n) the one that does the most; 0 where all would be seen.
        """
        whitened = self._factor[:, np.newaxis] * columns
        worst, beyond = 0.0, False
        for column in whitened.T:
            product = self._basis.T @ column
            left = float(column @ column - product @ product)
            if left * size**2 >= WOULD_SHOW**2:
                continue
            moved, farther = self.tool_moved(self.left.root @ product * size)
            if moved > worst:
                worst, beyond = moved, farther
        return worst, beyond

    @property
    def of_lengths(self) -> Flags:
        """(k,) which of its readings are lengths."""
        flags: Flags = np.array([unit == "m" for unit in UNITS])[self.data.observable[self.own]]
        return flags

    def named_rows(self, first: int, last: int) -> str:
        """Between which two of its rows, or their lines in the file."""
        lines = self.data.lines[self.rows[[first, last]]]
        if lines.all():
            return f"between lines {lines[0]} and {lines[1]}"
        numbers = self.data.row_numbers[self.rows[[first, last]]] + 1
        return f"between rows {numbers[0]} and {numbers[1]}"


WOULD_SHOW = 5.0
"""Standard deviations of a pattern that would be seen almost certainly."""


@dataclass(frozen=True, eq=False)
class Finding:
    """A pattern, its `columns` (k, n), what is said of it, and the rows from which it is."""

    pattern: Pattern
    columns: Floats
    words: str
    rows: tuple[int, ...] = ()


@dataclass(frozen=True)
class PatternKind:
    """A registry's line: `inspect(view)` gives what it finds, or None."""

    code: str
    doc: str
    inspect: Callable[[ResidualsView], Finding | None]
