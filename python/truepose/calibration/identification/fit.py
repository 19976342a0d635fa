"""The fit: unknowns, their covariance, and what neither the data nor anything else determines.

Weighted nonlinear least squares with what is known beforehand as further equations. Directions that
leave every reading as it is, to first order, are held where the file has them: of all machines that
explain the readings equally well, the one nearest to the drawing is taken, distances measured in
standard deviations of the tolerances (of unknowns without one, in what one of their own would
change of the readings). That is the gauge rule; it holds for frames as for machine parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.approach import approach, rows_in_the_way
from truepose.calibration.identification.data_snooping import FEW, given_up
from truepose.calibration.identification.equations import (
    EXACT,
    FAINT,
    SETTLED,
    Equations,
    no_fit,
    whitened,
    whitened_jacobian,
)
from truepose.calibration.identification.placement import Placements, place_instruments
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.robust import LOSS_ROUNDS, noise_of, weights_of
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.measurements import Measurements
from truepose.errors import Problem as Refused
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.representation import Facts, Represented

SNOOPINGS = 10
"""Most times that it is asked which readings to give up; two or three do."""


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Represented):
    """Unknowns found from measurements, n of them from m observations.

    `values` (n,), `covariance` (n, n) over what is determined. `jacobian` (m, n): derivatives of
    the readings over their uncertainties, before robust weights. `residual` (m,): (predicted -
    measured) over the uncertainty; `before` (m,) the same with the machine as its file has it and
    only the instruments' unknowns fitted. `weights` (m,): of the robust loss, 1 where it changes
    nothing, 0 of a reading that was given up. `null_space` (k, n): unit directions, in values over
    `scale` (n,), that neither readings nor prior determine. `leverage` (m,): how much of itself
    each reading determines.
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
    problem: IdentificationProblem
    evaluations: int = 0
    noise: float = float("nan")
    """Residuals in stated uncertainties, robust, over their freedom; NaN where there is none."""
    unplaced: Flags = field(default_factory=lambda: np.zeros(0, np.bool_))
    """(n_row,) rows where the machine found cannot be assembled; their residuals are 0."""

    def _facts(self) -> Facts:
        yield "unknowns", self.unknowns.count
        yield "directions not determined", len(self.null_space)
        yield "rows", self.measurements.n_row
        yield "readings", self.measurements.n_observation
        yield "of less weight", int((self.weights < 1.0).sum())
        yield "residuals over their uncertainties", self.noise
        yield "tolerances used", self.use_prior

    @property
    def standardised(self) -> Floats:
        """(m,) residuals in units of their own standard deviation after the fit."""
        left = np.maximum(1.0 - self.leverage, 1e-12)
        # What a reading without weight differs by from the others holds their uncertainty too.
        variance = np.where(self.weights > 0.0, left, 1.0 + self.prediction / self.birge**2)
        standardised: Floats = self.residual / (self.birge * np.sqrt(variance))
        return standardised

    @property
    def prediction(self) -> Floats:
        """(m,) variances with which the fit predicts the readings, over the stated ones."""
        along = self.jacobian @ self.covariance
        variances: Floats = np.einsum("ij,ij->i", along, self.jacobian)
        return variances

    @property
    def redundancy(self) -> Floats:
        """(m,) redundancy numbers, 0 to 1: how much of an error of its own each reading shows.

        The diagonal of I less the hat matrix, of readings as they count; of one that was given up
        what it would be, did it count.
        """
        spread = self.prediction / self.birge**2
        of_given_up = 1.0 / (1.0 + spread)
        return np.where(self.weights > 0.0, np.clip(1.0 - self.leverage, 0.0, 1.0), of_given_up)

    @property
    def birge(self) -> float:
        """By what the stated uncertainties were multiplied, for fit and covariance: 1 or more.

        Where residuals are larger than they should be, readings weigh less against what was known
        beforehand (R. T. Birge, Phys. Rev. 40 (1932) 207-227).
        """
        return max(1.0, self.noise) if np.isfinite(self.noise) else 1.0

    @property
    def freedom(self) -> float:
        """Expected sum of squared residuals, were the stated uncertainties (and prior) right."""
        return float(np.sum((1.0 - self.leverage)[self.weights > 0.0]))

    @property
    def deviations(self) -> Floats:
        """(n,) standard uncertainties; infinite where an unknown is not determined."""
        deviations: Floats = np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))
        open_ = (np.abs(self.null_space) > 1e-6).any(axis=0)
        return np.where(open_, np.inf, deviations)


