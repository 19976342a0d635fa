"""3-PRS heads: three carriages, three struts that swing in planes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import PositiveLength, ThreePositiveLengths
from truepose.machine.families._circles import THIRDS, planes_of_swing
from truepose.machine.families._family import MachineFamily, Row, Values, X, Z, outward


class PrsHeadFamily(MachineFamily):
    """The machine axis is z, the guideways are parallel to it."""

    kind: ClassVar[str] = "3prs"
    doc: ClassVar[str] = (
        "Three carriages, three struts that swing in planes; x, y and c follow from the tilt."
    )
    drawing: ClassVar[str] = """\
from above                              1 (90 deg), 2 (210), 3 (330 deg)

        1 o                             rail_radius: + to each guideway
          :   .
          + . o  . platform joints      platform_radius: + to each platform joint
       .        .
    2 o          o 3
rod: length of the struts, each of which swings in the plane of its guideway and +.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = ("z", "a", "b")
    example: ClassVar[Mapping[str, Any]] = {
        "rail_radius": 350,
        "platform_radius": 250,
        "rod": 500,
    }

    rail_radius: PositiveLength = Field(
        description="Radius of the circle of guideways.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )
    rod: ThreePositiveLengths = Field(
        description="Length of the struts.",
    )

    def size(self) -> float:
        """The circle of guideways."""
        return self.rail_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`; guides `g1` to `g3`."""
        for name, angle in zip(cls.limbs, THIRDS, strict=True):
            place = {"origin": values["rail_radius"] * outward(angle)[0], "axis": Z}
            yield Row("drive", f"d{name}", {"kind": "slider"}, place, {"working_mode": "+"})
        for limb, (name, angle) in enumerate(zip(cls.limbs, THIRDS, strict=True)):
            joints = {
                "base": 0.0 * X,
                "platform": values["platform_radius"] * outward(angle)[0],
                "length": values["rod"][limb],
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
        yield from planes_of_swing(cls.limbs, values)
