"""When there are enough samples: a number of them, or JCGM 101's adaptive rule."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats

if TYPE_CHECKING:
    from truepose._kernel import Tallies

BATCH = 10_000
"""Samples of a batch at least (JCGM 101:2008, 7.9.4 a)."""

SLICE = 2_000_000
"""Samples, over all poses together, between two looks at Ctrl-C and progress."""

MOST = 10_000_000
"""Samples at which the adaptive rule ends though some figure is not stable."""


class StoppingRule(ABC):
    """When there are enough samples."""

    adaptive = False

    @abstractmethod
    def next(self, done: int, n_pose: int) -> int:
        """Samples to draw next at every pose; 0: there are enough."""

    @abstractmethod
    def expected(self, done: int) -> int:
        """Samples that there will be at every pose, as it looks after those `done`; 0: unknown."""


@dataclass(frozen=True)
class FixedNumber(StoppingRule):
    """As many as asked for."""

    samples: int

    def next(self, done: int, n_pose: int) -> int:
        """As many as are looked at together, at most what is left."""
        together = max(1, SLICE // (n_pose * BATCH)) * BATCH
        return min(together, self.samples - done)

    def expected(self, done: int) -> int:
        """As many as asked for."""
        return self.samples


class Adaptive(StoppingRule):
    """JCGM 101:2008, 7.9.4: batches until mean, standard deviation and ends are stable.

    Stable: twice the standard deviation of a figure's mean over the batches is below half a unit of
    the last of `digits` significant digits of the standard deviation of the output.
    """

    adaptive = True

    def __init__(self, probability: float, digits: int) -> None:
        self._tails = [0.5 * (1.0 - probability), 0.5 * (1.0 + probability)]
        self._digits = digits
        # Less what is rounding: 1 - 0.9999 is a little less than 0.0001.
        self.batch = max(math.ceil(100.0 / (1.0 - probability) * (1.0 - 1e-9)), BATCH)
        self._figures: list[Floats] = []

    def next(self, done: int, n_pose: int) -> int:
        """A batch, or 0."""
        return 0 if done >= MOST or self._stable() else self.batch

    def expected(self, done: int) -> int:
        """As many as make the least stable figure so, whose mean spreads by 1 / sqrt(batches)."""
        count = len(self._figures)
        unstable = self._unstable() if count > 1 else math.nan
        if not math.isfinite(unstable):
            return 0
        batches = max(count, math.ceil(count * unstable**2))
        return min(batches * self.batch, max(MOST, done))

    def update(self, batch: Tallies, columns: slice) -> None:
        """The figures of one batch."""
        m = np.asarray(batch.covariance).shape[1]
        variance = np.diagonal(np.asarray(batch.covariance), axis1=1, axis2=2)
        ends = np.asarray(batch.quantiles(self._tails))[:, :m]
        figures = [np.asarray(batch.mean)[:, :m], np.sqrt(np.maximum(variance, 0.0))]
        self._figures.append(np.stack([*figures, ends[..., 0], ends[..., 1]]))

    def _stable(self) -> bool:
        return len(self._figures) >= 2 and self._unstable() < 1.0

    def _unstable(self) -> float:
        """Twice the deviation of a figure's mean over what is allowed, of that where it is most."""
        count = len(self._figures)
        figures = np.stack(self._figures)
        deviation = figures.std(axis=0, ddof=1) / np.sqrt(count)
        spread = figures[:, 1].mean(axis=0)
        size = np.abs(figures[:, 0]).max(axis=0) + spread
        # A pose at which no sample has a result, and what does not vary, are as they are.
        varying = np.isfinite(spread) & (spread > 1e-12 * size)
        with np.errstate(divide="ignore", invalid="ignore"):
            last = np.floor(np.log10(spread)) - self._digits + 1.0
            tolerance = 0.5 * 10.0**last
        ratios = (2.0 * deviation)[:, varying] / tolerance[varying]
        return float(ratios.max(initial=0.0))
