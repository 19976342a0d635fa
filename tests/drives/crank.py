"""An arm that turns about a fixed axis."""

from __future__ import annotations

import math

import numpy as np

from drive_kinds import Row, Vector
from reference_kinematics import tangents, turned_about, unit


def _origin(drive: Row) -> Vector:
    return np.array(drive.get("origin", np.zeros(3)), float)


def centre(drive: Row, base: Vector, actual: float) -> Vector:
    """At the end of the arm, which is `base` at angle 0."""
    return np.asarray(_origin(drive) + turned_about(unit(drive["axis"]), actual) @ base)


def slopes(drive: Row, base: Vector, actual: float) -> dict[str, Vector]:
    """Across the arm; a tilt changes Rodrigues' formula by its axis, which stays a unit vector."""
    axis = unit(drive["axis"])

    def tilted(way: Vector) -> Vector:
        return np.asarray(
            np.sin(actual) * np.cross(way, base)
            + (1 - np.cos(actual)) * (way * (axis @ base) + axis * (way @ base))
        )

    by_name = dict(zip(("origin.x", "origin.y", "origin.z"), np.eye(3), strict=True))
    by_name |= dict(zip(("axis.u", "axis.v"), map(tilted, tangents(axis)), strict=True))
    return by_name | {"offset": np.cross(axis, centre(drive, base, actual) - _origin(drive))}


def roots(drive: Row, base: Vector, platform: Vector, length: float) -> list[float]:
    """The law of cosines in the plane of the arm's circle."""
    axis, span = unit(drive["axis"]), platform - _origin(drive)
    arm, reach = base - (base @ axis) * axis, span - (span @ axis) * axis
    cosine = (span @ span + base @ base - length**2) / 2
    cosine = (cosine - (span @ axis) * (base @ axis)) / (
        np.linalg.norm(arm) * np.linalg.norm(reach)
    )
    if abs(cosine) > 1:
        return []
    towards = math.atan2(float(np.cross(arm, reach) @ axis), float(arm @ reach))
    return [towards - math.acos(cosine), towards + math.acos(cosine)]
