"""What the kinds of features share: how rows, elements and datums become a feature."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, Field

from truepose.arrays import Floats
from truepose.files.file_table import FileTable
from truepose.files.quantity import AllowedLength
from truepose.files.size_limits import SizeLimits
from truepose.files.tolerance_standards import ToleranceClassError
from truepose.files.wording import counted
from truepose.workpiece.coordinates import Coordinates
from truepose.workpiece.datum_frame import DatumFrame
from truepose.workpiece.element import Element, FeatureError
from truepose.workpiece.features._base import Forms, Method, Quantity
from truepose.workpiece.first_order import FirstOrder

Side = Literal["inside", "outside"] | None

LIMITS = (
    'Limits: `"+0.025 0"`, `"±0.05 mm"`, `[-0.05, 0.05]`, `0.05` (±), or `"H7"`, `"h7"`, `"JS7"`.'
)
SIDE = (
    "Where the tool is, which has a radius: `inside` a bore or slot, or `outside`, around a boss "
    "or web."
)


_SAMPLES = 1000
"""Samples at once, so that what is computed on the way needs little memory."""


class ZoneTable(FileTable):
    """Keys of a feature that has a zone and nothing else."""

    zone: AllowedLength = Field(description="Width of the tolerance zone.")


class EvaluatedFeature:
    """A feature in its own coordinates. A kind says `set_up`, `evaluate` and `linear`."""

    kind: ClassVar[str]
    doc: ClassVar[str]
    table: ClassVar[type[BaseModel]]
    most_elements: ClassVar[int] = 1
    takes_datums: ClassVar[bool] = True
    needs_datums: ClassVar[bool] = False

    quantities: tuple[Quantity, ...]

    def __init__(
        self,
        name: str,
        elements: Sequence[Element],
        datums: Mapping[str, Element],
        method: Method,
    ) -> None:
        """Raises `FeatureError` where there are too many elements, or datums that are no frame."""
        self.name = name
        self.elements: Sequence[Element] = tuple(elements)
        self.datums: Sequence[Element] = tuple(datums.values())
        self.least_squares = method == "least-squares"
        self._require_counts()
        self.coordinates = Coordinates.of(self.elements, self.datums)
        self.programmed = [self.coordinates.local(element.points) for element in self.elements]
        self.frame = (
            DatumFrame(self.datums, self.coordinates, least_squares=self.least_squares)
            if self.datums
            else None
        )

    @classmethod
    def build(
        cls,
        name: str,
        row: BaseModel,
        elements: Sequence[Element],
        datums: Mapping[str, Element],
        method: Method,
    ) -> Self:
        """From its checked row; see `Feature.build`."""
        assert isinstance(row, cls.table)
        feature = cls(name, elements, datums, method)
        feature.set_up(row)
        return feature

    def values(self, points: Sequence[Floats]) -> Floats:
        """(s, n_quantity) of parts whose tool points are there; see `Feature.values`."""
        count = len(points[0])
        values = np.empty((count, len(self.quantities)))
        for first in range(0, count, _SAMPLES):
            some = slice(first, first + _SAMPLES)
            local = [self.coordinates.local(element[some]) for element in points]
            own, datums = local[: len(self.elements)], local[len(self.elements) :]
            seen = own if self.frame is None else self.frame.seen(own, datums)
            values[some] = np.stack(self.evaluate(own, seen), axis=-1)
        return values

    def forms(self) -> tuple[Forms, ...]:
        """The linear forms of each quantity."""
        order = FirstOrder(self.ideal(), self.programmed, self.coordinates, self.frame)
        return tuple(self.linear(order))

    def set_up(self, row: BaseModel) -> None:
        """Look at the elements and set `quantities`. Raises `FeatureError`."""
        raise NotImplementedError

    def evaluate(self, own: Sequence[Floats], seen: Sequence[Floats]) -> list[Floats]:
        """(s,) of each quantity, of points (s, n, 3) of each element in u v w.

        `seen`: the same points as the frame of the datums sees them.
        """
        raise NotImplementedError

    def ideal(self) -> list[Floats]:
        """(n, 3) of each element without the program's rounding, in u v w."""
        raise NotImplementedError

    def linear(self, order: FirstOrder) -> list[Forms]:
        """The forms of each quantity."""
        raise NotImplementedError

    def zone(self, name: str, width: float, operator: str) -> Quantity:
        """A zone of that width, m."""
        return Quantity(name, 0.0, -math.inf, width, "m", is_form=True, operator=operator)

    def size(
        self, name: str, nominal: float, limits: SizeLimits, operators: Mapping[str, str]
    ) -> list[Quantity]:
        """A size with its limits, once for each of `operators`, by what stands behind its name.

        Raises `FeatureError` where the standard gives the size no limits.
        """
        try:
            band = limits.band(nominal)
        except ToleranceClassError as error:
            raise _again(error, self.name) from None
        return [
            Quantity(
                name + suffix,
                nominal,
                nominal + band.lower,
                nominal + band.upper,
                "m",
                is_form=False,
                operator=operator,
            )
            for suffix, operator in operators.items()
        ]

    def surface(self, side: str | None, what: str) -> float:
        """By how much a size is more than that of the path, m: two tool radii, or less of them.

        The surface is the path moved by the tool's radius along the drawing's normal. Its form is
        that of the path: where the path is off by e, the envelope of the tool is off by the part of
        e along the normal, to first order.
        """
        radii = {element.tool_radius for element in self.elements}
        if len(radii) > 1:
            raise FeatureError(
                "feature-elements",
                f"{self.name}: driven with tools of two radii",
                found=" and ".join(f"{radius * 1e3:.6g} mm" for radius in sorted(radii)),
                expected="one tool for a size",
            )
        radius = radii.pop()
        if radius <= 0.0:
            return 0.0
        if side is None:
            raise FeatureError(
                "missing-key",
                f"{self.name}: a tool with a radius, and nothing says on which side of it {what}",
                found=f"tool radius {radius * 1e3:.6g} mm and no side",
                expected='side = "inside" or "outside"',
                hint="inside: the tool is within the bore or slot; outside: around the boss or web",
            )
        return 2.0 * radius if side == "inside" else -2.0 * radius

    def _require_counts(self) -> None:
        count = len(self.elements)
        least = 2 if self.kind == "size" else 1
        if not least <= count <= self.most_elements:
            raise FeatureError(
                "feature-elements",
                f"{self.name}: a feature of kind {self.kind} is not about so many elements",
                found=counted(count, "element"),
                expected=counted(least, "element")
                if least == self.most_elements
                else f"{least} to {counted(self.most_elements, 'element')}",
                hint="an element is a stretch of the path without a gap: name its lines",
            )
        if self.needs_datums and not self.datums:
            raise FeatureError(
                "feature-datums",
                f"{self.name}: the {self.kind} of a feature is to a datum",
                found="no datum",
                expected='datums = ["A"], and a datum of that name',
            )
        if self.datums and not self.takes_datums:
            raise FeatureError(
                "feature-datums",
                f"{self.name}: a feature of kind {self.kind} has no datum",
                found=counted(len(self.datums), "datum"),
                expected="no datums",
            )


def _again(error: ToleranceClassError, name: str) -> FeatureError:
    fault = error.fault.about(name)
    return FeatureError(
        fault.code, fault.message, found=fault.found, expected=fault.expected, hint=fault.hint
    )
