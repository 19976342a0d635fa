"""The library's machines that are of a family, told by its parameters instead of joint centres."""

from __future__ import annotations

import math
from typing import Any

from build_machine import MACHINES
from machine_file import File, Row, file_at, rows_of
from truepose.machine.families import REGISTRY

GEOMETRY = {
    "drive": ("kind", "origin", "axis", "working_mode"),
    "strut": ("drive", "base", "platform", "length", "ring_radius", "ring_axis"),
    "guide": ("kind", "origin", "normal", "axis", "platform", "base_axis", "platform_axis"),
}
"""Keys that a family gives, by table."""

LENGTHS = ("origin", "base", "platform", "length", "ring_radius")
DIRECTIONS = ("axis", "normal", "ring_axis", "base_axis", "platform_axis")


def _polar(row: Row, key: str) -> tuple[float, float]:
    """Radius and angle, deg, of a point of the file in the base plane."""
    x, y, _ = row[key]
    return math.hypot(x, y), math.degrees(math.atan2(y, x))


def _linear_delta(file: File) -> File:
    """A calibrated machine: three radii, angles and rods, which are those of its drives."""
    polar = [_polar(drive, "origin") for drive in file["drive"]]
    return {
        "radius": [radius for radius, _ in polar],
        "angle": [angle for _, angle in polar],
        "rod": [strut["length"] for strut in file["strut"][::2]],
        "effector_radius": 30,
        "spacing": 50,
    }


def _rotary_delta(file: File) -> File:
    return {
        "shoulder_radius": 63.9,
        "shoulder_height": 412.9,
        "upper_arm": 170,
        "lower_arm": [strut["length"] for strut in file["strut"][::2]],
        "effector_radius": 30,
        "spacing": 50,
    }


OF_KIND = {"linear_delta": _linear_delta, "rotary_delta": _rotary_delta}
"""Kinds whose library machine is calibrated: what its file says of each limb by itself."""


def library_file(kind: str) -> File:
    """The library's machine of a kind, as it is written by hand."""
    return file_at(MACHINES / f"{kind}.toml")


def family_of(kind: str) -> File:
    """`[family]` of the library's machine, in its file's units."""
    family = next(family for family in REGISTRY if family.kind == kind)
    own = OF_KIND[kind](library_file(kind)) if kind in OF_KIND else family.example
    return {"kind": kind, **own}


def family_file(kind: str, **changed: Any) -> File:
    """The library's machine with `[family]` in place of all that follows from it."""
    file = library_file(kind)
    for table, keys in GEOMETRY.items():
        for row in rows_of(file, table):
            for key in keys:
                row.pop(key, None)
    for key in ("dof", "commanded"):
        file["machine"].pop(key, None)
    family = family_of(kind) | changed
    if "height" in family:
        file["workspace"].pop("home")
    return {**file, "family": family}


KINDS = tuple(family.kind for family in REGISTRY)
