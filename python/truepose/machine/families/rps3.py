"""3-RPS: three telescopic struts on revolute joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from truepose.files.quantity import PositiveLength
from truepose.machine.families._family import MachineFamily, Row, Values, outward


class RpsFamily(MachineFamily):
    """The machine axis is z, the base joints in the plane z = 0."""

    kind: ClassVar[str] = "3rps"
    doc: ClassVar[str] = (
        "Three telescopic struts on revolute joints; x, y and c follow from the tilt."
    )
    drawing: ClassVar[str] = """\
from above                              1 (90 deg), 2 (210), 3 (330 deg)

        1 o                             base_radius: + to each base joint
          :   .
          + . o  . platform joints      platform_radius: + to each platform joint
       .        .
    2 o          o 3
Each strut swings in the plane through its revolute joint and the machine axis +.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = ("z", "a", "b")
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 350,
        "platform_radius": 220,
    }

    base_radius: PositiveLength = Field(
        description="Radius of the circle of revolute joints.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )

    def size(self) -> float:
        """The base."""
        return self.base_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`; guides `g1` to `g3`."""
        angles = np.radians((90.0, 210.0, 330.0))
        for name in cls.limbs:
            yield Row("drive", f"d{name}", {"kind": "telescopic"}, {})
        for name, angle in zip(cls.limbs, angles, strict=True):
            out, _ = outward(angle)
            joints = {
                "base": values["base_radius"] * out,
                "platform": values["platform_radius"] * out,
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
        for name, angle in zip(cls.limbs, angles, strict=True):
            out, across = outward(angle)
            plane = {"normal": across, "platform": values["platform_radius"] * out}
            yield Row("guide", f"g{name}", {"kind": "plane"}, plane)
