"""Parallelism of a wall or face to a datum (ISO 1101)."""

from __future__ import annotations

from typing import ClassVar

from pydantic import BaseModel

from truepose.workpiece.features._evaluated import ZoneTable
from truepose.workpiece.features._orientation import OrientationFeature


class Parallelism(OrientationFeature):
    """A zone parallel to the datum."""

    kind = "parallelism"
    doc = "zone of a wall or face, parallel to a datum"
    table: ClassVar[type[BaseModel]] = ZoneTable

    def set_up(self, row: BaseModel) -> None:
        """Raises `FeatureError` where the element is not parallel to its datum."""
        assert isinstance(row, ZoneTable)
        self.orient(0.0)
        self.quantities = (self.orientation(row.zone),)
