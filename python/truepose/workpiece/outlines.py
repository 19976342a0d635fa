"""What a stretch of the path is on the drawing: a straight wall, a face, or a circle.

Recognised from the programmed points, which a program rounds; what is further off is refused.
Points are in u v w of `Coordinates`, m.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from truepose.arrays import Floats
from truepose.files.wording import counted
from truepose.spatial import norm
from truepose.workpiece.element import FeatureError
from truepose.workpiece.fits import AnyPlane, CircleInPlane, associate

OFF = 1e-3
"""Of its size: how far programmed points may be off the straight line, plane or circle.

A program's rounding is a thousandth of that; a polygon of 70 sides is no circle any more.
"""

SHORTEST_ARC = np.pi / 3.0
"""An arc of this angle makes 1 um of its points 7.5 um of its radius, 1 / (1 - cos 30 degrees);
of shorter ones the diameter says where the noise is."""

_UPRIGHT = 1e-3
"""Sine of the angle between the working plane's normal and a wall that stands along it."""

_STEEPEST = 0.7
"""Cosine to the working plane's normal, of a line that a wall can be read from."""


@dataclass(frozen=True, eq=False)
class Straight:
    """A wall or a face: its points (n, 3) as they would be without rounding, and `normal` (3,).

    `kind`: "wall" where it stands across the working plane, "face" otherwise. `deep`: driven at
    several depths, so that its points are no line. `off`: how far programmed points are off, m.
    """

    kind: Literal["wall", "face"]
    points: Floats
    normal: Floats
    deep: bool
    off: float

    @property
    def along(self) -> Floats:
        """(3,) unit vector in the working plane along a wall."""
        u, v, _ = self.normal
        return np.array([v, -u, 0.0])

    def ideal(self, programmed: Floats) -> Floats:
        """(n, 3) of the programmed points (n, 3), without rounding."""
        return self.points

    @property
    def length(self) -> float:
        """Of its longest extent, m."""
        return float(np.ptp(self.points, axis=0).max())


@dataclass(frozen=True, eq=False)
class Round:
    """A circle or an arc: `centre` (2,), `radius`, m, `spokes` (n, 2), unit vectors to its points.

    `arc`: the angle that its points cover, rad. `off`: how far programmed points are off, m.
    """

    centre: Floats
    radius: float
    spokes: Floats
    arc: float
    off: float

    def ideal(self, programmed: Floats) -> Floats:
        """(n, 3) of the programmed points (n, 3), without rounding, each at its own depth."""
        return np.column_stack([self.centre + self.radius * self.spokes, programmed[:, 2]])

    def placed(self, points: Floats) -> CircleInPlane:
        """Where to look for the circles through points (s, n, 3): moved as their middles are."""
        middle = self.centre + self.radius * self.spokes.mean(axis=0)
        return CircleInPlane(self.centre + points[..., :2].mean(axis=1) - middle)


def straight(name: str, points: Floats) -> Straight:
    """The wall or face through points (n, 3). Raises `FeatureError`."""
    middle = points.mean(axis=0)
    directions = np.linalg.svd(points - middle, full_matrices=False)[2]
    if len(points) < 3:
        raise too_few(name, len(points), 3, "a straight line")
    extents = np.ptp((points - middle) @ directions.T, axis=0)
    size = extents[0]
    if size <= 0.0:
        raise too_few(name, 1, 3, "a straight line", "all are at one place")
    deep = extents[1] > OFF * size
    normal = directions[2] if deep else np.array([-directions[0, 1], directions[0, 0], 0.0])
    if not deep and abs(directions[0, 2]) > _STEEPEST:
        raise FeatureError(
            "feature-elements",
            f"{name}: a straight line along the tool is no wall",
            found="points above each other",
            expected="a wall driven along the working plane, or a face",
        )
    wall = abs(normal[2]) <= _UPRIGHT * float(np.linalg.norm(normal))
    if wall:
        normal = np.array([normal[0], normal[1], 0.0])
    normal = normal / np.linalg.norm(normal)
    if tuple(np.round(normal[::-1], 9)) < (0.0, 0.0, 0.0):
        normal = -normal
    deviation = (points - middle) @ normal
    deviation -= 0.5 * (deviation.max() + deviation.min())
    off = float(np.abs(deviation).max())
    if off > OFF * size:
        raise FeatureError(
            "feature-elements",
            f"{name}: the programmed points are neither on a straight line nor on a plane",
            found=f"points up to {off * 1e3:.3g} mm off, of {size * 1e3:.4g} mm",
            expected=f"a straight wall or a flat face, to {OFF:g} of its length",
            hint="leave out the lines that lead in and out",
        )
    return Straight(
        "wall" if wall else "face", points - deviation[:, np.newaxis] * normal, normal, deep, off
    )


