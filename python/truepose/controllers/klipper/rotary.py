"""Klipper's `kinematics: rotary_delta`.

Shoulders stand at the height H, at a radius R about the z axis and the angle a_i; the upper arm of
length U_i, t_i over the horizontal, ends in the elbow, from which the lower arm of length V_i goes
to the tool point. In the arm's plane the tool point lies at d outwards and h upwards of the
shoulder and at w beside the plane, so that

    d = x cos a + y sin a - R,  h = z - H,  w = y cos a - x sin a
    (d - U cos t)^2 + (h - U sin t)^2 = V^2 - w^2,

with the elbow outwards. `position_endstop` is the height of the tool at x = y = 0 with the arm
where its endstop trips. Facts from Klipper's configuration reference
(https://www.klipper3d.org/Config_Reference.html, rotary delta kinematics).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta import (
    AROUND,
    LEAN,
    DeltaLimb,
    limbs,
    lowest_z,
    surrounded,
    wrapped,
)
from truepose.controllers._export import unsupported_machine
from truepose.controllers._homing import switches
from truepose.controllers._small_model import (
    INSTEAD,
    MM,
    Parameter,
    Printed,
    ascii_only,
    fixed,
    more_decimals,
    scales,
)
from truepose.machine import Machine

LENGTH_DIGITS, ANGLE_DIGITS = 6, 7
"""Decimals that are written; of lengths more where the characteristic one is below `SMALL`, m."""

SMALL = 0.01
RETURNED = 1e-5
"""rad, by how much an arm's angle at its endstop may change by being printed as a height."""
STEPPERS = "abc"
RADIUS, HEIGHT = 0, 1
ANGLES, UPPER, LOWER, ENDS = slice(2, 5), slice(5, 8), slice(8, 11), slice(11, 14)
"""Places of R, H, a_i, U_i, V_i and the arm angles at the endstops among the fourteen numbers."""


class Rotary:
    """A `SmallModel` of fourteen numbers; stepper_a drives the machine's first drive, and so on."""

    def __init__(self, machine: Machine, options: Mapping[str, float | str]) -> None:
        """Raises `RequestError`: controller-cannot, bad-option."""
        self._machine = machine
        arms = limbs(machine, "klipper", "crank")
        for limb in arms:
            if abs(limb.axis[2]) > math.sin(LEAN):
                raise unsupported_machine(
                    "klipper",
                    machine,
                    f"drive {limb.drive.name}, whose axis is not level",
                    "a delta with level axes of its cranks",
                    INSTEAD,
                )
        up = np.array([_sense(limb) for limb in arms])
        ends = [limb.drive.travel[1 if u > 0.0 else 0] for limb, u in zip(arms, up, strict=True)]
        self.switches = switches(machine, options, ends, "klipper")
        """(3,) joint coordinates, rad, where the endstops trip."""
        # By how much each arm rises for a radian of its coordinate.
        self._gain = up * scales(machine)
        self._digits = LENGTH_DIGITS + more_decimals(machine.characteristic_length, SMALL)
        self._start = self._nominal(arms)
        self._check_endstops()

    def _nominal(self, limbs: list[DeltaLimb]) -> Floats:
        start = np.empty(ENDS.stop)
        outwards = [_outwards(limb) for limb in limbs]
        shoulders = [
            limb.origin + limb.axis * float(limb.axis @ limb.base) - limb.platform for limb in limbs
        ]
        arms = [limb.base - limb.axis * float(limb.axis @ limb.base) for limb in limbs]
        start[RADIUS] = np.mean([s @ o for s, o in zip(shoulders, outwards, strict=True)])
        start[HEIGHT] = np.mean([s[2] for s in shoulders])
        start[ANGLES] = [math.atan2(o[1], o[0]) for o in outwards]
        start[UPPER] = [np.linalg.norm(arm) for arm in arms]
        start[LOWER] = [limb.length for limb in limbs]
        at_home = [math.atan2(arm[2], arm @ o) for arm, o in zip(arms, outwards, strict=True)]
        start[ENDS] = at_home + self._gain * (self.switches - [limb.home for limb in limbs])
        if start[RADIUS] <= 0.0:
            raise unsupported_machine(
                "klipper",
                self._machine,
                f"a shoulder radius less the effector's of {start[RADIUS] / MM:.6g} mm",
                "shoulders farther out than the effector's joints",
                INSTEAD,
            )
        if not surrounded(start[ANGLES]):
            shown = ", ".join(f"{angle:.1f}" for angle in np.degrees(start[ANGLES]))
            raise unsupported_machine(
                "klipper",
                self._machine,
                f"shoulders at {shown} degrees",
                "shoulders around the z axis",
                AROUND,
            )
        return start

    def _check_endstops(self) -> None:
        """Klipper tells an endstop by the tool's height in the middle, if it comes there."""
        with np.errstate(invalid="ignore"):
            trips = _endstop(self._start)
        back = np.full(3, np.nan)
        if np.isfinite(trips).all():
            back = self.parse(self.format(self._start))[ENDS]
        for drive, off in zip(
            self._machine.drives, np.abs(wrapped(back - self._start[ENDS])), strict=True
        ):
            if not off < RETURNED:
                raise unsupported_machine(
                    "klipper",
                    self._machine,
                    f"drive {drive.name}, whose arm at its switch cannot hold the tool on the axis",
                    "switches that are told by a height of the tool at x = y = 0",
                    "give a switch nearer to the workspace's joint coordinates: switches=...",
                )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """R, H, angles, upper arms, lower arms and arm angles at the endstops."""
        names = ["shoulder radius", "shoulder height"]
        for what in ("angle", "upper arm", "lower arm", "endstop"):
            names += [f"{what} {drive.name}" for drive in self._machine.drives]
        arm = float(self._start[UPPER].mean())
        turn = 1.0 / (float(self._start[RADIUS]) + arm)
        sizes = [1.0, 1.0] + [turn] * 3 + [1.0] * 6 + [1.0 / arm] * 3
        return tuple(
            Parameter(*parameter)
            for parameter in zip(names, self._start.tolist(), sizes, strict=True)
        )

    def joints(self, values: Floats, poses: Floats) -> Floats:
        """(n, 3) joint coordinates, rad, for poses (n, 3)."""
        arms = arm_angles(values, poses)
        # As Klipper counts: both angles between -pi and pi, their difference not brought there.
        joints: Floats = self.switches + (arms - wrapped(values[ENDS])) / self._gain
        return joints

    def format(self, values: Floats) -> Printed:
        """Numbers by section and key, mm and degrees."""
        settings = {
            "printer.shoulder_radius": fixed(values[RADIUS] / MM, self._digits),
            "printer.shoulder_height": fixed(values[HEIGHT] / MM, self._digits),
        }
        steppers = zip(
            STEPPERS,
            np.degrees(values[ANGLES]) % 360.0,
            values[UPPER] / MM,
            values[LOWER] / MM,
            _endstop(values) / MM,
            strict=True,
        )
        for letter, angle, upper, lower, height in steppers:
            settings[f"stepper_{letter}.angle"] = fixed(angle, ANGLE_DIGITS)
            settings[f"stepper_{letter}.upper_arm_length"] = fixed(upper, self._digits)
            settings[f"stepper_{letter}.lower_arm_length"] = fixed(lower, self._digits)
            settings[f"stepper_{letter}.position_endstop"] = fixed(height, self._digits)
        return settings

    def parse(self, printed: Printed) -> Floats:
        """(14,) the model's values of printed numbers."""

        def of(key: str) -> Floats:
            return np.array([float(printed[f"stepper_{letter}.{key}"]) for letter in STEPPERS])

        values = np.empty(ENDS.stop)
        values[RADIUS] = float(printed["printer.shoulder_radius"]) * MM
        values[HEIGHT] = float(printed["printer.shoulder_height"]) * MM
        values[ANGLES] = np.radians(of("angle"))
        values[UPPER] = of("upper_arm_length") * MM
        values[LOWER] = of("lower_arm_length") * MM
        on_axis = np.zeros((3, 3))
        on_axis[:, 2] = of("position_endstop") * MM
        values[ENDS] = np.diagonal(arm_angles(values, on_axis))
        return values

    def block(self, printed: Printed) -> list[str]:
        """The sections of printer.cfg."""
        lines = [
            "[printer]",
            "kinematics: rotary_delta",
            f"shoulder_radius: {printed['printer.shoulder_radius']}",
            f"shoulder_height: {printed['printer.shoulder_height']}",
            "# of the workspace, not fitted:",
            f"minimum_z_position: {lowest_z(self._machine)}",
        ]
        for letter, drive in zip(STEPPERS, self._machine.drives, strict=True):
            lines += ["", f"# drive {ascii_only(drive.name)}", f"[stepper_{letter}]"]
            for key in ("position_endstop", "upper_arm_length", "lower_arm_length", "angle"):
                lines.append(f"{key}: {printed[f'stepper_{letter}.{key}']}")
        return lines


