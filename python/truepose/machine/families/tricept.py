"""Tricepts: three telescopic struts and a central tube in a universal joint."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from truepose.machine.families._circles import TwoCircles, struts_outward, telescopic_drives
from truepose.machine.families._family import Row, Values, X, Y, Z


class TriceptFamily(TwoCircles):
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

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`; guides `tube`, `joint`."""
        yield from telescopic_drives(cls.limbs)
        yield from struts_outward(cls.limbs, values)
        line = {"origin": 0.0 * X, "platform": 0.0 * X, "axis": Z}
        yield Row("guide", "tube", {"kind": "line"}, line)
        cross = {"base_axis": X, "platform_axis": Y}
        yield Row("guide", "joint", {"kind": "universal"}, cross)
