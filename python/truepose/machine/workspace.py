"""The poses of a machine file: a grid over commanded freedoms, or a list."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LARGEST_GRID = 10_000_000
"""A grid of more poses is refused before anything is allocated."""


@dataclass(frozen=True)
class GridAxis:
    """`count` equal steps from `start` to `stop`, both included, along one freedom; SI."""

    name: str
    start: float
    stop: float
    count: int

    @property
    def centre(self) -> float:
        """Half way."""
        return 0.5 * (self.start + self.stop)


@dataclass(frozen=True)
class Workspace:
    """Either `axes`, one per commanded freedom in their order, or `listed` poses; SI.

    `line` is where the machine file gives them.
    """

    axes: tuple[GridAxis, ...] = ()
    listed: NDArray[np.float64] | None = None
    line: int | None = None

    @property
    def shape(self) -> tuple[int, ...]:
        """Counts along the axes, or (n_pose,) where the poses are listed."""
        if self.listed is not None:
            return (len(self.listed),)
        return tuple(axis.count for axis in self.axes)

    @property
    def n_pose(self) -> int:
        """How many poses there are."""
        return math.prod(self.shape)

    def poses(self) -> NDArray[np.float64]:
        """(n_pose, n_commanded): the first axis runs fastest."""
        if self.listed is not None:
            return self.listed.copy()
        poses = np.empty((self.n_pose, len(self.axes)))
        repeat = 1
        for column, axis in enumerate(self.axes):
            values = np.repeat(np.linspace(axis.start, axis.stop, axis.count), repeat)
            repeat *= axis.count
            poses[:, column] = np.tile(values, self.n_pose // repeat)
        return poses


@dataclass(frozen=True)
class Accuracy:
    """What is asked: largest position error in m, largest orientation error in rad; or None."""

    target: float | None = None
    angle_target: float | None = None
