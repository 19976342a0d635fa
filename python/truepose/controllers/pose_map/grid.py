"""A grid over the workspace, and multilinear interpolation in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._export import Option
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.machine.workspace import GridAxis, grid

AS_FILE = "as the machine file"

COUNT = Option(
    AS_FILE,
    "nodes along each axis: one number for all, or by axis as in x 9 y 9 z 5; default: the counts "
    "of the machine file's grid, 5 where it lists poses",
    dimension=None,
)

LISTED = 5
"""Nodes along an axis where the machine file lists poses."""

MOST_NODES = 1_000_000


@dataclass(frozen=True)
class Grid:
    """Nodes over the box of the workspace: `axes`, one for each commanded freedom, SI."""

    axes: tuple[GridAxis, ...]

    @property
    def nodes(self) -> Floats:
        """(n_node, n_axis), the first axis fastest."""
        return grid(self.axes)

    @property
    def values(self) -> list[Floats]:
        """Nodes along each axis, ascending."""
        return [np.linspace(axis.start, axis.stop, axis.count) for axis in self.axes]

    @property
    def shape(self) -> tuple[int, ...]:
        """How many nodes each axis has."""
        return tuple(axis.count for axis in self.axes)

    def centres(self) -> Floats:
        """(n_cell, n_axis) the middle of every cell, the first axis fastest."""
        halves = [0.5 * (a.stop - a.start) / max(a.count - 1, 1) for a in self.axes]
        return grid(
            tuple(
                GridAxis(a.name, a.start + half, a.stop - half, max(a.count - 1, 1))
                for a, half in zip(self.axes, halves, strict=True)
            )
        )

    def scattered(self, count: int, seed: int) -> Floats:
        """(count, n_axis) points all over the box."""
        ends = np.array([(axis.start, axis.stop) for axis in self.axes])
        return np.random.default_rng(seed).uniform(ends[:, 0], ends[:, 1], (count, len(ends)))

    def interpolated(self, table: Floats, points: Floats) -> Floats:
        """(n, n_column) `table` (n_node, n_column), multilinear, at points (n, n_axis) of the box.

        NaN where a node with a weight is NaN.
        """
        values = table.reshape(*reversed(self.shape), table.shape[1])
        lower, share = [], []
        for column, axis in enumerate(self.axes):
            span = axis.stop - axis.start
            place = (points[:, column] - axis.start) / span * (axis.count - 1) if span else 0.0
            first = np.clip(np.floor(place), 0, max(axis.count - 2, 0)).astype(np.intp)
            lower.append(np.broadcast_to(first, (len(points),)))
            share.append(np.broadcast_to(place - first, (len(points),)))
        total = np.zeros((len(points), table.shape[1]))
        moving = [at for at, axis in enumerate(self.axes) if axis.count > 1]
        for corner in range(1 << len(moving)):
            weight = np.ones(len(points))
            index = [*lower]
            for bit, at in enumerate(moving):
                high = corner >> bit & 1
                weight = weight * (share[at] if high else 1.0 - share[at])
                index[at] = lower[at] + high
            node_values = values[tuple(reversed(index))]
            total += np.where(weight[:, np.newaxis] > 0.0, weight[:, np.newaxis] * node_values, 0.0)
        return total


def grid_of(machine: Machine, text: str) -> Grid:
    """The grid over the box of the machine's workspace.

    Raises `RequestError`: no-workspace, bad-option, grid-too-large.
    """
    poses = machine.poses()
    counts = _counts(machine, text)
    axes = []
    for name, column in zip(machine.commanded, poses.T, strict=True):
        start, stop = float(column.min()), float(column.max())
        axes.append(GridAxis(name, start, stop, counts[name] if stop > start else 1))
    total = math.prod(axis.count for axis in axes)
    if total > MOST_NODES:
        raise RequestError(
            Problem(
                "grid-too-large",
                "the pose map has too many nodes",
                file=machine.file,
                found=f"{total} nodes",
                expected=f"at most {MOST_NODES}",
                hint="give fewer nodes along an axis: count=x 9 y 9 z 5",
            )
        )
    return Grid(tuple(axes))


def _counts(machine: Machine, text: str) -> dict[str, int]:
    workspace = machine.workspace
    counts = dict.fromkeys(machine.commanded, LISTED)
    if workspace is not None and workspace.axes:
        counts = {axis.name: axis.count for axis in workspace.axes}
    if text == AS_FILE:
        return counts
    words = text.split()
    if len(words) == 1:
        return dict.fromkeys(machine.commanded, _count(text, words[0]))
    if not words or len(words) % 2:
        raise _bad(text, COUNT.doc)
    for at, (name, count) in enumerate(zip(words[::2], words[1::2], strict=True)):
        if name not in machine.commanded:
            raise _bad(name, one_of(machine.commanded), did_you_mean(name, machine.commanded))
        if name in words[: 2 * at : 2]:
            raise _bad(text, f"one count for {name}")
        counts[name] = _count(text, count)
    return counts


def _count(text: str, word: str) -> int:
    if not (word.isascii() and word.isdigit() and len(word) < 10 and int(word) > 1):
        raise _bad(text, f"a whole number of two or more; {COUNT.doc}")
    return int(word)


def _bad(found: str, expected: str, hint: str | None = None) -> RequestError:
    return RequestError(
        Problem(
            "bad-option",
            "option count of pose-map cannot be read",
            found=repr(found),
            expected=expected,
            hint=hint,
        )
    )


__all__ = ["COUNT", "Grid", "grid_of"]
