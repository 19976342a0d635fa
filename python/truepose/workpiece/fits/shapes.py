"""Shapes that are fitted to points: a plane with one or two turns left, a circle, a contour.

Points are (s, n, 3) in the coordinates u v w of `Coordinates`, m, w along the normal of the working
plane. A shape is linear about where it stands; each step's x is in m, what a point of the nominal
shape moves by, so that the last steps can be judged by one number.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.spatial import cross, norm, rotate_about, tangents


class FittedShape:
    """Where a shape stands, of each sample, and how what is left moves with it.

    `places` names the fields that are of each sample. Where `offset`, one more freedom moves all
    residuals alike, and stands nowhere: the radius of a circle.
    """

    places: ClassVar[tuple[str, ...]]
    offset: ClassVar[bool] = True

    def linearised(self, points: Floats) -> tuple[Floats, Floats]:
        """Columns (k, s, n), without that of the offset, and residuals (s, n), m."""
        raise NotImplementedError

    def moved(self, x: Floats) -> Self:
        """The same shape, moved by x (s, k)."""
        raise NotImplementedError

    def of(self, samples: slice | Indices) -> Self:
        """That of some samples."""
        return self.with_places({name: getattr(self, name)[samples] for name in self.places})

    def joined(self, pieces: Sequence[Self]) -> Self:
        """Pieces of samples that follow each other as one."""
        return self.with_places(
            {
                name: np.concatenate([getattr(piece, name) for piece in pieces])
                for name in self.places
            }
        )

    def with_places(self, values: dict[str, Floats]) -> Self:
        """The same shape with these fields."""
        return replace(self, **values)  # type: ignore[type-var]


@dataclass(frozen=True, eq=False)
class TurnedPlane(FittedShape):
    """A plane whose `normal` (s, 3) may turn about an `axis` (s, 3): of a wall, about w.

    In the working plane it is a line. `length`: of the points, m.
    """

    normal: Floats
    axis: Floats
    length: float
    places: ClassVar[tuple[str, ...]] = ("normal", "axis")

    def linearised(self, points: Floats) -> tuple[Floats, Floats]:
        """By the slope, as what it moves at `length`; the residual is along the normal."""
        across = _along(points, cross(self.axis, self.normal)) / self.length
        return across[np.newaxis], _along(points, self.normal)

    def moved(self, x: Floats) -> TurnedPlane:
        """Turned to that slope."""
        angle = -np.arctan(x / self.length)
        return replace(self, normal=rotate_about(self.normal, self.axis, angle))


@dataclass(frozen=True, eq=False)
class AnyPlane(FittedShape):
    """A plane whose `normal` (s, 3) may turn to any side; `length` of the points, m."""

    normal: Floats
    length: float
    places: ClassVar[tuple[str, ...]] = ("normal",)

    def linearised(self, points: Floats) -> tuple[Floats, Floats]:
        """By two slopes, as what they move at `length`; the residual is along the normal."""
        across = tangents(self.normal)
        columns = [_along(points, across[:, k]) / self.length for k in (0, 1)]
        return np.stack(columns), _along(points, self.normal)

    def moved(self, x: Floats) -> AnyPlane:
        """Tilted to those slopes."""
        across = tangents(self.normal)
        normal = self.normal - np.einsum("sk,skc->sc", x / self.length, across)
        return replace(self, normal=normal / norm(normal)[:, np.newaxis])


@dataclass(frozen=True, eq=False)
class CircleInPlane(FittedShape):
    """A circle in the working plane, `centre` (s, 2); its radius is the offset."""

    centre: Floats
    places: ClassVar[tuple[str, ...]] = ("centre",)

    def linearised(self, points: Floats) -> tuple[Floats, Floats]:
        """By the centre; the residual is the distance from it."""
        spoke = points[..., :2] - self.centre[:, np.newaxis]
        radius = norm(spoke)
        return np.moveaxis(spoke / radius[..., np.newaxis], -1, 0), radius

    def moved(self, x: Floats) -> CircleInPlane:
        """About the next centre."""
        return replace(self, centre=self.centre + x)


@dataclass(frozen=True, eq=False)
class Contour(FittedShape):
    """Points (n, 2) with normals (n, 2), moved as one body in the working plane.

    `free` (k, 3): which motions, along the axes and by the turn, change anything: a circle has a
    turn that does not.
    `turn` (s, 1) and `origin` (s, 2): a point of the contour at y is seen at R y + origin. The
    residual is of each point from its own, along the normal there.
    """

    points: Floats
    normals: Floats
    length: float
    free: Floats
    turn: Floats
    origin: Floats
    places: ClassVar[tuple[str, ...]] = ("turn", "origin")
    offset: ClassVar[bool] = False

    def linearised(self, points: Floats) -> tuple[Floats, Floats]:
        """By the origin, along the contour's own axes, and by the turn."""
        cosine, sine = np.cos(self.turn), np.sin(self.turn)
        u, v = np.moveaxis(points[..., :2] - self.origin[:, np.newaxis], -1, 0)
        seen = np.stack([cosine * u + sine * v, cosine * v - sine * u], axis=-1)
        turned = self.normals[:, 1] * seen[..., 0] - self.normals[:, 0] * seen[..., 1]
        still = np.broadcast_to(self.normals.T[:, np.newaxis], (2, *turned.shape))
        motions = np.concatenate([still, turned[np.newaxis] / self.length])
        columns = np.tensordot(self.free, motions, 1)
        return columns, np.einsum("snc,nc->sn", seen - self.points, self.normals)

    def moved(self, x: Floats) -> Contour:
        """Moved along its own axes, then turned."""
        x = x @ self.free
        cosine, sine = np.cos(self.turn[:, 0]), np.sin(self.turn[:, 0])
        shift = [cosine * x[:, 0] - sine * x[:, 1], sine * x[:, 0] + cosine * x[:, 1]]
        turn = self.turn + x[:, 2:] / self.length
        return replace(self, turn=turn, origin=self.origin + np.stack(shift, axis=-1))


def _along(points: Floats, directions: Floats) -> Floats:
    """(s, n) components of points (s, n, 3) along a direction (s, 3) of each sample."""
    return np.asarray(np.matmul(points, directions[..., np.newaxis])[..., 0])
