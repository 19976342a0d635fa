"""Rotary deltas: three cranks, two parallel rods each."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, ClassVar

from pydantic import Field

from truepose.files.quantity import Length, PositiveLength, ThreeAngles, ThreePositiveLengths
from truepose.machine.families._family import MachineFamily, Row, Values, Z, outward


class RotaryDeltaFamily(MachineFamily):
    """Base frame below or on the bed, z up; the tool point is in the plane of its joints."""

    kind: ClassVar[str] = "rotary_delta"
    doc: ClassVar[str] = "Three cranks, two parallel rods each."
    drawing: ClassVar[str] = """\
from above                               from the side, one limb

 b  (150 deg)       a  (30 deg)                    |<-->|  shoulder_radius
    o              o                               :    :  upper_arm
   o  .           .  o                             :    o------------o elbow
        .       .                  shoulder_height :  shoulder      /
          .   .                                    :               / lower_arm
            +                                      :              /
            :  shoulder_radius + upper_arm,   tool +-------------o
            :  at joint coordinate 0               |<----------->|  effector_radius
           o o                              z = 0 -+-
            c  (270 deg)
                                         joint coordinate: 0 as drawn, level; up is positive
o o  the two joints of a pair at the elbows, spacing apart: so do they stand on the effector too
"""
    limbs: ClassVar[tuple[str, ...]] = ("a", "b", "c")
    dof: ClassVar[tuple[str, ...]] = ("x", "y", "z", "a", "b", "c")
    commanded: ClassVar[tuple[str, ...]] = ("x", "y", "z")
    example: ClassVar[Mapping[str, Any]] = {
        "shoulder_radius": 63.9,
        "effector_radius": 30,
        "upper_arm": 170,
        "lower_arm": 320,
        "spacing": 50,
        "shoulder_height": 412.9,
    }

    shoulder_radius: PositiveLength = Field(
        description="From the machine's axis to each shoulder, the axis of a crank."
    )
    effector_radius: PositiveLength = Field(
        description="From the tool's axis to the middle of each two joints of the effector."
    )
    upper_arm: ThreePositiveLengths = Field(description="Length of the cranks, shoulder to elbow.")
    lower_arm: ThreePositiveLengths = Field(description="Length of the rods, joint to joint.")
    spacing: PositiveLength = Field(description="Distance of the two rods of a pair.")
    shoulder_height: Length = Field(description="Height of the shoulders over z = 0.")
    angle: ThreeAngles = Field(
        default_factory=lambda: (math.radians(30.0), math.radians(150.0), math.radians(270.0)),
        description="Direction of each arm from x. Default: 30, 150 and 270 degrees.",
    )

    def size(self) -> float:
        """Both arms."""
        return (sum(self.upper_arm) + sum(self.lower_arm)) / 3.0

    def level(self) -> float:
        """The shoulders."""
        return self.shoulder_height

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """Drives `a`, `b`, `c`; struts `a1`, `a2`, `b1`, ..."""
        for limb, name in enumerate(cls.limbs):
            out, across = outward(values["angle"][limb])
            shoulder = values["shoulder_radius"] * out + values["shoulder_height"] * Z
            place = {"origin": shoulder, "axis": -across}
            yield Row("drive", name, {"kind": "crank"}, place, {"working_mode": "+"})
        for limb, name in enumerate(cls.limbs):
            out, across = outward(values["angle"][limb])
            for number, side in ((1, -0.5), (2, 0.5)):
                aside = side * values["spacing"] * across
                joints = {
                    "base": values["upper_arm"][limb] * out + aside,
                    "platform": values["effector_radius"] * out + aside,
                    "length": values["lower_arm"][limb],
                }
                yield Row("strut", f"{name}{number}", {"drive": name}, joints)
