"""The quantile of the length of a normal vector, against tables and against draws."""

from __future__ import annotations

import numpy as np
import pytest

from truepose.probability.normal_length import length_quantile


@pytest.mark.parametrize(
    ("variances", "expected"),
    [
        # Roots of chi-square's 95 % points of 1, 2 and 3 degrees: 3.841459, 5.991465, 7.814728.
        ([4.0], 2.0 * 1.959964),
        ([1.0, 1.0], 2.447747),
        ([9.0, 9.0, 9.0], 3.0 * 2.795483),
        ([1.0, 1.0, 0.0], 2.447747),
        ([0.0, 1.0, 0.0], 1.959964),
        ([0.0, 0.0, 0.0], 0.0),
    ],
)
def test_equal_variances_are_of_chi_square(variances: list[float], expected: float) -> None:
    found = length_quantile(np.diag(variances)[np.newaxis], 0.95)
    assert found == pytest.approx([expected], rel=1e-6)


@pytest.mark.parametrize("probability", [0.5, 0.95, 0.999])
@pytest.mark.parametrize("size", [1, 2, 3])
def test_the_share_of_draws_within(size: int, probability: float) -> None:
    rng = np.random.default_rng(size)
    roots = rng.normal(size=(6, size, size))
    roots[3:, :, -1] *= 1e-3  # long and thin
    lengths = length_quantile(roots @ roots.transpose(0, 2, 1), probability)
    drawn = rng.normal(size=(200_000, size))
    for root, length in zip(roots, lengths, strict=True):
        inside = np.linalg.norm(drawn @ root.T, axis=1) <= length
        error = np.sqrt(probability * (1.0 - probability) / len(drawn))
        assert inside.mean() == pytest.approx(probability, abs=4.0 * error)


def test_what_is_not_determined_keeps_nothing() -> None:
    covariances = np.array([[[1.0, 0.0], [0.0, np.inf]], [[1.0, 0.0], [0.0, 1.0]]])
    assert length_quantile(covariances, 0.95) == pytest.approx([np.inf, 2.447747])
    assert length_quantile(np.zeros((2, 0, 0)), 0.95) == pytest.approx([0.0, 0.0])
    with pytest.raises(ValueError, match="4 components"):
        length_quantile(np.zeros((1, 4, 4)), 0.95)
