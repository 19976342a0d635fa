"""In which units people are answered: those of the machine file, small ones for errors.

A file in millimetres is answered in mm and µm, one in inches in in and µin; one in degrees in ° and
mdeg, one in radians in rad and µrad. The only place where that is decided; files for programs have
the file's units as they are.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.language import marked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from truepose.files.units import FileUnit

INCH = 0.0254
DEGREE = math.pi / 180.0
ICE_POINT = 273.15
KELVIN_OF_FAHRENHEIT = 5.0 / 9.0
MICRO = 1e6
ALIKE = 1e-9
"""Relative difference below which two scales are one unit."""


@dataclass(frozen=True)
class Shown:
    """A unit for people: its `label`, and how many of it are one SI unit."""

    label: str
    per_si: float

    @property
    def decimals(self) -> int:
        """Decimals of a sum of errors: a tenth of a µm, a µin or a µrad, or less."""
        return 1 if self.per_si >= MICRO else 3

    def text(self, value: float, digits: int = 3) -> str:
        """An SI value in this unit, with that, in at least so many significant digits: "1.64 µm".

        Digits before the point are never rounded away.
        """
        scaled = value * self.per_si
        whole = f"{scaled:.0f}"
        short = f"{scaled:.{digits}g}"
        number = whole if len(whole.lstrip("-")) > digits else short
        return f"{marked(number)} {self.label}".rstrip()


MILLIMETRES, MICROMETRES = Shown("mm", 1e3), Shown("µm", 1e6)
INCHES, MICROINCHES = Shown("in", 1.0 / INCH), Shown("µin", 1e6 / INCH)
DEGREES, MILLIDEGREES = Shown("°", 1.0 / DEGREE), Shown("mdeg", 1e3 / DEGREE)
NEWTONS = Shown("N", 1.0)
RADIANS, MICRORADIANS = Shown("rad", 1.0), Shown("µrad", 1e6)
PARTS, MILLIONTHS = Shown("", 1.0), Shown("ppm", 1e6)

_IMPERIAL = (INCH, 12.0 * INCH, 36.0 * INCH, 1e-3 * INCH, 1e-6 * INCH)
"""m: inch, foot, yard, thousandth and millionth of an inch."""
_ANGLES: tuple[tuple[float, Shown, Shown], ...] = (
    (1.0, RADIANS, MICRORADIANS),
    (1e-3, Shown("mrad", 1e3), MICRORADIANS),
    (1e-6, Shown("mrad", 1e3), MICRORADIANS),
    (DEGREE / 60.0, DEGREES, Shown("arcsec", 3600.0 / DEGREE)),
    (DEGREE / 3600.0, DEGREES, Shown("arcsec", 3600.0 / DEGREE)),
    (math.pi / 200.0, Shown("gon", 200.0 / math.pi), Shown("mgon", 2e5 / math.pi)),
)
"""Angles that a file may declare, rad, beside degrees: the units of poses and of errors."""


@dataclass(frozen=True)
class ShownUnits:
    """Units of one machine: of poses and dimensions (`length`, `angle`), and of errors (small)."""

    length: Shown = MILLIMETRES
    angle: Shown = DEGREES
    small_length: Shown = MICROMETRES
    small_angle: Shown = MILLIDEGREES
    force: Shown = NEWTONS
    fahrenheit: bool = False

    def errors(self, values: ArrayLike, names: Sequence[str]) -> Floats:
        """Errors (..., n_name), SI, each component in its unit."""
        return np.asarray(values, np.float64) * [self.error(name).per_si for name in names]

    def temperature(self, kelvin: ArrayLike) -> Floats:
        """Temperatures, K, any shape, on the scale of the file: °C or °F."""
        celsius = np.asarray(kelvin, np.float64) - ICE_POINT
        return celsius * 1.8 + 32.0 if self.fahrenheit else celsius

    def declaring(self, units: Mapping[str, FileUnit]) -> ShownUnits:
        """The same where another file declares other units of lengths and angles."""
        other = shown_units(units)
        lengths = other if "length" in units else self
        angles = other if "angle" in units else self
        return replace(
            self,
            length=lengths.length,
            small_length=lengths.small_length,
            angle=angles.angle,
            small_angle=angles.small_angle,
        )

    @property
    def least_dimension(self) -> float:
        """M, from which on a sentence says a length in `length`: 0.1 mm, or 0.01 in."""
        return 0.01 * INCH if self.length == INCHES else 1e-4

    @property
    def degree(self) -> str:
        """The unit of `temperature`."""
        return "°F" if self.fahrenheit else "°C"

    def pose(self, coordinate: str) -> Shown:
        """Of a coordinate of a pose, x y z a b c."""
        return self.length if coordinate in ("x", "y", "z") else self.angle

    def error(self, name: str) -> Shown:
        """Of a component of an error, x y z rx ry rz, or of "position" and "orientation"."""
        return self.small_length if name in ("x", "y", "z", "position") else self.small_angle

    def of(self, si: str) -> Shown:
        """Of a dimension in SI units "m", "rad" or "1"."""
        return {"m": self.length, "rad": self.angle}.get(si, PARTS)

    def small(self, si: str) -> Shown:
        """Of a deviation of such a dimension; of ratios in millionths."""
        return {"m": self.small_length, "rad": self.small_angle}.get(si, MILLIONTHS)


def shown_units(declared: Mapping[str, FileUnit]) -> ShownUnits:
    """The units for a file that declares these, by dimension; without any mm and degrees."""
    length, small_length = MILLIMETRES, MICROMETRES
    if "length" in declared and _is_one_of(declared["length"].scale, _IMPERIAL):
        length, small_length = INCHES, MICROINCHES
    angle, small_angle = DEGREES, MILLIDEGREES
    if "angle" in declared:
        for scale, coarse, fine in _ANGLES:
            if _is_one_of(declared["angle"].scale, (scale,)):
                angle, small_angle = coarse, fine
    force, temperature = declared.get("force"), declared.get("temperature")
    return ShownUnits(
        length,
        angle,
        small_length,
        small_angle,
        NEWTONS if force is None else Shown(force.label, 1.0 / force.scale),
        temperature is not None and _is_one_of(temperature.scale, (KELVIN_OF_FAHRENHEIT,)),
    )


def _is_one_of(scale: float, scales: tuple[float, ...]) -> bool:
    return any(math.isclose(scale, usual, rel_tol=ALIKE) for usual in scales)


METRIC = ShownUnits()
"""Millimetres and degrees."""

__all__ = ["METRIC", "Shown", "ShownUnits", "shown_units"]
