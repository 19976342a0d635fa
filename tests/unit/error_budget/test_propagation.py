"""The law of propagation: correlation, effective degrees of freedom, coverage factors."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from truepose.error_budget.propagation import combine, coverage_factor, standard_uncertainty

RANDOM = np.random.default_rng(1993)
EFFECTS = RANDOM.normal(size=(4, 3, 5))
SIGMAS = np.array([3.0, np.sqrt(3.0), 1.0, np.sqrt(6.0), 2.0])


def correlation() -> np.ndarray:
    factors = RANDOM.normal(size=(5, 2))
    matrix = factors @ factors.T
    scale = np.sqrt(np.diagonal(matrix))
    return np.asarray(matrix / np.outer(scale, scale))


def test_independent_variables_add_as_squares() -> None:
    found = combine(EFFECTS, SIGMAS)
    each = EFFECTS / SIGMAS
    assert np.allclose(found.standard_uncertainty, np.sqrt((each**2).sum(axis=2)), rtol=1e-14)
    assert np.allclose(found.standard_uncertainty, standard_uncertainty(EFFECTS, SIGMAS))
    assert np.isinf(found.dof).all()


def test_correlated_ones_with_their_covariance() -> None:
    matrix = correlation()
    found = combine(EFFECTS, SIGMAS, matrix)
    inputs = matrix / np.outer(SIGMAS, SIGMAS)
    for n in range(4):
        expected = EFFECTS[n] @ inputs @ EFFECTS[n].T
        assert np.allclose(found.covariance[n], expected, rtol=1e-12, atol=1e-14)
        assert np.array_equal(found.covariance[n], found.covariance[n].T)
    alone = standard_uncertainty(EFFECTS, SIGMAS, correlation=matrix)
    assert np.allclose(found.standard_uncertainty, alone, rtol=1e-12)
    assert np.allclose(alone**2, np.einsum("ncc->nc", found.covariance), rtol=1e-12)


def test_no_coefficient_is_no_correlation() -> None:
    plain = standard_uncertainty(EFFECTS, SIGMAS)
    assert np.allclose(standard_uncertainty(EFFECTS, SIGMAS, correlation=np.eye(5)), plain)
    assert np.allclose(standard_uncertainty(EFFECTS.copy(), SIGMAS, EFFECTS.copy()), plain)


def test_what_cancels_is_nothing_and_not_the_root_of_rounding_below_zero() -> None:
    effects = np.array([[[1.0, 1.0]]])
    opposite = np.array([[1.0, -1.0], [-1.0, 1.0]])
    assert standard_uncertainty(effects, np.ones(2), correlation=opposite).tolist() == [[0.0]]
    assert combine(effects, np.ones(2), opposite).standard_uncertainty.tolist() == [[0.0]]


def test_effective_degrees_of_freedom_by_welch_and_satterthwaite() -> None:
    # GUM G.4.2: two readings of 9 degrees of freedom each, and one that is known outright.
    effects = np.array([[[3.0, 4.0, 0.0], [3.0, 4.0, 12.0]]])
    found = combine(effects, np.ones(3), None, np.array([9.0, 9.0, np.inf]))
    assert found.dof[0, 0] == pytest.approx(25.0**2 / ((3.0**4 + 4.0**4) / 9.0))
    assert found.dof[0, 1] == pytest.approx(169.0**2 / ((3.0**4 + 4.0**4) / 9.0))
    assert np.isinf(
        combine(effects * [0, 0, 1], np.ones(3), None, np.array([9, 9, np.inf])).dof[0]
    )[1]


def test_correlated_variables_of_finite_degrees_have_no_effective_ones() -> None:
    matrix = np.eye(4)
    matrix[0, 1] = matrix[1, 0] = 0.5
    matrix[1, 2] = matrix[2, 1] = 0.5
    effects, dofs = np.array([[[1.0, 2.0, 1.0, 3.0]]]), np.array([20.0, 8.0, 30.0, 5.0])
    found = combine(effects, np.ones(4), matrix, dofs)
    assert np.isnan(found.dof[0, 0])
    # The interval takes them as one variable of the fewest degrees among them.
    together = 1.0 + 4.0 + 1.0 + 2.0 * 0.5 * (2.0 + 2.0)
    expected = (together + 9.0) ** 2 / (together**2 / 8.0 + 81.0 / 5.0)
    assert found.scale_dof[0, 0] == pytest.approx(expected)
    # An output that none of them moves has its own, and so have correlated ones known outright.
    alone = combine(effects * [0.0, 0.0, 0.0, 1.0], np.ones(4), matrix, dofs)
    assert alone.dof[0, 0] == pytest.approx(5.0)
    known = combine(effects, np.ones(4), matrix, np.array([np.inf, np.inf, np.inf, 5.0]))
    assert known.dof[0, 0] == pytest.approx((together + 9.0) ** 2 / (81.0 / 5.0))


def test_student_variables_enter_the_degrees_of_freedom_by_their_scale() -> None:
    # Two of standard deviation 3 and 4, of 5 and 12 degrees, beside one known outright.
    scales = np.array([math.sqrt(3.0 / 5.0), math.sqrt(10.0 / 12.0), 1.0])
    effects, dofs = np.array([[[3.0, 4.0, 2.0]]]), np.array([5.0, 12.0, np.inf])
    found = combine(effects, np.ones(3), None, dofs, scales)
    assert found.standard_uncertainty[0, 0] == pytest.approx(math.sqrt(29.0))
    squares = [9.0 * 3.0 / 5.0, 16.0 * 10.0 / 12.0, 4.0]
    expected = sum(squares) ** 2 / (squares[0] ** 2 / 5.0 + squares[1] ** 2 / 12.0)
    assert found.dof[0, 0] == pytest.approx(expected)
    # The Student distribution of these degrees that has the standard deviation sqrt(29).
    assert found.scale[0, 0] == pytest.approx(math.sqrt(29.0 * (expected - 2.0) / expected))
    assert found.scale_dof[0, 0] == found.dof[0, 0]


@pytest.mark.parametrize("part", [0.0, 1e-100, 1e-60, 1e-10, 1e-3])
def test_parts_that_are_next_to_nothing_leave_the_degrees_of_freedom_without_end(
    part: float,
) -> None:
    effects, dofs = np.array([[[1.0, part]]]), np.array([np.inf, 5.0])
    found = combine(effects, np.ones(2), None, dofs)
    assert np.isinf(found.dof[0, 0])
    assert np.isfinite(coverage_factor(found.scale_dof, 0.95)).all()
    # One part in a hundred is one: 5 (1.0001)^2 / 1e-8.
    effects[0, 0, 1] = 1e-2
    assert combine(effects, np.ones(2), None, dofs).dof[0, 0] == pytest.approx(5.001e8, rel=1e-4)


@pytest.mark.parametrize("probability", [0.5, 0.6827, 0.95, 0.99, 0.9999])
def test_coverage_factors_are_students(probability: float) -> None:
    dof = np.array([[1.0, 2.5, 16.75], [1e4, np.inf, 2.5]])
    found = coverage_factor(dof, probability)
    expected = stats.t.ppf(0.5 + probability / 2, dof)
    assert np.allclose(found, expected, rtol=1e-9)


def test_table_g_2_of_the_gum() -> None:
    found = coverage_factor(np.array([1.0, 10.0, 16.0, 50.0, np.inf]), 0.95)
    assert np.round(found, 2).tolist() == [12.71, 2.23, 2.12, 2.01, 1.96]
