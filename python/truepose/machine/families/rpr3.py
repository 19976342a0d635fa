"""Planar 3-RPR: a platform on three telescopic struts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from truepose.files.quantity import Angle
from truepose.machine.families._circles import TwoCircles, telescopic_drives
from truepose.machine.families._family import Row, Values, outward


class PlanarRprFamily(TwoCircles):
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

    platform_angle: Angle = Field(
        description="By which the platform joints are ahead of the base joints at c = 0.",
    )

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`."""
        yield from telescopic_drives(cls.limbs)
        for name, degrees in zip(cls.limbs, (210.0, 330.0, 90.0), strict=True):
            angle = math.radians(degrees)
            joints = {
                "base": values["base_radius"] * outward(np.asarray(angle))[0],
                "platform": values["platform_radius"]
                * outward(angle + values["platform_angle"])[0],
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
