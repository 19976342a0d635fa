"""What a controller's own model of the machine is: some numbers, and the joints they lead to.

An adapter states it, with its controller's equations and homing; `truepose.controllers._fit` finds
the numbers and judges them. `values` are the model's numbers in SI, free of each other: what can be
written in two ways (a length and its trims) is one number here, and how it is split is stated where
it is printed. `printed` are the numbers as they stand in the controller's file, rounded.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from truepose.arrays import Floats
from truepose.files.units import UnitSystem, default_units
from truepose.machine import Machine

MM = 1e-3

Printed = Mapping[str, str]
"""Numbers as the controller reads them: its own words -> rounded text, in its own units."""


INSTEAD = "a corrected program, the pose map or a kinematics module takes it"
"""What a machine that an adapter refuses can be given instead: the hint of the refusal."""


@dataclass(frozen=True)
class Parameter:
    """A number of a controller's model.

    `name`: for people. `start`: of the nominal machine, SI. `size`: by how much it would have to
    change to move the tool by about one metre; it weighs numbers of different units.
    """

    name: str
    start: float
    size: float = 1.0


class SmallModel(Protocol):
    """A controller's model of one machine."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """What can be fitted."""
        ...

    @property
    def switches(self) -> Floats:
        """(n_joint,) joint coordinates, m or rad, in the machine's order, where they trip."""
        ...

    def joints(self, values: Floats, poses: Floats) -> Floats:
        """(n, n_joint) where the controller drives the machine's joints for `poses`.

        `values` (n_parameter,), `poses` (n, n_commanded), SI; the controller's inverse kinematics,
        and its homing, which says how its joints and the machine's belong together. NaN where the
        model does not reach.
        """
        ...

    def format(self, values: Floats) -> Printed:
        """The numbers to be written, rounded as they will stand there."""
        ...

    def parse(self, printed: Printed) -> Floats:
        """(n_parameter,) what the controller makes of the numbers written: `printed` undone."""
        ...


def value(machine: Machine, name: str) -> float:
    """The nominal value of a parameter, SI."""
    return float(machine.nominal[machine.parameters.index(name)])


def vector(machine: Machine, name: str) -> Floats:
    """(3,) nominal values of three parameters: `name`.x, y, z."""
    return np.array([value(machine, f"{name}.{axis}") for axis in "xyz"])


def scales(machine: Machine) -> Floats:
    """(n_joint,) true travel, as a controller counts it, for each of a joint coordinate: nominal.

    A deviation of it is none of the controller's numbers: it is left over.
    """
    return np.array([value(machine, f"{drive.part}.scale") for drive in machine.drives])


def in_file_units(machine: Machine, value: float, dimension: str) -> str:
    """A quantity given in SI, in the unit that the machine file has for it, with that unit."""
    unit = (default_units() | dict(machine.file_units))[dimension]
    return f"{float(unit.to_file(np.float64(value))):.6g} {unit.label}"


def more_decimals(size: float, usual: float) -> int:
    """Decimals to add where `size` is shorter than what the usual ones are meant for."""
    return max(0, math.ceil(math.log10(usual / size)))


def fixed(value: float, digits: int) -> str:
    """A number with `digits` decimals, without an exponent and without a negative zero."""
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if not text.strip("-0.") else text


def ascii_only(text: str) -> str:
    """Text for a comment in a controller's file: one line of ASCII, as the oldest of them wants."""
    plain = text.replace("µ", "u").replace("°", " deg")
    return " ".join(plain.encode("ascii", "replace").decode("ascii").split())


def quantities(machine: Machine, text: str, dimension: str) -> list[float]:
    """The quantities, SI, of a text with commas between them, in the units of the machine file.

    Raises `truepose.errors.ReadingError`.
    """
    units = UnitSystem(machine.file_units)
    return [units.read(part.strip(), dimension) for part in text.split(",")]


def stem(machine: Machine) -> str:
    """The machine file's name without its ending, with which the names of files begin.

    In letters, digits, points and dashes that every system and shell takes as they are.
    """
    plain = re.sub(r"[^A-Za-z0-9.-]+", "_", Path(machine.file).stem)
    return plain.strip("_.-") or "machine"


__all__ = [
    "INSTEAD",
    "MM",
    "Parameter",
    "Printed",
    "SmallModel",
    "ascii_only",
    "fixed",
    "in_file_units",
    "more_decimals",
    "quantities",
    "scales",
    "stem",
    "value",
    "vector",
]
