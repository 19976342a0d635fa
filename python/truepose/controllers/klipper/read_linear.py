"""`kinematics: delta`: the numbers of a printer.cfg as a machine.

A carriage's joints are position_endstop + sqrt(arm_length^2 - delta_radius^2) over z = 0 where its
endstop trips. `stepper_b` and `stepper_c` have arm_length and position_endstop of `stepper_a` where
they give none. Facts from Klipper's configuration reference
(https://www.klipper3d.org/Config_Reference.html, linear delta kinematics).
"""

from __future__ import annotations

import math

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta_file import LinearDeltaFile, Rods
from truepose.controllers.klipper.geometry import Geometry, bed_radius, lowest
from truepose.controllers.klipper.numbers import STEPPERS, Numbers

ANGLES = (210.0, 330.0, 90.0)
"""Degrees, where an angle is not given."""

NARROWEST = math.cos(math.atan(1.0 / 12.0))
"""Of an arm's length, how far from a tower Klipper still moves: carriages then go 12 for 1."""


def read_linear(numbers: Numbers, rods: Rods | None) -> Geometry | None:
    """The machine, mm; None where a number is missing or wrong, which `numbers` then knows."""
    radius = numbers.number("printer", "delta_radius", above=0.0, expected="mm, above zero")
    longer = 0.0 if math.isnan(radius) else radius
    arms = numbers.inherited(
        "arm_length", above=longer, expected=f"mm, above the delta_radius of {longer:.10g}"
    )
    ends = numbers.inherited("position_endstop", at_least=0.0, expected="mm, zero or above")
    angles = [
        numbers.number(section, "angle", angle, expected="degrees")
        for section, angle in zip(STEPPERS, ANGLES, strict=True)
    ]
    low = lowest(numbers, ends)
    if numbers.problems:
        return None
    switches = [
        e + math.sqrt(arm * arm - radius * radius) for arm, e in zip(arms, ends, strict=True)
    ]
    said = numbers.number_if("printer", "print_radius")
    farthest = radius if said is None else said  # Klipper's default
    reach = min(farthest, min(arms) - radius, NARROWEST * min(arms) - radius)
    wanted, assumed = bed_radius(numbers, reach, said)
    # Above this height Klipper's workspace narrows to a cone.
    cone = min(switch - arm for switch, arm in zip(switches, arms, strict=True))
    high = cone if cone > low else min(ends)
    file = LinearDeltaFile(
        name="Linear delta",
        origin=f"Klipper's {numbers.config.file.path.name}.",
        angles=angles,
        ends=switches,
        workspace=(wanted, low, high),
        rods=rods,
        reach_assumed=assumed,
        radius=[radius] * 3,
        arms=arms,
    )
    out = np.radians(angles)
    towers = radius * np.column_stack([np.cos(out), np.sin(out)])

    def spheres(joints: Floats) -> tuple[Floats, Floats]:
        return np.column_stack([towers, joints]), np.array(arms)

    return Geometry(file, np.array(switches), "mm", 1.0, spheres)


__all__ = ["read_linear"]
