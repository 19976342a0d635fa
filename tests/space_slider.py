"""A point on three struts with carriages in space: a machine file, and trilateration by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LENGTH = 0.4
ORIGINS = np.array([[0.2, -0.1, 0.0], [-0.2, -0.1, 0.0], [0.0, 0.25, 0.02]])
AXES = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])

_DRIVE = """\
[[drive]]
name = "d{i}"
kind = "slider"
origin = {origin}
axis = {axis}
travel = [0, 500]
working_mode = "+"
"""
_STRUT = """\
[[strut]]
name = "{i}"
drive = "d{i}"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 400
"""

SPACE = (
    """\
schema = 1
[machine]
name = "three carriages"
dof = ["x", "y", "z"]
[units]
length = "mm"
angle = "deg"
[workspace]
grid = { x = [-60, 50, 3], y = [-50, 40, 3], z = [-100, 60, 2] }
"""
    + "".join(
        _DRIVE.format(i=i, origin=(1e3 * origin).tolist(), axis=axis.tolist())
        for i, (origin, axis) in enumerate(zip(ORIGINS, AXES, strict=True), start=1)
    )
    + "".join(_STRUT.format(i=i) for i in range(1, 4))
)


def carriages(joints: Floats) -> Floats:
    """(n, 3, 3) places of the carriages at `joints` (n, 3), m."""
    placed: Floats = ORIGINS + joints[:, :, np.newaxis] * AXES
    return placed


def tool(centres: Floats, near: Floats) -> Floats:
    """(n, 3) where spheres of the struts' length about `centres` (n, 3, 3) meet, m.

    Of the two points, the one next to `near` (n, 3).
    """
    first, second = centres[:, 1] - centres[:, 0], centres[:, 2] - centres[:, 0]
    apart = np.linalg.norm(first, axis=1, keepdims=True)
    ahead = first / apart
    over = (ahead * second).sum(axis=1, keepdims=True)
    aside = second - over * ahead
    up = np.linalg.norm(aside, axis=1, keepdims=True)
    aside = aside / up
    x = apart / 2
    y = (over**2 + up**2 - 2 * over * x) / (2 * up)
    z = np.sqrt(LENGTH**2 - x**2 - y**2)
    foot = centres[:, 0] + x * ahead + y * aside
    points = [foot + side * z * np.cross(ahead, aside) for side in (1.0, -1.0)]
    away = [np.linalg.norm(point - near, axis=1) for point in points]
    return np.where((away[0] < away[1])[:, np.newaxis], *points)
