"""JCGM 101 clause 8: the numerical tolerance, and the reasons given in words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from truepose.sources import TRIANGULAR, UNIFORM, Distribution, normal
from truepose.uncertainty_analysis.validity import (
    Compared,
    LinearAnswer,
    Sampled,
    compare,
    numerical_tolerance,
)

Array = NDArray[np.float64]
K = 1.959963984540054
COUNT = 400_000


@pytest.mark.parametrize(
    ("u", "digits", "expected"),
    [
        # The examples of JCGM 101:2008, 7.9.2: 100.02147 g with 0.00035 g, and with 0.0004 g.
        (0.00035, 2, 0.5e-5),
        (0.0004, 1, 0.5e-4),
        (2.0, 1, 0.5),
        (2.0, 2, 0.05),
        (0.0996, 2, 0.005),
        (0.0994, 2, 0.0005),
        (9.96e-7, 2, 0.5e-7),
        (10.1, 3, 0.05),
        (0.0, 2, 0.0),
        (np.nan, 2, 0.0),
    ],
)
def test_half_a_unit_of_the_last_digit(u: float, digits: int, expected: float) -> None:
    assert numerical_tolerance(u, digits) == pytest.approx(expected, rel=1e-12)


def compared(
    function: Callable[[Array], Array],
    slopes: list[float],
    distributions: list[Distribution],
    *,
    count: int = COUNT,
    factor: float = K,
    digits: int = 2,
    rounding: float = 1e-15,
) -> Compared:
    """The linear answer of a function of variables t at 0, against plain sampling."""
    random = np.random.default_rng(101)
    draw: dict[str, Callable[[Distribution], Any]] = {
        "uniform": lambda _: random.uniform(-1, 1, count),
        "triangular": lambda _: random.uniform(-0.5, 0.5, (2, count)).sum(axis=0),
        "normal": lambda each: random.normal(0, 1 / each.sigmas, count),
    }
    t = np.stack([draw[each.name](each) for each in distributions], axis=1)
    sigmas = np.array([each.sigmas for each in distributions])
    effects = np.array([slopes], float)
    value = function(np.zeros((1, len(slopes))))
    u = np.sqrt(((effects / sigmas) ** 2).sum(axis=1))
    linear = LinearAnswer(
        value=value,
        standard_uncertainty=u,
        coverage_factor=np.full(1, factor),
        lower=value - factor * u,
        upper=value + factor * u,
        effects=effects,
        sigmas=sigmas,
        names=[f"p{at}" for at in range(len(slopes))],
        distributions=distributions,
    )
    outputs = function(t)
    sampled = Sampled(
        mean=np.array([outputs.mean()]),
        standard_deviation=np.array([outputs.std()]),
        lower=np.quantile(outputs, [0.025]),
        upper=np.quantile(outputs, [0.975]),
        samples=count,
    )
    return compare(
        linear,
        sampled,
        ["x"],
        ["m"],
        probability=0.95,
        digits=digits,
        rounding=np.array([rounding]),
    )


def test_a_sum_of_normal_variables_is_valid() -> None:
    found = compared(lambda t: t.sum(axis=1), [1.0] * 4, [normal(1.0)] * 4)
    assert found.valid.tolist() == [True]
    assert found.reason == ""
    assert found.tolerance.tolist() == [0.05]
    assert found.difference_lower[0] < 0.05
    assert found.difference_upper[0] < 0.05


def test_a_dominant_uniform_variable_is_named() -> None:
    scale = np.sqrt(3.0) * np.array([1.0, 1.0, 1.0, 10.0])
    found = compared(lambda t: t @ scale, list(scale), [UNIFORM] * 4)
    assert found.valid.tolist() == [False]
    assert found.reason.startswith(
        "x: the sampled lower end lies 2.9 m above the linear one (-19.9"
    )
    assert " and the sampled upper end lies 2.9 m below the linear one (19.9 m)" in found.reason
    assert "where 0.5 m is allowed" in found.reason
    assert "p3, which is uniform, makes 97 % of the variance" in found.reason
    assert "second order" not in found.reason


def test_a_sensitivity_of_nothing_is_told() -> None:
    found = compared(lambda t: (t**2).sum(axis=1), [0.0, 0.0], [normal(1.0)] * 2)
    assert not found.valid[0]
    assert "its sensitivity is nearly zero here" in found.reason
    assert "the distribution is skewed" in found.reason
    assert "the mean is +2 off the value at the estimates" in found.reason
    # Half a unit of the last digit of the sampled standard deviation, 2.0.
    assert found.tolerance.tolist() == [0.05]


def test_a_skewed_distribution_is_told() -> None:
    found = compared(lambda t: np.exp(t[:, 0]), [1.0], [normal(2.0)])
    assert "the distribution is skewed" in found.reason
    assert "nearly zero" not in found.reason
    assert "more than the linear one, which is of second order" in found.reason


def test_less_than_linear_is_told_as_well() -> None:
    found = compared(lambda t: np.tanh(t[:, 0]), [1.0], [normal(1.0)])
    assert "% less than the linear one" in found.reason


def test_only_the_end_that_is_off_is_named() -> None:
    found = compared(
        lambda t: np.where(t[:, 0] > 0.0, 1.5, 1.1) * t[:, 0], [1.1], [normal(1.0)], digits=1
    )
    assert "the sampled upper end lies 0.78 m above the linear one (2.16 m)" in found.reason
    assert "lower end" not in found.reason


def test_few_degrees_of_freedom_are_told() -> None:
    found = compared(lambda t: t[:, 0], [1.0], [normal(1.0)], factor=4.3)
    assert "few degrees of freedom widen the linear interval to 4.3" in found.reason


def test_a_shape_that_nothing_explains_is_told() -> None:
    found = compared(lambda t: t.sum(axis=1), [1.0, 1.0], [UNIFORM, UNIFORM], digits=3)
    assert "the distribution is not normal: it reaches 1.9" in found.reason


def test_a_triangular_variable_alone() -> None:
    found = compared(lambda t: t[:, 0], [1.0], [TRIANGULAR], digits=3)
    assert "p0, which is triangular, makes 100 % of the variance" in found.reason


def test_too_few_samples_decide_nothing() -> None:
    found = compared(lambda t: t.sum(axis=1), [1.0] * 3, [normal(1.0)] * 3, count=300, digits=3)
    assert not found.valid[0]
    assert "the ends of 300 samples scatter by" in found.reason
    assert "more samples may decide otherwise" in found.reason


def test_rounding_is_no_difference() -> None:
    found = compared(lambda t: 1e-18 * t[:, 0] ** 2, [0.0], [UNIFORM], rounding=1e-15)
    assert found.valid.tolist() == [True]
    assert found.tolerance.tolist() == [1e-15]
