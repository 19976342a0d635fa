"""Tricepts: three telescopic struts and a central tube in a universal joint."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from truepose.files.quantity import PositiveLength
from truepose.machine.families._family import MachineFamily, Row, Values, X, Y, Z, outward


class TriceptFamily(MachineFamily):
    """The origin in the centre of the universal joint, in the plane of the base joints."""

    kind: ClassVar[str] = "tricept"
    doc: ClassVar[str] = (
        "Three telescopic struts and a central tube in a universal joint; the tilt follows."
    )
    drawing: ClassVar[str] = """\
from above                              1 (90 deg), 2 (210), 3 (330 deg)

        1 o                             base_radius: + to each base joint
          :   .
          + . o  . platform joints      platform_radius: + to each platform joint
       .        .
    2 o          o 3
The tube is fixed to the platform, slides through + in a universal joint, and does not spin there.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 500,
        "platform_radius": 200,
    }

    base_radius: PositiveLength = Field(
        description="Radius of the circle of base joints.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )

    def size(self) -> float:
        """The base."""
        return self.base_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`; guides `tube`, `joint`."""
        for name in cls.limbs:
            yield Row("drive", f"d{name}", {"kind": "telescopic"}, {})
        for name, degrees in zip(cls.limbs, (90.0, 210.0, 330.0), strict=True):
            out, _ = outward(np.asarray(math.radians(degrees)))
            joints = {
                "base": values["base_radius"] * out,
                "platform": values["platform_radius"] * out,
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
        line = {"origin": 0.0 * X, "platform": 0.0 * X, "axis": Z}
        yield Row("guide", "tube", {"kind": "line"}, line)
        cross = {"base_axis": X, "platform_axis": Y}
        yield Row("guide", "joint", {"kind": "universal"}, cross)
