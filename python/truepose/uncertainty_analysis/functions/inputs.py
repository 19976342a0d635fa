"""What is known of an argument of a plain function: an estimate and how it spreads about it.

The same form as a deviation's: a centre, a half band and the distribution in it, so that a plain
function goes through the same combining code as a machine. Correlations of either are checked
here as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats, is_masked
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.probability import distributions
from truepose.probability.distributions import (
    ARCSINE,
    LEAST_DOF,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Distribution,
    Listed,
)
from truepose.probability.semidefinite import clash

Correlation: TypeAlias = Mapping[tuple[str, str], float] | ArrayLike | None
"""Coefficients by pairs of names, or a matrix over all names in their order; None: independent."""


@dataclass(frozen=True)
class Input:
    """An argument of a function: it lies in `centre` -+ `half`, spread as `distribution` says.

    `dof`: degrees of freedom of the estimate of its standard uncertainty (GUM, JCGM 100:2008,
    annex G); inf where that is known outright. Use one of the constructors, which raise
    `RequestError` for what cannot be.
    """

    centre: float
    half: float
    distribution: Distribution = UNIFORM
    dof: float = math.inf

    def __post_init__(self) -> None:
        _finite("centre", self.centre)
        _not_negative("half", self.half)

    @property
    def standard_uncertainty(self) -> float:
        """Half band over its number of standard deviations."""
        return self.half / self.distribution.sigmas

    @classmethod
    def exact(cls, value: float) -> Input:
        """A value without uncertainty."""
        return cls(_finite("value", value), 0.0)

    @classmethod
    def normal(cls, value: float, u: float, dof: float = math.inf, *, sigmas: float = 3.0) -> Input:
        """A normal distribution of standard uncertainty `u`, estimated with `dof`.

        `sigmas`: what a worst case takes as its half band, in standard uncertainties.
        """
        spread = distributions.normal(_positive("sigmas", sigmas))
        return cls(_finite("value", value), sigmas * _not_negative("u", u), spread, _degrees(dof))

    @classmethod
    def student_t(
        cls,
        value: float,
        u: float | None = None,
        dof: float | None = None,
        *,
        scale: float | None = None,
        sigmas: float = 3.0,
    ) -> Input:
        """Student's distribution of `dof` degrees of freedom, of standard deviation `u` or `scale`.

        It is what JCGM 101:2008, 6.4.9 makes of a few readings, and states by its scale: that of
        n readings with the standard deviation s is s / sqrt(n), the standard deviation of their
        mean, and `dof` n - 1. `u` is sqrt(dof / (dof - 2)) times the scale; it is known outright.
        One of `u` and `scale` is given (missing-key, excluding-keys), and `dof` (missing-key).
        """
        if dof is None:
            raise _refused(
                "missing-key",
                "Student's distribution has degrees of freedom",
                found="no dof",
                expected="dof, n - 1 of n readings",
            )
        if not (_finite("dof", dof) > LEAST_DOF):
            raise _refused(
                "too-few-degrees-of-freedom",
                "Student's distribution has no standard deviation with so few degrees of freedom",
                found=f"dof = {dof:g}",
                expected=f"more than {LEAST_DOF:g}",
            )
        deviation = _student_deviation(u, scale, dof)
        spread = distributions.student_t(dof, _positive("sigmas", sigmas))
        return cls(_finite("value", value), sigmas * deviation, spread)

    @classmethod
    def uniform(cls, lower: float, upper: float, dof: float = math.inf) -> Input:
        """Anywhere from `lower` to `upper`, as likely; `dof` of how well the limits are known."""
        return cls(*_band(lower, upper), UNIFORM, _degrees(dof))

    @classmethod
    def triangular(cls, lower: float, upper: float) -> Input:
        """From `lower` to `upper`, rather in the middle."""
        return cls(*_band(lower, upper), TRIANGULAR)

    @classmethod
    def arcsine(cls, lower: float, upper: float) -> Input:
        """From `lower` to `upper` and back as a sine of unknown phase."""
        return cls(*_band(lower, upper), ARCSINE)

    @classmethod
    def two_point(cls, lower: float, upper: float) -> Input:
        """Either `lower` or `upper`, as likely."""
        return cls(*_band(lower, upper), TWO_POINT)

    @classmethod
    def discrete(cls, values: Sequence[float], probabilities: Sequence[float]) -> Input:
        """One of `values`, with its probability."""
        return cls._listed(lambda: distributions.discrete(values, probabilities))

    @classmethod
    def empirical(cls, values: Sequence[float]) -> Input:
        """One of the measured `values`, as likely as another."""
        return cls._listed(lambda: distributions.empirical(values))

    @classmethod
    def _listed(cls, make: Callable[[], Listed]) -> Input:
        try:
            listed = make()
        except (TypeError, ValueError) as error:
            raise _refused(
                "bad-distribution",
                f"these values are no distribution: {error}",
                found=str(error),
                expected="finite values, and as many probabilities from 0 to 1, of sum 1",
            ) from None
        return cls(listed.centre, listed.half, listed.distribution)


def _refused(code: str, message: str, *, found: str, expected: str) -> RequestError:
    return RequestError(Problem(code, message, found=found, expected=expected))


def _finite(name: str, value: float) -> float:
    try:
        number = float(value if not is_masked(value) else "masked")
    except (TypeError, ValueError, OverflowError):
        raise _refused(
            "wrong-type", f"{name} is not a number", found=repr(value), expected="a number"
        ) from None
    if not math.isfinite(number):
        raise _refused(
            "not-finite",
            f"{name} is not finite",
            found=f"{name} = {number}",
            expected="a finite number",
        )
    return number


def _positive(name: str, value: float) -> float:
    number = _finite(name, value)
    if number <= 0.0:
        raise _refused(
            "not-positive",
            f"{name} is not above zero",
            found=f"{name} = {number:g}",
            expected="a number above zero",
        )
    return number


def _not_negative(name: str, value: float) -> float:
    number = _finite(name, value)
    if number < 0.0:
        raise _refused(
            "negative",
            f"{name} is negative: no uncertainty is",
            found=f"{name} = {number:g}",
            expected="zero or more",
        )
    return number


def _student_deviation(u: float | None, scale: float | None, dof: float) -> float:
    """The standard deviation of Student's distribution, given itself or by the scale."""
    if u is not None and scale is None:
        return _not_negative("u", u)
    if scale is not None and u is None:
        return distributions.student_deviation(_not_negative("scale", scale), dof)
    raise _refused(
        "missing-key" if scale is None else "excluding-keys",
        "Student's distribution is given by its standard deviation or by its scale",
        found="neither u nor scale" if scale is None else f"u = {u!r} and scale = {scale!r}",
        expected="u (the standard deviation), or scale (s / sqrt(n) of n readings)",
    )


