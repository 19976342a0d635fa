"""The linear delta as printers' firmware and lineardeltakins have it.

Towers stand upright at a radius R about the z axis, each with one rod of length L to the tool point
below. The carriage of tower i, at the angle a_i, stands at the height

    s_i = z + sqrt(L_i^2 - (R cos a_i - x)^2 - (R sin a_i - y)^2) + u x + v y

where u and v, the tilt, exist in some controllers only. Where the endstop trips, s_i is h_i: that
is how the controller's heights and the machine's joint coordinates q_i belong together,

    q_i = e_i + (s_i - h_i) / g_i,

with the joint coordinate e_i at which it trips and the gain g_i, by which the carriage rises for
each metre of its coordinate: the drive's nominal scale, negative where that counts downwards.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.controllers._delta import AROUND, LEAN, limbs, surrounded
from truepose.controllers._export import unsupported_machine
from truepose.controllers._homing import switches
from truepose.controllers._small_model import INSTEAD, MM, Parameter, ascii_only, scales
from truepose.machine import Machine

RADIUS, ANGLES, ARMS, HEIGHTS, TILT = (
    slice(0, 1),
    slice(1, 4),
    slice(4, 7),
    slice(7, 10),
    slice(10, 12),
)
"""Places of the twelve numbers: R, a_i, L_i, h_i and u, v, in the order of the towers."""

COUNT = 12


@dataclass(frozen=True)
class LinearDelta:
    """The nominal machine as a linear delta.

    `order` (3,): number of the drive of each tower; `gain` (3,): what its carriage rises by, per
    metre of its coordinate; `switch` (3,): coordinates e_i, m. `nominal` (12,): the numbers above.
    """

    machine: Machine
    order: Indices
    gain: Floats
    switch: Floats
    nominal: Floats

    def joints(self, numbers: Floats, poses: Floats) -> Floats:
        """(n, 3) joint coordinates, in the machine's order, for `poses` (n, 3) x y z."""
        x, y, z = poses.T[:, :, np.newaxis]
        radius, angles, arms = numbers[RADIUS], numbers[ANGLES], numbers[ARMS]
        across = (radius * np.cos(angles) - x) ** 2 + (radius * np.sin(angles) - y) ** 2
        with np.errstate(invalid="ignore"):  # out of reach is NaN
            rise = np.sqrt(arms**2 - across)
        heights = z + rise + numbers[TILT][0] * x + numbers[TILT][1] * y
        joints = np.empty((len(poses), 3))
        joints[:, self.order] = self.switch + (heights - numbers[HEIGHTS]) / self.gain
        return joints

    def in_order(self, order: list[int]) -> LinearDelta:
        """The same with its towers counted in another order."""
        nominal = self.nominal.copy()
        for places in (ANGLES, ARMS, HEIGHTS):
            nominal[places] = self.nominal[places][order]
        return LinearDelta(
            self.machine, self.order[order], self.gain[order], self.switch[order], nominal
        )

    @property
    def switches(self) -> Floats:
        """(3,) coordinates e_i, m, in the machine's order."""
        angles = np.empty(3)
        angles[self.order] = self.switch
        return angles

    def names(self) -> list[str]:
        """Names of the drives, tower by tower."""
        return [self.machine.drives[index].name for index in self.order]

    def towers(self, letters: str) -> str:
        """Which drive stands at which tower, for a comment: `X a, Y b, Z c`."""
        pairs = zip(letters, self.names(), strict=True)
        return ascii_only(", ".join(f"{letter} {name}" for letter, name in pairs))


