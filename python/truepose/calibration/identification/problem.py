"""Measurements and unknowns as the kernel's identification problem.

At every row the machine's parameters are nominal, plus what the error sources know of the row's
temperatures and loads, plus what the unknowns do; the reading follows by exact forward kinematics.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import Identification
from truepose.arrays import Floats, Indices
from truepose.calibration.acceptance.observability import prior_rows
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.machine import Condition, Machine
from truepose.representation import Facts, Represented
from truepose.runs.displacement import ParameterDeviation, sum_deviations
from truepose.sources import PoseBlock, acting
from truepose.sources.tolerance import DimensionalTolerance

TOLERANCES = (1e-16, 1e-10, 1e-13)
"""When a fit has settled: decrease of the cost, step, cosine of the gradient; all relative. What is
then left to go is far shorter than the last step: about that times the share that it was itself of
the one before."""

MOST_EVALUATIONS = 200


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the unknowns: |rows (u - mean)|^2 is added to the sum of squares.

    `rows` (r, n), `mean` (n,).
    """

    rows: Floats
    mean: Floats

    @classmethod
    def none(cls, count: int) -> Prior:
        """Nothing is known."""
        return cls(np.empty((0, count)), np.zeros(count))

    @classmethod
    def of(cls, unknowns: Unknowns, *, tolerances: bool = True) -> Prior:
        """The unknowns' own; without `tolerances` only what is known of the instruments."""
        known = unknowns.known_beforehand(tolerances=tolerances)
        return cls(prior_rows(known), unknowns.prior_mean)

    def with_rows(self, rows: Floats) -> Prior:
        """Further rows, about the same mean."""
        return Prior(np.vstack([self.rows, rows]), self.mean)


@dataclass(frozen=True, eq=False)
class Solved:
    """Fits of several sets of readings.

    `values` (n_set, n), `cost` (n_set,) sum of squares, of the prior too; `ending` (n_set,):
    "cost", "step", "gradient", or what prevented it: "stalled", "exhausted", "unreachable".
    """

    values: Floats
    cost: Floats
    ending: tuple[str, ...]
    evaluations: tuple[int, ...]


