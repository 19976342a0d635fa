"""What samples say where some of them have no result: of all of them, and in words.

A machine that cannot be assembled is a machine of the batch too. A share of the samples is one of
all samples, and those without a result lie beyond both ends of every interval: with f of n failed,
the part p of all is the part p n / (n - f) of those that have a result, and where that is more
than one there is no such interval. Of errors, which have a sign, half of what failed lies below all
others and half above; of sizes all lies above.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.files.wording import counted
from truepose.runs.poses import not_assembled_text

if TYPE_CHECKING:
    from truepose._kernel import Tallies

ROUNDING = 1e-12
"""Of a share of the samples."""


class OfAll:
    """Quantiles and intervals of all samples of some tallies, those without a result among them.

    All are (n_pose, n_column, ...), NaN where those that failed decide.
    """

    def __init__(self, tallies: Tallies) -> None:
        self._tallies = tallies
        count, failed = np.asarray(tallies.count), np.asarray(tallies.failed)
        with np.errstate(divide="ignore"):
            self._per_result = (count + failed) / count

    def between(self, levels: Sequence[float]) -> Floats:
        """Quantiles of errors of either sign: what failed lies half below and half above."""
        return self._each(
            lambda factor: np.asarray(levels) * factor - 0.5 * (factor - 1.0),
            lambda shares: self._tallies.quantiles(shares),
        )

    def below(self, levels: Sequence[float]) -> Floats:
        """Quantiles of sizes: what failed lies above all others."""
        return self._each(
            lambda factor: np.asarray(levels) * factor,
            lambda shares: self._tallies.quantiles(shares),
        )

    def shortest(self, share: float) -> Floats:
        """The narrowest interval with a `share` of all samples."""
        return self._each(
            lambda factor: np.full(2, share * factor),
            lambda shares: np.asarray(self._tallies.shortest(shares[0])),
        )

    def _each(
        self, shares: Callable[[float], Floats], ask: Callable[[list[float]], Floats]
    ) -> Floats:
        """What `ask` says of the `shares` of samples with a result, by the factor of the pose."""
        whole: Floats | None = None
        for factor in np.unique(self._per_result):
            with np.errstate(invalid="ignore"):  # where no sample has a result
                asked = shares(factor)
            there = (asked >= -ROUNDING) & (asked <= 1.0 + ROUNDING)
            inside = np.where(there, np.clip(asked, 0.0, 1.0), 0.5)
            quantiles = np.where(there, ask(inside.tolist()), np.nan)
            if whole is None:
                whole = np.full_like(quantiles, np.nan)
            of = self._per_result == factor
            whole[of] = quantiles[of]
        assert whole is not None
        return whole


def lost_text(failed: ArrayLike, every: ArrayLike, *, plain: bool = False) -> str:
    """How many of `every` sample have no result, in words; "none" where all have.

    Of a machine at n poses, both (n_pose,): "12 of 20,000 could not be assembled, at 1 of 2 poses".
    `plain`: of a plain function.
    """
    lost, count = np.asarray(failed), np.asarray(every)
    if not lost.any():
        return "none"
    few, many = int(lost.sum()), int(count.sum())
    if plain:
        return f"{few:,} of {many:,} have no finite value"
    text = not_assembled_text(few, many)
    if lost.size == 1:
        return text
    return f"{text}, at {np.count_nonzero(lost):,} of {counted(lost.size, 'pose')}"
