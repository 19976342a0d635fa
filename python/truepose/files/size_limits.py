"""Limits of a size as a drawing writes them: "+0.025 0", "±0.05 mm", [0, 0.025] or "H7".

Limit deviations go from the nominal size, and either may come first. Of the tolerance classes of
ISO 286-1 those are read whose limits follow from the grade alone: H and h, which begin at the
nominal size, and JS and js, which lie about it; of the others the limits are to be written.
"""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from typing import Annotated, Any

from pydantic.json_schema import JsonSchemaValue

from truepose.files import tolerance_standards
from truepose.files.dimensions import DIMENSIONS
from truepose.files.quantity import FileType
from truepose.files.tolerance import Band, read_within
from truepose.files.units import QuantityError, UnitSystem, shown_value, type_phrase

_NUMBER = r"[+-]?+(?:\d++\.?\d*+|\.\d++)"
_UNIT = r"(?:\s*+([A-Za-zµμ°'\"]++))?"
_TWO = re.compile(rf"\s*+({_NUMBER}){_UNIT}(?:\s*+[/;,]\s*+|\s++|(?=[+-]))({_NUMBER}){_UNIT}\s*+")
_CLASS = re.compile(r"\s*+(H|h|JS|js|J[sS])\s*+(\d{1,2}+)\s*+")
_ANY_CLASS = re.compile(r"\s*+[A-Za-z]{1,2}+\s*+\d{1,2}+\s*+")


@dataclass(frozen=True)
class SizeLimits:
    """Deviations outright, or `letter` and `grade` of a class, whose band depends on the size."""

    outright: Band | None = None
    letter: str = ""
    grade: str = ""

    def band(self, nominal: float) -> Band:
        """Limit deviations of a nominal size in m.

        Raises `tolerance_standards.ToleranceClassError`.
        """
        if self.outright is not None:
            return self.outright
        width = 2.0 * tolerance_standards.half_band(self.grade, nominal)
        lower = {"H": 0.0, "h": -width}.get(self.letter, -0.5 * width)
        return Band(lower, lower + width)


def read_size_limits(value: object, dimension: str, units: UnitSystem) -> SizeLimits:
    """`"+0.025 0"`, `"+0.025 mm / -0.01 mm"`, `"±0.05 mm"`, 0.05 (±), `[lower, upper]`, `"H7"`.

    Raises `QuantityError`.
    """
    if isinstance(value, str):
        of_class = _CLASS.fullmatch(value)
        if of_class and dimension == "length":
            return _of_class(of_class[1], of_class[2])
        if _ANY_CLASS.fullmatch(value):
            raise QuantityError(
                "unknown-tolerance-class",
                "limits that this program has no table of",
                found=shown_value(value),
                expected='"H7", "h7" or "JS7" with any grade, or the limits outright'
                if dimension == "length"
                else 'the limits outright, such as "±0.1 deg"',
                hint='write the limits that the standard gives it, such as "-0.007 -0.02"',
            )
        two = _TWO.fullmatch(value)
        if two:
            first, first_unit, second, second_unit = two.groups()
            unit_of_first, unit_of_second = first_unit or second_unit, second_unit or first_unit
            limits = [
                units.read(f"{number} {unit or ''}", dimension)
                for number, unit in ((first, unit_of_first), (second, unit_of_second))
            ]
            return SizeLimits(Band(min(limits), max(limits)))
    elif isinstance(value, bool) or not isinstance(value, (int, float, list)):
        raise QuantityError(
            "wrong-type",
            f"expected limits ({DIMENSIONS[dimension].phrase}), found {type_phrase(value)}",
            found=shown_value(value),
            expected='limits, such as "+0.025 0", "±0.05 mm" or [-0.05, 0.05]',
        )
    phrase = f"limits ({DIMENSIONS[dimension].phrase})"
    return SizeLimits(
        read_within(value, lambda limit: units.read(limit, dimension), phrase, known=False)
    )


def _of_class(letter: str, grade: str) -> SizeLimits:
    try:
        designation = tolerance_standards.canonical(f"IT{grade}")
    except tolerance_standards.ToleranceClassError as error:
        raise QuantityError(**asdict(error.fault)) from None
    return SizeLimits(letter=letter, grade=designation)


@dataclass(frozen=True)
class _SizeLimits(FileType):
    def read(self, value: Any, units: UnitSystem) -> SizeLimits:
        return read_size_limits(value, self.dimension, units)

    def json_schema(self) -> JsonSchemaValue:
        one: JsonSchemaValue = {"anyOf": [{"type": "number"}, {"type": "string"}]}
        both = {"type": "array", "items": one, "minItems": 2, "maxItems": 2}
        return {"anyOf": [*one["anyOf"], both], "x-dimension": self.dimension}


LengthLimits = Annotated[SizeLimits, _SizeLimits("length")]
AngleLimits = Annotated[SizeLimits, _SizeLimits("angle")]
