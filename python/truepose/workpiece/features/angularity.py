"""Angularity: a zone at an angle to a datum (ISO 1101), and the angle itself (ISO 14405-3).

The angle with its tolerance is that between two walls, each associated as `DatumFrame` does it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from truepose.arrays import Floats
from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import AllowedLength, PositiveAngle, refuse
from truepose.files.size_limits import AngleLimits
from truepose.spatial import norm
from truepose.workpiece.element import FeatureError
from truepose.workpiece.features._base import Forms, Quantity
from truepose.workpiece.features._orientation import OrientationFeature
from truepose.workpiece.features.straightness import largest
from truepose.workpiece.first_order import FirstOrder, Straightened


class AngularityTable(FileTable):
    """Keys of a feature of kind angularity."""

    angle: PositiveAngle = Field(description="Between the wall or face and its first datum.")
    zone: AllowedLength | None = Field(None, description="Width of the zone at that angle.")
    tolerance: AngleLimits | None = Field(
        None, description='Limits of the angle between two walls, such as `"±0.1 deg"`.'
    )

    @model_validator(mode="after")
    def _asks_something(self) -> Self:
        if self.zone is None and self.tolerance is None:
            refuse(
                Fault(
                    "missing-key",
                    "nothing is asked of the angle",
                    found="neither zone nor tolerance",
                    expected='zone, such as "0.05 mm", or tolerance, such as "±0.1 deg"',
                )
            )
        return self


class Angularity(OrientationFeature):
    """A wall or face at an angle to its datum."""

    kind = "angularity"
    doc = "zone at an angle to a datum, or the angle to it"
    table: ClassVar[type[BaseModel]] = AngularityTable

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the element is not at that angle to its datum."""
        assert isinstance(row, AngularityTable)
        self.orient(row.angle)
        quantities: list[Quantity] = []
        if row.zone is not None:
            quantities.append(self.orientation(row.zone))
        self._asks_angle = row.tolerance is not None
        if row.tolerance is not None:
            assert self.frame is not None
            if self._opens == 0.0 or self.outline.kind == "face" or self.free_axis is not None:
                raise FeatureError(
                    "feature-elements",
                    f"{self.name}: an angle with a tolerance is between two walls",
                    found="a face, or walls that are parallel",
                    expected="two walls at an angle, or a zone in place of the tolerance",
                )
            band = row.tolerance.band(row.angle)
            how = "least squares" if self.least_squares else "minimum zone"
            quantities.append(
                Quantity(
                    "angle",
                    row.angle,
                    row.angle + band.lower,
                    row.angle + band.upper,
                    "rad",
                    is_form=False,
                    operator=f"between two lines by {how} (ISO 14405-3)",
                )
            )
        self._asks_zone = row.zone is not None
        self.quantities = tuple(quantities)

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The width of the zone and the angle, as far as they are asked for."""
        values = super().evaluate(own, seen) if self._asks_zone else []
        if self._asks_angle:
            normal = self._turned(seen[0], _W)[0].normal
            sine = normal[:, 1] * self.normal[0] - normal[:, 0] * self.normal[1]
            turned = np.arctan2(sine, normal @ self.normal)
            values.append(self.angle + self._opens * turned)
        return values

    def linear(self, order: FirstOrder) -> list[Forms]:
        """The slope of least squares, as the frame sees the points.

        A minimum zone has another, by half the range of the residuals times the slope's weights.
        """
        forms = super().linear(order) if self._asks_zone else []
        if not self._asks_angle:
            return forms
        along = np.array([self.normal[1], -self.normal[0], 0.0])
        places = (self._ideal @ along)[:, np.newaxis]
        fit = Straightened.of(places)
        normals = np.tile(self.normal, (order.count, 1))
        across, ways = order.seen(0, normals), order.seen(0, np.tile(along, (order.count, 1)))
        slopes = np.tensordot(fit.slopes, across, 1)
        slope, moved = float(norm(slopes).sum()), largest(ways - ways.mean(axis=0))
        kept = across - across.mean(axis=0) - np.tensordot(places - places.mean(0), slopes, 1)
        bent = order.bent(self._ideal, normals, ranged=True)
        curvature = fit.bend(moved, largest(kept), 1.1 * slope) + fit.steep * bent + slope**2
        plus = order.plus(np.abs(fit.slopes[0]) @ np.abs(order.effect(self._ideal, normals)))
        if not self.least_squares:
            weights = float(np.abs(fit.slopes).sum())
            plus = (*plus, order.forms("spread", kept, factor=0.5 * weights))
            turned = slope + weights * largest(kept)
            curvature += weights * (bent + curvature * fit.length + 1.1 * turned * moved)
        # Along is the normal turned clockwise, so that a slope turns the normal with it.
        return [
            *forms,
            order.forms(
                "between",
                self._opens * slopes,
                self.angle,
                curvature=curvature,
                plus=plus,
                reach=fit.reach(moved),
            ),
        ]


_W = np.array([0.0, 0.0, 1.0])
