"""Whether the linear law may be used: the comparison with sampling of JCGM 101:2008, clause 8.

The linear interval is valid where neither of its ends is further from the sampled one than the
numerical tolerance: half a unit of the last of so many significant digits of the sampled standard
uncertainty (7.9.2). Where it is not, this says which end of what is off, by how much, and what the
numbers look like, which is a hint and no proof.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.sources.deviation import Distribution

DOMINANT = 0.5
"""Part of the variance from which one variable gives the sum its shape."""

FLAT = 0.5
"""Linear standard uncertainty, in the sampled one, below which the sensitivity is nearly zero."""

NOTABLE = 0.02
"""Part by which a width or a symmetry differs where it is worth a word."""

SCATTER = 3.0
"""Standard deviations of a sampled end within which it may be by chance."""

NORMAL = "normal"


@dataclass(frozen=True)
class LinearAnswer:
    """What the linear law says of m outputs, each (m,), with the effects (m, v) behind it."""

    value: Floats
    standard_uncertainty: Floats
    coverage_factor: Floats
    lower: Floats
    upper: Floats
    effects: Floats
    sigmas: Floats
    """(v,) the half band of each variable in standard deviations."""
    names: Sequence[str]
    distributions: Sequence[Distribution]


@dataclass(frozen=True)
class Sampled:
    """What sampling says of the same m outputs, each (m,), and of how many samples."""

    mean: Floats
    standard_deviation: Floats
    lower: Floats
    upper: Floats
    samples: int
    lost: str = "none"
    """How many samples besides have no result, in words."""


@dataclass(frozen=True)
class Compared:
    """Distances of the ends and what they may be, each (m,), and the reason where one is beyond."""

    difference_lower: Floats
    difference_upper: Floats
    tolerance: Floats
    valid: Flags
    reason: str


def numerical_tolerance(u: float, digits: int) -> float:
    """Half a unit of the last of `digits` significant digits of `u` (JCGM 101:2008, 7.9.2)."""
    if not (u > 0.0 and math.isfinite(u)):
        return 0.0
    # c x 10^l with a whole number c of so many digits; rounding may add one (0.0996 is 0.10).
    exponent = int(f"{u:.{digits - 1}e}".partition("e")[2])
    return 0.5 * 10.0 ** (exponent - digits + 1)


def compare(
    linear: LinearAnswer,
    sampled: Sampled,
    outputs: Sequence[str],
    units: Sequence[str],
    *,
    probability: float,
    digits: int,
    rounding: Floats,
) -> Compared:
    """The comparison for outputs named `outputs`, of `units`, at one coverage `probability`.

    The tolerance is that of the sampled standard uncertainty (8.1.2 b, 8.1.3), and at least
    `rounding` (m,). Where a sample has no result the linear law, which knows of none, is not valid.
    """
    stated = [
        numerical_tolerance(float(deviation), digits) for deviation in sampled.standard_deviation
    ]
    tolerance = np.maximum(stated, rounding)
    lower, upper = np.abs(linear.lower - sampled.lower), np.abs(linear.upper - sampled.upper)
    valid = (lower <= tolerance) & (upper <= tolerance)
    if sampled.lost != "none":
        reason = f"{sampled.lost}, of which the linear law knows nothing"
        return Compared(lower, upper, tolerance, np.zeros_like(valid), reason)
    reasons = []
    for at in np.flatnonzero(~valid).tolist():
        ends = [
            _end(side, ends[at], end[at], units[at])
            for side, ends, end, off in (
                ("lower", linear.lower, sampled.lower, lower),
                ("upper", linear.upper, sampled.upper, upper),
            )
            if not off[at] <= tolerance[at]
        ]
        causes = "; ".join(_causes(linear, sampled, at, probability, float(tolerance[at])))
        allowed = f"{tolerance[at]:.1g} {units[at]} is allowed"
        reasons.append(f"{outputs[at]}: {' and '.join(ends)}, where {allowed}: {causes}")
    return Compared(lower, upper, tolerance, np.asarray(valid, np.bool_), ". ".join(reasons))


def _end(side: str, linear: float, sampled: float, unit: str) -> str:
    return (
        f"the sampled {side} end lies {abs(sampled - linear):.2g} {unit} "
        f"{'above' if sampled > linear else 'below'} the linear one ({linear:.3g} {unit})"
    )


def _causes(
    linear: LinearAnswer, sampled: Sampled, at: int, probability: float, tolerance: float
) -> Iterator[str]:
    """What the numbers of output `at` look like, in words, at least one."""
    u, deviation = float(linear.standard_uncertainty[at]), float(sampled.standard_deviation[at])
    below, above = sampled.mean[at] - sampled.lower[at], sampled.upper[at] - sampled.mean[at]
    off = float(sampled.mean[at] - linear.value[at])
    factor = NormalDist().inv_cdf(0.5 + 0.5 * probability)
    scatter = _scatter(deviation, factor, probability, sampled.samples)
    furthest = max(
        abs(float(linear.lower[at] - sampled.lower[at])),
        abs(float(linear.upper[at] - sampled.upper[at])),
    )
    if furthest - tolerance <= SCATTER * scatter:
        yield (
            f"the ends of {sampled.samples} samples scatter by {scatter:.1g} themselves, so that "
            "more samples may decide otherwise"
        )
        return
    told = False
    if u < FLAT * deviation:
        told = True
        yield (
            f"its sensitivity is nearly zero here (linear standard uncertainty {u:.2g}, sampled "
            f"{deviation:.2g}), so that what is of second order rules"
        )
    elif abs(deviation / u - 1.0) > NOTABLE:
        told = True
        more = "more" if deviation > u else "less"
        yield (
            f"the sampled standard deviation is {100.0 * abs(deviation / u - 1.0):.0f} % {more} "
            "than the linear one, which is of second order"
        )
    if abs(off) > max(tolerance, SCATTER * deviation / math.sqrt(sampled.samples)):
        told = True
        yield f"the mean is {off:+.2g} off the value at the estimates, which is of second order"
    if abs(above - below) > NOTABLE * (above + below):
        told = True
        yield (
            f"the distribution is skewed: its ends lie {below:.2g} below and {above:.2g} above "
            "its mean"
        )
    shapes = [*_shapes(linear, at)]
    yield from shapes
    if linear.coverage_factor[at] > (1.0 + NOTABLE) * factor:
        told = True
        yield (
            f"few degrees of freedom widen the linear interval to {linear.coverage_factor[at]:.3g} "
            "standard uncertainties, which samples know nothing of unless their inputs are "
            "student-t"
        )
    if not (told or shapes):
        half = 0.5 * (above + below) / deviation if deviation > 0.0 else math.nan
        yield (
            f"the distribution is not normal: it reaches {half:.3g} standard deviations either "
            f"way, and {factor:.3g} were taken"
        )


def _shapes(linear: LinearAnswer, at: int) -> Iterator[str]:
    """The variable, not normal, that makes most of the variance of output `at`."""
    variances = np.square(linear.effects[at] / linear.sigmas)
    total = variances.sum()
    if not total > 0.0:
        return
    most = int(np.argmax(variances))
    part, how = variances[most] / total, linear.distributions[most].name
    if part > DOMINANT and how != NORMAL:
        yield (
            f"{linear.names[most]}, which is {how}, makes {100.0 * part:.0f} % of the variance, so "
            "that the sum is not normal"
        )


def _scatter(deviation: float, factor: float, probability: float, samples: int) -> float:
    """Standard deviation of a sampled end, as a normal distribution would have it."""
    beyond = 0.5 * (1.0 - probability)
    density = NormalDist().pdf(factor) / deviation if deviation > 0.0 else math.inf
    return math.sqrt(beyond * (1.0 - beyond) / max(samples, 1)) / density
