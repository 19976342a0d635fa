"""Dense weighted nonlinear least squares on callbacks: the kernel's scaled trust region.

The method, with its sources, is in crates/kernel/src/identification/trust_region.rs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import least_squares as solve_least_squares
from truepose.arrays import Floats

Residual = Callable[[Floats], Floats]
Status = Literal["cost", "step", "gradient", "stalled", "exhausted"]

CONVERGED: tuple[Status, ...] = ("cost", "step", "gradient")

EPSILON = float(np.finfo(np.float64).eps)


@dataclass(frozen=True)
class Tolerances:
    """When to stop, all relative, so that no unit matters.

    `cost`: decrease of the sum of squares that the linear model promises; far below rounding of
    the sum itself, since a value's digits are the square root of it. `step`: the step, or the trust
    region, in the norm |D x|. `gradient`: largest cosine between the residual and a column of the
    Jacobian.
    """

    cost: float = 1e-24
    step: float = 1e-12
    gradient: float = 1e-13


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the iteration ended.

    `values` (n,). `residual` (m,) and `jacobian` (m, n), weighted, at `values`. `cost`: sum of
    squares of `residual`. `status`: which test ended it; `cost`, `step` and `gradient` are
    convergence, `stalled` means that no step lowers the cost although none of them holds (a wrong
    Jacobian does that, or one that is nowhere finite about the point),
    `exhausted` that the evaluations allowed were used up.
    """

    values: Floats
    residual: Floats
    jacobian: Floats
    cost: float
    status: Status
    evaluations: int
    iterations: int

    @property
    def converged(self) -> bool:
        """Whether a convergence test held."""
        return self.status in CONVERGED


def least_squares(
    residual: Residual,
    jacobian: Residual,
    start: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    scale: ArrayLike | None = None,
    tolerances: Tolerances | None = None,
    most_evaluations: int = 10_000,
    first_radius: float = 1.0,
) -> Solution:
    """Values that minimise the sum of squares of weights * residual(values), from a start.

    `residual(values (n,)) -> (m,)`, `jacobian(values) -> (m, n)` its derivatives; a residual with a
    value that is not finite says that the model does not reach so far, and the step is shortened.
    `weights` (m,): one over each standard uncertainty; default 1. `scale` (n,): typical size of a
    change of each value, above zero, against which steps are then small too; default: found from
    the Jacobian's columns. `first_radius`: of the first trust region, in units of |D start|, above
    zero. Fewer equations than unknowns, and directions that no equation sees, are allowed: the
    values do not move along them.

    A Jacobian that is not that of the residual ends as `stalled` where the first step along it,
    however short, lowers nothing. A point where it is not finite is not gone to.

    Raises `ValueError` for shapes that contradict each other, a scale, weights or a first radius
    out of range, and for a start where the residual or the Jacobian is not finite. What a callback
    raises ends the iteration and is passed on.
    """
    limits = tolerances or Tolerances()
    if not (math.isfinite(first_radius) and first_radius > 0.0):
        raise ValueError(f"the first radius is {first_radius}, expected a number above zero")
    values = np.array(start, np.float64).reshape(-1)
    with np.errstate(all="ignore"):  # a value out of reach is looked at, not warned of
        solution = solve_least_squares(
            residual,
            jacobian,
            values,
            weights=None if weights is None else _weights(weights),
            scale=None if scale is None else _scale(scale, values.size),
            cost=limits.cost,
            step=limits.step,
            gradient=limits.gradient,
            most_evaluations=most_evaluations,
            first_radius=first_radius,
        )
    return Solution(*solution)


def covariance(
    jacobian: ArrayLike, variance: float = 1.0, *, rank_tolerance: float = 1e-12
) -> tuple[Floats, Floats]:
    """Covariance (n, n) of fitted values, variance (J^T J)^-1, and what no equation sees.

    `jacobian` (m, n) of weighted residuals. The second result (n_free, n) are unit directions, in
    values scaled to equal columns, along which the residual does not change: singular values below
    `rank_tolerance` of the largest. The covariance is over the rest; whoever asks must look.

    Raises `ValueError` for a Jacobian of another shape or not finite, and a variance below zero.
    """
    slope = np.asarray(jacobian, np.float64)
    if slope.ndim != 2:
        raise ValueError(f"the Jacobian has shape {slope.shape}, expected (m, n)")
    if not np.isfinite(slope).all():
        raise ValueError("the Jacobian is not finite")
    if not (math.isfinite(variance) and variance >= 0.0):
        raise ValueError(f"the variance is {variance}, expected zero or more")
    columns = column_norms(slope)
    columns[columns == 0.0] = 1.0
    singular, right = singular_decomposition(np.asarray(np.linalg.qr(slope / columns, mode="r")))
    seen = singular > rank_tolerance * max(float(singular.max(initial=0.0)), EPSILON)
    rows = right[seen] / singular[seen, np.newaxis] / columns
    return variance * (rows.T @ rows), right[~seen]


def _weights(weights: ArrayLike) -> Floats:
    array = np.asarray(weights, np.float64)
    if not (np.isfinite(array) & (array >= 0.0)).all():
        raise ValueError("the weights are not all finite and zero or more")
    if array.ndim != 1:
        raise ValueError(f"weights of shape {array.shape}, expected (m,)")
    return array


def _scale(scale: ArrayLike, size: int) -> Floats:
    array = np.asarray(scale, np.float64)
    if array.shape != (size,) or not (np.isfinite(array) & (array > 0.0)).all():
        raise ValueError("a finite scale above zero is wanted for every value")
    return array


def column_norms(matrix: Floats) -> Floats:
    """(n,) lengths of the columns of a matrix (m, n)."""
    norms: Floats = np.sqrt(np.einsum("ij,ij->j", matrix, matrix))
    return norms


def column_basis(matrix: Floats, tolerance: float) -> Floats:
    """(m, r) orthonormal: what the columns of a matrix (m, n) span.

    Singular values below `tolerance` of the largest count as none.
    """
    left, singular, _ = np.linalg.svd(matrix, full_matrices=False)
    basis: Floats = left[:, singular > tolerance * singular.max(initial=0.0)]
    return basis


def singular_decomposition(matrix: Floats) -> tuple[Floats, Floats]:
    """Singular values (n,), zeros added where there are fewer rows, and right vectors (n, n)."""
    n = matrix.shape[1]
    if matrix.shape[0] > n:
        matrix = np.asarray(np.linalg.qr(matrix, mode="r"), np.float64)
    if matrix.shape[0] == 0 or n == 0:
        return np.zeros(n), np.eye(n)
    _, values, right = np.linalg.svd(matrix, full_matrices=True)
    singular = np.zeros(n)
    singular[: values.size] = values
    return singular, right


__all__ = [
    "CONVERGED",
    "Solution",
    "Tolerances",
    "column_basis",
    "column_norms",
    "covariance",
    "least_squares",
    "singular_decomposition",
]
