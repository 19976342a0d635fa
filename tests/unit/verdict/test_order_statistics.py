"""Order statistics about a quantile: against the binomial distribution of SciPy, and by drawing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

from truepose.verdict.order_statistics import Ranks, ranks


@pytest.mark.parametrize("count", [1, 7, 100, 20_000, 1_000_000])
@pytest.mark.parametrize("probability", [0.01, 0.5, 0.95, 0.997])
@pytest.mark.parametrize("risk", [0.1, 0.01, 1e-6])
def test_the_ranks_are_the_narrowest_that_the_binomial_allows(
    count: int, probability: float, risk: float
) -> None:
    found = ranks(count, probability, risk)
    law = stats.binom(count, probability)
    # The value at a rank is above the quantile where fewer than so many lie at or below it.
    assert law.cdf(found.lower - 1) <= 0.5 * risk
    assert law.sf(found.upper - 1) <= 0.5 * risk
    assert found.lower == found.estimate or law.cdf(found.lower) > 0.5 * risk
    assert found.upper == found.estimate or law.sf(found.upper - 2) > 0.5 * risk
    assert found.lower <= found.estimate <= found.upper
    assert found.lower >= 0
    assert found.upper <= count + 1


def test_the_estimate_is_the_least_value_that_the_share_is_not_above() -> None:
    assert ranks(20_000, 0.95, 0.01).estimate == 19_000
    assert ranks(20_001, 0.95, 0.01).estimate == 19_001
    assert ranks(3, 0.001, 0.01).estimate == 1


def test_values_by_their_ranks() -> None:
    rng = np.random.default_rng(3)
    sizes = rng.permuted(np.arange(1.0, 101.0) * np.array([[1.0], [2.0]]), axis=1)
    found = Ranks(100, 90, 0, 101).of(sizes)
    assert [each.tolist() for each in found] == [[90.0, 180.0], [0.0, 0.0], [np.inf, np.inf]]
    found = Ranks(100, 90, 1, 100).of(sizes)
    assert [each.tolist() for each in found] == [[90.0, 180.0], [1.0, 2.0], [100.0, 200.0]]
    sizes[0, sizes[0] > 89.0] = np.inf
    assert np.isinf(Ranks(100, 90, 1, 100).of(sizes)[0]).tolist() == [True, False]


Draw = Callable[[np.random.Generator, tuple[int, int]], np.ndarray]


@pytest.mark.parametrize(
    ("draw", "quantile", "steps"),
    [
        (lambda rng, size: rng.random(size), 0.9, False),
        (lambda rng, size: np.abs(rng.standard_t(1.0, size)), stats.t.ppf(0.95, 1.0), False),
        # Values that come with a probability of their own: at the quantile, and about it.
        (lambda rng, size: rng.integers(0, 10, size), 8.0, True),
        (lambda rng, size: rng.random(size) < 0.2, 1.0, True),
    ],
    ids=["uniform", "no variance", "ten values", "two values"],
)
def test_the_interval_holds_the_quantile_whatever_the_distribution(
    draw: Draw, quantile: float, steps: bool
) -> None:
    risk, runs = 0.2, 4000
    values = np.asarray(draw(np.random.default_rng(1), (runs, 300)), np.float64)
    _, lower, upper = ranks(300, 0.9, risk).of(values)
    missed = np.count_nonzero((lower > quantile) | (upper < quantile))
    assert missed <= stats.binom(runs, risk).ppf(1.0 - 1e-5)
    # Not wider than it need be, but for what whole numbers leave.
    assert steps or missed >= 0.7 * risk * runs
