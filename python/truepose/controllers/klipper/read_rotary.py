"""`kinematics: rotary_delta`: the numbers of a printer.cfg as a machine.

`stepper_b` and `stepper_c` have arm lengths and position_endstop of `stepper_a` where they give
none; the angles of the arms at their endstops follow from position_endstop as
`truepose.controllers.klipper.rotary` has it. Facts from Klipper's configuration reference
(https://www.klipper3d.org/Config_Reference.html, rotary delta kinematics).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta_file import (
    LIMBS,
    DeltaFile,
    Rods,
    along,
    components,
)
from truepose.controllers.klipper.geometry import Geometry, bed_radius, lowest
from truepose.controllers.klipper.numbers import STEPPERS, Numbers
from truepose.controllers.klipper.rotary import arm_angles

ANGLES = (30.0, 150.0, 270.0)
"""Degrees, where an angle is not given."""

WIDE_END = 0.5
"""Degrees: assumed of where an endstop trips."""


@dataclass(frozen=True, kw_only=True)
class RotaryDeltaFile(DeltaFile):
    """A rotary delta: joint coordinates are the upper arms' angles over the level.

    `radius` and `height` of the shoulders, the radius less the effector's; `upper`, `lower` (3,):
    the arms.
    """

    radius: float
    height: float
    upper: Sequence[float]
    lower: Sequence[float]

    family: ClassVar[str] = "rotary_delta"
    drive: ClassVar[str] = "crank"
    described: ClassVar[str] = "Three cranks"
    lengths: ClassVar[Sequence[str]] = (
        "shoulder_radius",
        "shoulder_height",
        *(f"upper_arm.{name}" for name in LIMBS),
    )

    def parameters(self, rods: Rods) -> Iterator[tuple[str, float | Sequence[float]]]:
        """The shoulders' radius with the effector's."""
        yield "shoulder_radius", self.radius + rods.effector_radius
        yield "effector_radius", rods.effector_radius
        yield "upper_arm", self.upper
        yield "lower_arm", self.lower
        yield "spacing", rods.spacing
        yield "shoulder_height", self.height
        yield "angle", self.angles

    def rows(self, limb: int) -> Iterator[tuple[str, str]]:
        """A crank that is level at the coordinate 0."""
        out = along(self.angles[limb])
        x, y = (self.radius * part for part in out)
        elbow = ", ".join(repr(self.upper[limb] * part) for part in out)
        yield "origin", f"[{x!r}, {y!r}, {self.height!r}]"
        yield "axis", f"[{out[1]!r}, {-out[0]!r}, 0]"
        yield "", ""
        yield "base", f"[{elbow}, 0]"
        yield "length", repr(self.lower[limb])

    def groups(self) -> Iterator[tuple[str, Mapping[str, float]]]:
        """All shoulders outwards and upwards, each upper arm longer, and two limbs sideways."""
        outwards: dict[str, float] = {}
        for limb, name in enumerate(LIMBS):
            outwards |= components([f"drive.{name}.origin"], along(self.angles[limb]))
        yield "shoulder radius", outwards
        yield "shoulder height", {f"drive.{name}.origin.z": 1.0 for name in LIMBS}
        for limb, name in enumerate(LIMBS):
            parts = [f"strut.{strut}.base" for strut in self.struts(limb)]
            yield f"upper arm {name}", components(parts, along(self.angles[limb]))
        yield from self.sideways()

    def lever(self, rods: Rods) -> float:
        """The nearest elbow, its arm level."""
        return self.radius + rods.effector_radius + min(self.upper)

    def lowest(self) -> float:
        """Degrees: straight down."""
        return -90.0

    def wide_end(self) -> str:
        """Degrees."""
        return repr(WIDE_END)


def read_rotary(numbers: Numbers, rods: Rods | None) -> Geometry | None:
    """The machine, mm; None where a number is missing or wrong, which `numbers` then knows."""
    radius = numbers.number("printer", "shoulder_radius", above=0.0, expected="mm, above zero")
    height = numbers.number("printer", "shoulder_height", above=0.0, expected="mm, above zero")
    upper = numbers.inherited("upper_arm_length", above=0.0, expected="mm, above zero")
    lower = numbers.inherited("lower_arm_length", above=0.0, expected="mm, above zero")
    ends = numbers.inherited("position_endstop", at_least=0.0, expected="mm, zero or above")
    angles = [
        numbers.number(section, "angle", angle, expected="degrees")
        for section, angle in zip(STEPPERS, ANGLES, strict=True)
    ]
    low = lowest(numbers, ends)
    if numbers.problems:
        return None
    values = np.array([radius, height, *np.radians(angles), *upper, *lower, 0.0, 0.0, 0.0])
    on_axis = np.column_stack([np.zeros(3), np.zeros(3), ends])
    switches = np.diagonal(arm_angles(values, on_axis)).copy()
    for section, end, switch in zip(STEPPERS, ends, switches, strict=True):
        if math.isnan(switch):
            _refuse_end(numbers, section, end)
    if numbers.problems:
        return None
    elbows = height + np.array(upper) * np.sin(switches)
    cone = float((elbows - np.array(lower)).min())
    reach = min(radius + min(upper), min(lower) - radius)
    if not reach > 0.0:
        entry = numbers.config.get("printer", "shoulder_radius")
        assert entry is not None
        expected = f"mm, below the shortest lower arm, {min(lower):.10g}"
        message = "the arms do not come to the middle"
        numbers.refuse(entry, "printer", "shoulder_radius", "import-value", message, expected)
        return None
    wanted, assumed = bed_radius(numbers, reach)
    file = RotaryDeltaFile(
        name="Rotary delta",
        origin=f"Klipper's {numbers.config.file.path.name}.",
        angles=angles,
        ends=[float(angle) for angle in np.degrees(switches)],
        workspace=(wanted, low, cone if cone > low else min(ends)),
        rods=rods,
        reach_assumed=assumed,
        radius=radius,
        height=height,
        upper=upper,
        lower=lower,
    )
    out = np.radians(angles)
    outwards = np.column_stack([np.cos(out), np.sin(out)])

    def spheres(joints: Floats) -> tuple[Floats, Floats]:
        away = radius + np.array(upper) * np.cos(joints)
        up = height + np.array(upper) * np.sin(joints)
        return np.column_stack([outwards * away[:, np.newaxis], up]), np.array(lower)

    return Geometry(file, switches, "deg", math.degrees(1.0), spheres)


def _refuse_end(numbers: Numbers, section: str, end: float) -> None:
    for owner in (section, STEPPERS[0]):
        entry = numbers.config.get(owner, "position_endstop")
        if entry is not None:
            numbers.refuse(
                entry,
                owner,
                "position_endstop",
                "import-value",
                f"no angle of the arm of {section} holds the tool in the middle at this height",
                "a height that both arms reach",
            )
            return


__all__ = ["read_rotary"]
