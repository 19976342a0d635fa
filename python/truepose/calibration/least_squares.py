"""Dense weighted nonlinear least squares: a scaled trust region on callbacks.

Each step minimises the linearised sum of squares inside an ellipsoid, |D p| <= radius, whose axes
D are the largest column norms that the Jacobian had so far, so that the units of the parameters do
not matter. The step is found from the singular value decomposition of the triangular factor of
the scaled Jacobian, the multiplier by Newton's iteration on the reciprocal of the step's length.

    J. J. More, The Levenberg-Marquardt algorithm: implementation and theory, Lecture Notes in
    Mathematics 630 (1978) 105-116.
    J. Nocedal and S. J. Wright, Numerical Optimization, 2nd ed. (2006), chapters 4 and 10.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Residual = Callable[[Floats], Floats]
Status = Literal["cost", "step", "gradient", "stalled", "exhausted"]

CONVERGED: tuple[Status, ...] = ("cost", "step", "gradient")

EPSILON = float(np.finfo(np.float64).eps)

ACCEPTED = 1e-4
"""A step is taken that lowers the cost by at least this share of what the linear model promised."""

SHRUNK, WIDENED = 0.25, 0.75
"""Below and above these shares of the promise the trust region shrinks and widens."""

NOISE = 1e-11
"""Decreases of the cost below this share are taken to be lost in its rounding, which that of the
data adds to where residuals are small differences: there the linear model is believed."""

STEEP = 1e-3
"""Cosine between residual and Jacobian above which a point is no optimum, however short the steps,
if the linear model wants to go `FAR`: there the Jacobian is wrong, or the residual too rough."""

FAR = 1e-6
"""In the norm |D x|: a longer way than rounding leaves to a root."""

HELD = 0.1
"""The step's length may miss the radius of the trust region by this share."""