def fit(
    machine: Machine,
    measurements: Measurements,
    unknowns: Unknowns,
    *,
    use_prior: bool = True,
    robust: bool = True,
    placements: Placements | None = None,
) -> Fit:
    """Fit the unknowns to all rows of the measurements.

    `placements`: where the instruments stand for the machine as filed, if that is known already.

    Directions that the readings do not see, or too faintly for a search to follow them, are held.

    Raises `RequestError` (too-few-measurements) where more readings would see more and none can be
    spared, and (no-fit) where the search does not settle.
    """
    standing = place_instruments(machine, measurements) if placements is None else placements
    problem = IdentificationProblem(machine, standing.measurements, unknowns)
    as_filed = standing.as_filed(unknowns)
    prior = Prior.of(unknowns, tolerances=use_prior)
    values = unknowns.prior_mean
    slope = whitened(problem, values)
    equations = Equations.of(slope, prior, unknowns)
    require_enough(measurements, unknowns, equations, prior)
    counted = np.ones(measurements.n_observation, np.bool_)
    in_the_way, pardoned, given = np.zeros(measurements.n_row, np.bool_), False, 0
    weights, scale, noise = np.ones(measurements.n_observation), 1.0, float("nan")
    factor = weights
    evaluations, same = 0, True
    if robust:
        near = approach(problem, prior.with_rows(equations.gauge_rows()), values, counted)
        values, weights, evaluations = near.values, near.weights, near.evaluations
        in_the_way = problem.status(values) != 0
        counted = ~in_the_way[measurements.row]
        weights = weights * counted
    freed, left_out = np.empty((0, unknowns.count)), None
    holds = _firmer_holds(_extent(machine, unknowns))
    holding: Callable[[Equations], Floats] = Equations.gauge_rows
    for _ in range(LOSS_ROUNDS):
        held = prior.with_rows(holding(equations))
        solved = problem.solve(prior=held, weights=weights / scale**2, start=values)
        evaluations += solved.evaluations[0]
        # Readings that fit to the last digit leave nothing that a step could be judged by.
        exact = solved.cost[0] < EXACT**2 * measurements.n_observation
        settled = solved.ending[0] in SETTLED or exact
        jacobian = problem.jacobian(solved.values[0])
        usable = settled and np.isfinite(jacobian[counted]).all()
        if robust and not usable:
            ahead = rows_in_the_way(problem, held, solved.values[0], weights / scale**2)
            if ahead.any() and (in_the_way | ahead).sum() <= max(1, FEW * measurements.n_row):
                in_the_way |= ahead
                counted &= ~ahead[measurements.row]
                weights = weights * counted
                values = solved.values[0]
                continue
        if not (usable or same) and left_out is None:
            # What the first solution begins to see is seen too little to be followed.
            left_out = freed
            equations = Equations.of(factor[:, np.newaxis] * slope, prior, unknowns, left_out)
            continue
        if not usable and (firmer := next(holds, None)) is not None:
            holding, faint = firmer
            left_out = faint(equations)
            equations = Equations.of(factor[:, np.newaxis] * slope, prior, unknowns, left_out)
            continue
        if not settled:
            raise no_fit(problem, f"it ended as {solved.ending[0]}", np.empty(0, np.intp))
        values = solved.values[0]
        residual = problem.residual(values)
        slope = whitened_jacobian(problem, values, jacobian, counted)
        # Rows that only the way there could not pass count again, once.
        missing = problem.status(values) != 0
        back = in_the_way & ~missing & (not pardoned)
        pardoned |= bool(in_the_way.any())
        in_the_way = (in_the_way | missing) & ~back
        counted = (counted | back[measurements.row]) & ~in_the_way[measurements.row]
        freed = equations.null_space * equations.scale
        factor = np.sqrt(weights) / scale
        equations = Equations.of(factor[:, np.newaxis] * slope, prior, unknowns, left_out)
        covariance = equations.covariance
        leverage = np.square(slope @ equations.root).sum(axis=1) * factor**2
        residual = np.where(in_the_way[measurements.row], 0.0, residual)
        noise = noise_of(weights * residual, float(np.sum((1.0 - leverage)[weights > 0.0])))
        larger = max(1.0, noise) if np.isfinite(noise) else 1.0
        changed = weights_of(residual / larger) * counted if robust else weights
        # What nothing saw at the start may be seen where the machine really is.
        same = len(equations.null_space) == len(freed)
        if same and abs(larger / scale - 1.0) < 1e-3 and np.abs(changed - weights).max() < 1e-3:
            root = equations.root
            away = prior.rows @ (values - prior.mean)
            judged = ~in_the_way[measurements.row]
            kept = judged.copy()
            if robust and given < SNOOPINGS:
                kept[judged] = ~given_up(slope[judged], residual[judged], (prior.rows, away), root)
                given += 1
            if not robust or given == SNOOPINGS or np.array_equal(kept, counted):
                break
            counted = kept
            changed = weights_of(residual / larger) * counted
        weights, scale = changed, larger
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
        noise,
        in_the_way,
    )