def _outwards(limb: DeltaLimb) -> Floats:
    """(3,) level unit vector in the arm's plane, away from the z axis."""
    across = np.array([limb.axis[1], -limb.axis[0], 0.0])
    across /= np.linalg.norm(across)
    seen = limb.origin + limb.axis * float(limb.axis @ limb.base) - limb.platform
    # An arm that is driven from the middle still points to where its elbow is.
    side = float(across @ seen) or float(across @ limb.base)
    turned: Floats = across if side > 0.0 else -across
    return turned


def _sense(limb: DeltaLimb) -> float:
    """+1 where a growing coordinate raises the arm, else -1."""
    return math.copysign(1.0, np.cross(limb.axis, _outwards(limb))[2])


def arm_angles(values: Floats, poses: Floats) -> Floats:
    """(n, 3) angles of the upper arms over the horizontal, rad, elbows outwards.

    From A cos t + B sin t = C with A = 2 U d, B = 2 U h, C = d^2 + h^2 + U^2 - V^2 + w^2: t is
    atan2(B, A) plus or minus acos(C / |A, B|). Of the two the elbow with the larger outward
    coordinate is taken.
    """
    x, y, z = poses.T[:, :, np.newaxis]
    cosine, sine = np.cos(values[ANGLES]), np.sin(values[ANGLES])
    outward = x * cosine + y * sine - values[RADIUS]
    upward = z - values[HEIGHT]
    beside = y * cosine - x * sine
    upper = values[UPPER]
    between = outward**2 + upward**2 + upper**2 - values[LOWER] ** 2 + beside**2
    size = np.hypot(outward, upward)
    with np.errstate(invalid="ignore", divide="ignore"):  # out of reach is NaN
        half_angle = np.arccos(between / (2.0 * upper * size))
    middle = np.arctan2(upward, outward)
    one, other = middle + half_angle, middle - half_angle
    angle: Floats = np.where(np.cos(one) >= np.cos(other), one, other)
    return wrapped(angle)


def _endstop(values: Floats) -> Floats:
    """(3,) height of the tool at x = y = 0 with each arm at its endstop, m."""
    elbow_out = values[RADIUS] + values[UPPER] * np.cos(values[ENDS])
    elbow_up = values[HEIGHT] + values[UPPER] * np.sin(values[ENDS])
    height: Floats = elbow_up - np.sqrt(values[LOWER] ** 2 - elbow_out**2)
    return height


__all__ = ["Rotary", "arm_angles"]