MULTIPLIER_STEPS = 20
"""Newton steps on the multiplier; two or three do, the rest is safety."""


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
    change of each value, above zero; default: found from the Jacobian's columns. `first_radius`: of
    the first trust region, in units of |D start|, above zero. Fewer equations than unknowns, and
    directions that no equation sees, are allowed: the values do not move along them.

    A Jacobian that is not that of the residual ends as `stalled` where the first step along it,
    however short, lowers nothing. A point where it is not finite is not gone to.

    Raises `ValueError` for shapes that contradict each other, a scale, weights or a first radius
    out of range, and for a start where the residual or the Jacobian is not finite.
    """
    limits = tolerances or Tolerances()
    if not (math.isfinite(first_radius) and first_radius > 0.0):
        raise ValueError(f"the first radius is {first_radius}, expected a number above zero")
    problem = _Problem(residual, jacobian, weights)
    values = np.array(start, np.float64).reshape(-1)
    error = problem.residual(values)
    slope = problem.jacobian(values, error.size)
    if not (np.isfinite(error).all() and np.isfinite(slope).all()):
        raise ValueError("the residual or its Jacobian is not finite at the start")
    axes = _Axes(scale, slope)
    size = float(np.linalg.norm(axes.of * values))
    radius = first_radius * size if size > 0.0 else first_radius
    norm, iterations = float(np.linalg.norm(error)), 0
    last = math.inf
    promise = _Promise(slope, error, axes.of)

    def ended(status: Status) -> Solution:
        return Solution(values, error, slope, norm * norm, status, problem.evaluations, iterations)

    while True:
        if promise.cosine <= limits.gradient:
            return ended("gradient")
        status: Status | None = None
        taken = False
        while not (taken or status):
            step, multiplier = promise.step(radius)
            length = float(np.linalg.norm(axes.of * step))
            if iterations == 0:
                radius = min(radius, length)
            tried = problem.residual(values + step)
            tried_norm = float(np.linalg.norm(tried))
            promised, half_slope = promise.decrease(multiplier, length, step)
            # Far worse, or not finite: nothing is won by knowing how much.
            actual = 1.0 - _square(tried_norm / norm) if tried_norm < 10.0 * norm else -1.0
            share = actual / promised if promised > 0.0 else 0.0
            rounding = promised <= NOISE and abs(actual) <= NOISE
            radius = _radius(
                radius, length, 1.0 if rounding else share, multiplier, actual, half_slope
            )
            taken = rounding or share >= ACCEPTED
            if taken:
                next_slope = problem.jacobian(values + step, error.size)
                if not np.isfinite(next_slope).all():
                    taken, radius = False, 0.5 * min(radius, length)
            if taken:
                values, error, norm, slope = values + step, tried, tried_norm, next_slope
                size = float(np.linalg.norm(axes.of * values))
                iterations += 1
            if norm * norm == 0.0 or (
                rounding and (promised <= limits.cost or promised > 0.5 * last)
            ):
                status = "cost"
            elif min(radius, length) <= limits.step * size:
                steep = promise.cosine > STEEP and promise.way > FAR * size
                status = "stalled" if steep and not taken else "step"
            elif not taken and promised <= EPSILON * EPSILON:
                status = "stalled"
            elif problem.evaluations >= most_evaluations:
                status = "exhausted"
            last = promised if rounding else math.inf
        if status:
            return ended(status)
        axes.widen(slope)
        promise = _Promise(slope, error, axes.of)


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
    columns = _column_norms(slope)
    columns[columns == 0.0] = 1.0
    factor = np.linalg.qr(slope / columns, mode="r")
    _, found, right = np.linalg.svd(factor, full_matrices=True)
    singular = np.zeros(slope.shape[1])
    singular[: found.size] = found
    seen = singular > rank_tolerance * max(float(singular.max(initial=0.0)), EPSILON)
    rows = right[seen] / singular[seen, np.newaxis] / columns
    return variance * (rows.T @ rows), right[~seen]


class _Problem:
    """The callbacks, weighted, checked for their shapes, and counted."""

    def __init__(self, residual: Residual, jacobian: Residual, weights: ArrayLike | None) -> None:
        self._residual, self._jacobian = residual, jacobian
        self._weights = None if weights is None else np.asarray(weights, np.float64)
        if self._weights is not None:
            fit = np.isfinite(self._weights) & (self._weights >= 0.0)
            if not fit.all():
                raise ValueError("the weights are not all finite and zero or more")
        self.evaluations = 0

    def residual(self, values: Floats) -> Floats:
        self.evaluations += 1
        with np.errstate(all="ignore"):  # a value out of reach is looked at, not warned of
            found = np.asarray(self._residual(values), np.float64)
        if found.ndim != 1:
            raise ValueError(f"the residual has shape {found.shape}, expected (m,)")
        if self._weights is None:
            return found
        if self._weights.shape != found.shape:
            raise ValueError(
                f"weights of shape {self._weights.shape} for a residual of {found.size}"
            )
        return self._weights * found

    def jacobian(self, values: Floats, rows: int) -> Floats:
        with np.errstate(all="ignore"):
            found = np.asarray(self._jacobian(values), np.float64)
        if found.shape != (rows, values.size):
            raise ValueError(
                f"the Jacobian has shape {found.shape}, expected ({rows}, {values.size})"
            )
        return found if self._weights is None else self._weights[:, np.newaxis] * found


class _Axes:
    """The scale D of the trust region: 1 / given scale, or the largest column norms so far."""

    def __init__(self, scale: ArrayLike | None, slope: Floats) -> None:
        self._given = scale is not None
        if scale is not None:
            given = np.asarray(scale, np.float64)
            if given.shape != (slope.shape[1],) or not (np.isfinite(given) & (given > 0.0)).all():
                raise ValueError("a finite scale above zero is wanted for every value")
            self.of = 1.0 / given
        else:
            self.of = _column_norms(slope)
            self.of[self.of == 0.0] = 1.0

    def widen(self, slope: Floats) -> None:
        if not self._given:
            self.of = np.maximum(self.of, _column_norms(slope))


class _Promise:
    """The linear model |error + slope p| about one point, decomposed once."""

    def __init__(self, slope: Floats, error: Floats, axes: Floats) -> None:
        self._axes, self._slope = axes, slope
        self._norm = float(np.linalg.norm(error))
        # The factor of both at once, so that the orthogonal one need not be formed.
        both: Floats = np.column_stack([slope / axes, error])
        factor = np.asarray(np.linalg.qr(both, mode="r"), np.float64)[: min(slope.shape)]
        u, singular, self._right = np.linalg.svd(factor[:, :-1], full_matrices=False)
        self._turned = u.T @ factor[:, -1]
        # What is rounding only must not move the values: those directions are left out.
        floor = EPSILON * max(slope.shape) * float(singular.max(initial=0.0))
        self._singular = np.where(singular > floor, singular, 0.0)
        columns = _column_norms(slope)
        lengths = np.where(columns > 0.0, columns, 1.0) * (self._norm or 1.0)
        self.cosine = float(np.abs(slope.T @ error / lengths).max(initial=0.0))
        seen = self._singular > 0.0
        self._whole = np.zeros_like(self._singular)
        with np.errstate(over="ignore"):
            self._whole[seen] = -self._turned[seen] / self._singular[seen]
        self.way = float(np.linalg.norm(self._whole))

    def step(self, radius: float) -> tuple[Floats, float]:
        """The step (n,) inside the trust region, and its multiplier, 0 where the region is wide."""
        s, c = self._singular, self._turned
        coordinates, multiplier = self._whole, 0.0
        if self.way > (1.0 + HELD) * radius:
            with np.errstate(all="ignore"):  # a length of infinity is one too long
                multiplier = self._multiplier(radius, s > 0.0)
                coordinates = -s * c / (s * s + multiplier)
        return (self._right.T @ coordinates) / self._axes, multiplier

    def _multiplier(self, radius: float, seen: NDArray[np.bool_]) -> float:
        """Newton's iteration on 1 / |p(m)| - 1 / radius (More 1978, equations 5.4-5.8)."""
        s, c = self._singular[seen], self._turned[seen]
        upper = float(np.linalg.norm(s * c)) / radius
        lower = max(0.0, (float(np.linalg.norm(c / s)) - radius) * _inverse_slope(s, c, radius))
        found = min(max(lower, 1e-3 * upper), upper)
        for _ in range(MULTIPLIER_STEPS):
            weight = s * s + found
            length = float(np.linalg.norm(s * c / weight))
            if abs(length - radius) <= HELD * radius:
                break
            if length < radius:
                upper = found
            else:
                lower = max(lower, found)
            slope = float(np.sum((s * c) ** 2 / weight**3)) / length
            found += (length - radius) / radius * length / slope
            if not lower < found < upper:
                found = max(1e-3 * upper, math.sqrt(lower * upper))
        return found

    def decrease(self, multiplier: float, length: float, step: Floats) -> tuple[float, float]:
        """Share of the cost that the model promises to take away, and half its slope at 0."""
        along = _square(float(np.linalg.norm(self._slope @ step)) / self._norm)
        held = multiplier * _square(length / self._norm)
        return along + 2.0 * held, -(along + held)


