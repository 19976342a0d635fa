"""Straightness of a wall in the working plane (ISO 1101, ISO 12780).

The width between two parallel lines that hold all points: the least there is, or with
"least-squares" from the lowest to the highest point from the line of orthogonal least squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from truepose.arrays import Floats
from truepose.spatial import norm
from truepose.workpiece.element import FeatureError
from truepose.workpiece.features._base import Forms
from truepose.workpiece.features._evaluated import EvaluatedFeature, ZoneTable
from truepose.workpiece.first_order import FirstOrder, Straightened
from truepose.workpiece.fits import TurnedPlane, associate
from truepose.workpiece.outlines import straight


class Straightness(EvaluatedFeature):
    """The form of one pass along a wall."""

    kind = "straightness"
    doc = "form of a straight wall in the working plane"
    table: ClassVar[type[BaseModel]] = ZoneTable
    takes_datums = False

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the element is no straight line."""
        assert isinstance(row, ZoneTable)
        self.outline = straight(self.elements[0].name, self.programmed[0])
        if self.outline.deep:
            raise FeatureError(
                "feature-elements",
                f"{self.elements[0].name}: straightness is that of one pass",
                found="passes beside or above each other",
                expected="one straight line",
                hint="of all passes together it is flatness",
            )
        operator = "from the least-squares line" if self.least_squares else "minimum zone"
        self.quantities = (self.zone("straightness", row.zone, f"{operator} (ISO 12780)"),)

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The width of the zone."""
        normal = np.tile(self.outline.normal, (len(own[0]), 1))
        axis = np.broadcast_to([0.0, 0.0, 1.0], normal.shape)
        shape = TurnedPlane(normal, axis, self.outline.length)
        residuals = associate(shape, own[0], least_squares=self.least_squares)[1]
        return [np.ptp(residuals, axis=1)]

    def ideal(self) -> list[Floats]:
        """The straight line."""
        return [self.outline.points]

    def linear(self, order: FirstOrder) -> list[Forms]:
        """Residuals from the line of least squares; see `residual_forms`."""
        along = self.outline.along[np.newaxis]
        return [
            residual_forms(
                order, self.outline.points, self.outline.normal, along, self.least_squares
            )
        ]


def residual_forms(
    order: FirstOrder,
    ideal: Floats,
    normal: Floats,
    along: Floats,
    least_squares: bool,
) -> Forms:
    """What is left of points (n, 3), the first of all, from their line or plane of least squares.

    `along` (k, 3): directions of the slopes that are free. The minimum zone is at most as wide as
    one of any slope: that of b_1, the slope to first order, holds residuals h - b_1 (t + tau), and
    its width is theirs times a cosine. With least squares b is off besides by `bend`.
    """
    fit = Straightened.of(ideal @ along.T)
    across = order.seen(0, np.tile(normal, (len(ideal), 1)))
    slopes = np.tensordot(fit.slopes, across, 1)
    places = (ideal - ideal.mean(axis=0)) @ along.T
    kept = across - across.mean(axis=0) - np.tensordot(places, slopes, 1)
    slope = float(norm(norm(slopes).sum(axis=1)))
    ways = [order.seen(0, np.tile(way, (len(ideal), 1))) for way in along]
    moved = math.sqrt(sum(largest(way) ** 2 for way in ways))
    apart = math.sqrt(sum(largest(way - way.mean(axis=0)) ** 2 for way in ways))
    directions = np.tile(normal, (len(ideal), 1))
    bent = order.bent(ideal, directions, ranged=True)
    curvature = 2.0 * slope * min(moved, apart) + 2.0 * bent
    if least_squares:
        own = fit.bend(min(moved, apart), min(largest(across), largest(kept)), 1.1 * slope)
        own += fit.steep * bent
        curvature = 1.1 * curvature + own * fit.length
    return order.forms("spread", kept, curvature=curvature, reach=fit.reach(min(moved, apart)))


def largest(forms: Floats) -> float:
    """The most that any of the forms (n, N, 3) can be, per rho."""
    return float(norm(forms).sum(axis=1).max())
