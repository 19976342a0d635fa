"""Planar machines of two carriages on parallel guideways."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import PositiveLength, TwoPositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X, Y


class PlanarTwoSliderFamily(MachineFamily):
    """Guideways along y, the first through the origin; both struts meet in the tool point."""

    kind: ClassVar[str] = "planar_two_slider"
    doc: ClassVar[str] = (
        "Two carriages on parallel guideways, two struts that meet at the tool point."
    )
    drawing: ClassVar[str] = """\
  y
  |  d1            d2
  |  o              o    carriages
  |   \\            /
  |    \\  1    2  /  rod
  |     \\        /
  |      '--- + -'   tool point
  |
  +----------------- x
  :<--- span ---->:
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2")
    dof: ClassVar[tuple[str, ...]] = ("x", "y")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "span": 600,
        "rod": 500,
    }

    span: PositiveLength = Field(
        description="Distance of the two guideways.",
    )
    rod: TwoPositiveLengths = Field(
        description="Length of the struts.",
    )

    def size(self) -> float:
        """The span."""
        return self.span

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1`, `d2`; struts `1`, `2`."""
        for limb, name in enumerate(cls.limbs):
            place = {"origin": limb * values["span"] * X, "axis": Y}
            yield Row("drive", f"d{name}", {"kind": "slider"}, place, {"working_mode": "+"})
        for limb, name in enumerate(cls.limbs):
            joints = {"base": 0.0 * X, "platform": 0.0 * X, "length": values["rod"][limb]}
            yield Row("strut", name, {"drive": f"d{name}"}, joints)
