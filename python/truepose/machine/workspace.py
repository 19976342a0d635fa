"""The poses of a machine file: a grid over commanded freedoms, or one after the other."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.language import marked

MOST_POSES = 10_000_000
"""More poses at once are refused before anything is allocated."""

LARGEST_GRID = 10**10
"""More poses of a grid are refused; those between are walked through a block at a time."""

MOST_STEPS = 1e15
"""More steps are not told apart: they are far too many."""

WORST = "worst"
"""What a machine file says where an accuracy is asked of every machine inside the bands."""


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

    `line` is where the machine file gives them. `is_path`: the poses are passed through in their
    order, so that each is reached from the one before it.
    """

    axes: tuple[GridAxis, ...] = ()
    listed: Floats | None = None
    line: int | None = None
    is_path: bool = False

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

    @property
    def ends(self) -> tuple[Floats, Floats]:
        """The least and the largest coordinate along each freedom, (n_commanded,) each."""
        if self.listed is not None:
            return self.listed.min(axis=0), self.listed.max(axis=0)
        both = np.array([(axis.start, axis.stop) for axis in self.axes])
        return both.min(axis=1), both.max(axis=1)

    def poses(self) -> Floats:
        """(n_pose, n_commanded): the first axis runs fastest."""
        if self.listed is not None:
            return self.listed.copy()
        return grid(self.axes)

    def table(self) -> PoseTable:
        """The same, of a grid each pose made where it is looked at."""
        return GridPoses(self.axes) if self.listed is None else self.listed.copy()


@dataclass(frozen=True)
class GridPoses:
    """The poses of a grid as a table that is never all there: rows are made as they are asked for.

    To the bits of `grid`, however many rows there are.
    """

    axes: tuple[GridAxis, ...]

    def __len__(self) -> int:
        return math.prod(axis.count for axis in self.axes)

    def __getitem__(self, rows: slice | int | np.integer | Indices) -> Floats:
        """Rows (n, n_commanded), or one (n_commanded,); numbers count from 0, none from the end."""
        if isinstance(rows, slice):
            rows = np.arange(*rows.indices(len(self)), dtype=np.intp)
        rest = np.asarray(rows, np.intp)
        poses = np.empty((*rest.shape, len(self.axes)))
        for column, axis in enumerate(self.axes):
            rest, at = np.divmod(rest, axis.count)
            poses[..., column] = _along(axis, at)
        return poses


PoseTable = Floats | GridPoses
"""Poses (n_pose, n_commanded), SI, of which some rows at a time are looked at."""


def _along(axis: GridAxis, numbers: Indices) -> Floats:
    """Coordinates of steps of an axis, rounded as `numpy.linspace` rounds all of them."""
    if axis.count == 1:
        return np.full(numbers.shape, axis.start)
    span = axis.stop - axis.start
    step = span / (axis.count - 1)
    ahead = numbers * step if step != 0.0 else numbers / (axis.count - 1) * span
    values: Floats = np.asarray(ahead + axis.start)
    values[numbers == axis.count - 1] = axis.stop
    return values


def grid(axes: tuple[GridAxis, ...]) -> Floats:
    """(product of counts, n_axis): every combination, the first axis runs fastest."""
    poses = np.empty((math.prod(axis.count for axis in axes), len(axes)))
    repeat = 1
    for column, axis in enumerate(axes):
        values = np.repeat(np.linspace(axis.start, axis.stop, axis.count), repeat)
        repeat *= axis.count
        poses[:, column] = np.tile(values, len(poses) // repeat)
    return poses


def steps(span: float, step: float) -> int:
    """How many equal steps of at most `step` make up `span`; a rounding error is no step more."""
    return math.ceil(min(abs(span) / step * (1.0 - 1e-12), MOST_STEPS))


def disc(radius: float, step: float) -> Floats:
    """(n, 2) points of a disc about the origin, its centre and rim included.

    They lie on rings about the centre, at most `step` apart along the radius and along each ring.
    """
    n_ring = steps(radius, step)
    rings = [np.zeros((1, 2))]
    for ring in range(1, n_ring + 1):
        at = radius * ring / n_ring
        angles = np.linspace(0.0, 2.0 * np.pi, on_ring(at, step), endpoint=False)
        rings.append(at * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    return np.concatenate(rings)


def on_ring(radius: float, step: float) -> int:
    """How many points stand on one ring of a disc; a multiple of 4, so that the axes are met."""
    return 4 * max(1, steps(0.5 * np.pi * radius, step))


def disc_size(radius: float, step: float) -> float:
    """At least as many points as `disc` has, without making them: sum over rings, bounded."""
    n_ring = abs(radius) / step + 1.0
    return 1.0 + n_ring * (np.pi * (n_ring + 1.0) + 4.0)


def along(waypoints: Floats, counts: Indices) -> Floats:
    """(1 + sum of counts, n_commanded) poses on the straight lines between `waypoints`.

    `counts` (n_waypoint - 1,): steps on each line; 0 where a waypoint repeats the one before it.
    """
    shares = np.concatenate([np.arange(1, count + 1) / max(count, 1) for count in counts])
    line = np.repeat(np.arange(len(counts)), counts)
    start, stop = waypoints[line], waypoints[line + 1]
    between = start + shares[:, np.newaxis] * (stop - start)
    # A waypoint is met as it was given.
    between[np.cumsum(counts)[counts > 0] - 1] = waypoints[1:][counts > 0]
    return np.concatenate([waypoints[:1], between])


@dataclass(frozen=True)
class Accuracy:
    """What is asked: largest position error in m, largest orientation error in rad; or None.

    `at`: the share of all machines that must keep it at the worst pose, in (0, 1); None where
    every machine inside the bands must.
    `target_text`, `angle_target_text`: as the file, or the user, says them, with their unit.
    """

    target: float | None = None
    angle_target: float | None = None
    target_text: str = ""
    angle_target_text: str = ""
    at: float | None = None

    @property
    def asks(self) -> bool:
        """Whether anything is asked, of position or orientation."""
        return self.target is not None or self.angle_target is not None

    @property
    def at_text(self) -> str:
        """Whom it is asked of as a machine file says it: "worst", or "95 %"."""
        return WORST if self.at is None else f"{100.0 * self.at:.12g} %"

    def said(self, quantity: str) -> str:
        """What is asked of "position" or "orientation" as it was asked; empty where nothing is."""
        of_position = quantity == "position"
        asked = self.target if of_position else self.angle_target
        if asked is None:
            return ""
        text = self.target_text if of_position else self.angle_target_text
        return marked(text or f"{asked:.6g} {'m' if of_position else 'rad'}")
