"""Quantiles of the normal and of Student's distribution, with NumPy alone.

All take and return arrays of any shape.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats

_MANY = 1000.0
"""Degrees of freedom from which Student's quantile is taken from its expansion about the normal's:
the first term left out is then 1e-10 of it at six standard deviations."""

_FAR = 26.0
"""Of the standard normal variable, which is beyond with a probability of 1e-149: farther out
Student's is given as there, so that even one of a single degree of freedom is a number."""

_NODES = 96
"""Of the interpolation over the normal variable: to 1e-12 of the quantile."""

_TAIL_NODES = 320
"""Of the integral over a tail."""

# Numerator and denominator of three rational functions, highest power first.
_CENTRE = (
    (
        2.5090809287301226727e3,
        3.3430575583588128105e4,
        6.7265770927008700853e4,
        4.5921953931549871457e4,
        1.3731693765509461125e4,
        1.9715909503065514427e3,
        1.3314166789178437745e2,
        3.3871328727963666080e0,
    ),
    (
        5.2264952788528545610e3,
        2.8729085735721942674e4,
        3.9307895800092710610e4,
        2.1213794301586595867e4,
        5.3941960214247511077e3,
        6.8718700749205790830e2,
        4.2313330701600911252e1,
        1.0,
    ),
)
_MIDDLE = (
    (
        7.74545014278341407640e-4,
        2.27238449892691845833e-2,
        2.41780725177450611770e-1,
        1.27045825245236838258e0,
        3.64784832476320460504e0,
        5.76949722146069140550e0,
        4.63033784615654529590e0,
        1.42343711074968357734e0,
    ),
    (
        1.05075007164441684324e-9,
        5.47593808499534494600e-4,
        1.51986665636164571966e-2,
        1.48103976427480074590e-1,
        6.89767334985100004550e-1,
        1.67638483018380384940e0,
        2.05319162663775882187e0,
        1.0,
    ),
)
_TAIL = (
    (
        2.01033439929228813265e-7,
        2.71155556874348757815e-5,
        1.24266094738807843860e-3,
        2.65321895265761230930e-2,
        2.96560571828504891230e-1,
        1.78482653991729133580e0,
        5.46378491116411436990e0,
        6.65790464350110377720e0,
    ),
    (
        2.04426310338993978564e-15,
        1.42151175831644588870e-7,
        1.84631831751005468180e-5,
        7.86869131145613259100e-4,
        1.48753612908506148525e-2,
        1.36929880922735805310e-1,
        5.99832206555887937690e-1,
        1.0,
    ),
)

_erfc = np.vectorize(math.erfc, otypes=[np.float64])


def normal_cdf(z: ArrayLike) -> Floats:
    """Probability that a standard normal variable is below `z`."""
    below: Floats = 0.5 * _erfc(-np.asarray(z, np.float64) / math.sqrt(2.0))
    return below


def normal_density(z: ArrayLike) -> Floats:
    """Density of the standard normal distribution."""
    density: Floats = np.exp(-0.5 * np.square(np.asarray(z, np.float64))) / math.sqrt(2.0 * math.pi)
    return density


def normal_quantile(u: ArrayLike) -> Floats:
    """Where the standard normal distribution function is `u`; -inf and inf at 0 and 1.

    M. J. Wichura, Algorithm AS 241: The percentage points of the normal distribution, Applied
    Statistics 37 (1988) 477-484: relative error below 1e-15.
    """
    probability = np.asarray(u, np.float64)
    off = probability - 0.5
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.sqrt(-np.log(np.minimum(probability, 1.0 - probability)))
        outer = np.where(
            depth <= 5.0, _rational(_MIDDLE, depth - 1.6), _rational(_TAIL, depth - 5.0)
        )
        outer = np.where(np.isinf(depth), np.inf, outer)
    inner = off * _rational(_CENTRE, 0.180625 - off * off)
    quantile: Floats = np.where(np.abs(off) <= 0.425, inner, np.copysign(outer, off))
    return quantile


def _rational(coefficients: tuple[tuple[float, ...], tuple[float, ...]], at: Floats) -> Floats:
    above, below = (np.polyval(coefficient, at) for coefficient in coefficients)
    value: Floats = above / below
    return value


