"""What the delta adapters share: the limbs as a controller sees them, and where they are homed.

A controller takes the two parallel rods of a limb as one line. With the platform level, only the
difference of the base-side and the platform-side joint centre counts, so that the effector shrinks
to the tool point and each limb moves inwards by as much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.compensation.commands import has_joints
from truepose.controllers._export import unsupported_machine
from truepose.controllers._homing import switch_option
from truepose.controllers._small_model import INSTEAD, MM, value, vector
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.machine.parts import Drive
from truepose.runs.poses import SkippedPoses, no_pose_left

LEAN = math.radians(5.0)
"""What a drive's axis may be off that of the controller's model: more is another machine."""

UNLIKE = 0.05
"""What the two rods of a limb may differ by, in their length."""

TOWERS = np.radians([210.0, 330.0, 90.0])
"""Where controllers that count towers have A, B and C (or X, Y and Z) about the z axis."""

AROUND = "controllers have the z axis of the base frame in the middle of the drives"

ROUNDING = 1e-6
"""Of the last digit that is written: what a number may be beyond it and still be that number."""

SWITCHES = switch_option("the end of each drive's travel that raises the tool")


@dataclass(frozen=True)
class DeltaLimb:
    """One drive and its rods at the machine's home, the platform level.

    `drive`, its number `index`, and unit `axis` (3,). `origin` (3,), m, of the drive. `base` (3,),
    m: the rods' base-side joint centre from that origin, at home; `platform` (3,): their
    platform-side one from the tool point; `length`, m; all mean over the rods. `home`: joint
    coordinate there, m or rad.
    """

    drive: Drive
    index: int
    axis: Floats
    origin: Floats
    base: Floats
    platform: Floats
    length: float
    home: float


def limbs(machine: Machine, controller: str, kind: str) -> list[DeltaLimb]:
    """The three limbs of a delta whose drives are all of a `kind`.

    Raises `RequestError`: controller-cannot, no-pose-left where home is out of reach.
    """
    wanted = f"a delta: three {kind} drives, x y z commanded, and two equal, parallel rods a drive"

    def refused(found: str) -> RequestError:
        return unsupported_machine(controller, machine, found, wanted, INSTEAD)

    if machine.commanded != ("x", "y", "z"):
        raise refused(f"commanded freedoms {' '.join(machine.commanded)}")
    kinds = [drive.kind for drive in machine.drives]
    if kinds != [kind] * 3:
        raise refused(f"drives of kind {', '.join(kinds)}")
    if machine.guides:
        raise refused(f"guide {machine.guides[0].name}")
    unmoved = [strut.name for strut in machine.struts if strut.drive is None]
    if unmoved:
        raise refused(f"strut {unmoved[0]}, which no drive moves")
    home = machine.home[[machine.dof.index(name) for name in machine.commanded]]
    joints, placements, status = machine.kernel.place(home[np.newaxis, :])
    if not has_joints(status)[0]:
        left_out = SkippedPoses()
        left_out.add(np.zeros(1, np.intp), status)
        raise no_pose_left(machine, home[np.newaxis, :], left_out.counts(), of_file=True)
    centres = machine.kernel.joint_centres(joints, placements)[0]
    number = 2 if len(machine.dof) > 3 else 1
    delta_limbs = []
    for index, drive in enumerate(machine.drives):
        rods = [at for at, strut in enumerate(machine.struts) if strut.drive == drive.name]
        if len(rods) != number:
            raise refused(f"{len(rods)} struts on drive {drive.name}")
        lengths = np.array([value(machine, f"{machine.struts[at].part}.length") for at in rods])
        lines = centres[rods, 0] - centres[rods, 1]
        if np.ptp(lines, axis=0).max() + np.ptp(lengths) > UNLIKE * lengths.mean():
            raise refused(f"rods of drive {drive.name} that are not parallel, or not equal")
        origin = vector(machine, f"{drive.part}.origin")
        axis = np.array(drive.fields["axis"], np.float64)
        delta_limbs.append(
            DeltaLimb(
                drive,
                index,
                axis / np.linalg.norm(axis),
                origin,
                centres[rods, 0].mean(axis=0) - origin,
                centres[rods, 1].mean(axis=0) - placements[0, :3],
                float(lengths.mean()),
                float(joints[0, index]),
            )
        )
    return delta_limbs


def tower_order(angles: Floats) -> list[int]:
    """Which limb stands nearest to each of the towers A, B and C: their numbers, each once.

    `angles` (3,): of the limbs about the z axis, rad.
    """
    away = np.abs(wrapped(angles[np.newaxis, :] - TOWERS[:, np.newaxis]))
    orders = [[a, b, c] for a in range(3) for b in range(3) for c in range(3)]
    whole = [order for order in orders if sorted(order) == [0, 1, 2]]
    return min(whole, key=lambda order: float(away[range(3), order].sum()))


def wrapped(angles: Floats) -> Floats:
    """Angles brought between -pi and pi."""
    turned: Floats = (angles + math.pi) % (2.0 * math.pi) - math.pi
    return turned


def surrounded(angles: Floats) -> bool:
    """Whether limbs at `angles` (3,), rad, stand all around the z axis."""
    turns = np.sort(angles % (2.0 * math.pi))
    return bool(np.diff(turns, append=turns[0] + 2.0 * math.pi).max() < math.pi)


def print_radius(machine: Machine) -> str:
    """The radius of the workspace about the z axis, mm, rounded up and above zero.

    A radius that has one decimal stays as it is: its rounding counts for nothing.
    """
    radius = float(np.hypot(*machine.poses()[:, :2].T).max()) / MM
    return f"{max(math.ceil(radius * 10.0 - ROUNDING), 1) / 10.0:.1f}"


def lowest_z(machine: Machine) -> str:
    """Klipper's minimum_z_position of the workspace, mm: rounded down, not above zero."""
    lowest = float(machine.poses()[:, 2].min()) / MM
    return f"{min(0.0, math.floor(lowest + ROUNDING)):.0f}"


__all__ = [
    "AROUND",
    "LEAN",
    "ROUNDING",
    "SWITCHES",
    "TOWERS",
    "DeltaLimb",
    "limbs",
    "lowest_z",
    "print_radius",
    "surrounded",
    "tower_order",
    "wrapped",
]
