"""Five-bars: two cranks, two rods that meet at the tool point (5R)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import PositiveLength, TwoPositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X, Z


class FiveBarFamily(MachineFamily):
    """The pivots on the x axis, the origin between them; both rods meet in the tool point."""

    kind: ClassVar[str] = "five_bar"
    doc: ClassVar[str] = "Two cranks on the frame, two rods that meet at the tool point (5R)."
    drawing: ClassVar[str] = """\
           + tool point
         /   \\
        / rod \\
       o       o    elbows, outwards
        \\     /
   crank \\   /
          o-o   pivots left and right, span apart, on x
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2")
    dof: ClassVar[tuple[str, ...]] = ("x", "y")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "span": 250,
        "crank": 250,
        "rod": 350,
    }

    span: PositiveLength = Field(
        description="Distance of the two pivots.",
    )
    crank: TwoPositiveLengths = Field(
        description="Length of the cranks.",
    )
    rod: TwoPositiveLengths = Field(
        description="Length of the rods.",
    )

    def size(self) -> float:
        """Crank and rod."""
        return 0.5 * (sum(self.crank) + sum(self.rod))

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `left`, `right`; struts `1`, `2`."""
        sides = {"left": (-0.5, "+"), "right": (0.5, "-")}
        for drive, (side, mode) in sides.items():
            place = {"origin": side * values["span"] * X, "axis": Z}
            yield Row("drive", drive, {"kind": "crank"}, place, {"working_mode": mode})
        for limb, (name, drive) in enumerate(zip(cls.limbs, sides, strict=True)):
            joints = {
                "base": values["crank"][limb] * X,
                "platform": 0.0 * X,
                "length": values["rod"][limb],
            }
            yield Row("strut", name, {"drive": drive}, joints)