def student_quantile(u: ArrayLike, dof: float) -> Floats:
    """Where Student's distribution function of `dof` >= 1 degrees of freedom is `u`."""
    z = normal_quantile(u)
    quantile: Floats
    if dof >= _MANY:
        quantile = _expanded(z, dof)
    else:
        size = np.abs(z)
        finite = np.minimum(size, _FAR)
        ratio = np.exp(np.polynomial.chebyshev.chebval(2.0 * finite / _FAR - 1.0, _ratios(dof)))
        quantile = np.copysign(finite * ratio, z)
    return quantile


def _expanded(z: Floats, dof: float) -> Floats:
    """M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions, 26.7.5."""
    finite = np.clip(z, -_FAR, _FAR)
    s = np.square(finite)
    terms = (
        (s + 1.0) / 4.0,
        ((5.0 * s + 16.0) * s + 3.0) / 96.0,
        (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0,
        ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) / 92160.0,
    )
    factor = 1.0 + sum(term / dof ** (k + 1) for k, term in enumerate(terms))
    expanded: Floats = np.where(np.isinf(z), z, finite * factor)
    return expanded


@lru_cache(maxsize=256)
def _ratios(dof: float) -> Floats:
    """Chebyshev series, over [0, _FAR], of the logarithm of Student's over the normal variable."""
    nodes = np.polynomial.chebyshev.chebpts1(_NODES)
    z = 0.5 * _FAR * (nodes + 1.0)
    near = z < 1.0
    t = np.empty_like(z)
    t[near] = _in_middle(z[near], dof)
    t[~near] = _in_tail(z[~near], dof)
    series = np.polynomial.chebyshev.chebfit(nodes, np.log(t / z), _NODES - 1)
    return np.asarray(series, np.float64)


def _in_middle(z: Floats, dof: float) -> Floats:
    """The t > 0 with as much probability from 0 to it as the normal distribution has up to `z`.

    By Newton's iteration: the integral is concave, so that it rises to the t from below.
    """
    wanted = np.vectorize(math.erf)(z / math.sqrt(2.0)) / 2.0
    x, weights = np.polynomial.legendre.leggauss(64)
    along = 0.5 * (x + 1.0)
    t = np.zeros_like(z)
    for _ in range(60):
        reached = 0.5 * t * (_density(t[:, np.newaxis] * along, dof) @ weights)
        t = t + (wanted - reached) / _density(t, dof)
    return t


def _in_tail(z: Floats, dof: float) -> Floats:
    """The t > 0 with as much probability beyond it as the normal distribution has beyond `z`.

    By Newton's iteration on logarithms, in which the tail is concave. The tail is an integral over
    t / v^2 for v from 0 to 1.
    """
    wanted = np.log(0.5 * _erfc(z / math.sqrt(2.0)))
    x, weights = np.polynomial.legendre.leggauss(_TAIL_NODES)
    v = 0.5 * (x + 1.0)
    t = z.copy()
    for _ in range(60):
        at = _log_density(t[:, np.newaxis] / np.square(v), dof) - 3.0 * np.log(v)
        largest = at.max(axis=1)
        tail = np.log(t * (np.exp(at - largest[:, np.newaxis]) @ weights)) + largest
        slope = -np.exp(np.log(t) + _log_density(t, dof) - tail)
        t = t * np.exp((wanted - tail) / slope)
    return t


def _log_density(t: Floats, dof: float) -> Floats:
    scale = math.lgamma(0.5 * (dof + 1.0)) - math.lgamma(0.5 * dof) - 0.5 * math.log(dof * math.pi)
    # Beyond 1e150 the square overflows; one is then nothing beside it.
    size = np.abs(t)
    far = 2.0 * np.log(np.maximum(size, 1.0)) - math.log(dof)
    near = np.log1p(np.square(np.minimum(size, 1e150)) / dof)
    logarithm: Floats = scale - 0.5 * (dof + 1.0) * np.where(size < 1e150, near, far)
    return logarithm


def _density(t: Floats, dof: float) -> Floats:
    density: Floats = np.exp(_log_density(t, dof))
    return density
