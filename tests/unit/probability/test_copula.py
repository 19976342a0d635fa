"""Correlated variables come to the correlation stated, each in its own distribution."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from truepose.errors import RequestError
from truepose.probability.copula import Copula
from truepose.probability.distributions import (
    ARCSINE,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Distribution,
    discrete,
    normal,
    student_t,
)

LISTED = discrete([0.0, 1.0, 5.0], [0.5, 0.3, 0.2]).distribution
EACH = [UNIFORM, TRIANGULAR, ARCSINE, TWO_POINT, normal(2.0), LISTED]


def of_two(one: Distribution, other: Distribution, coefficient: float) -> Copula:
    return Copula.of([one, other], np.array([[1.0, coefficient], [coefficient, 1.0]]))


def drawn(copula: Copula, count: int = 200_000) -> np.ndarray:
    normals = np.random.default_rng(1).standard_normal((count, len(copula.linked)))
    return copula.variables(normals @ copula.factor)


@pytest.mark.parametrize("coefficient", [-0.6, 0.35, 0.7])
@pytest.mark.parametrize(("one", "other"), list(itertools.combinations_with_replacement(EACH, 2)))
def test_the_correlation_stated_is_reached(
    one: Distribution, other: Distribution, coefficient: float
) -> None:
    try:
        copula = of_two(one, other, coefficient)
    except RequestError:
        assert LISTED in (one, other)  # askew: it cannot have all
        return
    found = drawn(copula, 60_000)
    assert np.corrcoef(found.T)[0, 1] == pytest.approx(coefficient, abs=0.012)
    deviations = [1.0 / one.sigmas, 1.0 / other.sigmas]
    assert found.std(axis=0) == pytest.approx(deviations, rel=0.02)


def test_uniform_variables_against_the_closed_form() -> None:
    """rho = 2 sin(pi r / 6), Pearson's own."""
    for coefficient in (-0.9, -0.2, 0.5, 0.97):
        latent = of_two(UNIFORM, UNIFORM, coefficient).latent[0, 1]
        assert latent == pytest.approx(2.0 * np.sin(np.pi * coefficient / 6.0), abs=1e-12)


def test_two_point_variables_against_the_closed_form() -> None:
    """r = 2 / pi asin(rho): Sheppard's."""
    for coefficient in (-0.8, 0.3, 0.6):
        latent = of_two(TWO_POINT, TWO_POINT, coefficient).latent[0, 1]
        assert latent == pytest.approx(np.sin(0.5 * np.pi * coefficient), abs=1e-9)


def test_normal_variables_keep_their_correlation() -> None:
    stated = np.array([[1.0, 0.4, 0.0], [0.4, 1.0, 0.0], [0.0, 0.0, 1.0]])
    copula = Copula.of([normal(3.0), normal(2.0), UNIFORM], stated)
    assert copula.linked.tolist() == [0, 1]
    assert (copula.latent == stated[:2, :2]).all()


def test_independent_variables_have_no_copula() -> None:
    assert Copula.of([UNIFORM, UNIFORM], np.eye(2)).linked.size == 0
    assert Copula.of([UNIFORM, UNIFORM], None).linked.size == 0


def test_variables_that_are_one() -> None:
    found = drawn(of_two(UNIFORM, UNIFORM, -1.0), 1000)
    assert found[:, 0] == pytest.approx(-found[:, 1], abs=1e-6)
    found = drawn(of_two(student_t(5.0), student_t(5.0), 1.0), 1000)
    assert found[:, 0] == pytest.approx(found[:, 1], abs=1e-6)


def test_a_correlation_that_two_distributions_cannot_have() -> None:
    """A sign and a normal variable have sqrt(2 / pi) = 0.798 at most."""
    stated = np.array([[1.0, 0.0, 0.85], [0.0, 1.0, 0.0], [0.85, 0.0, 1.0]])
    with pytest.raises(RequestError) as caught:
        Copula.of([TWO_POINT, UNIFORM, normal(3.0)], stated, ["a", "b", "c"])
    problem = caught.value.problems[0]
    assert problem.code == "correlation-out-of-reach"
    assert problem.found == "0.85"
    assert "0.797" in str(problem.expected) or "0.798" in str(problem.expected)
    assert problem.message.startswith("a (two-point) and c (normal, 3 sigma)")
    of_two(TWO_POINT, normal(3.0), 0.79)


def test_correlations_that_the_distributions_cannot_have_together() -> None:
    """Each pair could; the normal variables behind them could not be correlated so."""
    stated = np.array([[1.0, 0.6, -0.35], [0.6, 1.0, 0.2], [-0.35, 0.2, 1.0]])
    stated = np.block([[np.ones((1, 1)), np.zeros((1, 3))], [np.zeros((3, 1)), stated]])
    assert np.linalg.eigvalsh(stated).min() > 0.1
    with pytest.raises(RequestError) as caught:
        Copula.of([UNIFORM, ARCSINE, TWO_POINT, LISTED], stated, ["o", "a", "b", "c"])
    problem = caught.value.problems[0]
    assert problem.code == "correlation-out-of-reach"
    assert problem.found == "a with b 0.6, a with c -0.35, b with c 0.2"
    # What is all but out of reach, by rounding only, is not refused.
    one = np.ones((3, 3))
    for each in (UNIFORM, ARCSINE, TRIANGULAR, student_t(4.0)):
        assert Copula.of([each] * 3, one).latent == pytest.approx(one, abs=1e-9)