def linear_delta(
    machine: Machine, options: Mapping[str, float | str], controller: str
) -> LinearDelta:
    """The machine as a linear delta, its towers in the order of the drives.

    Raises `RequestError`: controller-cannot, bad-option.
    """
    towers = limbs(machine, controller, "slider")
    for limb in towers:
        if abs(limb.axis[2]) < math.cos(LEAN):
            raise _refused(machine, controller, f"drive {limb.drive.name}, which is not upright")
        if limb.base[2] + limb.origin[2] <= limb.platform[2] + machine.home[2]:
            raise _refused(machine, controller, f"carriage {limb.drive.name} below the platform")
    # The carriages at home as seen with the effector shrunk to the tool point, base frame.
    heads = np.array([limb.origin + limb.base - limb.platform for limb in towers])
    radii, angles = np.hypot(heads[:, 0], heads[:, 1]), np.arctan2(heads[:, 1], heads[:, 0])
    arms = np.array([limb.length for limb in towers])
    if not surrounded(angles):
        raise _refused(machine, controller, f"towers at {_degrees(angles)} degrees", AROUND)
    if not (arms > radii.mean()).all():
        shown = f"rods of {arms.min() / MM:.6g} mm, towers {radii.mean() / MM:.6g} mm"
        raise _refused(machine, controller, f"{shown} off the z axis", AROUND)
    up = np.array([math.copysign(1.0, limb.axis[2]) for limb in towers])
    ends = [
        limb.drive.travel[1 if sense > 0 else 0] for limb, sense in zip(towers, up, strict=True)
    ]
    switch = switches(machine, options, ends, controller)
    gain = up * scales(machine)
    nominal = np.zeros(COUNT)
    nominal[RADIUS], nominal[ANGLES], nominal[ARMS] = radii.mean(), angles, arms
    nominal[HEIGHTS] = heads[:, 2] + gain * (switch - [limb.home for limb in towers])
    return LinearDelta(machine, np.arange(3), gain, switch, nominal)


def parameters(delta: LinearDelta, *, tilt: bool = False) -> tuple[Parameter, ...]:
    """All numbers of the delta as what can be fitted, with or without the tilt."""
    radius = float(delta.nominal[RADIUS][0])
    names = ["delta radius"]
    for what in ("angle", "rod", "endstop"):
        names += [f"{what} {drive}" for drive in delta.names()]
    names += ["tilt along x", "tilt along y"]
    sizes = [1.0] + [1.0 / radius] * 3 + [1.0] * 6 + [1.0 / radius] * 2
    count = COUNT if tilt else TILT.start
    return tuple(
        Parameter(*parameter)
        for parameter in zip(
            names[:count], delta.nominal[:count].tolist(), sizes[:count], strict=True
        )
    )


def endstop(numbers: Floats) -> Floats:
    """(3,) height of the tool at x = y = 0 at which each carriage trips its endstop, m."""
    heights: Floats = numbers[HEIGHTS] - np.sqrt(numbers[ARMS] ** 2 - numbers[RADIUS] ** 2)
    return heights


def heights(endstops: Floats, arms: Floats, radius: float) -> Floats:
    """(3,) heights of the carriages at the endstops: `endstop` undone."""
    joints: Floats = endstops + np.sqrt(arms**2 - radius**2)
    return joints


def untilted(values: Floats) -> Floats:
    """(12,) the numbers of a linear delta from the first ten, without a tilt."""
    numbers = np.zeros(COUNT)
    numbers[: TILT.start] = values
    return numbers


class TowerModel:
    """What every `SmallModel` of a linear delta shares: all but how its numbers are written."""

    def __init__(self, delta: LinearDelta, *, tilt: bool = False) -> None:
        """`tilt`: whether the controller knows u and v."""
        self.delta = delta
        self._tilt = tilt

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """R, angles, rods and heights, and the tilt where there is one."""
        return parameters(self.delta, tilt=self._tilt)

    @property
    def switches(self) -> Floats:
        """(3,) joint coordinates, m, where the endstops trip."""
        return self.delta.switches

    def joints(self, values: Floats, poses: Floats) -> Floats:
        """(n, 3) joint coordinates, m, for poses (n, 3), m."""
        return self.delta.joints(values if self._tilt else untilted(values), poses)


def _degrees(angles: Floats) -> str:
    return ", ".join(f"{angle:.1f}" for angle in np.degrees(angles))


def _refused(machine: Machine, controller: str, found: str, hint: str = INSTEAD) -> Exception:
    wanted = "a delta with upright guideways around the z axis and the carriages above the platform"
    return unsupported_machine(controller, machine, found, wanted, hint)


__all__ = [
    "ANGLES",
    "ARMS",
    "COUNT",
    "HEIGHTS",
    "RADIUS",
    "TILT",
    "LinearDelta",
    "endstop",
    "heights",
    "linear_delta",
    "parameters",
    "untilted",
]
