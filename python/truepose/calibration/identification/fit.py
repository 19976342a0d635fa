"""The fit: unknowns, their covariance, and what neither the data nor anything else determines.

Weighted nonlinear least squares with what is known beforehand as further equations. Directions that
leave every reading as it is, to first order, are held where the file has them: of all machines that
explain the readings equally well, the one nearest to the drawing is taken, distances measured in
standard deviations of the tolerances (of unknowns without one, in what one of their own would
change of the readings). That is the gauge rule; it holds for frames as for machine parameters.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.data_snooping import UNCHECKED
from truepose.calibration.identification.equations import Equations, whitened
from truepose.calibration.identification.placement import Placements, place_instruments
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.robust import LOSS_ROUNDS
from truepose.calibration.identification.rounds import Rounds
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.measurements import Measurements
from truepose.errors import Problem as Refused
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.representation import Facts, Represented


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
        """(m,) residuals in units of their own standard deviation after the fit.

        0 where nothing checks a reading: its residual is rounding, and so is its deviation.
        """
        left = 1.0 - self.leverage
        # What a reading without weight differs by from the others holds their uncertainty too.
        variance = np.where(self.weights > 0.0, left, 1.0 + self.prediction / self.birge**2)
        checked = variance > UNCHECKED
        deviation = self.birge * np.sqrt(np.where(checked, variance, 1.0))
        return np.where(checked, self.residual / deviation, 0.0)

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
    slope = whitened(problem, unknowns.prior_mean)
    equations = Equations.of(slope, prior, unknowns)
    require_enough(measurements, unknowns, equations, prior)
    extent = _extent(machine, unknowns)
    rounds = Rounds(problem, prior, slope, equations, extent, robust=robust)
    rounds.settle(LOSS_ROUNDS)
    return Fit(
        unknowns,
        problem.measurements,
        rounds.values,
        rounds.equations.covariance,
        rounds.slope,
        rounds.residual,
        problem.residual(as_filed),
        rounds.weights,
        use_prior,
        rounds.equations.null_space,
        rounds.equations.scale,
        np.clip(rounds.leverage, 0.0, 1.0),
        as_filed,
        problem,
        rounds.evaluations,
        rounds.noise,
        rounds.in_the_way,
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