def unfitted(
    measurements: Measurements, unknowns: Unknowns, placements: Placements, *, use_prior: bool
) -> Fit:
    """The machine as filed in the place of a fit, from readings of which none is used.

    Raises `RequestError` (no-fit) where a pose of it cannot be solved.
    """
    problem = IdentificationProblem(placements.machine, placements.measurements, unknowns)
    as_filed = placements.as_filed(unknowns)
    residual = problem.residual(as_filed)
    nothing = np.zeros(measurements.n_observation)
    slope = whitened(problem, as_filed)
    known = Prior.of(unknowns, tolerances=use_prior)
    equations = Equations.of(np.zeros_like(slope), known, unknowns)
    return Fit(
        unknowns,
        problem.measurements,
        as_filed,
        equations.covariance,
        slope,
        residual,
        residual,
        nothing,
        use_prior,
        equations.null_space,
        equations.scale,
        nothing,
        as_filed,
        problem,
        unplaced=np.zeros(measurements.n_row, np.bool_),
    )


def _extent(machine: Machine, unknowns: Unknowns) -> Floats:
    """(n,) what an unknown is small against: the machine's size, a radian; no end for others."""
    extents = {"m": machine.characteristic_length, "rad": 1.0}
    return np.array([extents.get(unit, np.inf) for unit in unknowns.units])


Hold = tuple[Callable[[Equations], Floats], Callable[[Equations], Floats]]
"""Of equations: the rows that hold what is not determined, and the directions that count as it."""


def _firmer_holds(extent: Floats) -> Iterator[Hold]:
    """What to try in turn where a search does not settle, the slightest change first."""
    for own_scale in (True, False):
        for share in FAINT:
            yield (
                partial(Equations.gauge_rows, extent=extent, own_scale=own_scale),
                partial(Equations.faint, extent=extent, share=share),
            )


def require_enough(
    measurements: Measurements, unknowns: Unknowns, equations: Equations, prior: Prior
) -> None:
    """Refuse readings of which none can be spared, and which leave directions open all the same.

    What counts is rank: unknowns that no reading sees ask for no reading, and a reading that says
    what others do is no equation more. `equations`: of readings and `prior`.

    Raises `RequestError` (too-few-measurements), saying how many readings are lacking.
    """
    lacking = len(equations.null_space)
    known = int(np.linalg.matrix_rank(prior.rows)) if len(prior.rows) else 0
    seen = unknowns.count - lacking - known
    if not lacking or seen < measurements.n_observation:
        return
    free = unknowns.count - known
    rows = max(measurements.n_row, 1)
    readings_a_row = max(measurements.n_observation // rows, 1)
    more = -(-lacking // readings_a_row)
    raise RequestError(
        Refused(
            "too-few-measurements",
            f"{measurements.n_observation} readings cannot determine {free} unknowns",
            measurements.file or None,
            found=f"{measurements.n_row} rows with {measurements.n_observation} readings",
            expected=f"{lacking} more readings: {more} more rows of the same kind at other poses, "
            f"and more to spare",
            hint="the tolerances are equations too: leave them in, or identify fewer parameters"
            if not len(prior.rows)
            else None,
        )
    )
