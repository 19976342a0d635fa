"""Derivatives of plain functions, analytic or not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from truepose.uncertainty_analysis.functions.derivatives import slopes, steps

AT = np.array([0.7, -1.3])
SCALE = np.array([0.3, 0.2])


def of(function: Callable[..., np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    return lambda x: np.stack([function(x[:, 0], x[:, 1])], axis=1)


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (lambda x, y: x * y, [-1.3, 0.7]),
        (lambda x, y: np.exp(3.0 * x) / y, [3.0 * np.exp(2.1) / -1.3, -np.exp(2.1) / 1.69]),
        (lambda x, y: np.sin(40.0 * x) + y**3, [40.0 * np.cos(28.0), 3.0 * 1.69]),
        (lambda x, y: np.where(x > 0.0, x**2, np.nan) + 0 * y, [1.4, 0.0]),
    ],
)
def test_analytic_functions_to_the_last_digits(
    function: Callable[..., np.ndarray], expected: list[float]
) -> None:
    found = slopes(of(function), AT, SCALE)
    assert found.shape == (1, 2)
    assert np.allclose(found[0], expected, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        # Each gives wrong complex steps, or none, without a word.
        (lambda x, y: np.abs(x) * np.abs(y), [1.3, -0.7]),
        (lambda x, y: np.hypot(x, y), AT / np.hypot(*AT)),
        (lambda x, y: np.arctan2(y, x), np.array([1.3, 0.7]) / np.dot(AT, AT)),
        (lambda x, y: np.real(x) ** 2 + y, [1.4, 1.0]),
        (lambda x, y: np.asarray(x, np.float64) ** 2 + y, [1.4, 1.0]),
        (lambda x, y: np.vectorize(lambda a, b: float(a) * float(b))(x, y), [-1.3, 0.7]),
        (lambda x, y: (x * np.conj(x)).real + y, [1.4, 1.0]),
        (lambda x, y: np.sqrt(x * np.conj(x)) + y, [1.0, 1.0]),
    ],
)
def test_other_functions_by_differences(
    function: Callable[..., np.ndarray], expected: list[float]
) -> None:
    assert np.allclose(slopes(of(function), AT, SCALE)[0], expected, rtol=1e-9, atol=1e-9)


def test_several_outputs_and_an_exact_input() -> None:
    def function(x: np.ndarray) -> np.ndarray:
        return np.stack([x[:, 0] ** 2, x[:, 1], np.abs(x[:, 0])], axis=1)

    found = slopes(function, AT, np.array([0.3, 0.0]))
    assert np.allclose(found, [[1.4, 0.0], [0.0, 0.0], [1.0, 0.0]], rtol=1e-12, atol=1e-14)


def test_a_band_that_is_tiny_beside_its_input_is_looked_at_more_widely() -> None:
    """A difference over the band would be the rounding of 5e7."""
    at, half = np.array([5e7, 0.0]), np.array([1e-6, 1e-9])
    scale = steps(at, half)
    assert scale.tolist() == [5e4, 1e-9]
    assert steps(at, np.zeros(2)).tolist() == [0.0, 0.0]
    found = slopes(of(lambda x, y: np.abs(x) * np.asarray(1.0 + y).real), at, scale)
    assert np.allclose(found[0], [1.0, 5e7], rtol=1e-5)


def test_a_function_that_ends_within_its_first_steps() -> None:
    """Beyond its end it has no value, and steps that reach there do not count."""
    found = slopes(of(lambda x, y: np.sqrt(np.abs(x.real)) + 0 * y.real), AT, np.array([20.0, 1.0]))
    assert found[0] == pytest.approx([0.5 / np.sqrt(0.7), 0.0], rel=1e-6, abs=1e-9)
    with np.errstate(invalid="ignore"):
        near = slopes(of(lambda x, y: np.log(x.real) + 0 * y.real), AT, np.array([20.0, 1.0]))
    assert near[0] == pytest.approx([1.0 / 0.7, 0.0], rel=1e-6, abs=1e-9)
