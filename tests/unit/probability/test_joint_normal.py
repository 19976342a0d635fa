"""The correlation of normal variables that gives others the correlation stated."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement

import numpy as np
import pytest

from sweeps import sweep
from truepose.errors import RequestError
from truepose.probability.distributions import discrete, empirical, student_t
from truepose.probability.joint_normal import normal_correlation, reach
from truepose.probability.quantiles import normal_cdf
from truepose.sources import ARCSINE, TRIANGULAR, TWO_POINT, UNIFORM, Distribution, normal

THREE = discrete([0.0, 1.0, 5.0], [0.5, 0.3, 0.2]).distribution
MEASURED = empirical(np.random.default_rng(4).lognormal(size=25).tolist()).distribution
BELOW_ONE = 1.0 - 2.0**-53
EVERY = (UNIFORM, TRIANGULAR, ARCSINE, TWO_POINT, normal(), student_t(3.0), THREE, MEASURED)
PAIRS = [
    pytest.param(*pair, marks=() if number % 4 == 0 else sweep)
    for number, pair in enumerate(combinations_with_replacement(EVERY, 2))
]


def test_normal_variables_have_what_is_stated() -> None:
    assert normal_correlation(normal(3.0), normal(2.0), -0.37) == -0.37
    assert normal_correlation(normal(), normal(), 1.0) == 1.0


def test_two_uniform_variables_in_closed_form() -> None:
    for stated in (-1.0, -0.4, 0.0, 0.6, 1.0):
        found = normal_correlation(UNIFORM, UNIFORM, stated)
        assert found == pytest.approx(2.0 * math.sin(math.pi * stated / 6.0), abs=1e-15)


def test_two_points_in_closed_form() -> None:
    """Both signs agree with the probability 1/2 + asin(r) / pi (Sheppard)."""
    for stated in (-0.9, 0.3, 0.99):
        found = normal_correlation(TWO_POINT, TWO_POINT, stated)
        assert found == pytest.approx(math.sin(0.5 * math.pi * stated), abs=1e-12)


def test_a_normal_variable_is_proportional_to_what_it_goes_with() -> None:
    """E[z2 t1(z1)] = r E[z1 t1(z1)]."""
    share = math.sqrt(3.0 / math.pi)
    assert normal_correlation(normal(), UNIFORM, 0.5) == pytest.approx(0.5 / share, abs=1e-10)
    share = math.sqrt(2.0 / math.pi)
    assert normal_correlation(TWO_POINT, normal(), -0.5) == pytest.approx(-0.5 / share, abs=1e-10)


@pytest.mark.parametrize(("one", "other"), PAIRS, ids=lambda each: each.name)
def test_against_sums_over_a_fine_grid(one: Distribution, other: Distribution) -> None:
    """With z2 = r z1 + sqrt(1 - r^2) x, the mean of t1 t2 over midpoints of z1 and x."""
    least, most = reach(one, other)
    stated = 0.6 * least
    r = normal_correlation(one, other, stated)
    step = 1.0 / 20.0
    z = step * (np.arange(-160, 160) + 0.5)
    weights = np.exp(-0.5 * z**2)
    weights /= weights.sum()
    # At its upper end a probability is one before z is out of the grid.
    t1 = one.quantile(np.minimum(normal_cdf(z), BELOW_ONE))
    z2 = r * z[:, np.newaxis] + math.sqrt(1.0 - r * r) * z
    t2 = other.quantile(np.minimum(normal_cdf(z2), BELOW_ONE))
    found = float((weights * t1) @ t2 @ weights) * one.sigmas * other.sigmas
    # A step is out of place by up to half a step of z; Student's tail goes on beyond the grid.
    assert found == pytest.approx(stated, abs=3e-2 if one.stepped or other.stepped else 3e-3)
    assert normal_correlation(other, one, stated) == pytest.approx(r, abs=1e-9)
    assert -1.0 - 1e-7 <= least < 0.0 < most <= 1.0 + 1e-7


@pytest.mark.parametrize("distribution", EVERY, ids=str)
def test_a_variable_can_be_one_with_another_of_its_distribution(distribution: Distribution) -> None:
    assert reach(distribution, distribution)[1] == pytest.approx(1.0, abs=1e-6)
    assert normal_correlation(distribution, distribution, 1.0) == 1.0
    assert normal_correlation(distribution, distribution, 0.0) == pytest.approx(0.0, abs=1e-12)


def test_what_no_two_variables_of_these_distributions_can_have() -> None:
    with pytest.raises(RequestError) as caught:
        normal_correlation(normal(), UNIFORM, 0.98)
    (problem,) = caught.value.problems
    assert problem.code == "correlation-out-of-reach"
    assert problem.found == "0.98"
    assert problem.expected is not None
    assert "-0.9772 to 0.9772" in problem.expected
    with pytest.raises(RequestError, match="discrete"):
        normal_correlation(THREE, THREE, -0.5)
    with pytest.raises(RequestError, match=r"one \(.*\) and other \(uniform\) cannot have"):
        normal_correlation(normal(), UNIFORM, 0.98, ("one", "other"))
