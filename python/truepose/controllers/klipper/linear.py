"""Klipper's `kinematics: delta`: one radius, and an angle, a rod and an endstop a tower.

`position_endstop` is the height of the nozzle over z = 0, in the middle, at which the tower's
endstop trips; `delta_radius` counts for every tower. Facts from Klipper's configuration reference
(https://www.klipper3d.org/Config_Reference.html, linear delta kinematics) and delta page.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta import lowest_z, print_radius
from truepose.controllers._linear_delta import (
    ANGLES,
    ARMS,
    HEIGHTS,
    RADIUS,
    TILT,
    TowerModel,
    endstop,
    heights,
    linear_delta,
    untilted,
)
from truepose.controllers._small_model import (
    MM,
    Printed,
    ascii_only,
    fixed,
    more_decimals,
)
from truepose.machine import Machine

LENGTH_DIGITS, ANGLE_DIGITS = 6, 7
"""Decimals that are written; of lengths more where the characteristic one is below `SMALL`, m."""

SMALL = 0.01
STEPPERS = "abc"


class KlipperLinear(TowerModel):
    """A `SmallModel` of ten numbers; stepper_a drives the machine's first drive, and so on."""

    def __init__(self, machine: Machine, options: Mapping[str, float | str]) -> None:
        """Raises `RequestError`: controller-cannot, bad-option."""
        super().__init__(linear_delta(machine, options, "klipper"))
        self._digits = LENGTH_DIGITS + more_decimals(machine.characteristic_length, SMALL)

    def format(self, values: Floats) -> Printed:
        """Numbers by section and key, mm and degrees."""
        numbers = untilted(values)
        settings = {"printer.delta_radius": fixed(float(numbers[RADIUS][0]) / MM, self._digits)}
        towers = zip(
            STEPPERS,
            np.degrees(numbers[ANGLES]) % 360.0,
            numbers[ARMS] / MM,
            endstop(numbers) / MM,
            strict=True,
        )
        for letter, angle, arm, height in towers:
            settings[f"stepper_{letter}.angle"] = fixed(angle, ANGLE_DIGITS)
            settings[f"stepper_{letter}.arm_length"] = fixed(arm, self._digits)
            settings[f"stepper_{letter}.position_endstop"] = fixed(height, self._digits)
        return settings

    def parse(self, printed: Printed) -> Floats:
        """(10,) the model's values of printed numbers."""

        def of(key: str) -> Floats:
            return np.array([float(printed[f"stepper_{letter}.{key}"]) for letter in STEPPERS])

        radius, arms = float(printed["printer.delta_radius"]) * MM, of("arm_length") * MM
        values = np.empty(TILT.start)
        values[RADIUS], values[ARMS] = radius, arms
        values[ANGLES] = np.radians(of("angle"))
        values[HEIGHTS] = heights(of("position_endstop") * MM, arms, radius)
        return values

    def block(self, printed: Printed) -> list[str]:
        """The sections of printer.cfg."""
        lines = [
            "[printer]",
            "kinematics: delta",
            f"delta_radius: {printed['printer.delta_radius']}",
            "# of the workspace, not fitted:",
            f"print_radius: {print_radius(self.delta.machine)}",
            f"minimum_z_position: {lowest_z(self.delta.machine)}",
        ]
        for letter, drive in zip(STEPPERS, self.delta.names(), strict=True):
            lines += ["", f"# drive {ascii_only(drive)}", f"[stepper_{letter}]"]
            for key in ("position_endstop", "arm_length", "angle"):
                lines.append(f"{key}: {printed[f'stepper_{letter}.{key}']}")
        return lines


__all__ = ["KlipperLinear"]
