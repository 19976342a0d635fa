"""Inputs of plain functions, and their correlations."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

import truepose as tp
from truepose.errors import RequestError
from truepose.uncertainty_analysis.functions.inputs import Input, correlation_matrix

NAMES = ("x", "y", "z")


@pytest.mark.parametrize(
    ("made", "centre", "half", "u"),
    [
        (Input.exact(3.0), 3.0, 0.0, 0.0),
        (Input.normal(215.0, 5.8), 215.0, 17.4, 5.8),
        (Input.normal(215.0, 5.8, sigmas=2.0), 215.0, 11.6, 5.8),
        (Input.student_t(1.5, 0.1, 3), 1.5, 0.3, 0.1),
        (Input.uniform(-1.0, 2.0), 0.5, 1.5, 1.5 / math.sqrt(3.0)),
        (Input.triangular(0.0, 1.0), 0.5, 0.5, 0.5 / math.sqrt(6.0)),
        (Input.arcsine(-0.5, 0.5), 0.0, 0.5, 0.5 / math.sqrt(2.0)),
        (Input.two_point(1.0, 2.0), 1.5, 0.5, 0.5),
        (Input.discrete([1, 2], [0.25, 0.75]), 1.75, 0.75, math.sqrt(3.0) / 4.0),
        (Input.empirical([1, 1, 4]), 2.0, 2.0, math.sqrt(2.0)),
    ],
)
def test_every_constructor(made: Input, centre: float, half: float, u: float) -> None:
    assert made.centre == pytest.approx(centre, rel=1e-15)
    assert made.half == pytest.approx(half, rel=1e-15)
    assert made.standard_uncertainty == pytest.approx(u, rel=1e-14)
    assert made.dof == math.inf


def test_degrees_of_freedom_are_of_the_estimate() -> None:
    assert Input.normal(0.0, 1.0, 18).dof == 18.0
    assert Input.uniform(-1.0, 1.0, 50).dof == 50.0
    student = Input.student_t(0.0, 1.0, 5)
    assert (student.dof, student.distribution.dof) == (math.inf, 5.0)


def test_the_halves_of_a_huge_band_are_finite() -> None:
    huge = Input.uniform(-1.5e308, 1.5e308)
    assert (huge.centre, huge.half) == (0.0, 1.5e308)


def test_it_is_public() -> None:
    assert tp.Input is Input


@pytest.mark.parametrize(
    ("make", "code", "words"),
    [
        (lambda: Input.uniform(2.0, 1.0), "band-reversed", "lower = 2, upper = 1"),
        (lambda: Input.triangular(2.0, 1.0), "band-reversed", "above"),
        (lambda: Input.arcsine(2.0, 1.0), "band-reversed", "above"),
        (lambda: Input.two_point(2.0, 1.0), "band-reversed", "above"),
        (lambda: Input.uniform(-math.inf, 1.0), "not-finite", "lower"),
        (lambda: Input.normal(math.nan, 1.0), "not-finite", "value"),
        (lambda: Input.normal(0.0, -1.0), "negative", "u = -1"),
        (lambda: Input.normal("a", 1.0), "wrong-type", "value is not a number"),
        (lambda: Input.normal(0.0, 1.0, 0), "not-positive", "dof = 0"),
        (lambda: Input.normal(0.0, 1.0, math.nan), "not-finite", "dof"),
        (lambda: Input.normal(0.0, 1.0, sigmas=0.0), "not-positive", "sigmas"),
        (lambda: Input.student_t(0.0, 1.0, 2), "too-few-degrees-of-freedom", "dof = 2"),
        (lambda: Input.student_t(0.0, scale=1.0, dof=2), "too-few-degrees-of-freedom", "dof = 2"),
        (lambda: Input.student_t(0.0, 1.0, 4, scale=1.0), "excluding-keys", "u = 1.0 and scale"),
        (lambda: Input.student_t(0.0, dof=4), "missing-key", "neither u nor scale"),
        (lambda: Input.student_t(0.0, scale=1.0), "missing-key", "no dof"),
        (lambda: Input.student_t(0.0, scale=-1.0, dof=4), "negative", "scale = -1"),
        (lambda: Input.student_t(0.0, scale=math.nan, dof=4), "not-finite", "scale = nan"),
        (lambda: Input.student_t(0.0, 1.0, math.inf), "not-finite", "dof"),
        (lambda: Input.exact(math.inf), "not-finite", "value"),
        (lambda: Input(0.0, -1.0), "negative", "half = -1"),
        (lambda: Input(math.nan, 1.0), "not-finite", "centre"),
        (lambda: Input.normal(0.0, 1e308), "not-finite", "half"),
        (lambda: Input.discrete([1, 2], [0.5, 0.6]), "bad-distribution", "add up to 1.1"),
        (lambda: Input.empirical([]), "bad-distribution", "at least one"),
        (lambda: Input.empirical(["a"]), "bad-distribution", "no distribution"),
    ],
)
def test_what_an_input_cannot_be(make: Callable[[], Input], code: str, words: str) -> None:
    with pytest.raises(RequestError) as caught:
        make()
    (problem,) = caught.value.problems
    assert problem.code == code
    assert words in str(problem)
    assert problem.found
    assert problem.expected


def test_correlations_by_pairs() -> None:
    found = correlation_matrix(NAMES, {("z", "x"): 0.5, ("x", "y"): -0.25})
    assert found is not None
    assert found.tolist() == [[1.0, -0.25, 0.5], [-0.25, 1.0, 0.0], [0.5, 0.0, 1.0]]


def test_a_correlation_matrix_is_taken_as_it_is() -> None:
    given = np.array([[1.0, 0.2, 0.0], [0.2, 1.0, 0.3], [0.0, 0.3, 1.0]])
    found = correlation_matrix(NAMES, given)
    assert np.array_equal(found, given)
    given[0, 1] = 9.0
    assert found[0, 1] == 0.2


def test_independent_inputs_have_none() -> None:
    assert correlation_matrix(NAMES, None) is None
    assert correlation_matrix(NAMES, {}) is None
    assert correlation_matrix(NAMES, {("x", "y"): 0.0}) is None
    assert correlation_matrix(NAMES, np.eye(3)) is None
    assert correlation_matrix((), None) is None


def test_what_is_just_semidefinite_holds() -> None:
    half = dict.fromkeys((("x", "y"), ("y", "z"), ("x", "z")), -0.5)
    assert correlation_matrix(NAMES, half) is not None
    one = dict.fromkeys(half, 1.0)
    assert np.array_equal(correlation_matrix(NAMES, one), np.ones((3, 3)))


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        ({("x", "y"): 1.5}, "bad-correlation", "1.5"),
        ({("x", "y"): math.nan}, "bad-correlation", "nan"),
        ({("x", "y"): "a"}, "bad-correlation", "no coefficient"),
        ({"xy": 0.5}, "bad-correlation", "between two inputs"),
        ({("x", "w"): 0.5}, "unknown-input", "one of x, y, z"),
        ({("x", "x"): 1.0}, "correlation-twice", "with itself"),
        ({("x", "y"): 0.5, ("y", "x"): 0.5}, "correlation-twice", "twice"),
        (np.eye(2), "bad-correlation", "shape (2, 2)"),
        ("text", "bad-correlation", "no correlation matrix"),
        (2.0 * np.eye(3), "bad-correlation", "from -1 to 1"),
        (0.5 * np.eye(3), "bad-correlation", "with itself is not 1"),
        (np.array([[1.0, 0.5, 0.0], [0.4, 1.0, 0.0], [0.0, 0.0, 1.0]]), "bad-correlation",
         "across the diagonal"),
        ({("x", "y"): 0.9, ("y", "z"): 0.9, ("x", "z"): -0.9}, "correlation-not-semidefinite",
         "x, y, z"),
    ],
)  # fmt: skip
def test_what_is_no_correlation(given: object, code: str, words: str) -> None:
    with pytest.raises(RequestError) as caught:
        correlation_matrix(NAMES, given)
    (problem,) = caught.value.problems
    assert problem.code == code
    assert words in str(problem)


def test_only_those_that_clash_are_named_and_the_remedy_holds() -> None:
    names = [f"v{number}" for number in range(9)]
    pairs = {("v2", "v5"): 0.8, ("v5", "v7"): 0.8, ("v2", "v7"): -0.8, ("v0", "v1"): 0.3}
    with pytest.raises(RequestError) as caught:
        correlation_matrix(names, pairs)
    (problem,) = caught.value.problems
    assert [name for name in names if name in problem.message] == ["v2", "v5", "v7"]
    assert "-0.6" in str(problem.found)  # 1 - 2 * 0.8
    assert "times 0.625" in str(problem.hint)
    found = correlation_matrix(names, {pair: 0.625 * r for pair, r in pairs.items()})
    assert np.linalg.eigvalsh(found).min() >= -1e-12
