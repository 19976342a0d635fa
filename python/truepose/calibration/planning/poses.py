"""Which poses a plan may choose from, where it assesses the tool, and a short way through some.

Candidates are poses of the workspace that the machine reaches within travel and joint limits, away
from singularities. A way through poses is short in the distance that weighs an angle with the
characteristic length: nearest neighbours first, then reversals of parts of it that shorten it.

    G. A. Croes, A method for solving traveling-salesman problems, Operations Research 6 (1958)
    791-812 (2-opt).
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.machine import Machine
from truepose.machine.workspace import GridAxis, Workspace, grid
from truepose.runs.poses import OK, SkippedPoses, no_pose_left, requested_poses

MOST_POSES = 1024
"""About how many poses of a workspace are considered: a finer grid hardly improves a plan."""

CONDITIONED = 0.1
"""A candidate's conditioning is at least this share of the best in the workspace: nearer to a
singularity every error is magnified, and what is linear in the unknowns no longer holds."""

SHORTER = 1e-9
"""A way that is shorter by a smaller share is not."""


def workspace_poses(machine: Machine) -> Floats:
    """(n, n_commanded) poses, SI, that stand for the file's workspace, corners included.

    A grid is refined by halving its steps, or thinned, to at most `MOST_POSES`; of listed poses so
    many are taken, evenly. Raises `RequestError` (no-workspace).
    """
    if machine.workspace is None:
        return machine.poses()  # which raises
    if machine.workspace.listed is not None:
        return _thinned(machine.workspace.listed)
    return grid(_axes(machine.workspace))


def _axes(workspace: Workspace) -> tuple[GridAxis, ...]:
    axes = [
        replace(axis, count=1 if axis.start == axis.stop else axis.count) for axis in workspace.axes
    ]
    counts = [axis.count for axis in axes]
    while np.prod(counts, dtype=float) > MOST_POSES and max(counts) > 2:
        largest = int(np.argmax(counts))
        counts[largest] = (counts[largest] + 1) // 2
    while True:
        open_ = [axis for axis, count in enumerate(counts) if count > 1]
        if not open_:
            break
        fewest = min(open_, key=lambda axis: counts[axis])
        finer = [2 * c - 1 if axis == fewest else c for axis, c in enumerate(counts)]
        if np.prod(finer, dtype=float) > MOST_POSES:
            break
        counts = finer
    return tuple(replace(axis, count=count) for axis, count in zip(axes, counts, strict=True))


def _thinned(poses: Floats) -> Floats:
    """At most `MOST_POSES` of them, evenly, and those farthest out along each diagonal."""
    if len(poses) <= MOST_POSES:
        return poses.copy()
    even = np.linspace(0, len(poses) - 1, MOST_POSES).round().astype(np.intp)
    spans = np.ptp(poses, axis=0)
    scaled = (poses - poses.mean(axis=0)) / np.where(spans > 0.0, spans, 1.0)
    diagonals = np.array(list(product((-1.0, 1.0), repeat=poses.shape[1])))
    farthest = np.argmax(scaled @ diagonals.T, axis=0)
    return np.asarray(poses[np.union1d(even, farthest)], np.float64)


class Placed:
    """Poses that the nominal machine can be commanded to: `poses`, `joints`, `placements` of each.

    `left_out`: how many could not be used. Raises `RequestError` (bad-poses, no-pose-left).
    """

    def __init__(self, machine: Machine, poses: ArrayLike, *, of_file: bool = False) -> None:
        requested = requested_poses(machine, poses)
        self.joints, self.placements, status = machine.kernel.place(requested)
        conditioning, regular = machine.kernel.conditioning(requested, status=True)
        status = np.where(status == OK, regular, status)
        usable = status == OK
        if not usable.any():
            left_out = SkippedPoses()
            left_out.add(np.flatnonzero(~usable), status)
            raise no_pose_left(machine, requested, left_out.counts(), of_file=of_file)
        self.left_out = int((~usable).sum())
        self.poses, self.conditioning = (
            requested[usable],
            np.asarray(conditioning[usable], np.float64),
        )
        self.joints, self.placements = self.joints[usable], self.placements[usable]

    def __len__(self) -> int:
        return len(self.poses)

    def select(self, wanted: Flags) -> Placed:
        """Only the poses where `wanted` (n,); the others count as left out."""
        chosen = copy(self)
        for name in ("poses", "joints", "placements", "conditioning"):
            setattr(chosen, name, getattr(self, name)[wanted])
        chosen.left_out = self.left_out + int((~wanted).sum())
        return chosen

    def away_from_singularities(self) -> Flags:
        """(n,) whether the conditioning is at least `CONDITIONED` of the best of them."""
        best = float(self.conditioning.max())
        return np.asarray(self.conditioning >= CONDITIONED * best, np.bool_)


def weighed(machine: Machine, poses: Floats) -> Floats:
    """Poses (n, n_commanded) in m: angles times the characteristic length."""
    scale = [1.0 if name in "xyz" else machine.characteristic_length for name in machine.commanded]
    return np.asarray(poses * np.array(scale), np.float64)


def home_of(machine: Machine) -> Floats:
    """(n_commanded,) the machine's home, SI."""
    return np.array([machine.home[machine.dof.index(name)] for name in machine.commanded])


def short_way(machine: Machine, poses: Floats) -> Indices:
    """(n,) the order of a short way from home through all poses (n, n_commanded) and back."""
    points = weighed(machine, np.concatenate([home_of(machine)[np.newaxis], poses]))
    apart = np.linalg.norm(points[:, np.newaxis] - points, axis=-1)
    way = [0]
    left = np.ones(len(points), np.bool_)
    left[0] = False
    while left.any():
        nearest = int(np.argmin(np.where(left, apart[way[-1]], np.inf)))
        way.append(nearest)
        left[nearest] = False
    return _reversals(apart, np.array([*way, 0], np.intp))[1:-1] - 1


def _reversals(apart: Floats, way: Indices) -> Indices:
    """The way (n + 2,) with parts reversed until no reversal shortens it."""
    last = len(way) - 2
    for _ in range(10 * len(way)):
        # Part from place i to place j reversed: two legs go, two come.
        i, j = np.triu_indices(last + 1, 1)
        i, j = i[i > 0], j[i > 0]
        if not i.size:
            return way
        before, first, end, after = way[i - 1], way[i], way[j], way[j + 1]
        gain = apart[before, first] + apart[end, after] - apart[before, end] - apart[first, after]
        best = int(np.argmax(gain))
        if gain[best] <= SHORTER * apart.max():
            return way
        part = slice(i[best], j[best] + 1)
        way = np.concatenate([way[: part.start], way[part][::-1], way[part.stop :]])
    return way
