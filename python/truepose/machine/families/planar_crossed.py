"""Planar machines of two carriages on guideways that cross."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Angle, TwoPositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X, outward


class PlanarCrossedFamily(MachineFamily):
    """The guideways cross in the origin; both struts meet in the tool point."""

    kind: ClassVar[str] = "planar_crossed"
    doc: ClassVar[str] = (
        "Two carriages on guideways that cross, two struts that meet at the tool point."
    )
    drawing: ClassVar[str] = """\
              y
              |
  o====== 1 ==+ tool point, here at the origin
  carriage x  |\\
              2  ' angle between the guideways
              |
              o carriage y
      rod: length of each strut
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2")
    dof: ClassVar[tuple[str, ...]] = ("x", "y")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "rod": 500,
    }

    rod: TwoPositiveLengths = Field(
        description="Length of the struts.",
    )
    angle: Angle = Field(
        math.pi / 2.0,
        description="Between the two guideways. Default: 90 degrees.",
    )

    def size(self) -> float:
        """The longer strut."""
        return max(self.rod)

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `x`, `y`; struts `1`, `2`."""
        axes = {"x": X, "y": outward(values["angle"])[0]}
        for name, axis in axes.items():
            place = {"origin": 0.0 * X, "axis": axis}
            yield Row("drive", name, {"kind": "slider"}, place, {"working_mode": "-"})
        for limb, (name, drive) in enumerate(zip(cls.limbs, axes, strict=True)):
            joints = {"base": 0.0 * X, "platform": 0.0 * X, "length": values["rod"][limb]}
            yield Row("strut", name, {"drive": drive}, joints)
