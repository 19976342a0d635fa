"""The grid that poses make, if they do: its rows, and the lines through one of its poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from truepose.arrays import Floats, Indices
from truepose.reporting.study import Study

SAME = 1e-9
"""Of the range of a coordinate: values that are nearer to each other are one value of the grid."""

SPARSE = 2
"""Poses that stand on no more than one in so many places of a grid make none."""


@dataclass(frozen=True)
class Lattice:
    """Poses on a grid: `steps` (n_pose, n_coordinate) counts along each coordinate from 0.

    `values`: the values along each coordinate, ascending, one where it does not vary; SI.
    """

    steps: Indices
    values: tuple[Floats, ...]

    @property
    def varying(self) -> list[int]:
        """Coordinates along which there is more than one value."""
        return [at for at, values in enumerate(self.values) if len(values) > 1]

    def slice_through(self, pose: int, coordinate: int) -> Indices:
        """Poses that differ from a pose in one coordinate only, in the order of it."""
        others = np.delete(self.steps, coordinate, axis=1)
        line = np.flatnonzero((others == others[pose]).all(axis=1))
        return line[np.argsort(self.steps[line, coordinate], kind="stable")]


def lattice(poses: Floats) -> Lattice | None:
    """The grid of poses (n_pose, n_coordinate), of which some may be left out; None without one.

    Poses of a path, of points or of a disc make no grid: too few of its places are taken.
    """
    if len(poses) == 0:
        return None
    steps, values = zip(*(_steps(column) for column in poses.T), strict=True)
    places = np.prod([len(along) for along in values], dtype=float)
    if SPARSE * len(poses) <= places:
        return None
    return Lattice(np.stack(steps, axis=1), values)


def turns(study: Study) -> NDArray[np.bool_]:
    """(n_pose - 1,) whether a line from one pose to the next would lead across the workspace.

    That is where the grid turns to a new row, and where poses in between are left out.
    """
    gaps = np.diff(study.numbers) > 1
    grid = lattice(study.poses)
    if grid is None or not grid.varying:
        return gaps
    moved = np.diff(grid.steps, axis=0) != 0
    fastest = grid.varying[int(np.argmax(moved[:, grid.varying].sum(axis=0)))]
    return np.asarray(gaps | np.delete(moved, fastest, axis=1).any(axis=1))


def _steps(column: Floats) -> tuple[Indices, Floats]:
    """Which of its values each coordinate (n_pose,) has, and the values."""
    order = np.argsort(column, kind="stable")
    ascending = column[order]
    new = np.diff(ascending) > SAME * (ascending[-1] - ascending[0])
    steps = np.empty(len(column), np.intp)
    steps[order] = np.concatenate([[0], np.cumsum(new)])
    return steps, ascending[np.concatenate([[True], new])]


__all__ = ["Lattice", "lattice", "turns"]
