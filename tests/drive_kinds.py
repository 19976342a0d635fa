"""What tests ask of a kind of drive: what the kernel's table says, and the tests' own formulas.

The table is `_kernel.elements()["drive"]`, so that a new kind is known here as it is listed. How it
moves is written out once more in `drives/<kind>.py`, in plain NumPy: the second road of all tests.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from truepose._kernel import elements
from truepose.compensation.remainder_struts import KINDS as WITH_MAJORANT
from truepose.machine import Machine

Vector = NDArray[np.float64]
Row = Mapping[str, Any]
"""A drive of a description (tests/build_machine.py), SI."""

KINDS: dict[str, dict[str, Any]] = {entry["kind"]: entry for entry in elements()["drive"]}


class Formulas(Protocol):
    """What `drives/<kind>.py` says.

    `base` (3,) is the joint centre as the description gives it, m; `actual` is `scale q + offset`,
    m or rad.
    """

    def centre(self, drive: Row, base: Vector, actual: float) -> Vector:
        """(3,) m: the base-side joint centre of a strut."""

    def slopes(self, drive: Row, base: Vector, actual: float) -> dict[str, Vector]:
        """(3,) how the centre moves for a unit of each parameter but the scale, by its name."""

    def roots(self, drive: Row, base: Vector, platform: Vector, length: float) -> list[float]:
        """`actual` at which a strut reaches: [in working mode "-", in "+"], one, or none."""


def formulas(kind: str) -> Formulas:
    """Those of a kind of drive."""
    return cast(Formulas, importlib.import_module(f"drives.{kind}"))


def turns(kind: str) -> bool:
    """Whether the joint coordinate is an angle, and not a length."""
    return kind in KINDS and KINDS[kind]["coordinate"] == "angle"


def is_strut(kind: str) -> bool:
    """Whether the joint coordinate is the strut's length: its base joint stands on the frame."""
    return kind in KINDS and bool(KINDS[kind]["sets_length"])


def has_carriage(kind: str) -> bool:
    """Whether it moves a body along a line: neither the strut itself, nor an arm."""
    return kind in KINDS and not turns(kind) and not is_strut(kind)


def has_majorant(machine: Machine) -> bool:
    """Whether the remainder of compensation knows all parts; of the others nothing is proven."""
    known = all(drive.kind in WITH_MAJORANT for drive in machine.drives)
    return known and not machine.kernel.overconstrained


def fields(dimension: str, *, shape: int | None = None) -> tuple[str, ...]:
    """Keys of all kinds of drives, struts and guides that measure this."""
    every = [
        field["name"]
        for family in elements().values()
        for entry in family
        for field in entry["fields"]
        if field["dimension"] == dimension and shape in (None, field["shape"])
    ]
    return tuple(dict.fromkeys(every))


def fields_of(kind: str) -> list[dict[str, Any]]:
    """Of a kind of drive: name, shape (0 or 3), dimension, default and doc."""
    return list(KINDS[kind]["fields"])


def drive_fields() -> tuple[str, ...]:
    """Keys of all kinds of drive."""
    return tuple(dict.fromkeys(field["name"] for kind in KINDS for field in fields_of(kind)))


def vectors_of(kind: str) -> list[str]:
    """Keys of a drive's points and directions, all in the base frame."""
    return [field["name"] for field in fields_of(kind) if field["shape"] == 3]


def lengths_of(kind: str) -> list[str]:
    """Keys of a drive that measure lengths, its travel among them where that is one."""
    measured = {"length"} | (set() if turns(kind) else {"coordinate"})
    keys = [field["name"] for field in fields_of(kind) if field["dimension"] in measured]
    return keys if turns(kind) else [*keys, "travel"]


def is_place(key: str) -> bool:
    """Whether a drive's vector of this key is a point of the base frame.

    The origin is; every other vector is told from there, and only turns with the machine.
    """
    return key == "origin"


def turned_alike(description: Mapping[str, Any], found: Vector, expected: Vector) -> Vector:
    """(n_joint,) difference, of drives that turn to whole turns."""
    difference = found - expected
    for j, drive in enumerate(description["drives"]):
        if turns(drive["kind"]):
            turn = 2 * np.pi / drive["scale"]
            difference[j] -= turn * np.round(difference[j] / turn)
    return difference
