"""Flatness of a face or of a wall driven at several depths (ISO 1101, ISO 12781).

The distance between two parallel planes that hold all points: the least there is, or with
"least-squares" from the lowest to the highest point from the plane of orthogonal least squares.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from truepose.arrays import Floats
from truepose.spatial import tangents
from truepose.workpiece.features._base import Forms
from truepose.workpiece.features._evaluated import EvaluatedFeature, ZoneTable
from truepose.workpiece.features.straightness import residual_forms
from truepose.workpiece.first_order import FirstOrder
from truepose.workpiece.fits import AnyPlane, associate
from truepose.workpiece.outlines import plane, straight


class Flatness(EvaluatedFeature):
    """The form of a face, of one element or of several."""

    kind = "flatness"
    doc = "form of a flat face of several passes"
    table: ClassVar[type[BaseModel]] = ZoneTable
    most_elements = 10_000
    takes_datums = False

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the elements together are no face."""
        assert isinstance(row, ZoneTable)
        together = np.concatenate(self.programmed)
        plane(self.name, together)
        self.outline = straight(self.name, together)
        operator = "from the least-squares plane" if self.least_squares else "minimum zone"
        self.quantities = (self.zone("flatness", row.zone, f"{operator} (ISO 12781)"),)

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The width of the zone."""
        together = np.concatenate(own, axis=1)
        shape = AnyPlane(np.tile(self.outline.normal, (len(together), 1)), self.outline.length)
        residuals = associate(shape, together, least_squares=self.least_squares)[1]
        return [np.ptp(residuals, axis=1)]

    def ideal(self) -> list[Floats]:
        """The plane."""
        ends = np.cumsum([len(points) for points in self.programmed])[:-1]
        return np.split(self.outline.points, ends)

    def linear(self, order: FirstOrder) -> list[Forms]:
        """Residuals from the plane of least squares."""
        normal = self.outline.normal
        along = tangents(normal)
        return [residual_forms(order, self.outline.points, normal, along, self.least_squares)]
