"""The way to the fit, on which a few wrong readings lead nowhere.

A least-squares step from the drawing weighs readings by their stated noise, and one that is off by
a thousand times that bends the machine until other rows cannot be assembled. So the first steps
weigh them by how far off the readings are at present: the median of their sizes, which half of them
would have to be wrong to move (P. J. Huber, Robust Statistics (1981), 6.6 and 7.7; the scale falls
as the fit gets nearer). A row that stands in the way, because the machine could not be assembled
there, loses its weight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.identification.problem import IdentificationProblem, Prior
from truepose.calibration.identification.robust import weights_of

NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median size."""

STEPS = 4
"""Evaluations between one weighing and the next."""

ROUNDS = 30

SLOWER = 0.9
"""The scale falls to less than this, or the way is gone."""

GROSS = 0.5
"""Readings of a larger weight count in full when the fit begins."""

ALONG = (1e-6, 1e-4, 1e-2, 0.1, 0.3, 1.0)
"""Shares of a step at which rows are looked at, the first that cannot be assembled."""


@dataclass(frozen=True, eq=False)
class Approach:
    """`values` (n,) near the fit, and `weights` (m,) there: what is far off has little."""

    values: Floats
    weights: Floats
    evaluations: int


def approach(
    problem: IdentificationProblem, held: Prior, start: Floats, counted: Flags
) -> Approach:
    """From `start` (n,) towards what most readings say; `held`: prior, and what is not determined.

    `counted` (m,): readings that have a weight at all.
    """
    values, scale, evaluations = start, np.inf, 0
    weights = counted.astype(np.float64)
    for _ in range(ROUNDS):
        residual = problem.residual(values)
        known = counted & np.isfinite(residual)
        spread = max(1.0, NORMAL * float(np.median(np.abs(residual[known]))))
        if not spread < SLOWER * scale:
            break
        scale = spread
        weights = np.zeros(residual.size)
        weights[known] = weights_of(residual[known] / scale)
        solved = problem.solve(
            prior=held, weights=weights / scale**2, start=values, most_evaluations=STEPS
        )
        if solved.ending[0] == "unreachable":
            break
        values = solved.values[0]
        evaluations += solved.evaluations[0]
    # What is only a little off may be so because the scale is still rough.
    return Approach(values, np.where(weights < GROSS, weights, 1.0), evaluations)


def rows_in_the_way(
    problem: IdentificationProblem, held: Prior, values: Floats, weights: Floats
) -> Flags:
    """(n_row,) the first rows on the way of a whole step from `values` that cannot be assembled.

    `weights` (m,) of squared residuals. None where all can, or where there is no step.
    """
    counted = weights > 0.0
    needed = np.zeros(problem.measurements.n_row, np.bool_)
    needed[problem.measurements.row[counted]] = True
    failing: Flags = needed & (problem.status(values) != 0)
    residual = problem.residual(values)[counted]
    slope = problem.jacobian(values)[counted]
    slope = slope / problem.measurements.uncertainty[counted, np.newaxis]
    if failing.any() or not (np.isfinite(slope).all() and np.isfinite(residual).all()):
        return failing
    factor = np.sqrt(weights[counted])
    equations = np.vstack([factor[:, np.newaxis] * slope, held.rows])
    right = np.concatenate([factor * residual, held.rows @ (values - held.mean)])
    step = -np.linalg.lstsq(equations, right, rcond=None)[0]
    for share in ALONG:
        failing = needed & (problem.status(values + share * step) != 0)
        if failing.any():
            break
    return failing
