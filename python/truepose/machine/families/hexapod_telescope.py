"""Hexapods about a pivot far from their joints, as telescopes have."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Angle, Length, PositiveLength
from truepose.machine.families._circles import PAIRS_ABOVE, PAIRS_BELOW, telescopic_drives
from truepose.machine.families._family import MachineFamily, Row, Values, Z, between


class HexapodTelescopeFamily(MachineFamily):
    """The origin is the pivot, which is the tool point at the pose zero."""

    kind: ClassVar[str] = "hexapod_telescope"
    doc: ClassVar[str] = (
        "Six telescopic struts that move a platform about a pivot far outside them."
    )
    drawing: ClassVar[str] = """\
base joints, from above             platform joints, from above

      2 .  |  . 1                              1 . | . 2     platform_angle between
    3 .    |    . 6                                |         the two of a pair
           +-- x   base_radius                  - - - +         platform_radius
        4 . . 5                                3 .   . 6
                                                4 . . 5
base_angle between the two of a pair: pairs at 30, 150 and 270 degrees from x here, at 90, 210 and
330 on the platform
base_height, platform_height: of the planes of the joints over the pivot.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3", "4", "5", "6")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 697.04,
        "base_angle": 34.586,
        "base_height": 2637,
        "platform_radius": 692.255,
        "platform_angle": 38.397,
        "platform_height": 2233.4,
    }

    base_radius: PositiveLength = Field(
        description="Radius of the circle of base joints.",
    )
    base_angle: Angle = Field(
        description="Between the two base joints of a pair, seen from the middle.",
    )
    base_height: Length = Field(
        description="Height of the base joints over the pivot.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )
    platform_angle: Angle = Field(
        description="Between the two platform joints of a pair, seen from the middle.",
    )
    platform_height: Length = Field(
        description="Height of the platform joints over the pivot at the pose zero.",
    )

    def size(self) -> float:
        """The distance of the planes of the joints."""
        return abs(self.base_height - self.platform_height)

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d6`; struts `1` to `6`."""
        yield from telescopic_drives(cls.limbs)
        for name, below, pair in zip(cls.limbs, PAIRS_BELOW, PAIRS_ABOVE, strict=True):
            base = values["base_radius"] * between(*below, values["base_angle"])
            platform = values["platform_radius"] * between(*pair, values["platform_angle"])
            joints = {
                "base": base + values["base_height"] * Z,
                "platform": platform + values["platform_height"] * Z,
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
