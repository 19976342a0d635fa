"""Quantiles of a sample with an interval that holds whatever the distribution is.

Of n independent values the number at or below the p quantile is binomial (n, p), so two of them, in
their order, enclose it with a probability that binomial tails give (David and Nagaraja, Order
Statistics, 3rd ed. 2003, 7.1). Where values come with a probability of their own, or none of them
is finite, the probability is no less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from truepose.arrays import Floats

_ROUNDING = 1e-12
"""Of p n, so that 0.95 of 20,000 is 19,000 and not one more."""


@dataclass(frozen=True)
class Ranks:
    """Places, from 1, of n values in ascending order that enclose their p quantile.

    `estimate` is the least place at or below which lies the share p of all values. `lower` may be
    0 and `upper` n + 1, where so few values enclose it at one side only.
    """

    count: int
    estimate: int
    lower: int
    upper: int

    def of(self, sizes: Floats) -> tuple[Floats, Floats, Floats]:
        """Estimate, lower and upper end (...,), of sizes (..., count), which are not below 0."""
        wanted = (self.estimate, self.lower, self.upper)
        inside = sorted({min(max(rank, 1), self.count) - 1 for rank in wanted})
        ordered = np.partition(sizes, inside, axis=-1)

        def at(rank: int) -> Floats:
            if 1 <= rank <= self.count:
                return np.array(ordered[..., rank - 1])
            return np.full(sizes.shape[:-1], 0.0 if rank < 1 else np.inf)

        estimate, lower, upper = (at(rank) for rank in wanted)
        return estimate, lower, upper


@lru_cache(maxsize=64)
def ranks(count: int, probability: float, risk: float) -> Ranks:
    """Ranks whose values enclose the quantile with a probability of 1 - `risk` or more.

    Either end misses it with at most half of the risk.
    """
    mass = _binomial(count, probability)
    below, above = np.cumsum(mass), np.cumsum(mass[::-1])
    # The value at a place lies above the quantile where fewer values than that lie at or below it.
    lower = int(np.searchsorted(below, 0.5 * risk, side="right"))
    upper = count + 1 - int(np.searchsorted(above, 0.5 * risk, side="right"))
    estimate = max(1, math.ceil(count * probability * (1.0 - _ROUNDING)))
    return Ranks(count, estimate, min(lower, estimate), max(upper, estimate))


def _binomial(count: int, probability: float) -> Floats:
    """(count + 1,) probabilities of 0 to `count` of so many, each as likely as `probability`.

    From the ratio of one to the next, scaled to a sum of one.
    """
    k = np.arange(count)
    odds = math.log(probability) - math.log1p(-probability)
    logarithm = np.concatenate([[0.0], np.cumsum(np.log((count - k) / (k + 1.0)) + odds)])
    mass = np.exp(logarithm - logarithm.max())
    scaled: Floats = mass / mass.sum()
    return scaled
