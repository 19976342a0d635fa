"""Ratios and slopes of a machine file that are known outright, or known within limits.

A ratio of two quantities is written as people state it: `"12 ppm"`, `"20 um/m"` or
`"20 um / 300 mm"`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic.json_schema import JsonSchemaValue

from truepose.files.quantity import FileType
from truepose.files.tolerance import Band, read_within
from truepose.files.units import QuantityError, UnitSystem, shown_value

_BEGINS_WITH_A_NUMBER = re.compile(r"\.?\d")


def read_quotient(value: object, units: UnitSystem) -> float | None:
    """`"20 um / 300 mm"`, `"10 arcsec / 360 deg"` -> their ratio; None where it is no quotient.

    Raises `QuantityError`.
    """
    parts = [part.strip() for part in value.split("/", 1)] if isinstance(value, str) else []
    if len(parts) != 2 or not parts[0] or not _BEGINS_WITH_A_NUMBER.match(parts[1]):
        return None
    try:
        above, below = (units.read(part, "length") for part in parts)
    except QuantityError as error:
        try:
            above, below = (units.read(part, "angle") for part in parts)
        except QuantityError:
            raise error from None
    if below == 0.0:
        raise QuantityError(
            "not-positive",
            "a quantity is divided by zero",
            found=shown_value(value),
            expected='a length over a length, such as "20 um / 300 mm"',
        )
    return above / below


def read_ratio(value: object, units: UnitSystem) -> float:
    """A plain number, `"12 ppm"`, `"20 um/m"` or a quotient. Raises `QuantityError`."""
    quotient = read_quotient(value, units)
    return units.read(value, "ratio") if quotient is None else quotient


def _read_error(value: object, units: UnitSystem) -> float:
    ratio = read_ratio(value, units)
    if abs(ratio) >= 1.0:
        raise QuantityError(
            "not-a-fraction",
            "an error as large as the quantity itself",
            found=shown_value(value),
            expected='a ratio between -1 and 1, such as "12 ppm"',
            hint="a bare number is a plain ratio, neither ppm nor um/m",
        )
    return ratio


def read_slope(value: object, units: UnitSystem) -> float:
    """An angle, rad, or what rises over a length: `"20 um/m"`, `"20 um / 300 mm"`.

    Raises `QuantityError`.
    """
    quotient = read_quotient(value, units)
    if quotient is not None:
        return quotient
    try:
        return units.read(value, "angle")
    except QuantityError as error:
        if isinstance(value, str) and error.code == "wrong-dimension":
            try:
                return units.read(value, "ratio")
            except QuantityError:
                pass
        raise


@dataclass(frozen=True)
class _Ratio(FileType):
    """A ratio that is known, or known within limits; an error, so less than the whole."""

    def read(self, value: Any, units: UnitSystem) -> Band:
        return read_within(value, lambda limit: _read_error(limit, units), "a ratio", known=True)

    def json_schema(self) -> JsonSchemaValue:
        return one_or_limits(self.dimension) | {"x-known": True}


@dataclass(frozen=True)
class _Slope(FileType):
    """An angle between straight lines, as a tolerance."""

    def read(self, value: Any, units: UnitSystem) -> Band:
        return read_within(value, lambda limit: read_slope(limit, units), "a slope", known=False)

    def json_schema(self) -> JsonSchemaValue:
        return one_or_limits(self.dimension) | {"x-slope": True}


def one_or_limits(dimension: str) -> JsonSchemaValue:
    """JSON schema of one value, or of two limits."""
    one = [{"type": "number"}, {"type": "string"}]
    limits = {"type": "array", "items": {"anyOf": one}, "minItems": 2, "maxItems": 2}
    return {"anyOf": [*one, limits], "x-dimension": dimension}


RatioWithin = Annotated[Band, _Ratio("ratio")]
SlopeWithin = Annotated[Band, _Slope("angle")]
