"""What an instrument can observe of a machine at a pose; the kernel knows each by its number here.

x y z           the target point in the instrument's frame, m
a b c           the platform's angles in that frame, R = Rz(c) Ry(b) Rx(a), rad
distance        from the frame's origin to the target point, m
length          of a strut, between its joint centres, m
direction.*     of a strut, from its base to its platform joint: a unit vector in the frame
angle           by which a strut's direction is turned about an axis from a zero direction, rad
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from truepose.machine import Machine

OBSERVABLES = (
    "x",
    "y",
    "z",
    "a",
    "b",
    "c",
    "distance",
    "length",
    "direction.x",
    "direction.y",
    "direction.z",
    "angle",
)
"""Names by number."""

UNITS = ("m",) * 3 + ("rad",) * 3 + ("m",) * 2 + ("1",) * 3 + ("rad",)
"""SI unit of each."""

OF_STRUTS = frozenset(OBSERVABLES[7:])
"""Those that are of one strut."""


def column_name(machine: Machine, observable: int, strut: int) -> str:
    """What a reading's column is called: "x", "strut.a1.length"."""
    name = OBSERVABLES[observable]
    return f"strut.{machine.struts[strut].name}.{name}" if name in OF_STRUTS else name


def si_unit(observable: str) -> str:
    """SI unit of an observable, by its name."""
    return UNITS[OBSERVABLES.index(observable)]
