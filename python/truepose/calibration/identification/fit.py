"""The fit: unknowns, their covariance, and what neither the data nor anything else determines.

Weighted nonlinear least squares with what is known beforehand as further equations. Directions that
leave every reading as it is, to first order, are held where the file has them: of all machines that
explain the readings equally well, the one nearest to the drawing is taken, distances measured in
standard deviations of the tolerances (of unknowns without one, in what one of their own would
change of the readings). That is the gauge rule; it holds for frames as for machine parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.calibration.identification.frames import with_frames_found
from truepose.calibration.identification.problem import Prior, Problem
from truepose.calibration.identification.robust import LOSS_ROUNDS, weights_of
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.measurements import Measurements
from truepose.errors import Problem as Refused
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.sources._base import Floats

RANK = 1e-9
"""Singular values of the scaled equations below this share of the largest determine nothing."""

ROUNDING = 1e-13
"""Columns of the equations shorter than this share of the longest are rounding."""

HELD = 1e-3
"""How firmly an undetermined direction is held, in shares of the largest singular value: it is
nowhere else, for nothing pulls at it."""

SETTLED = ("cost", "step", "gradient")

EXACT = 1e-6
"""Residuals, in uncertainties, that are taken for rounding."""


@dataclass(frozen=True, eq=False)
class Fit:
    """Unknowns found from measurements, n of them from m observations.

    `values` (n,), `covariance` (n, n) over what is determined. `jacobian` (m, n): derivatives of
    the readings over their uncertainties, before robust weights. `residual` (m,): (predicted -
    measured) over the uncertainty; `before` (m,) the same with the machine as its file has it and
    only the instruments' unknowns fitted. `weights` (m,): of the robust loss, 1 where it changes
    nothing. `null_space` (k, n): unit directions, in values over `scale` (n,), that neither
    readings nor prior determine. `leverage` (m,): how much of itself each reading determines.
    """

    unknowns: Unknowns
    measurements: Measurements
    values: Floats
    covariance: Floats
    jacobian: Floats
    residual: Floats
    before: Floats
    weights: Floats
    use_prior: bool
    null_space: Floats
    scale: Floats
    leverage: Floats
    as_filed: Floats
    """(n,) the machine as filed, 0, and where the instruments then are."""
    problem: Problem
    evaluations: int = 0

    @property
    def standardised(self) -> Floats:
        """(m,) residuals in units of their own standard deviation after the fit."""
        left = np.maximum(1.0 - self.leverage, 1e-12)
        standardised: Floats = self.residual / np.sqrt(left)
        return standardised

    @property
    def freedom(self) -> float:
        """Expected sum of squared residuals, were the stated uncertainties (and prior) right."""
        return float(np.sum(1.0 - self.leverage))

    @property
    def deviations(self) -> Floats:
        """(n,) standard uncertainties; infinite where an unknown is not determined."""
        found: Floats = np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))
        open_ = (np.abs(self.null_space) > 1e-6).any(axis=0)
        return np.where(open_, np.inf, found)


@dataclass(frozen=True, eq=False)
class Equations:
    """Whitened equations (r, n), of readings and prior, in values over `scale` (n,), decomposed."""

    scale: Floats
    singular: Floats
    directions: Floats
    """(n, n): rows are right singular vectors, in the order of `singular`."""

    @classmethod
    def of(cls, jacobian: Floats, prior: Prior, unknowns: Unknowns) -> Equations:
        """Scaled by the tolerances' standard deviations, else by their columns."""
        equations = np.vstack([jacobian, prior.rows])
        norms = np.linalg.norm(equations, axis=0)
        # A column of rounding is none: scaled by its length it would seem well determined.
        nothing = norms <= ROUNDING * norms.max(initial=0.0)
        norms[nothing], equations[:, nothing] = 0.0, 0.0
        variances = np.diagonal(unknowns.prior_covariance)
        known = np.isfinite(variances)
        scale = np.where(norms > 0.0, 1.0 / np.where(norms > 0.0, norms, 1.0), 1.0)
        scale[known] = np.sqrt(variances[known])
        count = unknowns.count
        factor = np.linalg.qr(equations * scale, mode="r")
        _, found, directions = np.linalg.svd(factor, full_matrices=True)
        singular = np.zeros(count)
        singular[: found.size] = found
        return cls(scale, singular, directions)

    @property
    def seen(self) -> np.ndarray:
        """(n,) which directions are determined."""
        flags: np.ndarray = self.singular > RANK * max(
            float(self.singular.max(initial=0.0)), 1e-300
        )
        return flags

    @property
    def null_space(self) -> Floats:
        """(k, n) unit directions that are not, in values over `scale`."""
        rows: Floats = self.directions[~self.seen]
        return rows

    @property
    def covariance(self) -> Floats:
        """(n, n) over what is determined, in the unknowns' own units."""
        rows = self.directions[self.seen] / self.singular[self.seen, np.newaxis] * self.scale
        covariance: Floats = rows.T @ rows
        return covariance

    def holding(self) -> Floats:
        """(k, n) rows that hold what is not determined."""
        firmness = HELD * float(self.singular.max(initial=1.0))
        rows: Floats = firmness * self.null_space / self.scale
        return rows