class IdentificationProblem(Represented):
    """What instruments read of a machine, as a function of the unknowns."""

    def __init__(
        self,
        machine: Machine,
        measurements: Measurements,
        unknowns: Unknowns,
        shifts: ParameterDeviation | None = None,
    ) -> None:
        """`shifts`: what `row_shifts` says, where that is known already.

        Raises `TrueposeError` where a row's condition asks for what the machine does not say.
        """
        self.machine, self.measurements, self.unknowns = machine, measurements, unknowns
        self._each_pose = measurements.with_second_poses()
        if shifts is None:
            shifts = row_shifts(machine, measurements, unknowns)
        self.shifts = shifts
        self._kernel = Identification(machine.kernel, self._description())

    def _facts(self) -> Facts:
        yield "machine", self.machine
        yield "rows", self.measurements.n_row
        yield "readings", self.measurements.n_observation
        yield "unknowns", self.unknowns.count

    def predict(self, values: ArrayLike) -> Floats:
        """(n_observation,) what would be read, SI; NaN where a pose cannot be solved."""
        return self._kernel.predict(values)[0]

    def status(self, values: ArrayLike) -> np.ndarray:
        """(n_row,) kernel status of each row's pose, of two that of the first that fails.

        0 of what needs no pose.
        """
        status: np.ndarray = self._kernel.predict(values)[1]
        of_rows = status[: self.measurements.n_row].copy()
        between = np.flatnonzero(self.measurements.between)
        second = status[self.measurements.n_row :]
        of_rows[between] = np.where(of_rows[between] == 0, second, of_rows[between])
        of_rows[~self.measurements.posed] = 0
        return of_rows

    def jacobian(self, values: ArrayLike) -> Floats:
        """(n_observation, n) derivatives of `predict`; NaN where a pose cannot be solved."""
        return self._kernel.jacobian(values)[0]

    def residual(self, values: ArrayLike) -> Floats:
        """(n_observation,) (predicted - measured) / uncertainty; angles by the shorter way."""
        away = self.predict(values) - self.measurements.value
        away[self._turning] -= 2.0 * np.pi * np.round(away[self._turning] / (2.0 * np.pi))
        return away / self.measurements.uncertainty

    @property
    def _turning(self) -> np.ndarray:
        names = ("a", "b", "c", "angle")
        flags: np.ndarray = np.isin(
            self.measurements.observable, [OBSERVABLES.index(name) for name in names]
        )
        return flags

    def solve(
        self,
        measured: ArrayLike | None = None,
        *,
        prior: Prior | None = None,
        weights: ArrayLike | None = None,
        start: ArrayLike | None = None,
        tolerances: tuple[float, float, float] = TOLERANCES,
        most_evaluations: int = MOST_EVALUATIONS,
    ) -> Solved:
        """Values that explain the readings best.

        `measured` (n_observation,) or (n_set, n_observation), default the measurements' own; every
        set is fitted alone, from `start` (n,), default the prior's mean. `weights` (n_observation,)
        multiply squared residuals; a row of which all are 0 need not be solved. `prior`: default
        the unknowns' own where they have one. `tolerances`: when the search has settled.
        """
        known = Prior.of(self.unknowns) if prior is None else prior
        read = np.atleast_2d(self.measurements.value if measured is None else measured)
        factor = 1.0 / self.measurements.uncertainty
        if weights is not None:
            factor = factor * np.sqrt(np.asarray(weights, np.float64))
        values, cost, ending, evaluations = self._kernel.solve(
            read,
            factor,
            known.rows,
            known.mean,
            known.mean if start is None else start,
            tolerances,
            most_evaluations,
        )
        return Solved(values, cost, tuple(ending), tuple(evaluations))

    def _description(self) -> dict[str, object]:
        measurements, unknowns = self.measurements, self.unknowns
        poses = self._each_pose
        columns, shifts = self.shifts
        terms, coefficients = self._terms(columns, shifts)
        order = np.argsort(measurements.row, kind="stable")
        if not np.array_equal(order, np.arange(order.size)):
            raise ValueError("observations are not in the order of their rows")
        by = measurements.instrument[measurements.row]
        between = np.flatnonzero(measurements.between).tolist()
        second = {row: measurements.n_row + at for at, row in enumerate(between)}
        observations = [
            (int(row), second.get(int(row)), int(number), int(what), max(int(strut), 0), bias)
            for row, number, what, strut, bias in zip(
                measurements.row,
                by,
                measurements.observable,
                measurements.strut,
                (
                    unknowns.biases.get((int(number), int(what), int(strut)))
                    for number, what, strut in zip(
                        by, measurements.observable, measurements.strut, strict=True
                    )
                ),
                strict=True,
            )
        ]
        return {
            "unknowns": unknowns.count,
            "joints": poses.joints.ravel().tolist(),
            "starts": poses.placements.ravel().tolist(),
            "shifted": columns.tolist(),
            "shifts": shifts.ravel().tolist(),
            "terms": terms,
            "coefficients": coefficients.ravel().tolist(),
            "instruments": [
                {
                    "frame": [*instrument.frame.origin, *instrument.frame.rotation],
                    "target": list(instrument.target),
                    "axis": list(instrument.axis),
                    "zero": list(instrument.zero),
                    "on_platform": instrument.end == "platform",
                    "unknowns": list(unknowns.frames.get(number, (None,) * 9)),
                }
                for number, instrument in enumerate(measurements.instruments)
            ],
            "observations": observations,
        }

    def _terms(self, columns: Indices, shifts: Floats) -> tuple[list[tuple[int, int]], Floats]:
        """(unknown, parameter) of every effect, and the coefficients (1 or n_pose, n_term)."""
        unknowns = self.unknowns
        at, numbers = np.nonzero(unknowns.effects)
        terms = [
            (int(number), int(unknowns.columns[place]))
            for place, number in zip(at, numbers, strict=True)
        ]
        constant = unknowns.effects[at, numbers][np.newaxis, :]
        if not unknowns.properties:
            return terms, constant
        parts = [np.repeat(constant, self._each_pose.n_row, axis=0)]
        for number, change in property_effects(
            self.machine, self._each_pose, unknowns, (columns, shifts)
        ):
            own, slopes = change
            terms += [(number, int(column)) for column in own]
            parts.append(slopes)
        return terms, np.hstack(parts)


