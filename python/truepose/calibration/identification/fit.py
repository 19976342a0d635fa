"""The fit: unknowns, their covariance, and what neither the data nor anything else determines.

Weighted nonlinear least squares with what is known beforehand as further equations. Directions that
leave every reading as it is, to first order, are held where the file has them: of all machines that
explain the readings equally well, the one nearest to the drawing is taken, distances measured in
standard deviations of the tolerances (of unknowns without one, in what one of their own would
change of the readings). That is the gauge rule; it holds for frames as for machine parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.approach import approach, rows_in_the_way
from truepose.calibration.identification.data_snooping import FEW, given_up
from truepose.calibration.identification.frames import (
    FAR,
    TURNED,
    frame_starts,
    rebase_frame,
    rotated_starts,
)
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.robust import LOSS_ROUNDS, noise_of, weights_of
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.least_squares import singular_decomposition
from truepose.calibration.measurements import Measurements
from truepose.errors import Problem as Refused
from truepose.errors import RequestError
from truepose.machine import Machine

RANK = 1e-9
"""Singular values of the scaled equations below this share of the largest determine nothing."""

ROUNDING = 1e-13
"""Columns of the equations shorter than this share of the longest are rounding."""

HELD = 1e-3
"""Weight of the rows that hold an undetermined direction, in shares of the largest singular value;
no other equation acts on it."""

FIRM = 1e-3
"""Share of the machine, or radians, by which a held direction gives way to one standard
uncertainty: what readings see of it once the machine has moved must not pull it away."""

FAINT = (1.0, 0.1, 0.01, 1e-3)
"""Shares of the machine, or radians: directions known to no better than this by themselves are held
where the search does not settle, the faintest first."""

SNOOPINGS = 10
"""Most times that it is asked which readings to give up; two or three do."""

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


@dataclass(frozen=True, eq=False)
class Equations:
    """Whitened equations (r, n), of readings and prior, in values over `scale` (n,), decomposed."""

    scale: Floats
    singular: Floats
    directions: Floats
    """(n, n): rows are right singular vectors, in the order of `singular`."""

    @classmethod
    def of(
        cls,
        jacobian: Floats,
        prior: Prior,
        unknowns: Unknowns,
        left_out: Floats | None = None,
    ) -> Equations:
        """Scaled by the tolerances' standard deviations, else by their columns.

        Along `left_out` (k, n), in the unknowns' own units, nothing counts as determined.
        """
        equations = np.vstack([jacobian, prior.rows])
        norms = np.linalg.norm(equations, axis=0)
        # A column of rounding is none: scaled by its length it would seem well determined.
        nothing = norms <= ROUNDING * norms.max(initial=0.0)
        norms[nothing], equations[:, nothing] = 0.0, 0.0
        variances = np.diagonal(unknowns.prior_covariance)
        has_prior = np.isfinite(variances)
        scale = np.where(norms > 0.0, 1.0 / np.where(norms > 0.0, norms, 1.0), 1.0)
        scale[has_prior] = np.sqrt(variances[has_prior])
        scaled = equations * scale
        if left_out is not None and len(left_out):
            basis = np.linalg.qr((left_out / scale).T)[0].T
            scaled = scaled - scaled @ basis.T @ basis
        return cls(scale, *singular_decomposition(np.asarray(np.linalg.qr(scaled, mode="r"))))

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
        covariance: Floats = self.root @ self.root.T
        return covariance

    @property
    def root(self) -> Floats:
        """(n, r) whose product with its transpose is the covariance."""
        rows = self.directions[self.seen] / self.singular[self.seen, np.newaxis] * self.scale
        columns: Floats = rows.T
        return columns

    def faint(self, extent: Floats, share: float) -> Floats:
        """(k, n) directions, in the unknowns' own units, that are hardly determined.

        One standard uncertainty along them is more than `share` of `extent` (n,) of an unknown: a
        model that is linear over such a way is none, and a search does not come to its end.
        """
        steps = self.directions * self.scale
        lengths = np.abs(steps / extent).max(axis=1, initial=0.0)
        rows: Floats = steps[lengths > share * self.singular]
        return rows

    def gauge_rows(self, extent: Floats | None = None, *, own_scale: bool = True) -> Floats:
        """(k, n) rows that hold what is not determined.

        With `extent` (n,), firmly: one standard uncertainty of a row is at most `FIRM` of it. Held
        is what is across all else in values over `scale`, or, where not `own_scale`, over `extent`:
        a scale that faint columns gave says nothing once the machine has moved.
        """
        firmness = np.full(len(self.null_space), HELD * float(self.singular.max(initial=1.0)))
        rows: Floats = firmness[:, np.newaxis] * self.null_space / self.scale
        if extent is None:
            return rows
        steps = self.null_space * self.scale / extent
        lengths = np.abs(steps).max(axis=1, initial=0.0)
        loose = lengths > FIRM * firmness
        rows[loose] *= (lengths / (FIRM * firmness))[loose, np.newaxis]
        if not own_scale:
            rows[loose] = steps[loose] / (FIRM * lengths[loose, np.newaxis] * extent)
        return rows


def whitened(problem: IdentificationProblem, values: Floats) -> Floats:
    """(m, n) derivatives of the readings over their uncertainties.

    Raises `RequestError` (no-fit) where a pose of the machine with these values cannot be solved.
    """
    every = np.ones(problem.measurements.n_observation, np.bool_)
    return _whitened(problem, values, problem.jacobian(values), every)


def _whitened(
    problem: IdentificationProblem, values: Floats, jacobian: Floats, counted: Flags
) -> Floats:
    """The same of a Jacobian that is there; zero where a reading does not count and has none."""
    if not np.isfinite(jacobian[counted]).all():
        status = problem.status(values)
        rows = np.flatnonzero(status)
        raise _no_fit(problem, "a pose of it cannot be solved or is singular", rows)
    slope: Floats = jacobian / problem.measurements.uncertainty[:, np.newaxis]
    return np.where(np.isfinite(slope).all(axis=1, keepdims=True), slope, 0.0)


def fit(
    machine: Machine,
    measurements: Measurements,
    unknowns: Unknowns,
    *,
    use_prior: bool = True,
    robust: bool = True,
) -> Fit:
    """Fit the unknowns to all rows of the measurements.

    Directions that the readings do not see, or too faintly for a search to follow them, are held.

    Raises `RequestError` (too-few-measurements) where more readings would see more and none can be
    spared, and (no-fit) where the search does not settle.
    """
    problem, as_filed = place_instruments(machine, measurements, unknowns)
    known = Prior.of(unknowns) if use_prior else Prior.none(unknowns.count)
    prior = Prior(known.rows, unknowns.prior_mean)  # without tolerances, where the gauge holds
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
            raise _no_fit(problem, f"it ended as {solved.ending[0]}", np.empty(0, np.intp))
        values = solved.values[0]
        residual = problem.residual(values)
        slope = _whitened(problem, values, jacobian, counted)
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


def place_instruments(
    machine: Machine, measurements: Measurements, unknowns: Unknowns
) -> tuple[IdentificationProblem, Floats]:
    """The problem, its instruments where the machine as filed has them, and values (n,) of that.

    Of several starts of the frames the one that fits best is taken, one that settles before one
    that does not; frames that are still far from fitting are then tried in other rotations.

    Raises `RequestError` (no-fit) where from no start the readings can be followed.
    """
    best: tuple[bool, float, IdentificationProblem, Floats] | None = None
    refused: RequestError | None = None
    of = measurements.instrument[measurements.row]
    for number in [None, *unknowns.frames]:
        if number is None:
            starts = frame_starts(machine, measurements)
        elif best is None:
            starts = rotated_starts(machine, measurements, number)
        else:
            # Each instrument on its own: on a machine as filed none depends on another.
            residual = best[2].residual(best[3])[of == number]
            near = not best[0] and float(np.sum(residual**2)) <= FAR**2 * residual.size
            starts = [] if near else rotated_starts(machine, best[2].measurements, number)
        for start in starts:
            try:
                placed = _fit_instruments(machine, start, unknowns.of_instruments)
            except RequestError as failure:
                refused = failure
                continue
            if best is None or placed[:2] < best[:2]:
                best = placed
    if best is None:
        assert refused is not None
        raise refused
    alone, values = best[2].unknowns, best[3]
    standing = best[2].measurements
    turns = [at for own in alone.frames.values() for at in own[3:6] if at is not None]
    if np.abs(values[turns]).max(initial=0.0) > TURNED:
        standing = rebase_frame(standing, alone, values)
        values = _fit_instruments(machine, standing, alone)[3]
    of_all = np.concatenate([np.zeros(unknowns.n_machine), values])
    return IdentificationProblem(machine, standing, unknowns), of_all


def _fit_instruments(
    machine: Machine, measurements: Measurements, alone: Unknowns
) -> tuple[bool, float, IdentificationProblem, Floats]:
    """(whether unsettled, cost, problem, values) of the instruments' unknowns alone.

    They fit the machine as filed; an infinite cost where a reading is not finite.
    """
    problem = IdentificationProblem(machine, measurements, alone)
    values = np.zeros(alone.count)
    unsettled = False
    if alone.count:
        none = Prior.none(alone.count)
        held = none.with_rows(Equations.of(whitened(problem, values), none, alone).gauge_rows())
        solved = problem.solve(prior=held, start=values)
        values = solved.values[0]
        unsettled = solved.ending[0] not in SETTLED
    cost = float(np.sum(problem.residual(values) ** 2))
    if not np.isfinite(cost):
        return True, np.inf, problem, values
    return unsettled and cost > EXACT**2 * measurements.n_observation, cost, problem, values


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


def _no_fit(problem: IdentificationProblem, reason: str, rows: np.ndarray) -> RequestError:
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
