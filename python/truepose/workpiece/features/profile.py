"""Profile of a contour in the working plane (ISO 1101): how far it is from the drawing anywhere.

The value is twice the largest distance of a point from its place on the drawing, along the
drawing's normal there: the width of the zone about the drawing that just holds the contour. A point
at a corner counts along the normals of both sides. With datums the drawing is where their frame is;
without it lies as it fits best, in the working plane: so that the value is least, or with
"least-squares" by these. A point that moved by t along a rounding of radius R counts as t^2 / (2 R)
off; a round contour, which no fit can turn, does so wherever the part is turned.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from truepose.arrays import Floats, Indices
from truepose.spatial import norm
from truepose.workpiece.features._base import Forms
from truepose.workpiece.features._evaluated import EvaluatedFeature, ZoneTable
from truepose.workpiece.features.position import both_sides
from truepose.workpiece.first_order import FirstOrder
from truepose.workpiece.fits import Contour, associate
from truepose.workpiece.outlines import OFF, too_few

_CORNER = np.radians(20.0)
"""The path turns by more than this at a corner, and by less from point to point of an arc."""


class ContourProfile(EvaluatedFeature):
    """The contour of one element or of several."""

    kind = "profile"
    doc = "form of any contour, with datums its place too"
    table: ClassVar[type[BaseModel]] = ZoneTable
    most_elements = 10_000

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where there are too few points, or datums that are no frame."""
        assert isinstance(row, ZoneTable)
        count = sum(len(np.unique(points[:, :2], axis=0)) for points in self.programmed)
        if count < 4:
            raise too_few(self.name, count, 4, "a contour that may be moved and turned")
        places, normals, first = [], [], 0
        for element, points in zip(self.elements, self.programmed, strict=True):
            place, normal = _normals(points[:, :2], closed=element.closed)
            places.append(place + first)
            normals.append(normal)
            first += len(points)
        self.places = np.concatenate(places)
        self.normals = np.concatenate(normals)
        if self.frame is not None:
            self.frame.require_place(list(np.eye(3)[:2]), self.name)
            operator = "largest deviation along the normal, twice (ISO 1101)"
        else:
            how = "least squares" if self.least_squares else "minimum zone"
            operator = f"largest deviation along the normal, twice (ISO 1101), placed by {how}"
        self.quantities = (self.zone("profile", row.zone, operator),)

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The width of the zone."""
        nominal = np.concatenate(self.programmed)[self.places]
        points = np.concatenate(seen, axis=1)[:, self.places]
        if self.frame is None:
            shape = self._contour(len(points))
            off = associate(shape, points, least_squares=self.least_squares)[1]
        else:
            off = np.einsum("snc,nc->sn", points[..., :2] - nominal[:, :2], self.normals)
        return [2.0 * np.abs(off).max(axis=1)]

    def ideal(self) -> list[Floats]:
        """The programmed points."""
        return self.programmed

    def linear(self, order: FirstOrder) -> list[Forms]:
        """What each point is off along its normal, as the frame or as least squares see it.

        Moved by m = (shift, turn) to first order, |turn| <= W rho, a point is off by at most
        W rho^2 + W^2 X rho^2 more. With least squares m itself is off besides: its equations'
        columns turn by the turn and stretch by a point's deviation, against residuals of V rho.
        """
        normals = np.column_stack([self.normals, np.zeros(len(self.normals))])
        if self.frame is not None:
            return [both_sides(order, self.places, normals)]
        contour = self._contour(1)
        rows = self._motions()
        free = rows @ contour.free.T
        inverse = contour.free.T @ np.linalg.inv(free.T @ free) @ contour.free
        fit = inverse @ rows.T
        across = order.seen_at(self.places, normals)
        kept = np.tensordot(np.eye(len(rows)) - rows @ fit, across, 1)
        sums = np.abs(fit).sum(axis=1)
        farthest = float(norm(np.concatenate(self.programmed)[:, :2]).max())
        turned = 1.1 * float(sums[2]) / contour.length
        off = 1.05 * (1.0 + 1.1 * float(norm(sums[:2])) + turned * farthest)
        bent = turned * off + turned**2 * farthest
        curvature, reach = 2.0 * bent, 0.1 * farthest / off
        if self.least_squares:
            change = (turned + off / contour.length) * len(rows) * off
            moved = sums * bent + np.abs(inverse).sum(axis=1) * change
            curvature += 2.0 * float(np.abs(rows).max(axis=0) @ moved)
            free = moved > 0.0
            reach = min(reach, 0.1 * float((sums[free] / moved[free]).min(initial=math.inf)))
        return [
            order.forms("spread", np.concatenate([kept, -kept]), curvature=curvature, reach=reach)
        ]

    def _contour(self, count: int) -> Contour:
        sizes, motions = np.linalg.svd(self._motions(), full_matrices=False)[1:]
        return Contour(
            self._nominal(),
            self.normals,
            self._length(),
            motions[sizes > OFF * sizes[0]],
            np.zeros((count, 1)),
            np.zeros((count, 2)),
        )

    def _nominal(self) -> Floats:
        return np.concatenate(self.programmed)[self.places, :2]

    def _length(self) -> float:
        return float(np.ptp(self._nominal(), axis=0).max())

    def _motions(self) -> Floats:
        """(n, 3) what a motion along u, along v or by a turn is along the normals."""
        u, v = self._nominal().T
        turned = self.normals[:, 1] * u - self.normals[:, 0] * v
        return np.column_stack([self.normals, turned / self._length()])


def _normals(path: Floats, *, closed: bool) -> tuple[Indices, Floats]:
    """Places of the points (n, 2) that count, and the normal of each: twice at a corner.

    `closed`: from the last point the path goes on to the first, if that is not there twice.
    """
    steps = np.diff(path, axis=0, append=path[:1])
    lengths = norm(steps)
    still = 1e-9 * float(lengths.sum())
    closed = closed or (len(path) > 3 and float(lengths[-1]) <= still)
    moves = np.flatnonzero(lengths[: None if closed else -1] > still)
    directions = steps[moves] / lengths[moves, np.newaxis]
    if not len(moves):
        return np.zeros(0, np.intp), np.zeros((0, 2))
    places: list[int] = []
    tangents: list[Floats] = []
    for place in range(len(path)):
        after = int(np.searchsorted(moves, place))
        before = after - 1
        if closed:
            before, after = before % len(moves), after % len(moves)
        sides = [directions[k] for k in (before, after) if 0 <= k < len(moves)]
        together = sides[0] + sides[-1]
        if len(sides) == 2 and sides[0] @ sides[1] < np.cos(_CORNER):
            places += [place, place]
            tangents += sides
        else:
            places.append(place)
            tangents.append(together / norm(together))
    along = np.array(tangents)
    return np.array(places, np.intp), np.column_stack([along[:, 1], -along[:, 0]])
