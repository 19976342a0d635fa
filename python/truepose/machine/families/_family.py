"""What a family is: a machine's shape as a function of a few parameters.

A family is a file with one class, its parameters as pydantic fields, and a line in `REGISTRY`. All
is in SI. `rows` is plain NumPy on real or complex numbers without a branch on a value, so that its
derivatives are exact by a complex step (J. N. Lyness, C. B. Moler, Numerical differentiation of
analytic functions, SIAM J. Numer. Anal. 4 (1967) 202-210).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import NDArray

from truepose.arrays import Floats
from truepose.files.file_table import FileTable

Numbers: TypeAlias = NDArray[Any]
"""Real or complex."""

Values: TypeAlias = Mapping[str, Numbers]
"""Parameter -> its value () or, of one that each limb has its own of, (n_limb,); m, rad."""

X, Y, Z = np.eye(3)

_NOTHING = 1e-15
"""Relative to the largest component: what rounding leaves of the sine of half a turn."""


@dataclass(frozen=True)
class Row:
    """One drive, strut or guide of a machine of a family.

    `words`, such as the kind of a drive, and `numbers`, () or (3,), m, rad or a unit vector, are
    its geometry. `defaults` are what a file may say otherwise.
    """

    table: str
    name: str
    words: Mapping[str, str]
    numbers: Mapping[str, Numbers]
    defaults: Mapping[str, str] = field(default_factory=dict)


class MachineFamily(FileTable):
    """A family of machines; an instance is one of them, in SI."""

    kind: ClassVar[str]
    """The word of `[family] kind`, and of the library's machine of the family."""
    doc: ClassVar[str]
    drawing: ClassVar[str]
    """What the parameters measure, as characters."""
    limbs: ClassVar[tuple[str, ...]]
    """Names of the limbs, for parameters that each may have its own of."""
    dof: ClassVar[tuple[str, ...]]
    commanded: ClassVar[tuple[str, ...]]
    example: ClassVar[Mapping[str, Any]]
    """The parameters of the library's machine of the family, as a file in its units has them."""

    @classmethod
    def rows(cls, values: Values) -> Iterator[Row]:
        """The machine's rows, in their order."""
        raise NotImplementedError

    def size(self) -> float:
        """m, with which the workspace goes: half as large a machine has half of it."""
        raise NotImplementedError

    def level(self) -> float:
        """Height in m from which the workspace is told."""
        return 0.0

    def home(self) -> Mapping[str, float]:
        """Home by freedom, m and rad, where it follows from a parameter."""
        return {}

    def real_rows(self) -> list[Row]:
        """The machine's rows as they are, real and without rounding of what is nothing."""
        rows = type(self).rows(self.values())
        return [
            replace(row, numbers={key: _clean(value) for key, value in row.numbers.items()})
            for row in rows
        ]

    def values(self) -> dict[str, Numbers]:
        """The value of every parameter that has one, () or (n_limb,)."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: np.asarray(value) for name, value in given.items() if value is not None}


def _clean(value: Numbers) -> Floats:
    numbers: Floats = np.asarray(value, np.float64)
    return np.where(np.abs(numbers) <= _NOTHING * np.abs(numbers).max(), 0.0, numbers)


def between(middle: float, side: float, angle: Numbers) -> Numbers:
    """The direction (3,) of one of two points `angle` apart, on its side of their middle, deg."""
    return outward(math.radians(middle) + 0.5 * side * angle)[0]


def outward(angle: Numbers) -> tuple[Numbers, Numbers]:
    """Unit vectors (3,) in the base plane at an angle, rad, from x: outward, and across to it."""
    cosine, sine, zero = np.cos(angle), np.sin(angle), 0.0 * angle
    return np.array([cosine, sine, zero]), np.array([-sine, cosine, zero])
