"""Distributions: their quantiles have the mean, spread and shape that each states."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.special
import scipy.stats

from truepose.probability.distributions import Listed, discrete, empirical, student_t
from truepose.probability.quantiles import (
    normal_cdf,
    normal_density,
    normal_quantile,
    student_quantile,
)
from truepose.sources import ARCSINE, TRIANGULAR, TWO_POINT, UNIFORM, Distribution, normal

DISCRETE = discrete([0.0, 1.0, 5.0], [0.5, 0.3, 0.2]).distribution
EMPIRICAL = empirical([1.0, 1.2, 0.7, 0.7, 2.0]).distribution
EVERY = (
    UNIFORM,
    TRIANGULAR,
    ARCSINE,
    TWO_POINT,
    normal(2.0),
    student_t(12.0),
    DISCRETE,
    EMPIRICAL,
)
EVENLY = (np.arange(100_000) + 0.5) / 100_000
"""Probabilities: the quantiles there are a sample without chance."""


@pytest.mark.parametrize("distribution", EVERY, ids=str)
def test_the_variable_has_mean_0_and_the_standard_deviation_stated(
    distribution: Distribution,
) -> None:
    t = distribution.quantile(EVENLY)
    assert abs(t.mean()) < 1e-9
    assert np.sqrt(np.square(t).mean()) == pytest.approx(1.0 / distribution.sigmas, rel=1e-3)
    assert (np.diff(t) >= 0.0).all()
    assert distribution.bounded == (np.abs(t) <= 1.0).all()


@pytest.mark.parametrize(
    ("distribution", "reference"),
    [
        (UNIFORM, scipy.stats.uniform(-1.0, 2.0)),
        (TRIANGULAR, scipy.stats.triang(0.5, -1.0, 2.0)),
        (ARCSINE, scipy.stats.arcsine(-1.0, 2.0)),
        (normal(3.0), scipy.stats.norm(0.0, 1.0 / 3.0)),
        (student_t(3.0, 2.0), scipy.stats.t(3.0, 0.0, 0.5 / math.sqrt(3.0))),
    ],
    ids=lambda each: each.name if isinstance(each, Distribution) else "",
)
def test_the_quantiles_are_those_of_scipy(distribution: Distribution, reference: object) -> None:
    u = np.concatenate(
        [np.logspace(-12, -2, 50), np.linspace(0.01, 0.99, 99), 1 - 1e-9 * EVENLY[::1000]]
    )
    assert np.allclose(distribution.quantile(u), reference.ppf(u), rtol=1e-10, atol=1e-14)


def test_the_quantile_has_the_shape_of_what_it_is_given() -> None:
    for distribution in EVERY:
        assert distribution.quantile(np.full((2, 3), 0.25)).shape == (2, 3)
        assert distribution.quantile(0.25).shape == ()


def test_listed_values_have_their_shares_to_the_last_one() -> None:
    values, counts = np.unique(DISCRETE.quantile(EVENLY), return_counts=True)
    assert values.tolist() == list(DISCRETE.values)
    assert counts.tolist() == [50_000, 30_000, 20_000]
    _, counts = np.unique(EMPIRICAL.quantile(EVENLY), return_counts=True)
    assert counts.tolist() == [40_000, 20_000, 20_000, 20_000]


def test_listed_values_are_a_band_about_their_mean() -> None:
    listed = discrete([5.0, 0.0, 1.0], [0.2, 0.5, 0.3])
    assert listed.centre == pytest.approx(1.3, abs=1e-15)
    assert listed.half == pytest.approx(3.7, abs=1e-15)
    assert listed.distribution == DISCRETE
    assert max(DISCRETE.values) == 1.0
    spread = math.sqrt(0.5 * 1.3**2 + 0.3 * 0.3**2 + 0.2 * 3.7**2)
    assert listed.half / listed.distribution.sigmas == pytest.approx(spread, rel=1e-14)
    measured = [0.3, -0.1, 0.2, 0.2]
    of_file = empirical(measured)
    assert of_file.centre == pytest.approx(np.mean(measured), abs=1e-16)
    assert of_file.half / of_file.distribution.sigmas == pytest.approx(np.std(measured), rel=1e-14)


def test_values_that_differ_little_from_one_large_number_keep_their_digits() -> None:
    large = 2.0**40
    of_file = empirical([large, large + 1.0, large + 5.0])
    assert of_file.centre == large + 2.0
    assert of_file.half == 3.0
    assert of_file.distribution.values == (-2.0 / 3.0, -1.0 / 3.0, 1.0)


def test_one_value_has_no_band() -> None:
    for listed in (empirical([2.5, 2.5]), discrete([2.5, 7.0], [1.0, 0.0])):
        assert (listed.centre, listed.half) == (2.5, 0.0)
        assert listed.distribution.quantile(0.3) == 0.0


def test_equal_values_and_none_of_no_probability_are_kept() -> None:
    assert discrete([1, 3, 3, 9], [0.5, 0.25, 0.25, 0.0]) == discrete([1, 3], [0.5, 0.5])
    assert isinstance(discrete([1, 3], [0.5, 0.5]), Listed)


@pytest.mark.parametrize(
    ("values", "probabilities", "words"),
    [
        ([], [], "at least one"),
        ([1.0, 2.0], [1.0], "2 values, but 1 prob"),
        ([1.0, 2.0], [1.5, -0.5], "a probability is -0.5"),
        ([1.0, 2.0], [0.5, 0.4], "add up to 0.9"),
        ([1.0, math.nan], [0.5, 0.5], "not finite"),
        ([[1.0, 2.0]], [0.5, 0.5], "a list of numbers"),
    ],
)
def test_what_is_no_distribution(values: list, probabilities: list, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        discrete(values, probabilities)


def test_what_cannot_be() -> None:
    with pytest.raises(ValueError, match="no band"):
        normal(0.0)
    with pytest.raises(ValueError, match="no band"):
        student_t(5.0, math.inf)
    for dof in (2.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="no standard deviation"):
            student_t(dof)


def test_how_each_is_told() -> None:
    assert str(UNIFORM) == "uniform"
    assert str(normal()) == "normal, 3 sigma"
    assert str(student_t(4.0)) == "student-t, 4 degrees of freedom, 3 sigma"
    assert str(DISCRETE) == "discrete"


@pytest.mark.parametrize("dof", [1.0, 2.1, 3.0, 5.5, 30.0, 400.0, 1000.0, 1e5, 1e9])
def test_student_s_quantiles_against_scipy(dof: float) -> None:
    u = np.concatenate(
        [np.logspace(-12, -1, 300), np.linspace(0.1, 0.9, 801), 1 - 1e-3 * EVENLY[::1000]]
    )
    u = u[np.abs(u - 0.5) > 1e-9]
    assert np.allclose(student_quantile(u, dof), scipy.special.stdtrit(dof, u), rtol=1e-9, atol=0)
    assert student_quantile(0.5, dof) == 0.0


def test_student_s_quantiles_of_one_degree_of_freedom_in_closed_form() -> None:
    u = np.logspace(-100, -2, 99)
    cauchy = -1.0 / np.tan(np.pi * u)
    assert np.allclose(student_quantile(u, 1.0), cauchy, rtol=1e-11, atol=0)


def test_the_normal_distribution() -> None:
    u = np.concatenate(
        [np.logspace(-300, -1, 600), np.linspace(0.1, 0.9, 801), 1 - 1e-6 * EVENLY[::1000]]
    )
    assert np.allclose(normal_quantile(u), scipy.special.ndtri(u), rtol=2e-15, atol=1e-16)
    assert normal_quantile([0.0, 0.5, 1.0]).tolist() == [-math.inf, 0.0, math.inf]
    z = np.linspace(-37.0, 9.0, 500)
    assert np.allclose(normal_cdf(z), scipy.special.ndtr(z), rtol=1e-12, atol=0)
    assert np.allclose(normal_density(z), scipy.stats.norm.pdf(z), rtol=1e-12, atol=0)
