"""A dimension as a drawing has it: the nominal value, and the limits of the actual one.

    size = "100 +-0.05"                                # bare numbers in the units of the file
    diameter = "40 mm +0.025 0"                        # what has no unit after one has that
    size = { nominal = 100, tolerance = "IT7" }        # any tolerance of a machine file

Key and text are also what a comment of a program says: `(feature: bore, diameter 40 +0.025 0)`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic.json_schema import JsonSchemaValue

from truepose.files.dimensions import DIMENSIONS
from truepose.files.quantity import FileType
from truepose.files.tolerance import read_tolerance
from truepose.files.tolerance_standards import ToleranceClassError
from truepose.files.units import QuantityError, UnitSystem, shown_value, type_phrase

_PART = r"\d++\.?\d*+|\.\d++"
_NUMBER = rf"[+-]?(?:{_PART})(?:[eE][+-]?\d++)?+"
_UNIT = r"[A-Za-zµμ°]++"
_TEXT = re.compile(
    rf"\s*+(?P<nominal>{_NUMBER})(?:\s*+(?P<unit>{_UNIT}))?+\s++"
    rf"(?:(?P<same>±|\+/?-)\s*+(?P<half>{_PART})(?:\s*+(?P<half_unit>{_UNIT}))?+"
    rf"|(?P<one>{_NUMBER})(?:\s*+(?P<one_unit>{_UNIT}))?+\s++"
    rf"(?P<two>{_NUMBER})(?:\s*+(?P<two_unit>{_UNIT}))?+)"
    r"\s*+"
)
_KEYS = ("nominal", "tolerance")


@dataclass(frozen=True)
class Limits:
    """`nominal`, and the smallest and the largest value allowed, SI."""

    nominal: float
    lower: float
    upper: float


@dataclass(frozen=True)
class _Toleranced(FileType):
    """A quantity with its limits."""

    positive: bool = False

    def read(self, value: Any, units: UnitSystem) -> Limits:
        limits = self._read(value, units)
        if self.positive and limits.lower <= 0.0:
            raise QuantityError(
                "not-positive",
                f"expected {DIMENSIONS[self.dimension].phrase} above zero within its limits",
                found=shown_value(value),
                expected=self._expected,
            )
        return limits

    @property
    def _expected(self) -> str:
        example = "100 +-0.05" if self.dimension == "length" else "90 +-0.01"
        return f'a nominal value and its limits, such as "{example}" or "40 +0.025 0"'

    def _read(self, value: Any, units: UnitSystem) -> Limits:
        if isinstance(value, dict):
            return self._of_table(value, units)
        if not isinstance(value, str):
            raise QuantityError(
                "wrong-type" if isinstance(value, bool | list) else "no-limits",
                f"expected a nominal value with its limits, found {type_phrase(value)}",
                found=shown_value(value),
                expected=self._expected,
            )
        match = _TEXT.fullmatch(value)
        if match is None:
            try:
                units.read(value, self.dimension)
            except QuantityError as error:  # it may be no quantity at all, or of another dimension
                if error.code != "unknown-unit":
                    raise
            raise QuantityError(
                "no-limits",
                "this value has no limits",
                found=shown_value(value),
                expected=self._expected,
            )
        unit = match["unit"]

        def of(number: str, own: str | None) -> float:
            named = own or unit
            return units.read(f"{number} {named}" if named else number, self.dimension)

        nominal = of(match["nominal"], None)
        if match["same"] is not None:
            half = of(match["half"], match["half_unit"])
            return Limits(nominal, nominal - half, nominal + half)
        one, two = of(match["one"], match["one_unit"]), of(match["two"], match["two_unit"])
        return Limits(nominal, nominal + min(one, two), nominal + max(one, two))

    def _of_table(self, table: dict[str, Any], units: UnitSystem) -> Limits:
        for key in (*table, *_KEYS):
            if key not in _KEYS or key not in table:
                raise QuantityError(
                    "unknown-key" if key in table else "missing-key",
                    "a dimension has a nominal value and a tolerance",
                    found=key if key in table else f"no {key}",
                    expected=" and ".join(_KEYS),
                )
        nominal = units.read(table["nominal"], self.dimension)
        tolerance = read_tolerance(table["tolerance"], self.dimension, units)
        try:
            band = tolerance.band(nominal)
        except (ToleranceClassError, ValueError) as error:
            raise QuantityError(
                "no-limits",
                f"this tolerance gives no limits: {error}",
                found=shown_value(table["tolerance"]),
                expected=self._expected,
            ) from None
        return Limits(nominal, nominal + band.lower, nominal + band.upper)

    def json_schema(self) -> JsonSchemaValue:
        return {"anyOf": [{"type": "string"}, {"type": "object"}], "x-dimension": self.dimension}


Toleranced = Annotated[Limits, _Toleranced("length")]
TolerancedSize = Annotated[Limits, _Toleranced("length", positive=True)]
TolerancedAngle = Annotated[Limits, _Toleranced("angle")]


__all__ = ["Limits", "Toleranced", "TolerancedAngle", "TolerancedSize"]
