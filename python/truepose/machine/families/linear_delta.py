"""Linear deltas: carriages on three vertical guideways, two parallel rods each."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import PositiveLength, ThreeAngles, ThreePositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, Z, outward


class LinearDeltaFamily(MachineFamily):
    """Base frame on the bed, z up; the tool point is in the plane of the effector's joints."""

    kind: ClassVar[str] = "linear_delta"
    doc: ClassVar[str] = "Three carriages on vertical guideways, two parallel rods each."
    drawing: ClassVar[str] = """\
from above                               from the side, one tower

            c  (90 deg)                                 joint o-+ carriage
           o o                                               /  |
            :                                           rod /   |
            :  radius                                      /    | guideway
            +                                             /     |
          .   .                               tool +-----o      |
        .       .                                  :     :    : |
   o  .           .  o                      z = 0 -:-----:----:-+-
    o              o                               :     :    :
a  (210 deg)        b  (330 deg)                   |<--->|    :  effector_radius
                                                   |<-------->|  radius
o o  the two joints of a pair, spacing apart: so do they stand on the effector too
"""
    limbs: ClassVar[tuple[str, ...]] = ("a", "b", "c")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    example: ClassVar[Mapping[str, Any]] = {
        "radius": 204.75,
        "effector_radius": 30,
        "rod": 333,
        "spacing": 50,
    }

    radius: ThreePositiveLengths = Field(
        description="From the machine's axis to the middle of each carriage's two joints: a "
        "firmware's delta radius and the effector_radius together."
    )
    effector_radius: PositiveLength = Field(
        description="From the tool's axis to the middle of each two joints of the effector."
    )
    rod: ThreePositiveLengths = Field(description="Length of the rods, joint to joint.")
    spacing: PositiveLength = Field(description="Distance of the two rods of a pair.")
    angle: ThreeAngles = Field(
        default_factory=lambda: (math.radians(210.0), math.radians(330.0), math.radians(90.0)),
        description="Direction of each tower from x. Default: 210, 330 and 90 degrees.",
    )

    def size(self) -> float:
        """What the rods reach over."""
        return sum(self.radius) / 3.0 - self.effector_radius

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `a`, `b`, `c`; struts `a1`, `a2`, `b1`, ..."""
        for limb, name in enumerate(cls.limbs):
            out, across = outward(values["angle"][limb])
            place = {"origin": values["radius"][limb] * out, "axis": Z}
            yield Row("drive", name, {"kind": "slider"}, place, {"working_mode": "+"})
        for limb, name in enumerate(cls.limbs):
            out, across = outward(values["angle"][limb])
            for number, side in ((1, -0.5), (2, 0.5)):
                aside = side * values["spacing"] * across
                joints = {
                    "base": aside,
                    "platform": values["effector_radius"] * out + aside,
                    "length": values["rod"][limb],
                }
                yield Row("strut", f"{name}{number}", {"drive": name}, joints)
