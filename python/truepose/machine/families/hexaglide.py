"""Hexaglides: six struts of fixed length on level, parallel guideways (6-PUS)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Length, PositiveLength
from truepose.machine.families._family import MachineFamily, Row, Values, X, Y, Z


class HexaglideFamily(MachineFamily):
    """Rails along x, alike on either side of it; the platform joints in one plane."""

    kind: ClassVar[str] = "hexaglide"
    doc: ClassVar[str] = (
        "Six struts of fixed length on carriages on level, parallel guideways (6-PUS)."
    )
    drawing: ClassVar[str] = """\
platform from above, one side; the other is its mirror image in x

  outer rail: 2 behind, 1 ahead         platform_front ahead of the origin,
 --o-----------------------o--          platform_back behind it:
                                          3 .         . 1   platform_outer from x
  inner rail: 3 behind                                . 2   platform_inner from x
 --o---------------------------             . . + . . . --- x
 = outer_rail, inner_rail from x
   outer_height, inner_height over z = 0     rod: length of each strut
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3", "4", "5", "6")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "outer_rail": 500,
        "outer_height": 650,
        "inner_rail": 210,
        "inner_height": 850,
        "platform_front": 120,
        "platform_back": 160,
        "platform_outer": 180,
        "platform_inner": 60,
        "rod": 1000,
    }

    outer_rail: PositiveLength = Field(
        description="Distance of the outer rails from x, on either side.",
    )
    outer_height: Length = Field(
        description="Height of the outer rails.",
    )
    inner_rail: PositiveLength = Field(
        description="Distance of the inner rails from x, on either side.",
    )
    inner_height: Length = Field(
        description="Height of the inner rails.",
    )
    platform_front: Length = Field(
        description="Of the platform joints of struts 1, 2, 4 and 5, ahead of the origin.",
    )
    platform_back: Length = Field(
        description="Of the platform joints of struts 3 and 6, behind the origin.",
    )
    platform_outer: Length = Field(
        description="Of the platform joints of struts 1, 3, 4 and 6, from x.",
    )
    platform_inner: Length = Field(
        description="Of the platform joints of struts 2 and 5, from x.",
    )
    rod: PositiveLength = Field(
        description="Length of the struts.",
    )

    def size(self) -> float:
        """The struts."""
        return self.rod

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d6`; struts `1` to `6`."""
        outer = (values["outer_rail"], values["outer_height"])
        inner = (values["inner_rail"], values["inner_height"])
        rails = (outer, outer, inner, outer, outer, inner)
        front, back = values["platform_front"], -values["platform_back"]
        wide, narrow = values["platform_outer"], values["platform_inner"]
        points = ((front, wide), (front, narrow), (back, wide)) * 2
        sides = (-1.0, -1.0, -1.0, 1.0, 1.0, 1.0)
        modes = ("+", "-", "-", "+", "-", "-")
        for name, side, mode, (aside, height) in zip(cls.limbs, sides, modes, rails, strict=True):
            place = {"origin": side * aside * Y + height * Z, "axis": X}
            yield Row("drive", f"d{name}", {"kind": "slider"}, place, {"working_mode": mode})
        for name, side, (along, aside) in zip(cls.limbs, sides, points, strict=True):
            joints = {
                "base": 0.0 * X,
                "platform": along * X + side * aside * Y,
                "length": values["rod"],
            }
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
