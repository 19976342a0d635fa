"""Comparison: which sources dominate and which may be ignored, over all poses (tables 5 and 6).

Position and orientation are never added: what is compared of each is the largest length that the
source alone can make it (`budget.largest`), be it a band or known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Accuracy

NEGLIGIBLE = 0.05
"""Part of the accuracy asked (or of the total) below which a source may be ignored."""

DOMINANT = 0.80
"""Part of the total that the dominant sources make together."""

ROUNDING = 1e-12

VERDICTS = ("negligible", "relevant", "dominant")


class Highest:
    """Running highest absolute value over poses; missing values are passed over."""

    def __init__(self, shape: tuple[int, ...]) -> None:
        self.value: Floats = np.full(shape, np.nan)

    def add(self, values: Floats) -> None:
        """`values` (n, *shape) of more poses."""
        self.raise_to(np.fmax.reduce(np.abs(values), axis=0))

    def raise_to(self, highest: Floats) -> None:
        """`highest`, as many numbers, over more poses."""
        np.fmax(self.value, highest.reshape(self.value.shape), out=self.value)


class LengthStatistics:
    """Running highest and root mean square of the largest error, a source and quantity."""

    def __init__(self, n_source: int, n_quantity: int) -> None:
        self._joined = np.zeros((n_source, n_quantity))
        self._squares: list[Floats] = []
        self._count = 0
        self.highest: Floats = np.zeros((n_source, n_quantity))

    def add(self, lengths: Floats) -> None:
        """`lengths` (n, n_source, n_quantity) of a block more."""
        self._count += len(lengths)
        self._squares.append(np.square(lengths).sum(axis=0))
        np.maximum(self.highest, lengths.max(axis=0, initial=0.0), out=self.highest)

    def join(self, later: LengthStatistics) -> None:
        """Those of the blocks that follow; rounded as if all had been added here.

        Sums of blocks are kept apart until then: where others add them up the bits differ.
        """
        self._joined = self._total(later._squares)
        self._squares = []
        self._count += later._count
        np.maximum(self.highest, later.highest, out=self.highest)

    def _total(self, more: Sequence[Floats] = ()) -> Floats:
        total = self._joined.copy()
        for squares in (*self._squares, *more):
            total += squares
        return total

    @property
    def rms(self) -> Floats:
        """(n_source, n_quantity) m and rad."""
        mean: Floats = np.sqrt(self._total() / max(self._count, 1))
        return mean


def share(highest: Floats) -> Floats:
    """(n_source,) each source's part of the sum of `highest` (n_source,); 0 where that is 0."""
    total = highest.sum()
    parts: Floats = highest / total if total > 0.0 else np.zeros_like(highest)
    return parts


def rank(shares: Floats) -> Indices:
    """(n_source,) 1 for the largest; equal ones in the order of the sources."""
    order = np.argsort(-shares, kind="stable")
    ranks = np.empty(order.size, np.intp)
    ranks[order] = np.arange(1, order.size + 1)
    return ranks


def verdict(highest: Floats, kinds: dict[str, Indices], accuracy: Accuracy) -> list[str]:
    """One of `VERDICTS` for each source, from `highest` (n_source, n_quantity).

    `negligible`: below 5 % of the accuracy asked, of the total where none is asked, in position,
    and in orientation where an accuracy of it is asked. `dominant`: the largest sources, by
    position, that together make 80 % of the total. All others are `relevant`.
    A machine that only turns is judged by its orientation.
    """
    names = list(kinds)
    leading = highest[:, 0]
    total = leading.sum()
    asked = {"position": accuracy.target, "orientation": accuracy.angle_target}
    limit = asked[names[0]]
    negligible = leading < NEGLIGIBLE * (total if limit is None else limit)
    if total == 0.0:
        negligible[:] = True
    for index, name in enumerate(names[1:], start=1):
        limit = asked[name]
        if limit is not None:
            negligible &= highest[:, index] < NEGLIGIBLE * limit
    dominant = np.zeros(leading.size, np.bool_)
    made = 0.0
    for source in np.argsort(-leading, kind="stable"):
        if made >= (DOMINANT - ROUNDING) * total:
            break
        dominant[source] = True
        made += leading[source]
    chosen = np.where(negligible, 0, np.where(dominant, 2, 1))
    return [VERDICTS[index] for index in chosen]
