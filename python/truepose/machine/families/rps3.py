"""3-RPS: three telescopic struts on revolute joints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from truepose.machine.families._circles import (
    TwoCircles,
    planes_of_swing,
    struts_outward,
    telescopic_drives,
)
from truepose.machine.families._family import Row, Values


class RpsFamily(TwoCircles):
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

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`; guides `g1` to `g3`."""
        yield from telescopic_drives(cls.limbs)
        yield from struts_outward(cls.limbs, values)
        yield from planes_of_swing(cls.limbs, values)
