"""How a deviation spreads inside its band: the distribution of its variable t.

A column deviates by `shift + half_width * t`. The variable is standardised: its mean is 0, and its
standard deviation 1 / sigmas, so that the half band is |half_width|. Bounded distributions have t
in [-1, 1], and reach both ends, but for listed values that lie further to one side of their mean
than to the other: those end where the values do. GUM (JCGM 100:2008) 4.3.5, 4.3.7, 4.3.9;
JCGM 101:2008, 6.4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.probability.quantiles import normal_quantile, student_quantile
from truepose.representation import Represented

_NORMAL = "normal"
_STUDENT = "student-t"
_DISCRETE = "discrete"
_EMPIRICAL = "empirical"

LEAST_DOF = 2.0
"""Student's distribution has a standard deviation only above so many degrees of freedom."""

_PROBABILITY_SLACK = 1e-9
"""By which probabilities may miss a sum of one, as decimal fractions do."""


@dataclass(frozen=True, repr=False)
class Distribution(Represented):
    """How a deviation spreads inside its band.

    `sigmas` is the half band in standard deviations: sqrt(3) for a uniform one, k for a normal or
    Student one that was given by its standard deviation (the band is then k sigma, and values
    outside it, though rare, exist), half / sigma for listed values.
    `dof`: degrees of freedom of Student's distribution. `values`, ascending, of mean 0, the
    largest of size 1, and their `probabilities` (none: all the same): of a discrete or empirical
    one.
    """

    name: str
    sigmas: float
    dof: float | None = None
    values: tuple[float, ...] = ()
    probabilities: tuple[float, ...] = ()

    def __str__(self) -> str:
        if self.name == _NORMAL:
            return f"{self.name}, {self.sigmas:g} sigma"
        if self.name == _STUDENT:
            return f"{self.name}, {self.dof:g} degrees of freedom, {self.sigmas:g} sigma"
        return self.name

    @property
    def degrees(self) -> float:
        """Degrees of freedom of Student's distribution; inf of every other."""
        return math.inf if self.dof is None else self.dof

    @property
    def scale(self) -> float:
        """Scale of Student's distribution in its standard deviation; 1 of every other."""
        return 1.0 if self.dof is None else math.sqrt((self.dof - 2.0) / self.dof)

    @property
    def bounded(self) -> bool:
        """Whether t lies in [-1, 1]; a normal or Student one reaches beyond any band."""
        return self.name not in (_NORMAL, _STUDENT)

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest t; of one that reaches beyond any band, those of its band."""
        return (self.values[0], self.values[-1]) if len(self.values) > 1 else (-1.0, 1.0)

    @property
    def stepped(self) -> bool:
        """Whether t takes listed values only."""
        return self.name in (TWO_POINT.name, _DISCRETE, _EMPIRICAL)

    @property
    def steps(self) -> tuple[Floats, Floats]:
        """Values (m,), ascending, and the probability up to and with each, of a `stepped` one."""
        if self.name == TWO_POINT.name:
            return np.array([-1.0, 1.0]), np.array([0.5, 1.0])
        values = np.array(self.values)
        if self.name == _EMPIRICAL:
            return values, np.arange(1, values.size + 1) / values.size
        up_to = np.cumsum(self.probabilities)
        up_to[-1] = 1.0
        return values, up_to

    def quantile(self, u: ArrayLike) -> Floats:
        """The t up to which the probability is `u`, an array of numbers in (0, 1)."""
        probability = np.asarray(u, np.float64)
        if self.name == _NORMAL:
            return normal_quantile(probability) / self.sigmas
        if self.name == _STUDENT:
            assert self.dof is not None
            return student_quantile(probability, self.dof) * (self.scale / self.sigmas)
        if self.stepped:
            values, up_to = self.steps
            # u in [up_to before, up_to): a variable drawn from [0, 1) has the exact share of each.
            at = np.searchsorted(up_to, probability, side="right")
            return np.asarray(values[np.minimum(at, values.size - 1)], np.float64)
        closed: Floats
        if self.name == TRIANGULAR.name:
            lower = np.sqrt(2.0 * np.minimum(probability, 0.5)) - 1.0
            upper = 1.0 - np.sqrt(2.0 * (1.0 - np.maximum(probability, 0.5)))
            closed = np.where(probability < 0.5, lower, upper)
        elif self.name == ARCSINE.name:
            closed = -np.cos(math.pi * probability)
        else:
            closed = 2.0 * probability - 1.0
        return closed


UNIFORM = Distribution("uniform", math.sqrt(3.0))
"""Anywhere in the band, as likely."""

TRIANGULAR = Distribution("triangular", math.sqrt(6.0))
"""Rather in the middle: the sum of two uniform ones of one width."""

ARCSINE = Distribution("arcsine", math.sqrt(2.0))
"""A sine of unknown phase: rather near the ends."""

TWO_POINT = Distribution("two-point", 1.0)
"""At either end of the band, as likely."""


def normal(sigmas: float = 3.0) -> Distribution:
    """Normal distribution whose half band is taken as `sigmas` standard deviations."""
    return Distribution(_NORMAL, _checked(sigmas))


def student_t(dof: float, sigmas: float = 3.0) -> Distribution:
    """Student's distribution; its half band is `sigmas` of its standard deviations.

    It is the standard deviation that is stated, not the scale: sqrt(dof / (dof - 2)) times the
    scale. Raises `ValueError` for `dof` of 2 or fewer, where there is none.
    """
    if not (math.isfinite(dof) and dof > LEAST_DOF):
        raise ValueError(f"no standard deviation with {dof} degrees of freedom")
    return Distribution(_STUDENT, _checked(sigmas), dof=float(dof))


def student_deviation(scale: float, dof: float) -> float:
    """Standard deviation of Student's distribution of a scale, as JCGM 101:2008, 6.4.9 states it.

    Its scale is that of x in (x - value) / scale = t, s / sqrt(n) of the mean of n readings. `dof`
    above 2.
    """
    return scale * math.sqrt(dof / (dof - 2.0))


def _checked(sigmas: float) -> float:
    if not (math.isfinite(sigmas) and sigmas > 0.0):
        raise ValueError(f"a band of {sigmas} standard deviations is no band")
    return float(sigmas)


@dataclass(frozen=True)
class Listed:
    """Listed values as a band: their mean, the largest distance from it, the distribution in it."""

    centre: float
    half: float
    distribution: Distribution


def discrete(values: Sequence[float], probabilities: Sequence[float]) -> Listed:
    """Listed values, each with its probability.

    Raises `ValueError` where there is no value, one is not finite, or the probabilities are not
    as many, negative, or do not add up to one.
    """
    listed, given = _numbers(values), _numbers(probabilities)
    if given.size != listed.size:
        raise ValueError(f"{listed.size} values, but {given.size} probabilities")
    if (given < 0.0).any():
        raise ValueError(f"a probability is {given.min():g}")
    total = math.fsum(given)
    if abs(total - 1.0) > _PROBABILITY_SLACK:
        raise ValueError(f"the probabilities add up to {total:.10g}")
    taken = given > 0.0
    kept, place = np.unique(listed[taken], return_inverse=True)
    together = np.zeros(kept.size)
    np.add.at(together, place, given[taken] / total)
    return _standardised(_DISCRETE, kept, together)


def empirical(values: Sequence[float]) -> Listed:
    """Measured values, each as likely as another.

    Raises `ValueError` where there is no value or one is not finite.
    """
    return _standardised(_EMPIRICAL, np.sort(_numbers(values)), None)


def _numbers(values: Sequence[float]) -> Floats:
    numbers = np.asarray(values, np.float64)
    if numbers.ndim != 1 or numbers.size == 0:
        raise ValueError("a list of numbers is wanted, at least one")
    if not np.isfinite(numbers).all():
        raise ValueError("a value is not finite")
    return numbers


def _standardised(name: str, values: Floats, probabilities: Floats | None) -> Listed:
    """The band of `values`, ascending, and where in it they lie."""
    weights = np.full(values.size, 1.0 / values.size) if probabilities is None else probabilities
    # About the middle first: values that differ little from one large number keep their digits.
    middle = 0.5 * float(values[0]) + 0.5 * float(values[-1])
    offset = math.fsum((values - middle) * weights)
    from_mean = (values - middle) - offset
    half = float(np.abs(from_mean).max())
    given = () if probabilities is None else tuple(weights.tolist())
    if half == 0.0:
        # One value: no band. How it spreads in it is all the same.
        return Listed(middle, 0.0, Distribution(name, 1.0, values=(0.0,), probabilities=given[:1]))
    t = from_mean / half
    deviation = math.sqrt(math.fsum(weights * np.square(t)))
    distribution = Distribution(
        name, 1.0 / deviation, values=tuple(t.tolist()), probabilities=given
    )
    return Listed(middle + offset, half, distribution)
