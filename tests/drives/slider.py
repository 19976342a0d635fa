"""A carriage on a straight guideway."""

from __future__ import annotations

import math

import numpy as np

from drive_kinds import Row, Vector
from reference_kinematics import tangents, unit


def centre(drive: Row, base: Vector, actual: float) -> Vector:
    """The carriage carries it along the guideway."""
    origin = np.array(drive.get("origin", np.zeros(3)), float)
    return np.asarray(origin + base + actual * unit(drive["axis"]))


def slopes(drive: Row, base: Vector, actual: float) -> dict[str, Vector]:
    """As the carriage goes; a tilt turns the way that it has gone."""
    axis = unit(drive["axis"])
    by_name = dict(zip(("origin.x", "origin.y", "origin.z"), np.eye(3), strict=True))
    by_name |= dict(zip(("axis.u", "axis.v"), actual * tangents(axis), strict=True))
    return by_name | {"offset": axis}


def roots(drive: Row, base: Vector, platform: Vector, length: float) -> list[float]:
    """Where the guideway cuts the sphere about the platform joint."""
    span = platform - centre(drive, base, 0.0)
    along = float(span @ unit(drive["axis"]))
    under = length**2 - span @ span + along**2
    if under < 0:
        return []
    return [along - math.sqrt(under), along + math.sqrt(under)]