def row_shifts(
    machine: Machine, measurements: Measurements, unknowns: Unknowns
) -> ParameterDeviation:
    """Parameters (k,) and how far every row's condition is known to move them (n_pose, k).

    By every source but the tolerances, whose middles are where unknowns start. A strut whose
    expansion is to be found need not have one in the file. Parts that were measured by themselves
    were cold and without loads.
    """
    measurements = measurements.with_second_poses()
    known = machine
    for identified in unknowns.properties.values():
        started = identified.changed(known, 0.0)
        assert started is not None  # looked at where the unknowns were chosen
        known = started
    parts: list[tuple[np.ndarray, ParameterDeviation]] = []
    for rows, condition in _by_condition(measurements):
        parts.append((rows, _shifts(known, measurements, condition, rows)))
    columns = np.unique(np.concatenate([deviation[0] for _, deviation in parts])).astype(np.intp)
    shifts = np.zeros((measurements.n_row, columns.size))
    for rows, (own, values) in parts:
        place = np.searchsorted(columns, own)
        shifts[np.ix_(rows, place)] = np.broadcast_to(values, (rows.size, own.size))
    shifts[~measurements.posed] = 0.0
    used = shifts.any(axis=0)
    return columns[used], np.ascontiguousarray(shifts[:, used])


def property_effects(
    machine: Machine, measurements: Measurements, unknowns: Unknowns, base: ParameterDeviation
) -> Iterator[tuple[int, ParameterDeviation]]:
    """(number, (parameters, their change (n_row, k) per unit)) of every unknown property."""
    for number, identified in unknowns.properties.items():
        changed = identified.changed(machine, identified.step)
        assert changed is not None
        shifts = row_shifts(changed, measurements, unknowns)
        columns, total = sum_deviations([shifts, (base[0], -base[1])])
        slopes = total / identified.step
        used = slopes.any(axis=0)
        yield number, (columns[used], slopes[:, used])


def _by_condition(measurements: Measurements) -> Iterator[tuple[np.ndarray, Condition]]:
    rows: dict[int, list[int]] = {}
    for row, condition in enumerate(measurements.conditions):
        rows.setdefault(id(condition), []).append(row)
    for numbers in rows.values():
        yield np.array(numbers, np.intp), measurements.conditions[numbers[0]]


def _shifts(
    machine: Machine, measurements: Measurements, condition: Condition, rows: np.ndarray
) -> ParameterDeviation:
    sources = [
        source
        for source in acting(machine, condition)
        if not isinstance(source, DimensionalTolerance)
    ]
    if not sources:
        return np.empty(0, np.intp), np.empty((1, 0))
    joints, placements = measurements.joints[rows], measurements.placements[rows]
    commanded = [machine.dof.index(name) for name in machine.commanded]
    poses = np.ascontiguousarray(machine.kernel.pose_of(placements)[:, commanded])
    block = PoseBlock(machine, condition, poses, np.arange(rows.size), joints, placements)
    parts = []
    for source in sources:
        deviation = source.deviation(machine, condition, block)
        shifted = deviation.shift.any(axis=0)
        parts.append((deviation.parameters[shifted], deviation.shift[:, shifted]))
    return sum_deviations(parts)


__all__ = ["IdentificationProblem", "Prior", "Solved", "row_shifts"]
