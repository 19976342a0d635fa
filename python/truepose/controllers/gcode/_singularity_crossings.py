"""Whether the platform can go from pose to pose without passing through a singularity."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.compensation.commands import NO_DEVIATION, ActualMachine, blocks
from truepose.runs.displacement import displacement
from truepose.runs.poses import OK

SAME = 1e-6
"""Distance of two poses that are one, in characteristic lengths or rad: far above rounding."""

STEP = 1.0 / 8.0
"""Longest step of a way, in characteristic lengths or rad, between whose ends it is looked for."""

FINER = 32
"""Parts of a step in which it is gone again before it is said to cross a singularity."""


def singularity_crossings(actual: ActualMachine, begins: Floats, ends: Floats) -> Indices:
    """Numbers of the ways, from poses (n, n_commanded) to others, that cross a singularity.

    The nominal machine is driven along them, from joints to joints: where the platform does not
    arrive, or arrives on the other side of one, there is a singularity on the way. Poses without
    joints are passed over, they are refused for themselves.
    """
    along = ends - begins
    far = np.abs(along / actual.unit).max(axis=1)
    steps = np.maximum(np.ceil(far / STEP), 1.0).astype(np.intp)
    way = np.repeat(np.arange(len(begins)), steps)
    step = np.arange(way.size) - (np.cumsum(steps) - steps)[way]
    share = np.stack([step, step + 1], axis=1) / steps[way][:, np.newaxis]
    lost = []
    for rows in blocks(way.size):
        at, along_it = begins[way[rows]], along[way[rows]]
        first, last = (at + along_it * share[rows, side, np.newaxis] for side in (0, 1))
        lost += (rows.start + np.flatnonzero(~_arrives(actual, first, last))).tolist()
    # By joints even a short way may leave the straight one: it is gone again in small steps.
    crossing = []
    for number in lost:
        fine = np.linspace(share[number, 0], share[number, 1], FINER + 1)[:, np.newaxis]
        poses = begins[way[number]] + along[way[number]] * fine
        if not _arrives(actual, poses[:-1], poses[1:]).all():
            crossing.append(int(way[number]))
    return np.unique(np.array(crossing, np.intp))


def first_crossing(
    actual: ActualMachine, begins: Floats, ends: Floats, size: Floats, alone: Flags
) -> int | None:
    """Number of the first of ways that follow each other which crosses a singularity.

    `begins` and `ends` (n, n_commanded) of ways so long, `size` (n,), m. Short ones are looked at
    together, as long as they are no longer than `STEP`; those `alone` (n,) begin no such stretch.
    """
    stretch = np.floor(np.cumsum(size) / (STEP * actual.machine.characteristic_length))
    chosen = np.diff(stretch, prepend=-1.0) > 0
    chosen |= alone
    chosen[-1] = True
    last = np.flatnonzero(chosen)
    first = np.concatenate([[0], last[:-1] + 1])
    for way in singularity_crossings(actual, begins[first], ends[last]):
        # A stretch may bend: what counts are its pieces.
        within = slice(first[way], last[way] + 1)
        crossings = singularity_crossings(actual, begins[within], ends[within])
        if crossings.size:
            return int(first[way] + crossings[0])
    return None


def _arrives(actual: ActualMachine, begins: Floats, ends: Floats) -> Flags:
    kernel = actual.machine.kernel
    from_joints, placements, _ = kernel.place(begins)
    joints, _, _ = kernel.place(ends)
    moved, status = displacement(actual.machine, joints, placements, NO_DEVIATION)
    arrived = actual.poses_from(placements, moved, ends)
    off = np.abs((arrived - ends) / actual.unit).max(axis=1)
    # Ways that follow each other share a pose, where it is asked for once.
    follows = np.concatenate([[False], (begins[1:] == ends[:-1]).all(axis=1)])
    end_side = _side(actual, ends)
    begin_side = np.concatenate([[np.nan], end_side[:-1]])
    begin_side[~follows] = _side(actual, begins[~follows])
    same_side = begin_side == end_side
    unplaced = np.isnan(from_joints).any(axis=1) | np.isnan(joints).any(axis=1)
    return np.asarray(unplaced | ((status == OK) & (off <= SAME) & same_side))


def _side(actual: ActualMachine, poses: Floats) -> Floats:
    """(n,) sign of the determinant of the Jacobian of pose to joints, on what is commanded.

    It changes where a singularity is crossed, even if close to it the platform is found beyond.
    """
    jacobians, _ = actual.machine.kernel.jac_pose_joint(poses, status=True)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sign(np.linalg.det(jacobians[:, actual.components])))


__all__ = ["first_crossing", "singularity_crossings"]
