"""Planar 3-RPR: a platform on three telescopic struts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from truepose.files.quantity import Angle, PositiveLength
from truepose.machine.families._family import MachineFamily, Row, Values, outward


class PlanarRprFamily(MachineFamily):
    """The origin amid the base joints, the tool point amid the platform joints."""

    kind: ClassVar[str] = "3rpr"
    doc: ClassVar[str] = "A planar platform on three telescopic struts between revolute joints."
    drawing: ClassVar[str] = """\
             3 (90 deg)
             o
                    o  platform joints, platform_angle ahead
        o    +         of the base joints at c = 0, on
          o            platform_radius about the tool point +
   o              o
1 (210 deg)      2 (330 deg)  base joints, on base_radius
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 400,
        "platform_radius": 120,
        "platform_angle": 90,
    }

    base_radius: PositiveLength = Field(
        description="Radius of the circle of base joints.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )
    platform_angle: Angle = Field(
        description="By which the platform joints are ahead of the base joints at c = 0.",
    )

    def size(self) -> float:
        """The base."""
        return self.base_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`."""
        for name in cls.limbs:
            yield Row("drive", f"d{name}", {"kind": "telescopic"}, {})
        for name, degrees in zip(cls.limbs, (210.0, 330.0, 90.0), strict=True):
            angle = math.radians(degrees)
            joints = {
                "base": values["base_radius"] * outward(np.asarray(angle))[0],
                "platform": values["platform_radius"]
                * outward(angle + values["platform_angle"])[0],
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
