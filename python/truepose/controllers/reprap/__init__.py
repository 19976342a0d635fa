"""RepRapFirmware: linear deltas, as M665 and M666.

    M665 L rods (X:Y:Z tower), R radius, H height, B safe radius, X Y Z tower angle corrections
         (degrees, counter-clockwise seen from above, from 210, 330 and 90 degrees)
    M666 X Y Z endstop adjustments: how much higher than by R, L and H alone each carriage stands
         at its endstop; A B tilt in percent: the heights of all carriages grow by (A x + B y) / 100

H and the adjustments say one thing twice: the mean of the adjustments is made 0, as the
firmware's own calibration does. Facts: https://docs.duet3d.com, M665 and M666, and the behaviour
of RepRapFirmware 2.03 to 3.6. Rods of different lengths came with 2.03; a firmware before that
reads the first alone. M500 writes what it keeps with three decimals, the tilt with two.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta import SWITCHES, TOWERS, print_radius, tower_order, wrapped
from truepose.controllers._export import Export, Option
from truepose.controllers._linear_delta import (
    ANGLES,
    ARMS,
    COUNT,
    HEIGHTS,
    RADIUS,
    TILT,
    TowerModel,
    endstop,
    heights,
    linear_delta,
)
from truepose.controllers._one_file import in_one_file
from truepose.controllers._small_model import MM, Printed, fixed, more_decimals
from truepose.machine import Machine

PERCENT = 1e-2
LENGTH_DIGITS, ANGLE_DIGITS, TILT_DIGITS = 5, 6, 6
"""Decimals that are written; of lengths more where the characteristic one is below `SMALL`, m."""

SMALL = 0.01

PREMISES = (
    "for RepRapFirmware 2.03 or newer, which takes a rod for each tower: an older one takes the "
    "first for all",
    "these must be 0 or off: axis skew (M556), height map (G29 S2), tool offsets (G10), "
    "baby steps (M290 R0 S0)",
    "keep them in config.g: M500 writes lengths to 0.001 mm and the tilt A B to 0.01 only, which "
    "M501 takes instead; G30 with S replaces them by its own",
)
"""What the letters, and what else the firmware may do to a position, depend on."""

AXES, TILTS = "XYZ", "AB"


class _Model(TowerModel):
    """A `SmallModel` of twelve numbers; its towers are counted as the firmware does."""

    def __init__(self, machine: Machine, options: Mapping[str, float | str]) -> None:
        delta = linear_delta(machine, options, "reprap")
        super().__init__(delta.in_order(tower_order(delta.nominal[ANGLES])), tilt=True)
        self._digits = LENGTH_DIGITS + more_decimals(machine.characteristic_length, SMALL)

    def format(self, values: Floats) -> Printed:
        """Numbers by command and word, mm, degrees and percent."""
        trips = endstop(values)
        height = float(trips.mean())
        settings = {
            "M665 R": fixed(values[RADIUS][0] / MM, self._digits),
            "M665 H": fixed(height / MM, self._digits),
        }
        turned = np.degrees(wrapped(values[ANGLES] - TOWERS))
        for at, axis in enumerate(AXES):
            settings[f"M665 L{axis}"] = fixed(values[ARMS][at] / MM, self._digits)
            settings[f"M665 {axis}"] = fixed(turned[at], ANGLE_DIGITS)
            settings[f"M666 {axis}"] = fixed((trips[at] - height) / MM, self._digits)
        for axis, tilt in zip(TILTS, values[TILT], strict=True):
            settings[f"M666 {axis}"] = fixed(tilt / PERCENT, TILT_DIGITS)
        return settings

    def parse(self, printed: Printed) -> Floats:
        """(12,) the model's values, SI, of printed numbers."""

        def of(words: list[str]) -> Floats:
            return np.array([float(printed[word]) for word in words])

        radius, height = of(["M665 R", "M665 H"]) * MM
        values = np.empty(COUNT)
        values[RADIUS] = radius
        values[ARMS] = of([f"M665 L{axis}" for axis in AXES]) * MM
        values[ANGLES] = TOWERS + np.radians(of([f"M665 {axis}" for axis in AXES]))
        trips = height + of([f"M666 {axis}" for axis in AXES]) * MM
        values[HEIGHTS] = heights(trips, values[ARMS], radius)
        values[TILT] = of([f"M666 {axis}" for axis in TILTS]) * PERCENT
        return values

    def block(self, printed: Printed) -> list[str]:
        """The two commands."""
        reach = print_radius(self.delta.machine)
        rods = ":".join(printed[f"M665 L{axis}"] for axis in AXES)
        corrections = " ".join(f"{axis}{printed[f'M665 {axis}']}" for axis in AXES)
        adjustments = " ".join(f"{word}{printed[f'M666 {word}']}" for word in AXES + TILTS)
        return [
            f"; towers: {self.delta.towers(AXES)}; B is the workspace's radius, not fitted",
            f"M665 L{rods} R{printed['M665 R']} H{printed['M665 H']} B{reach} {corrections}",
            f"M666 {adjustments}",
        ]


class RepRap:
    """The numbers of M665 and M666, fitted."""

    name: ClassVar[str] = "reprap"
    doc: ClassVar[str] = "M665 and M666 of a linear delta for RepRapFirmware (Duet)"
    options: ClassVar[Mapping[str, Option]] = {"switches": SWITCHES}

    @classmethod
    def export(cls, machine: Machine, options: Mapping[str, float | str]) -> Export:
        """The commands for config.g.

        Raises `RequestError`: controller-cannot, bad-option, no-workspace, no-pose-left.
        """
        model = _Model(machine, options)
        return in_one_file(
            machine, model, "RepRapFirmware", ending="reprap.g", comment=";", premises=PREMISES
        )


__all__ = ["RepRap"]
