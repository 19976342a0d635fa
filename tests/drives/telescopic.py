"""A strut whose length is the joint coordinate: its base joint stands on the frame."""

from __future__ import annotations

import numpy as np

from drive_kinds import Row, Vector


def centre(drive: Row, base: Vector, actual: float) -> Vector:
    """Where the file says."""
    return base


def slopes(drive: Row, base: Vector, actual: float) -> dict[str, Vector]:
    """Its offset is a length: nothing moves the joint."""
    return {}


def roots(drive: Row, base: Vector, platform: Vector, length: float) -> list[float]:
    """The distance of the joints; `length` is none of its own."""
    return [float(np.linalg.norm(platform - base))]
