"""Planar machines of two parallelograms on vertical guideways."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Length, PositiveLength, TwoPositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X, Y


class OverconstrainedFamily(MachineFamily):
    """Guideways along y, alike on either side; the tool point in the middle of the platform."""

    kind: ClassVar[str] = "overconstrained"
    doc: ClassVar[str] = "Two carriages, two parallel rods each: four closures for three freedoms."
    drawing: ClassVar[str] = """\
  left                         right
  |                               |
  o l1                         r1 o    spacing: of the two rods of a carriage
  o l2   rod                   r2 o
  | \\ \\                       / / |
  |    o- - platform_width - -o   |
  |    o          +           o   |
  |<----------- span ------------>|
"""
    limbs: ClassVar[tuple[str, ...]] = ("left", "right")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "c")
    commanded: ClassVar[tuple[str, ...]] = ("x", "y")
    example: ClassVar[Mapping[str, Any]] = {
        "span": 800,
        "spacing": 120,
        "platform_width": 200,
        "rod": 500,
    }

    span: PositiveLength = Field(
        description="Distance of the two guideways.",
    )
    spacing: PositiveLength = Field(
        description="Distance of the two rods of a carriage.",
    )
    platform_width: Length = Field(
        description="Distance of the platform joints of one carriage from those of the other.",
    )
    rod: TwoPositiveLengths = Field(
        description="Length of the rods of each carriage.",
    )

    def size(self) -> float:
        """The span."""
        return self.span

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `left`, `right`; struts `l1`, `l2`, `r1`, `r2`."""
        for name, side in zip(cls.limbs, (-0.5, 0.5), strict=True):
            place = {"origin": side * values["span"] * X, "axis": Y}
            yield Row("drive", name, {"kind": "slider"}, place, {"working_mode": "+"})
        for limb, (name, side) in enumerate(zip(cls.limbs, (-0.5, 0.5), strict=True)):
            for number, end in ((1, 0.5), (2, -0.5)):
                aside = end * values["spacing"] * Y
                joints = {
                    "base": aside,
                    "platform": side * values["platform_width"] * X + aside,
                    "length": values["rod"][limb],
                }
                yield Row("strut", f"{name[0]}{number}", {"drive": name}, joints)
