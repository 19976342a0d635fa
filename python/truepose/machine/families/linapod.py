"""Linapods: six struts of fixed length on vertical rails in pairs (6-PUS)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Angle, PositiveLength
from truepose.machine.families._circles import PAIRS_ABOVE
from truepose.machine.families._family import MachineFamily, Row, Values, X, Z, between


class LinapodFamily(MachineFamily):
    """Rails upright, in pairs on a circle; the platform joints in one plane."""

    kind: ClassVar[str] = "linapod"
    doc: ClassVar[str] = "Six struts of fixed length on six carriages on vertical rails (6-PUS)."
    drawing: ClassVar[str] = """\
             1, 2 (90 deg)                platform joints: pairs at the same
            . .                           angles, platform_angle between the two
                                          of a pair, on platform_radius
   3 .       +       . 6 (330 deg)
    4 .             . 5                   rails: rail_angle between the two of
(210 deg)                                 a pair, on rail_radius
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3", "4", "5", "6")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "rail_radius": 600,
        "rail_angle": 20,
        "platform_radius": 250,
        "platform_angle": 90,
        "rod": 800,
    }

    rail_radius: PositiveLength = Field(
        description="Radius of the circle of rails.",
    )
    rail_angle: Angle = Field(
        description="Between the two rails of a pair, seen from the middle.",
    )
    platform_radius: PositiveLength = Field(
        description="Radius of the circle of platform joints.",
    )
    platform_angle: Angle = Field(
        description="Between the two platform joints of a pair of rails, seen from the middle.",
    )
    rod: PositiveLength = Field(
        description="Length of the struts.",
    )

    def size(self) -> float:
        """The circle of rails."""
        return self.rail_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d6`; struts `1` to `6`."""
        for name, pair in zip(cls.limbs, PAIRS_ABOVE, strict=True):
            place = {"origin": values["rail_radius"] * between(*pair, values["rail_angle"])}
            place["axis"] = Z
            yield Row("drive", f"d{name}", {"kind": "slider"}, place, {"working_mode": "+"})
        for name, pair in zip(cls.limbs, PAIRS_ABOVE, strict=True):
            platform = values["platform_radius"] * between(*pair, values["platform_angle"])
            joints = {"base": 0.0 * X, "platform": platform, "length": values["rod"]}
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
