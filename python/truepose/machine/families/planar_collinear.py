"""Planar machines of two carriages on one guideway."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import TwoPositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, X


class PlanarCollinearFamily(MachineFamily):
    """The guideway is the x axis; both struts meet in the tool point, below it."""

    kind: ClassVar[str] = "planar_collinear"
    doc: ClassVar[str] = (
        "Two carriages on one straight guideway, two struts that meet at the tool point."
    )
    drawing: ClassVar[str] = """\
  left            right
 --o----------------o-- x, the guideway
    \\              /
     \\  1      2  /  rod: length of each strut
      \\          /
       '--- + --'  tool point
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

    def size(self) -> float:
        """The longer strut."""
        return max(self.rod)

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `left`, `right`; struts `1`, `2`."""
        modes = {"left": "-", "right": "+"}
        for drive, mode in modes.items():
            place = {"origin": 0.0 * X, "axis": X}
            yield Row("drive", drive, {"kind": "slider"}, place, {"working_mode": mode})
        for limb, (name, drive) in enumerate(zip(cls.limbs, modes, strict=True)):
            joints = {"base": 0.0 * X, "platform": 0.0 * X, "length": values["rod"][limb]}
            yield Row("strut", name, {"drive": drive}, joints)