def whitened(problem: Problem, values: Floats) -> Floats:
    """(m, n) derivatives of the readings over their uncertainties.

    Raises `RequestError` (no-fit) where a pose of the machine with these values cannot be solved.
    """
    jacobian = problem.jacobian(values)
    if not np.isfinite(jacobian).all():
        status = problem.status(values)
        rows = np.flatnonzero(status)
        raise _no_fit(problem, "a pose of it cannot be solved or is singular", rows)
    slope: Floats = jacobian / problem.measurements.uncertainty[:, np.newaxis]
    return slope


def fit(
    machine: Machine,
    measurements: Measurements,
    unknowns: Unknowns,
    *,
    use_prior: bool = True,
    robust: bool = True,
    start: Floats | None = None,
) -> Fit:
    """Fit the unknowns to all rows of the measurements.

    Raises `RequestError` (too-few-measurements) where there are fewer equations than unknowns, and
    (no-fit) where the search does not settle.
    """
    require_enough(measurements, unknowns, use_prior)
    problem, as_filed = placed(machine, measurements, unknowns)
    prior = Prior.of(unknowns) if use_prior else Prior.none(unknowns.count)
    prior = Prior(prior.rows, unknowns.prior_mean)
    values = unknowns.prior_mean if start is None else start
    equations = Equations.of(whitened(problem, values), prior, unknowns)
    weights = np.ones(measurements.n_observation)
    evaluations = 0
    for _ in range(LOSS_ROUNDS if robust else 1):
        held = prior.with_rows(equations.holding())
        solved = problem.solve(prior=held, weights=weights, start=values)
        evaluations += solved.evaluations[0]
        # Readings that fit to the last digit leave nothing that a step could be judged by.
        exact = solved.cost[0] < EXACT**2 * measurements.n_observation
        if solved.ending[0] not in SETTLED and not exact:
            raise _no_fit(problem, f"it ended as {solved.ending[0]}", np.empty(0, np.intp))
        values = solved.values[0]
        residual = problem.residual(values)
        if not robust:
            break
        changed = weights_of(residual)
        if np.abs(changed - weights).max() < 1e-4:
            break
        weights = changed
    slope = whitened(problem, values)
    equations = Equations.of(np.sqrt(weights)[:, np.newaxis] * slope, prior, unknowns)
    covariance = equations.covariance
    leverage = weights * np.einsum("ij,jk,ik->i", slope, covariance, slope)
    return Fit(
        unknowns,
        problem.measurements,
        values,
        covariance,
        slope,
        residual,
        problem.residual(as_filed),
        weights,
        use_prior,
        equations.null_space,
        equations.scale,
        np.clip(leverage, 0.0, 1.0),
        as_filed,
        problem,
        evaluations,
    )


def placed(
    machine: Machine, measurements: Measurements, unknowns: Unknowns
) -> tuple[Problem, Floats]:
    """The problem, its instruments where the machine as filed has them, and values (n,) of that.

    Of several starts of the frames the one that fits best is taken.
    """
    best: tuple[float, Problem, Floats] | None = None
    for each in with_frames_found(machine, measurements):
        problem = Problem(machine, each, unknowns)
        values = np.zeros(unknowns.count)
        values[unknowns.n_machine :] = _instruments(machine, each, unknowns)
        cost = float(np.sum(problem.residual(values) ** 2))
        if best is None or cost < best[0]:
            best = (cost, problem, values)
    assert best is not None
    return best[1], best[2]


def _instruments(machine: Machine, measurements: Measurements, unknowns: Unknowns) -> Floats:
    """Values of the instruments' unknowns that fit the machine as filed."""
    alone = unknowns.of_instruments
    start = np.zeros(alone.count)
    if not alone.count:
        return start
    problem = Problem(machine, measurements, alone)
    none = Prior.none(alone.count)
    held = none.with_rows(Equations.of(whitened(problem, start), none, alone).holding())
    values: Floats = problem.solve(prior=held, start=start).values[0]
    return values


def require_enough(measurements: Measurements, unknowns: Unknowns, use_prior: bool) -> None:
    """Refuse fewer equations than unknowns: how many more, and of what kind."""
    free = unknowns.count
    if use_prior:
        free -= int(unknowns.has_prior.sum())
    lacking = free - measurements.n_observation
    if lacking <= 0:
        return
    rows = max(measurements.n_row, 1)
    each = max(measurements.n_observation // rows, 1)
    more = -(-lacking // each)
    raise RequestError(
        Refused(
            "too-few-measurements",
            f"{measurements.n_observation} readings cannot determine {free} unknowns",
            measurements.file or None,
            found=f"{measurements.n_row} rows with {measurements.n_observation} readings",
            expected=f"{lacking} more readings: {more} more rows of the same kind at other poses, "
            f"and more to spare",
            hint=None
            if use_prior
            else "the tolerances are equations too: leave them in, or identify fewer parameters",
        )
    )


def _no_fit(problem: Problem, reason: str, rows: np.ndarray) -> RequestError:
    measurements = problem.measurements
    line = int(measurements.lines[rows[0]]) if rows.size and measurements.lines[rows[0]] else None
    return RequestError(
        Refused(
            "no-fit",
            f"no machine was found that explains the measurements: {reason}",
            measurements.file or None,
            line,
            found=f"{rows.size} such rows" if rows.size else "a search that does not settle",
            expected="measurements of this machine, near its nominal geometry",
            hint="look at the suspicions, at the units and at the frame of the instrument",
        )
    )


def names_of(unknowns: Unknowns, numbers: Sequence[int]) -> str:
    """`length of strut 1, delta radius`."""
    return ", ".join(unknowns.labels[number] for number in numbers)