def _degrees(dof: float) -> float:
    """Degrees of freedom of an estimate: above zero, inf where nothing was estimated."""
    return math.inf if dof == math.inf else _positive("dof", dof)


def _band(lower: float, upper: float) -> tuple[float, float]:
    """Centre and half of a band."""
    low, high = _finite("lower", lower), _finite("upper", upper)
    if low > high:
        raise _refused(
            "band-reversed",
            "the lower end of the band is above its upper end",
            found=f"lower = {low:g}, upper = {high:g}",
            expected="the lower end first",
        )
    # Halves first: the sum of two finite numbers may not be one.
    return 0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low


def correlation_matrix(names: Sequence[str], given: Correlation) -> Floats | None:
    """(n, n) correlation of the variables `names`, None where all are independent.

    Raises `RequestError`: bad-correlation, correlation-twice, unknown-input,
    correlation-not-semidefinite.
    """
    if given is None:
        return None
    matrix = _of_pairs(names, given) if isinstance(given, Mapping) else _of_matrix(names, given)
    problem = clash(names, matrix)
    if problem is not None:
        raise RequestError(problem)
    return None if np.array_equal(matrix, np.eye(len(names))) else matrix


def _of_pairs(names: Sequence[str], pairs: Mapping[Any, Any]) -> Floats:
    matrix = np.eye(len(names))
    given: dict[frozenset[str], object] = {}
    for pair, coefficient in pairs.items():
        if not (isinstance(pair, tuple) and len(pair) == 2):
            raise _refused(
                "bad-correlation",
                "a correlation is between two inputs",
                found=repr(pair),
                expected='a pair of names, such as ("x", "y")',
            )
        for name in pair:
            if name not in names:
                raise RequestError(
                    Problem(
                        "unknown-input",
                        f"a correlation with an input that is not there: {name!r}",
                        found=repr(name),
                        expected=one_of(names),
                        hint=did_you_mean(str(name), names),
                    )
                )
        both = frozenset(pair)
        if len(both) == 1 or both in given:
            raise _refused(
                "correlation-twice",
                f"{pair[0]} is correlated with itself"
                if len(both) == 1
                else f"{pair[0]} and {pair[1]} are given a correlation twice",
                found=repr(pair),
                expected="each pair of two inputs once, in either order",
            )
        given[both] = coefficient
        i, j = names.index(pair[0]), names.index(pair[1])
        matrix[i, j] = matrix[j, i] = _coefficient(pair, coefficient)
    return matrix


def _coefficient(pair: tuple[str, str], value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not -1.0 <= number <= 1.0:
        raise _refused(
            "bad-correlation",
            f"the correlation of {pair[0]} and {pair[1]} is no coefficient",
            found=repr(value),
            expected="a number from -1 to 1",
        )
    return number


def _of_matrix(names: Sequence[str], given: ArrayLike) -> Floats:
    try:
        matrix = np.array(given, np.float64)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    count = len(names)
    fault = None
    if matrix.shape != (count, count):
        fault = f"shape {matrix.shape}"
    elif not (np.abs(matrix) <= 1.0).all():
        fault = "a coefficient that is no number from -1 to 1"
    elif (np.diagonal(matrix) != 1.0).any():
        fault = "an input whose correlation with itself is not 1"
    elif np.abs(matrix - matrix.T).max(initial=0.0) > 1e-12:
        fault = "a coefficient that is another one across the diagonal"
    if fault is not None:
        raise _refused(
            "bad-correlation",
            "this is no correlation matrix of the inputs",
            found=fault,
            expected=f"({count}, {count}) numbers from -1 to 1, symmetric, 1 on the diagonal",
        )
    return 0.5 * (matrix + matrix.T)
