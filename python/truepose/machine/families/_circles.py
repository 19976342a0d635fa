"""What families of joints on circles have in common: radii, pairs of joints, drives, planes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from pydantic import Field

from truepose.files.quantity import PositiveLength
from truepose.machine.families._family import MachineFamily, Row, Values, outward

PAIRS_BELOW = ((30.0, 1), (150.0, -1), (150.0, 1), (270.0, -1), (270.0, 1), (30.0, -1))
PAIRS_ABOVE = ((90.0, -1), (90.0, 1), (210.0, -1), (210.0, 1), (330.0, -1), (330.0, 1))
"""Of six struts, where strut n goes from the n-th of the base to the n-th of the platform: the
middle of its pair, degrees from x, and its side of it."""


THIRDS: tuple[Any, ...] = tuple(np.radians((90.0, 210.0, 330.0)))
"""Of three limbs, rad from x."""


class TwoCircles(MachineFamily):
    """Base joints on one circle, platform joints on another."""

    base_radius: PositiveLength = Field(description="Radius of the circle of base joints.")
    platform_radius: PositiveLength = Field(description="Radius of the circle of platform joints.")

    def size(self) -> float:
        """The base."""
        return self.base_radius


def telescopic_drives(struts: tuple[str, ...]) -> Iterator[Row]:
    """A drive for each strut: `d1` sets the length of strut `1`."""
    for name in struts:
        yield Row("drive", f"d{name}", {"kind": "telescopic"}, {})


def struts_outward(struts: tuple[str, ...], values: Values) -> Iterator[Row]:
    """Three telescopic struts, each with both joints in one direction from the middle."""
    for name, angle in zip(struts, THIRDS, strict=True):
        out, _ = outward(angle)
        joints = {
            "base": values["base_radius"] * out,
            "platform": values["platform_radius"] * out,
        }
        yield Row("strut", name, {"drive": f"d{name}"}, joints)


def planes_of_swing(limbs: tuple[str, ...], values: Values) -> Iterator[Row]:
    """Guides `g1` to `g3`: each platform joint stays in the plane of its limb and the axis."""
    for name, angle in zip(limbs, THIRDS, strict=True):
        out, across = outward(angle)
        plane = {"normal": across, "platform": values["platform_radius"] * out}
        yield Row("guide", f"g{name}", {"kind": "plane"}, plane)
