"""Correlated variables of any distribution as functions of normal ones (a Gaussian copula).

    t = Q(Phi(z)),    z normal, unit variance

Q is the quantile function of the variable's distribution and Phi the normal distribution function.
The coefficient that is stated is Pearson's, of the variables t themselves; z must have another one
(M. C. Cario, B. L. Nelson, Modeling and generating random vectors with arbitrary marginal
distributions and correlation matrix, Northwestern University 1997). With r = sin(theta) for z,

    d E[t1 t2] / dr = E[t1'(z1) t2'(z2)]        (R. Price, IRE Trans. Inf. Theory 4 (1958) 69-72)

where ' is d/dz. The right-hand side is smooth in theta even where t steps from value to value.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem, RequestError
from truepose.probability.distributions import TRIANGULAR, UNIFORM, Distribution
from truepose.probability.quantiles import normal_cdf, normal_density, normal_quantile

_NORMAL = "normal"

ANGLES = 64
"""Nodes over theta."""

NODES = 48
"""Nodes of every other integral."""

FAR = 9.0
"""A normal variable is beyond with a probability of 1e-19."""

FARTHEST = 26.0
"""The same where a heavy tail grows against it: 1e-149."""

STEP = 1e-4
"""Of z, over which a derivative of t is taken; its error is 1e-13 of it."""

SLACK = 1e-6
"""By which a coefficient may miss what can be reached: the error of the integral."""

HALVINGS = 60
"""Bisections: beyond the last digit."""


def normal_correlation(
    one: Distribution,
    other: Distribution,
    coefficient: float,
    names: tuple[str, str] | None = None,
) -> float:
    """The correlation of the normal z that gives variables of two distributions `coefficient`.

    `names` of the variables, for a refusal. Raises `RequestError` (correlation-out-of-reach) where
    no joint distribution has it: the extremes are reached where each variable rises, or falls, with
    the other.
    """
    normal = one.name == other.name == _NORMAL
    if not normal:
        least, most = reach(one, other)
        if not least - SLACK <= coefficient <= most + SLACK:
            raise RequestError(
                Problem(
                    "correlation-out-of-reach",
                    f"{_in_words(one, other, names)} cannot have this correlation",
                    found=f"{coefficient:g}",
                    expected=f"{least:.4g} to {most:.4g}, which is all that they can have",
                    hint="give both one distribution, or a smaller coefficient",
                )
            )
    # At 1 and -1 each variable is a linear function of the other, and so z is.
    if normal or coefficient in (-1.0, 0.0, 1.0):
        return coefficient
    if one == other == UNIFORM:
        return 2.0 * math.sin(math.pi * coefficient / 6.0)
    curve = _curve(one, other)
    low, high = -1.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if curve.at(middle) < coefficient else (low, middle)
    return math.sin(0.5 * math.pi * 0.5 * (low + high))


def _in_words(one: Distribution, other: Distribution, names: tuple[str, str] | None) -> str:
    if names is None:
        return f"two variables of these distributions, {one} and {other},"
    return f"{names[0]} ({one}) and {names[1]} ({other})"


def reach(one: Distribution, other: Distribution) -> tuple[float, float]:
    """The least and the largest correlation of variables of two distributions."""
    curve = _curve(one, other)
    return curve.at(-1.0), curve.at(1.0)


@dataclass(frozen=True)
class _Curve:
    """Correlation of t1 and t2 as a Legendre series of theta / (pi / 2)."""

    series: Floats

    def at(self, share: float) -> float:
        """At theta = share pi / 2."""
        return float(np.polynomial.legendre.legval(share, self.series))


@lru_cache(maxsize=256)
def _curve(one: Distribution, other: Distribution) -> _Curve:
    nodes, weights = _gauss(ANGLES)
    rises = np.array([_rise(one, other, 0.5 * math.pi * node) for node in nodes])
    # The series of the rise, by its own quadrature; its integral from 0.
    degrees = np.arange(ANGLES)
    basis = np.polynomial.legendre.legvander(nodes, ANGLES - 1)
    series = (basis.T @ (weights * rises)) * (degrees + 0.5)
    scale = 0.5 * math.pi * one.sigmas * other.sigmas
    integral = np.polynomial.legendre.legint(series * scale, lbnd=0.0)
    return _Curve(np.asarray(integral, np.float64))


@lru_cache(maxsize=8)
def _gauss(count: int) -> tuple[Floats, Floats]:
    """Nodes and weights over [-1, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    return np.asarray(nodes, np.float64), np.asarray(weights, np.float64)


def _rise(one: Distribution, other: Distribution, theta: float) -> float:
    """d E[t1 t2] / d theta.

    A slope is even in z and may have a kink at 0, where integrals are split.
    """
    if one.stepped and other.stepped:
        return _rise_of_steps(one, other, theta)
    if one.stepped:
        return _rise_of_one_stepped(one, other, theta)
    if other.stepped:
        return _rise_of_one_stepped(other, one, theta)
    # z1 = radius cos(turn), z2 = radius sin(turn + theta): over half the turns, by symmetry.
    nodes, weights = _gauss(NODES)
    share = 0.5 * (nodes + 1.0)
    radius = FARTHEST * np.square(share)
    of_radius = FARTHEST * share * weights * radius * np.exp(-0.5 * np.square(radius))
    total = 0.0
    for start, stop in ((-0.5 * math.pi, -theta), (-theta, 0.5 * math.pi)):
        turn = start + (stop - start) * share
        first = _slope(one, radius * np.cos(turn)[:, np.newaxis])
        second = _slope(other, radius * np.sin(turn + theta)[:, np.newaxis])
        total += 0.5 * (stop - start) * float(weights @ ((first * second) @ of_radius))
    return math.cos(theta) * total / math.pi


def _rise_of_one_stepped(stepped: Distribution, smooth: Distribution, theta: float) -> float:
    """The slope of t2 that is expected where z1 is at a step, weighed with how likely that is."""
    where, size = _jumps(stepped)
    sine, cosine = math.sin(theta), math.cos(theta)
    # z2 = sin z1 + cos x, of independent x; it is 0 at the kink.
    kink = np.clip(-sine * where / max(cosine, 1e-9), -FAR, FAR)
    nodes, weights = _gauss(2 * NODES)
    expected = np.zeros(where.size)
    for start, stop in ((-FAR, kink), (kink, FAR)):
        half = 0.5 * (stop - start)
        x = start + np.outer(nodes + 1.0, half)
        slopes = _slope(smooth, sine * where + cosine * x)
        expected += half * (weights @ (slopes * normal_density(x)))
    return cosine * float((size * normal_density(where)) @ expected)


def _rise_of_steps(one: Distribution, other: Distribution, theta: float) -> float:
    """The joint density of z1 and z2 at every two steps, times d r / d theta = cos(theta)."""
    (a, first), (b, second) = _jumps(one), _jumps(other)
    sine, cosine = math.sin(theta), math.cos(theta)
    # a^2 - 2 a b sin + b^2 = (a - b sin)^2 + b^2 cos^2, which does not cancel where cos is small.
    along = np.square(a[:, np.newaxis] - sine * b) / cosine**2 + np.square(b)
    return float(first @ np.exp(-0.5 * along) @ second) / (2.0 * math.pi)


def _jumps(distribution: Distribution) -> tuple[Floats, Floats]:
    """Where over z the variable jumps, and by how much."""
    values, up_to = distribution.steps
    return normal_quantile(up_to[:-1]), np.diff(values)


def _slope(distribution: Distribution, z: Floats) -> Floats:
    """dt/dz."""
    if distribution.name == _NORMAL:
        return np.full(z.shape, 1.0 / distribution.sigmas)
    # Towards the nearer end only, so that no digits are lost at the farther one.
    size = -np.abs(z)
    slope: Floats
    if distribution.name == UNIFORM.name:
        slope = 2.0 * normal_density(size)
    elif distribution.name == TRIANGULAR.name:
        slope = normal_density(size) / np.sqrt(2.0 * normal_cdf(size))
    else:
        ahead, behind = (distribution.quantile(normal_cdf(size + step)) for step in (STEP, -STEP))
        slope = (ahead - behind) / (2.0 * STEP)
    return slope
