"""Planar 3-RRR: a platform on three limbs of a crank and a rod."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from truepose.files.quantity import Angle, PositiveLength, ThreePositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X, Z, outward


class PlanarRrrFamily(MachineFamily):
    """The origin in the middle of the pivots, the tool point in that of the platform joints."""

    kind: ClassVar[str] = "3rrr"
    doc: ClassVar[str] = (
        "A planar platform on three limbs of a crank and a rod, all joints revolute."
    )
    drawing: ClassVar[str] = """\
             3 (90 deg)
             o
                    o  platform joints, platform_angle ahead
        o    +         of the base joints at c = 0, on
          o            platform_radius about the tool point +
   o              o
1 (210 deg)      2 (330 deg)  pivots, on base_radius
From each pivot a crank to its elbow, from there a rod to the platform joint.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 350,
        "crank": 200,
        "rod": 250,
        "platform_radius": 80,
        "platform_angle": 30,
    }

    base_radius: PositiveLength = Field(
        description="Radius of the circle of pivots.",
    )
    crank: ThreePositiveLengths = Field(
        description="Length of the cranks.",
    )
    rod: ThreePositiveLengths = Field(
        description="Length of the rods.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )
    platform_angle: Angle = Field(
        description="By which the platform joints are ahead of the pivots at c = 0.",
    )

    def size(self) -> float:
        """The base."""
        return self.base_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`."""
        angles = [math.radians(degrees) for degrees in (210.0, 330.0, 90.0)]
        for name, angle in zip(cls.limbs, angles, strict=True):
            place = {"origin": values["base_radius"] * outward(np.asarray(angle))[0], "axis": Z}
            yield Row("drive", f"d{name}", {"kind": "crank"}, place, {"working_mode": "+"})
        for limb, (name, angle) in enumerate(zip(cls.limbs, angles, strict=True)):
            joints = {
                "base": values["crank"][limb] * X,
                "platform": values["platform_radius"]
                * outward(angle + values["platform_angle"])[0],
                "length": values["rod"][limb],
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
