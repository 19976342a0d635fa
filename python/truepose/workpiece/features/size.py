"""Size: the width between two opposite parallel walls, of a slot or of a web (ISO 14405-1).

Local sizes go across the walls, along the normal that both have in common by least squares, from
each point to the one opposite to it on the drawing, on the line between two points where none is.
The smallest and the largest must be within the limits; with "least-squares" it is one size, the
distance of the two walls with that normal. Walls are looked at in the working plane.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from truepose.arrays import Floats, Indices
from truepose.files.file_table import FileTable
from truepose.files.quantity import PositiveLength
from truepose.files.size_limits import LengthLimits
from truepose.workpiece.element import FeatureError
from truepose.workpiece.features._base import Forms
from truepose.workpiece.features._evaluated import LIMITS, SIDE, EvaluatedFeature, Side
from truepose.workpiece.first_order import FirstOrder, Straightened
from truepose.workpiece.outlines import OFF, straight


class SizeTable(FileTable):
    """Keys of a feature of kind size."""

    nominal: PositiveLength = Field(description="The width that the drawing asks for.")
    tolerance: LengthLimits = Field(description=LIMITS)
    side: Side = Field(None, description=SIDE)


class Size(EvaluatedFeature):
    """The width between two walls."""

    kind = "size"
    doc = "width between two opposite parallel walls"
    table: ClassVar[type[BaseModel]] = SizeTable
    most_elements = 2
    takes_datums = False

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the elements are no walls, not parallel or not opposite."""
        assert isinstance(row, SizeTable)
        walls = [
            straight(element.name, points)
            for element, points in zip(self.elements, self.programmed, strict=True)
        ]
        for element, wall in zip(self.elements, walls, strict=True):
            if wall.kind != "wall":
                raise FeatureError(
                    "feature-elements",
                    f"{element.name}: a size is between walls that stand across the working plane",
                    found="a face",
                    expected="two walls",
                )
        angle = abs(float(walls[0].normal @ walls[1].along))
        if angle > OFF:
            raise FeatureError(
                "feature-direction",
                f"{self.name}: the two walls are not parallel",
                found=f"walls at {np.degrees(np.arcsin(min(angle, 1.0))):.3g} degrees",
                expected=f"parallel walls, to {OFF:g}",
            )
        turn = _turn(self.programmed, walls[0].along, walls[0].normal)
        cosine, sine = float(np.cos(turn)), float(np.sin(turn))
        self.along = cosine * walls[0].along + sine * walls[0].normal
        self.normal = cosine * walls[0].normal - sine * walls[0].along
        places = [float((points @ self.normal).mean()) for points in self.programmed]
        if places[0] < places[1]:
            self.normal = -self.normal
        self._ideal = [
            points - np.outer((points - points.mean(axis=0)) @ self.normal, self.normal)
            for points in self.programmed
        ]
        self.width = abs(places[0] - places[1])
        self._pair()
        self._shift = self.surface(row.side, "the walls are")
        suffixes = {
            ", smallest": "two-point size (ISO 14405-1), smallest",
            ", largest": "two-point size (ISO 14405-1), largest",
        }
        if self.least_squares:
            suffixes = {"": "global least-squares size (ISO 14405-1)"}
        self.quantities = tuple(self.size("size", row.nominal, row.tolerance, suffixes))

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The smallest and the largest local size, or the one of least squares."""
        angle = _turn(seen, self.along, self.normal)
        normal = np.cos(angle)[:, np.newaxis] * self.normal
        normal = normal - np.sin(angle)[:, np.newaxis] * self.along
        first, second = (np.matmul(points, normal[..., np.newaxis])[..., 0] for points in seen)
        if self.least_squares:
            return [first.mean(axis=1) - second.mean(axis=1) + self._shift]
        (to_second, share), (to_first, other_share) = self._pairs
        local = np.concatenate(
            [
                first[:, to_second[:, 0]] - _between(second, to_second, share),
                _between(first, to_first, other_share) - second[:, to_first[:, 0]],
            ],
            axis=1,
        )
        return [local.min(axis=1) + self._shift, local.max(axis=1) + self._shift]

    def ideal(self) -> list[Floats]:
        """Two parallel walls."""
        return self._ideal

    def linear(self, order: FirstOrder) -> list[Forms]:
        """Local sizes along the drawing's normal.

        A pair's points are off each other by D n + h with |h| <= 2 rho, and the normal turns by an
        angle a of at most 1.02 k rho (`Straightened`): it adds D (1 - cos a) + 2 rho |a|. Of least
        squares, the middles of the walls may be apart along them too, which the turn itself makes
        a part of the size.
        """
        centred = [points - points.mean(axis=0) for points in self._ideal]
        fit = Straightened.of((np.concatenate(centred) @ self.along)[:, np.newaxis])
        turned = 1.02 * fit.steep
        curvature = 0.5 * self.width * turned**2 + 2.0 * turned
        sizes = self._pair_forms()
        if self.least_squares:
            middles = [points.mean(axis=0) for points in self._ideal]
            apart = float((middles[0] - middles[1]) @ self.along)
            sizes -= apart * fit.slopes[:, :, np.newaxis] * self.normal
            curvature += abs(apart) * fit.bend()
        base = self.width + self._shift
        return [
            order.forms(
                "between",
                sizes,
                base,
                curvature=curvature,
                side=side,
                reach=fit.reach(),
            )
            for side in ((1,) if self.least_squares else (-1, 1))
        ]

    def _pair_forms(self) -> Floats:
        """(K, N, 3) of each local size, or of the one of least squares."""
        count, other = map(len, self._ideal)
        if self.least_squares:
            scalar = np.concatenate([np.full(count, 1.0 / count), np.full(other, -1.0 / other)])
            return np.asarray(scalar[np.newaxis, :, np.newaxis] * self.normal)
        (to_second, share), (to_first, other_share) = self._pairs
        scalars = np.zeros((len(to_second) + len(to_first), count + other))
        rows = np.arange(len(scalars))
        for first, pairs, part, own, opposite, sign in (
            (0, to_second, share, 0, count, 1.0),
            (len(to_second), to_first, other_share, count, 0, -1.0),
        ):
            some = rows[first : first + len(pairs)]
            np.add.at(scalars, (some, own + pairs[:, 0]), sign)
            np.add.at(scalars, (some, opposite + pairs[:, 1]), -sign * (1.0 - part))
            np.add.at(scalars, (some, opposite + pairs[:, 2]), -sign * part)
        return np.asarray(scalars[..., np.newaxis] * self.normal)

    def _pair(self) -> None:
        """Set the pairs of opposite points. Raises `FeatureError` where there are none."""
        first, second = (
            np.column_stack([points @ self.along, points[:, 2]]) for points in self._ideal
        )
        self._pairs = (_opposite(first, second), _opposite(second, first))
        if sum(len(pairs) for pairs, _ in self._pairs) < 2:
            raise FeatureError(
                "feature-direction",
                f"{self.name}: the two walls are not opposite to each other",
                found="no point of one across the other",
                expected="walls that face each other over a part of their length, at one depth",
            )


def _turn(points: Sequence[Floats], along: Floats, normal: Floats) -> Floats:
    """(s,) angle by which both walls (s, n, 3), or (n, 3), turn together by least squares."""
    square_along = square_across = product = np.zeros(())
    for wall in points:
        centred = wall - wall.mean(axis=-2, keepdims=True)
        t, h = centred @ along, centred @ normal
        square_along = square_along + np.einsum("...n,...n->...", t, t)
        square_across = square_across + np.einsum("...n,...n->...", h, h)
        product = product + np.einsum("...n,...n->...", t, h)
    return np.asarray(0.5 * np.arctan2(2.0 * product, square_along - square_across))


def _opposite(places: Floats, wall: Floats) -> tuple[Indices, Floats]:
    """Of places (n, 2) those on the other wall's path (m, 2): indices (p, 3), and shares (p,).

    Of each the point itself and the two between which its opposite lies, and how far on the way.
    """
    start, way = wall[:-1], np.diff(wall, axis=0)
    square = np.maximum(np.einsum("mc,mc->m", way, way), 1e-300)
    between = places[:, np.newaxis] - start
    share = np.clip(np.einsum("nmc,mc->nm", between, way) / square, 0.0, 1.0)
    off = np.linalg.norm(between - share[..., np.newaxis] * way, axis=-1)
    segment = np.argmin(off, axis=1)
    rows = np.arange(len(places))
    near = off[rows, segment] <= OFF * float(np.ptp(wall, axis=0).max())
    indices = np.column_stack([rows, segment, segment + 1])[near]
    return indices, share[rows, segment][near]


def _between(values: Floats, pairs: Indices, share: Floats) -> Floats:
    return np.asarray((1.0 - share) * values[:, pairs[:, 1]] + share * values[:, pairs[:, 2]])
