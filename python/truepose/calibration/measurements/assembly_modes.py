"""In which assembly mode the machine stands in a row: that of home, "+", or another, "-".

Assembly modes that follow each other are parted by singular poses, where the determinant of what
joints do to the platform changes its sign (C. Gosselin, J. Angeles, Singularity analysis of
closed-loop kinematic chains, IEEE Trans. Robotics and Automation 6 (1990) 281-290). Of several
modes of the other sign the nearest to the one that is reached from home is meant, a
rotation counted at the machine's extent.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.errors import Fault
from truepose.machine import Machine

HOME, OTHER = "+", "-"

NO_OTHER_MODE = Fault(
    "commanded-out-of-reach",
    "the machine has no other assembly mode at these joints",
    found='assembly_mode "-"',
    expected='"+", or an empty cell',
)

STARTS = 400
"""Random starts for each row, of a fixed seed; a handful finds both modes of a planar machine."""

AROUND = 2.0
"""Starts lie in this many times the machine's extent about where it is."""

TURNED = np.pi / 2.0

APART = 1e-3
"""Placements nearer than this share of the machine are one; two modes meet only where singular."""


def other_modes(machine: Machine, joints: Floats, placements: Floats) -> tuple[Floats, Flags]:
    """(k, 7) placements of the nominal machine in its other mode, and which rows (k,) have one.

    `joints` (k, n_joint); `placements` (k, 7) in the mode that is reached from home.
    """
    found, has = placements.copy(), np.zeros(len(joints), np.bool_)
    random = np.random.default_rng(0)
    kernel = machine.kernel
    for row in range(len(joints)):
        centres = kernel.joint_centres(joints[row : row + 1], placements[row : row + 1])[0]
        extent = float(np.ptp(centres.reshape(-1, 3), axis=0).max())
        here = kernel.pose_of(placements[row : row + 1])[0]
        span = np.array([AROUND * extent if name in "xyz" else TURNED for name in machine.dof])
        starts = here + span * random.uniform(-1.0, 1.0, (STARTS, here.size))
        many = np.repeat(joints[row : row + 1], STARTS, axis=0)
        poses, status = kernel.forward(many, starts, status=True)
        there = kernel.placement_of(poses[status == 0])
        away = np.linalg.norm(there[:, :3] - placements[row, :3], axis=1)
        cosines = np.abs(there[:, 3:] @ placements[row, 3:])
        away += extent * 2.0 * np.arccos(np.minimum(cosines, 1.0))
        every = np.vstack([placements[row : row + 1], there])
        sign = _signs(machine, np.repeat(joints[row : row + 1], len(every), axis=0), every)
        other = (away > APART * machine.characteristic_length) & (sign[1:] * sign[0] <= 0.0)
        if other.any():
            has[row] = True
            found[row] = there[np.argmin(np.where(other, away, np.inf))]
    return found, has


def stand_in_other_modes(
    machine: Machine, stated: Flags | None, joints: Floats, placements: Floats
) -> list[int]:
    """Moves placements (n_row, 7) to where rows `stated` (n_row,) are; the rows without a mode.

    What is not placed, and so has a problem already, is left alone.
    """
    if stated is None:
        return []
    chosen = np.flatnonzero(stated & np.isfinite(placements).all(axis=1))
    placements[chosen], has = other_modes(machine, joints[chosen], placements[chosen])
    rows: list[int] = chosen[~has].tolist()
    return rows


def in_other_mode(machine: Machine, joints: Floats, placements: Floats) -> Flags:
    """(n_row,) rows that do not stand where the machine is found from home."""
    poses, status = machine.kernel.forward(joints, status=True)
    flags: Flags = status != 0
    at_home = machine.kernel.placement_of(poses[~flags])
    away = np.linalg.norm(at_home[:, :3] - placements[~flags, :3], axis=1)
    flags[~flags] = away > APART * machine.characteristic_length
    return flags


def _signs(machine: Machine, joints: Floats, placements: Floats) -> Floats:
    """(k,) sign of the determinant of what strut lengths, or drives, do to the platform; else 0."""
    names = list(machine.parameters)
    lengths = [f"strut.{strut.name}.length" for strut in machine.struts]
    offsets = [f"drive.{drive.name}.offset" for drive in machine.drives]
    for wanted, components in (
        (lengths, machine.components),
        (offsets, machine.commanded),
    ):
        if len(wanted) != len(components) or not set(wanted) <= set(names):
            continue
        columns = np.array([names.index(name) for name in wanted], np.intp)
        slopes, _ = machine.kernel.sensitivity_at(joints, placements, columns)
        if slopes.shape[1] == len(wanted):
            signs: Floats = np.sign(np.linalg.det(slopes))
            return signs
    return np.zeros(len(joints))


__all__ = [
    "HOME",
    "NO_OTHER_MODE",
    "OTHER",
    "in_other_mode",
    "other_modes",
    "stand_in_other_modes",
]
