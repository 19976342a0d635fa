"""Six struts of fixed length on vertical slides below the platform (6-PSU)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Angle, Length, PositiveLength
from truepose.machine.families._circles import PAIRS_ABOVE, PAIRS_BELOW
from truepose.machine.families._family import MachineFamily, Row, Values, X, Z, between


class WalkingPsuFamily(MachineFamily):
    """Slides upright, in pairs on a circle; the tool point in the plane of the platform joints."""

    kind: ClassVar[str] = "walking_6psu"
    doc: ClassVar[str] = "Six struts of fixed length on vertical slides below the platform (6-PSU)."
    drawing: ClassVar[str] = """\
slides, from above             platform joints, from above

      2 .  |  . 1                              1 . | . 2     platform_angle between
    3 .    |    . 6                                |         the two of a pair
           +-- x   slide_radius                  - - - +         platform_radius
        4 . . 5                                3 .   . 6
                                                4 . . 5
slide_angle between the two of a pair: pairs at 30, 150 and 270 degrees from x here, at 90, 210 and
330 on the platform
slide_height: of the carriage joints at joint coordinate 0, mostly below z = 0.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3", "4", "5", "6")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "slide_radius": 256.22,
        "slide_angle": 25.25,
        "slide_height": -178.076,
        "platform_radius": 82.5,
        "platform_angle": 34.5,
        "rod": 260,
    }

    slide_radius: PositiveLength = Field(
        description="Radius of the circle of slides.",
    )
    slide_angle: Angle = Field(
        description="Between the two slides of a pair, seen from the middle.",
    )
    slide_height: Length = Field(
        description="Height of the carriage joints at joint coordinate 0.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )
    platform_angle: Angle = Field(
        description="Between the two platform joints of a pair, seen from the middle.",
    )
    rod: PositiveLength = Field(
        description="Length of the struts.",
    )

    def size(self) -> float:
        """The circle of slides."""
        return self.slide_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d6`; struts `1` to `6`."""
        for name, pair in zip(cls.limbs, PAIRS_BELOW, strict=True):
            out = between(*pair, values["slide_angle"])
            place = {"origin": values["slide_radius"] * out + values["slide_height"] * Z}
            place["axis"] = Z
            yield Row("drive", f"d{name}", {"kind": "slider"}, place, {"working_mode": "-"})
        for name, pair in zip(cls.limbs, PAIRS_ABOVE, strict=True):
            platform = values["platform_radius"] * between(*pair, values["platform_angle"])
            joints = {"base": 0.0 * X, "platform": platform, "length": values["rod"]}
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
