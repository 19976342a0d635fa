"""What both of Klipper's deltas share: where the tool is at joints, and how far it goes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.controllers._delta_file import DeltaFile
from truepose.controllers.klipper.numbers import Numbers


@dataclass(frozen=True)
class Geometry:
    """A delta as Klipper has it, mm.

    `ends` (3,): joint coordinates where the endstops trip, mm or rad, and `unit` in which the
    machine file has them, `to_unit` of it for one. `spheres(joints)`: centres (3, 3) and radii
    (3,) of the spheres on whose lower common point the tool is.
    """

    file: DeltaFile
    ends: Floats
    unit: str
    to_unit: float
    spheres: Callable[[Floats], tuple[Floats, Floats]]

    def tool(self, steps: Floats, step: Floats) -> Floats:
        """(3,) mm: the tool at `steps` (3,) from the endstops, each of `step` (3,); else NaN."""
        centres, radii = self.spheres(self.ends - steps * step)
        return lower_point(centres, radii)


def lower_point(centres: Floats, radii: Floats) -> Floats:
    """(3,) the lower of the two points that lie on three spheres; NaN where there is none."""
    across, up = centres[1] - centres[0], centres[2] - centres[0]
    rows = np.array([across, up])
    right = np.array([across @ across, up @ up]) + radii[0] ** 2 - radii[1:] ** 2
    normal = np.cross(across, up)
    size = normal @ normal
    if not size > 0.0:
        return np.full(3, np.nan)
    # The point of the plane of the centres at which both differences of squares are right.
    foot = np.linalg.lstsq(rows, right / 2.0, rcond=None)[0]
    height = radii[0] ** 2 - foot @ foot
    if not height >= 0.0:
        return np.full(3, np.nan)
    aside = normal * np.sqrt(height / size)
    point: Floats = centres[0] + foot + (-aside if aside[2] > 0.0 else aside)
    return point


def lowest(numbers: Numbers, ends: Sequence[float]) -> float:
    """Klipper's minimum_z_position, which is not above the lowest endstop."""
    low = numbers.number("printer", "minimum_z_position", 0.0, expected="mm")
    entry = numbers.config.get("printer", "minimum_z_position")
    if low > min(ends):
        if entry is None:
            return low  # an endstop below zero is told already
        numbers.refuse(
            entry,
            "printer",
            "minimum_z_position",
            "import-value",
            "this is above an endstop",
            f"mm, at most {min(ends):.10g}",
        )
    return low


ALL_OF_IT = "the workspace is as wide as the controller goes"


def bed_radius(
    numbers: Numbers, reach: float, said: float | None = None
) -> tuple[float, str | None]:
    """The radius of the workspace, mm, and what is assumed where the file does not say it.

    `reach`: how far Klipper goes at all; `said`: what the file says of that.
    """
    probed = numbers.number_if("delta_calibrate", "radius")
    for radius in (said, probed):
        if radius is not None:
            return min(radius, reach), None
    return reach, ALL_OF_IT


__all__ = ["Geometry", "bed_radius", "lower_point", "lowest"]
