"""Orthoglides: three carriages on guideways at right angles, two rods each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Length, PositiveLength, ThreePositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X, Y, Z


class OrthoglideFamily(MachineFamily):
    """The guideways meet in the origin; the tool point in the middle of the platform."""

    kind: ClassVar[str] = "orthoglide"
    doc: ClassVar[str] = "Three carriages on guideways at right angles, two parallel rods each."
    drawing: ClassVar[str] = """\
the x limb, from above; y and z are alike, each turned on by one axis

                       rod
 carriage o----------------------o
          |                      | spacing   + tool point
  x ------o----------------------o
                                 :<------->:
                                 platform_radius
"""
    limbs: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    example: ClassVar[Mapping[str, Any]] = {
        "rod": 400,
        "spacing": 100,
        "platform_radius": 50,
    }

    rod: ThreePositiveLengths = Field(
        description="Length of the rods, joint to joint.",
    )
    spacing: PositiveLength = Field(
        description="Distance of the two rods of a pair.",
    )
    platform_radius: Length = Field(
        description="From the tool point back to each limb's platform joints, along its guideway.",
    )

    def size(self) -> float:
        """The rods."""
        return max(self.rod)

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `x`, `y`, `z`; struts `x1`, `x2`, `y1`, ..."""
        for name, axis in zip(cls.limbs, (X, Y, Z), strict=True):
            place = {"origin": 0.0 * axis, "axis": axis}
            yield Row("drive", name, {"kind": "slider"}, place, {"working_mode": "-"})
        limbs = zip(cls.limbs, (X, Y, Z), (Y, Z, X), strict=True)
        for limb, (name, axis, across) in enumerate(limbs):
            for number, side in ((1, 0.5), (2, -0.5)):
                aside = side * values["spacing"] * across
                joints = {
                    "base": aside,
                    "platform": aside - values["platform_radius"] * axis,
                    "length": values["rod"][limb],
                }
                yield Row("strut", f"{name}{number}", {"drive": name}, joints)
