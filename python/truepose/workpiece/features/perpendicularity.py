"""Perpendicularity of a wall or face to a datum (ISO 1101)."""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import BaseModel

from truepose.workpiece.features._evaluated import ZoneTable
from truepose.workpiece.features._orientation import OrientationFeature


class Perpendicularity(OrientationFeature):
    """A zone across the datum."""

    kind = "perpendicularity"
    doc = "zone of a wall or face, perpendicular to a datum"
    table: ClassVar[type[BaseModel]] = ZoneTable

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the element is not perpendicular to its datum."""
        assert isinstance(row, ZoneTable)
        self.orient(0.5 * math.pi)
        self.quantities = (self.orientation(row.zone),)