def _inverse_slope(s: Floats, c: Floats, radius: float) -> float:
    """1 / |d|p|/dm| at m = 0, which gives a lower bound of the multiplier, over the radius."""
    length = float(np.linalg.norm(c / s))
    slope = float(np.sum(c**2 / s**4)) / length
    return 1.0 / slope if math.isfinite(slope) and slope > 0.0 else 0.0


def _radius(
    radius: float,
    length: float,
    share: float,
    multiplier: float,
    actual: float,
    half_slope: float,
) -> float:
    """The next radius: by how well the linear model held (More 1978, section 7)."""
    if share <= SHRUNK:
        # Of the parabola through the cost here, its slope, and the cost at the trial.
        cut = 0.5 if actual >= 0.0 else 0.5 * half_slope / (half_slope + 0.5 * actual)
        return min(max(cut, 0.1), 0.5) * min(radius, 10.0 * length)
    if multiplier == 0.0 or share >= WIDENED:
        return 2.0 * length
    return radius


def _square(value: float) -> float:
    """Infinite where it is too large; a power would raise."""
    return value * value


def _column_norms(matrix: Floats) -> Floats:
    norms: Floats = np.sqrt(np.einsum("ij,ij->j", matrix, matrix))
    return norms


__all__ = ["CONVERGED", "Solution", "Tolerances", "covariance", "least_squares"]
