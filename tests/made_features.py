"""Kinds of features that only keep what they were built of, for tests of how a part is read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from truepose.arrays import Floats
from truepose.files.file_table import FileTable
from truepose.files.quantity import PositiveLength
from truepose.workpiece.element import Element
from truepose.workpiece.features._base import Feature, FeatureError, Forms, Method, Quantity


class Bore(FileTable):
    diameter: PositiveLength | None = Field(None, description="Of it.")
    tolerance: str | None = Field(None, description="Of the diameter.")
    roundness: PositiveLength | None = Field(None, description="Of it.")
    position: PositiveLength | None = Field(None, description="Of it.")


class Width(FileTable):
    nominal: PositiveLength = Field(description="Of it.")
    tolerance: str = Field(description="Of the size.")


class Straight(FileTable):
    zone: PositiveLength = Field(description="Of it.")


class _Made:
    """A feature as it was built; `wanted` elements, and at least `least` points of each."""

    kind: ClassVar[str] = ""
    doc: ClassVar[str] = "Made for tests."
    table: ClassVar[type[BaseModel]]
    wanted: ClassVar[int] = 1
    least: ClassVar[int] = 3

    def __init__(self, name: str, row: BaseModel, method: Method) -> None:
        self.name = name
        self.row = row
        self.method = method
        self.elements: Sequence[Element] = ()
        self.datums: Sequence[Element] = ()
        self.quantities: tuple[Quantity, ...] = ()

    @classmethod
    def build(
        cls,
        name: str,
        row: BaseModel,
        elements: Sequence[Element],
        datums: Mapping[str, Element],
        method: Method,
    ) -> Self:
        if len(elements) != cls.wanted:
            raise FeatureError(
                "part-no-motion", "elements", found=str(len(elements)), expected=str(cls.wanted)
            )
        made = cls(name, row, method)
        made.elements, made.datums = tuple(elements), tuple(datums.values())
        return made

    def values(self, points: Sequence[Floats]) -> Floats:
        return np.empty((0, 0))

    def forms(self) -> tuple[Forms, ...]:
        return ()


class MadeBore(_Made):
    kind = "circle"
    table = Bore


class MadeWidth(_Made):
    kind = "size"
    table = Width
    wanted = 2


class MadeStraight(_Made):
    kind = "straightness"
    table = Straight


class MadeFlat(_Made):
    kind = "flatness"
    table = Straight


KINDS: dict[str, type[Feature]] = {
    made.kind: made for made in (MadeBore, MadeWidth, MadeStraight, MadeFlat)
}
