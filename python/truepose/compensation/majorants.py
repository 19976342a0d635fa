"""Majorants: what functions do beyond their linear part, by powers of how far their variables go.

An analytic function f(z) about 0 is majorised by F(s), s >= 0, where no coefficient of F's power
series is less than the size of that of f. Then for all |z| <= s

    |f(z)| <= F(s),    |f'(z) h| <= F'(s) |h|

and sums, products and compositions of majorants majorise those of the functions (Cauchy's method of
majorants). F less its linear part majorises f less its own. Arrays throughout; where a series does
not converge the result is infinite.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats


def turn(angle: Floats) -> Floats:
    """Of `exp(r) - 1`, r a rotation vector of at most this size, applied to a unit vector."""
    return np.expm1(angle)


def turn_bent(angle: Floats) -> Floats:
    """The same beyond its linear part `r x`: e^s - 1 - s."""
    # Below 0.1 rad by the series, the other loses its digits there.
    series = 0.5 * angle * angle * (1.0 + angle / 3.0 * (1.0 + angle / 4.0 * (1.0 + angle / 4.0)))
    return np.where(angle < 0.1, series, np.expm1(angle) - angle)


def length_bent(length: Floats, across: Floats, along: Floats) -> Floats:
    """Of |v|, v of this length that moves across and along itself, beyond what goes along.

    |v + d| = sqrt((l + p)^2 + c^2) beyond l + p, with every sign of its series in c^2 and p a plus:
    (l - p) - sqrt((l - p)^2 - c^2).
    """
    rest = length - along
    square = rest * rest - across * across
    with np.errstate(divide="ignore", invalid="ignore"):
        bent = across * across / (rest + np.sqrt(square))
    return np.where((rest > across) | (across == 0.0) & (rest > 0.0), bent, np.inf)


def unit(tilt: Floats, along: Floats) -> Floats:
    """Of the unit vector c / |c| less itself at 0, as c = axis + t with |t| <= `tilt`.

    `along`: at most this part of t is along the axis (0 where tilts are across it).
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        square = 1.0 - 2.0 * along * tilt - tilt * tilt
        return np.where(square > 0.0, (1.0 + tilt) / np.sqrt(square) - 1.0, np.inf)


def unit_bent(tilt: Floats, along: Floats) -> Floats:
    """The same beyond its linear part."""
    return np.asarray(unit(tilt, along) - (1.0 + along) * tilt)
