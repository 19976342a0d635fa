"""The dimensions that a machine file's quantities have, and the SI unit of each.

The one table that units, field types, documentation and JSON schema are made from. It says nothing
of how units are written: that is `units.py`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Dimension:
    """One kind of quantity: its key under `[units]`, its name in a sentence, its SI unit."""

    name: str
    phrase: str
    plural: str
    si: str
    example: str


_ALL = (
    Dimension("length", "a length", "lengths", "m", "12.5 mm"),
    Dimension("angle", "an angle", "angles", "rad", "30 deg"),
    Dimension("force", "a force", "forces", "N", "1.2 kN"),
    Dimension("moment", "a moment", "moments", "N m", "3 N m"),
    Dimension("temperature", "a temperature", "temperatures", "K", "35 degC"),
    Dimension(
        "temperature_difference",
        "a temperature difference",
        "temperature differences",
        "K",
        "2 K",
    ),
    Dimension("area", "an area", "areas", "m^2", "28.3 mm^2"),
    Dimension("stress", "a stress", "stresses", "Pa", "210 GPa"),
    Dimension("stiffness", "a stiffness", "stiffnesses", "N/m", "50 N/um"),
    Dimension(
        "expansion", "an expansion coefficient", "expansion coefficients", "1/K", "1.1e-5 1/K"
    ),
    Dimension("mass", "a mass", "masses", "kg", "12 kg"),
    Dimension("time", "a time", "times", "s", "1800 s"),
    Dimension("acceleration", "an acceleration", "accelerations", "m/s^2", "9.81 m/s^2"),
    Dimension(
        "temperature_gradient",
        "a temperature gradient",
        "temperature gradients",
        "K/m",
        "2 K/m",
    ),
    Dimension(
        "torsional_stiffness",
        "a torsional stiffness",
        "torsional stiffnesses",
        "N m/rad",
        "12 kN m/rad",
    ),
    Dimension(
        "second_moment",
        "a second moment of area",
        "second moments of area",
        "m^4",
        "2.1e6 mm^4",
    ),
    Dimension("ratio", "a plain number", "plain numbers", "1", "1.0"),
)

DIMENSIONS: dict[str, Dimension] = {dimension.name: dimension for dimension in _ALL}

BY_UNIT = {"m": "length", "rad": "angle", "1": "ratio"}
"""Dimension of a kernel parameter, from the unit that the kernel states for it."""

FREEDOMS: dict[str, str] = {
    "x": "length",
    "y": "length",
    "z": "length",
    "a": "angle",
    "b": "angle",
    "c": "angle",
}
"""The freedoms that a platform may have, in order, with the dimension of each."""
