"""Tripods of three telescopic struts that meet in one point."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from truepose.files.quantity import Length, PositiveLength
from truepose.machine.families._circles import telescopic_drives
from truepose.machine.families._family import MachineFamily, Row, Values, X, Z, outward


class TripodFamily(MachineFamily):
    """z = 0 is the table; all struts end in the tool point."""

    kind: ClassVar[str] = "tripod"
    doc: ClassVar[str] = "Three telescopic struts that meet in one point, which is the tool."
    drawing: ClassVar[str] = """\
from above                          from the side

       3 (90 deg)                    base joints  o . . . . . o
       o                                           \\         /   :
       :  base_radius                               \\       /    :  base_height
       + tool point                                  '- + -'     :
   o       o                             tool point            - : - z = 0, the table
1 (210)   2 (330 deg)
"""
    limbs: ClassVar[tuple[str, ...]] = ("1", "2", "3")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    commanded: ClassVar[tuple[str, ...]] = dof
    example: ClassVar[Mapping[str, Any]] = {
        "base_radius": 600,
        "base_height": 900,
    }

    base_radius: PositiveLength = Field(
        description="Radius of the circle of base joints.",
    )
    base_height: Length = Field(
        description="Height of the base joints over z = 0.",
    )

    def size(self) -> float:
        """The base."""
        return self.base_radius

    def level(self) -> float:
        """The base joints."""
        return self.base_height

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `d1` to `d3`; struts `1` to `3`."""
        yield from telescopic_drives(cls.limbs)
        for name, degrees in zip(cls.limbs, (210.0, 330.0, 90.0), strict=True):
            out, _ = outward(np.asarray(math.radians(degrees)))
            base = values["base_radius"] * out + values["base_height"] * Z
            yield Row("strut", name, {"drive": f"d{name}"}, {"base": base, "platform": 0.0 * X})
