"""What an instrument can observe of a machine at a pose; the kernel knows each by its number here.

x y z           the target point in the instrument's frame, m
a b c           the platform's angles in that frame, R = Rz(c) Ry(b) Rx(a), rad
distance        from the frame's origin to the target point, m
length          of a strut, between its joint centres, m
direction.*     of a strut, from its base to its platform joint: a unit vector in the frame
angle           by which a strut's direction is turned about an axis from a zero direction, rad
separation      distance between the places of the target point at two poses, m
parameter.*     a parameter of the machine itself, measured without it: m, rad or a plain number
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags

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
    "separation",
    "parameter.length",
    "parameter.angle",
    "parameter.ratio",
)
"""Names by number."""

UNITS = ("m",) * 3 + ("rad",) * 3 + ("m",) * 2 + ("1",) * 3 + ("rad",) + ("m",) * 2 + ("rad", "1")
"""SI unit of each."""

OF_STRUTS = frozenset(OBSERVABLES[7:12])
"""Those that are of one strut."""

OF_PARAMETERS = {"m": OBSERVABLES[13], "rad": OBSERVABLES[14], "1": OBSERVABLES[15]}
"""Those that are of one parameter, by its unit."""


def is_parameter(observable: ArrayLike) -> Flags:
    """Whether observables, by number, are of a parameter; the shape as given."""
    flags: Flags = np.asarray(observable) >= OBSERVABLES.index(OF_PARAMETERS["m"])
    return flags


def column_name(machine: Machine, observable: int, strut: int) -> str:
    """What a reading's column is called: "x", "strut.a1.length", "parameter.strut.a1.length".

    `strut`: which strut or, of a parameter, which parameter.
    """
    name = OBSERVABLES[observable]
    if name in OF_STRUTS:
        return f"strut.{machine.struts[strut].name}.{name}"
    return parameter_column(machine.parameters[strut]) if is_parameter(observable) else name


def parameter_column(name: str) -> str:
    """The column of measured values of a parameter, or of what a group of tolerances moves."""
    return f"parameter.{name}"


def si_unit(observable: str) -> str:
    """SI unit of an observable, by its name."""
    return UNITS[OBSERVABLES.index(observable)]