def circle(name: str, points: Floats, least: int = 4) -> Round:
    """The circle through points (n, 3), of which `least` are needed. Raises `FeatureError`."""
    distinct = len(np.unique(np.round(points[:, :2], 12), axis=0))
    if distinct < least:
        raise too_few(name, distinct, least, "a circle")
    plane = points[np.newaxis]
    first, last = points[0, :2], points[-1, :2]
    start = _through(first, points[distinct // 3, :2], points[2 * distinct // 3, :2], last)
    if start is None:
        raise _no_circle(name, "points on a straight line")
    # Cleared of the start's error first; where the points are no circle the fit may go anywhere.
    with np.errstate(all="ignore"):
        try:
            shape, radii = associate(CircleInPlane(start[np.newaxis]), plane, least_squares=True)
        except np.linalg.LinAlgError:
            raise _no_circle(name, "points on no circle") from None
    radius = float(radii.mean())
    off = float(np.abs(radii - radius).max())
    if not off <= OFF * radius:
        raise _no_circle(
            name, f"points up to {off * 1e3:.3g} mm off a circle of radius {radius * 1e3:.4g} mm"
        )
    spokes = points[:, :2] - shape.centre[0]
    angles = np.sort(np.arctan2(spokes[:, 1], spokes[:, 0]))
    gaps = np.diff(angles, append=angles[0] + 2.0 * np.pi)
    arc = 2.0 * np.pi - float(gaps.max())
    if arc < SHORTEST_ARC:
        raise FeatureError(
            "feature-short-arc",
            f"{name}: too short an arc for a diameter and a centre",
            found=f"an arc of {np.degrees(arc):.3g} degrees",
            expected=f"at least {np.degrees(SHORTEST_ARC):.0f} degrees",
            hint="a shorter arc's shape is that of a profile",
        )
    return Round(shape.centre[0], radius, spokes / norm(spokes)[:, np.newaxis], arc, off)


def outline_of(name: str, points: Floats) -> Straight | Round:
    """The wall, face or circle through points (n, 3). Raises `FeatureError`.

    Points in the working plane that are on a circle are one, and no face.
    """
    outline: Straight | None = None
    try:
        outline = straight(name, points)
    except FeatureError as error:
        if error.code == "feature-too-few-points":
            raise
    if outline is not None and outline.kind == "wall":
        return outline
    try:
        return circle(name, points, least=5)
    except FeatureError as error:
        if outline is None or error.code == "feature-short-arc":
            raise
    plane(name, points)
    return outline


def plane(name: str, points: Floats) -> AnyPlane:
    """The plane through points (n, 3) that are on no line, to be fitted. Raises `FeatureError`."""
    outline = straight(name, points)
    if len(points) < 4:
        raise too_few(name, len(points), 4, "a plane")
    if not outline.deep:
        raise FeatureError(
            "feature-elements",
            f"{name}: the points are on one line, and a plane could turn about it",
            found="one pass",
            expected="two passes or more beside or above each other",
        )
    return AnyPlane(outline.normal[np.newaxis], outline.length)


def too_few(name: str, count: int, least: int, what: str, why: str | None = None) -> FeatureError:
    """That `count` points are too few: a shape goes through any `least` - 1 without deviation."""
    return FeatureError(
        "feature-too-few-points",
        f"{name}: too few points, which {what} always goes through",
        found=counted(count, "point") + (f": {why}" if why else ""),
        expected=f"at least {least} points",
        hint="name more lines of the program, or divide them finer",
    )


def _no_circle(name: str, found: str) -> FeatureError:
    return FeatureError(
        "feature-no-circle",
        f"{name}: the programmed points are no circle",
        found=found,
        expected=f"a circle or an arc in the working plane, to {OFF:g} of its radius",
        hint="leave out the lines that lead in and out",
    )


def _through(*points: Floats) -> Floats | None:
    """(2,) centre of a circle near four points, by the linear equations of their squares."""
    places = np.array(points)
    middle = places.mean(axis=0)
    shifted = places - middle
    size = float(np.abs(shifted).max()) or 1.0
    rows = np.column_stack([2.0 * shifted / size, np.ones(len(points))])
    squares = np.einsum("nc,nc->n", shifted, shifted) / size**2
    solution, _, rank, _ = np.linalg.lstsq(rows, squares, rcond=1e-9)
    return None if rank < 3 else np.asarray(middle + solution[:2] * size)
