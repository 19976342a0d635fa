"""Hexapods of telescopic struts (6-UPS) whose joints lie in pairs on two circles."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Angle, Length, PositiveLength
from truepose.machine.families._circles import telescopic_drives
from truepose.machine.families._family import MachineFamily, Row, Values, outward

_BASE = ((150.0, -0.5), (30.0, 0.5), (30.0, -0.5), (270.0, 0.5), (270.0, -0.5), (150.0, 0.5))
_PLATFORM = ((90.0, 0.5), (90.0, -0.5), (-30.0, 0.5), (-30.0, -0.5), (210.0, 0.5), (210.0, -0.5))
"""Of each strut the middle of its pair, degrees from x, and its side of it."""


class HexapodFamily(MachineFamily):
    """Base frame in the plane of the base joints; the tool point in that of the platform's."""

    kind: ClassVar[str] = "hexapod"
    doc: ClassVar[str] = "Six telescopic struts between joints in pairs on two circles (6-UPS)."
    drawing: ClassVar[str] = """\
base joints B, from above                platform joints P, from above

               y                                   P1     P2     platform_angle: P1 + P2
               |                                     .   .
  B1 .         |         . B2                          |
   B6 .  - - - + - - -  . B3  -- x             - - - - + - - -   platform_radius: + to each P
               |                                     .   .
               |  base_radius: + to each B    P6 .           . P3
            .     .                              P5 .     . P4
           B5     B4   base_angle: B5 + B4

Strut n goes from Bn to Pn. The pairs of the base are at 30, 150 and 270 degrees from x, those of
the platform at 90, 210 and 330. At home the platform is height above the base, neither tilted nor
turned.
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3", "4", "5", "6")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 26.5,
        "platform_radius": 11.5434,
        "base_angle": 0,
        "platform_angle": 9.9414,
        "height": 20,
    }

    base_radius: PositiveLength = Field(description="Radius of the circle of base joints.")
    platform_radius: PositiveLength = Field(description="Radius of the circle of platform joints.")
    base_angle: Angle = Field(
        description="Between the two base joints of a pair, seen from the middle; 0 where they "
        "coincide."
    )
    platform_angle: Angle = Field(
        description="Between the two platform joints of a pair, seen from the middle."
    )
    height: Length | None = Field(
        None,
        description="Height of the platform joints over the base joints at home: the z of "
        "`[workspace] home` where that is not written. No joint centre depends on it.",
    )

    def size(self) -> float:
        """The height, or where that is not said the base."""
        return self.base_radius if self.height is None else self.height

    def level(self) -> float:
        """The platform at home."""
        return 0.0 if self.height is None else self.height

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d6`; struts `1` to `6`."""
        yield from telescopic_drives(cls.limbs)
        for name, base, platform in zip(cls.limbs, _BASE, _PLATFORM, strict=True):
            below, _ = outward(math.radians(base[0]) + base[1] * values["base_angle"])
            above, _ = outward(math.radians(platform[0]) + platform[1] * values["platform_angle"])
            joints = {
                "base": values["base_radius"] * below,
                "platform": values["platform_radius"] * above,
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)

    def home(self) -> Mapping[str, float]:
        """The platform above the base."""
        return {} if self.height is None else {"z": self.height}
