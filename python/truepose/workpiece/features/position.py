"""Position of a circle's centre, or of a wall or face, to datums (ISO 1101).

The value is the size of the zone about the nominal place that just holds it: the diameter of the
circle about the centre, or the distance of two parallel planes that all points of a wall or face
are between. The nominal place is the programmed one, as the frame of the datums sees it; without
datums in the coordinates of the part, as they are aligned.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import BaseModel

from truepose.arrays import Floats, Indices
from truepose.workpiece.features._base import Forms
from truepose.workpiece.features._evaluated import EvaluatedFeature, ZoneTable
from truepose.workpiece.features.circle import PLACE_OF_CENTRE, centre_forms, centre_value
from truepose.workpiece.first_order import FirstOrder
from truepose.workpiece.outlines import Round, Straight, outline_of

_W = np.array([0.0, 0.0, 1.0])


class Position(EvaluatedFeature):
    """Where a circle, a wall or a face is."""

    kind = "position"
    doc = "place of a circle, wall or face to datums"
    table: ClassVar[type[BaseModel]] = ZoneTable

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the datums leave the place open."""
        assert isinstance(row, ZoneTable)
        element, points = self.elements[0], self.programmed[0]
        self.outline = outline_of(element.name, points)
        if isinstance(self.outline, Round):
            operator, directions = PLACE_OF_CENTRE, list(np.eye(3)[:2])
        else:
            operator, directions = "all points, width of the zone (ISO 1101)", [self.outline.normal]
        if self.frame is not None:
            level = isinstance(self.outline, Straight) and self.outline.kind == "face"
            if level and abs(float(directions[0] @ _W)) > 1.0 - 1e-6:
                self.frame.require_tilt(self.name)
            else:
                self.frame.require_place(directions, self.name)
        self.quantities = (self.zone("position", row.zone, operator),)

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """The size of the zone."""
        if isinstance(self.outline, Round):
            return [centre_value(self.outline, seen[0])]
        off = (seen[0] - self.outline.points) @ self.outline.normal
        return [2.0 * np.abs(off).max(axis=1)]

    def ideal(self) -> list[Floats]:
        """The circle, wall or face."""
        return [self.outline.ideal(self.programmed[0])]

    def linear(self, order: FirstOrder) -> list[Forms]:
        """The centre, or what each point is off along the normal to either side."""
        if isinstance(self.outline, Round):
            return [centre_forms(order, self.outline, 0)]
        normals = np.tile(self.outline.normal, (order.count, 1))
        return [both_sides(order, np.arange(order.count), normals)]


def both_sides(order: FirstOrder, places: Indices, normals: Floats) -> Forms:
    """Twice what points at `places` (n,) are off at most along normals (n, 3), to either side."""
    across = 2.0 * order.seen_at(places, normals)
    effect = np.abs(order.effect(order.ideal[places], normals)).max(axis=0)
    return order.forms(
        "between",
        np.concatenate([across, -across]),
        curvature=2.0 * order.bent(order.ideal[places], normals),
        plus=order.plus(effect, 2.0),
    )
