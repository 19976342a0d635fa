"""`kinematics: delta`: the numbers of a printer.cfg as a machine.

A carriage's joints are position_endstop + sqrt(arm_length^2 - delta_radius^2) over z = 0 where its
endstop trips. `stepper_b` and `stepper_c` have arm_length and position_endstop of `stepper_a` where
they give none. Facts from Klipper's configuration reference
(https://www.klipper3d.org/Config_Reference.html, linear delta kinematics).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from truepose.controllers._linear_delta_file import LinearDeltaFile
from truepose.controllers._reader import ControllerReading
from truepose.controllers.klipper.numbers import Numbers

STEPPERS = ("stepper_a", "stepper_b", "stepper_c")
ANGLES = (210.0, 330.0, 90.0)
"""Degrees, where an angle is not given."""

NARROWEST = math.cos(math.atan(1.0 / 12.0))
"""Of an arm's length, how far from a tower Klipper still moves: carriages then go 12 for 1."""


def read_linear(numbers: Numbers, settings: Mapping[str, float | str]) -> ControllerReading:
    """Raises `MachineFileError` with every number that is missing or wrong."""
    radius = numbers.number("printer", "delta_radius", above=0.0, expected="mm, above zero")
    above = 0.0 if math.isnan(radius) else radius
    longer = f"mm, longer than the delta_radius of {above:.10g} mm"
    arm, end = math.nan, math.nan
    arms, ends = [], []
    for number, section in enumerate(STEPPERS):
        of_first = (None, None) if number == 0 else (arm, end)
        arms.append(
            numbers.number(section, "arm_length", of_first[0], above=above, expected=longer)
        )
        ends.append(numbers.number(section, "position_endstop", of_first[1], expected="mm"))
        if number == 0:
            arm, end = arms[0], ends[0]
    angles = [
        numbers.number(section, "angle", angle, expected="degrees")
        for section, angle in zip(STEPPERS, ANGLES, strict=True)
    ]
    low = numbers.number("printer", "minimum_z_position", 0.0, expected="mm")
    wanted = numbers.number("printer", "print_radius", radius, above=0.0, expected="mm")
    numbers.done()
    switches = [
        end + math.sqrt(arm * arm - radius * radius) for arm, end in zip(arms, ends, strict=True)
    ]
    reach = min(wanted, min(arms) - radius, NARROWEST * min(arms) - radius)
    # Above this height Klipper's workspace narrows to a cone.
    cone = min(switch - arm for switch, arm in zip(switches, arms, strict=True))
    high = cone if cone > low else min(ends)
    delta = LinearDeltaFile(
        name="Linear delta",
        origin=f"Klipper's {numbers.config.file.path.name}.",
        radius=[radius] * 3,
        angles=angles,
        rods=arms,
        switches=switches,
        workspace=(reach, low, high),
    )
    return ControllerReading(delta.text(), None, numbers.read, delta.assumptions())


__all__ = ["read_linear"]
