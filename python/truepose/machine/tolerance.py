"""A tolerance as a machine file writes it: two limits, one half band, or a class of a standard."""

from __future__ import annotations

import re
from dataclasses import dataclass

from truepose.machine import tolerance_standards
from truepose.machine.dimensions import DIMENSIONS
from truepose.machine.units import QuantityError, UnitSystem, shown_value, type_phrase

_PLUS_MINUS = re.compile(r"\s*(?:±|\+/?-)\s*(?=[\d.])")
_CLASS = re.compile(r"\s*[A-Za-z]")


@dataclass(frozen=True)
class Band:
    """Lower and upper deviation from nominal, SI."""

    lower: float
    upper: float

    @property
    def shift(self) -> float:
        """Centre of the band: what is known of the deviation."""
        return 0.5 * (self.lower + self.upper)

    @property
    def half(self) -> float:
        """Half width of the band: what is not known."""
        return 0.5 * (self.upper - self.lower)


@dataclass(frozen=True)
class Tolerance:
    """Either a band outright or, of a length, a class whose band depends on the nominal size."""

    dimension: str
    outright: Band | None = None
    designation: str | None = None

    def band(self, nominal: float) -> Band:
        """The band for a nominal size in m. Raises `tolerance_standards.ToleranceClassError`."""
        if self.outright is not None:
            return self.outright
        if self.designation is None:
            raise ValueError("a tolerance is a band or a designation")
        half = tolerance_standards.half_band(self.designation, nominal, self.dimension)
        return Band(-half, half)


def read_tolerance(value: object, dimension: str, units: UnitSystem) -> Tolerance:
    """`[lower, upper]`, `0.02` (+- 0.02), `"+-0.02 mm"` or `"IT7"` -> Tolerance.

    Raises `QuantityError`.
    """
    phrase = f"a tolerance ({DIMENSIONS[dimension].phrase})"
    if isinstance(value, list):
        if len(value) != 2:
            raise QuantityError(
                "wrong-type",
                f"expected {phrase}, found a list of {len(value)}",
                found=shown_value(value),
                expected="[lower limit, upper limit]",
            )
        lower, upper = (units.read(limit, dimension) for limit in value)
        if upper < lower:
            raise QuantityError(
                "tolerance-reversed",
                "the upper limit is below the lower one",
                found=shown_value(value),
                expected="[lower limit, upper limit]",
            )
        return Tolerance(dimension, outright=Band(lower, upper))
    if isinstance(value, str):
        if _CLASS.match(value):
            return Tolerance(dimension, designation=_designation(value, dimension))
        value = _PLUS_MINUS.sub("", value, count=1)
    elif isinstance(value, bool) or not isinstance(value, (int, float)):
        raise QuantityError(
            "wrong-type",
            f"expected {phrase}, found {type_phrase(value)}",
            found=shown_value(value),
            expected="[lower limit, upper limit], one half band, or a class of a standard",
        )
    half = units.read(value, dimension)
    if half < 0.0:
        raise QuantityError(
            "negative",
            "a half band is zero or more",
            found=shown_value(value),
            expected="a half band of zero or more, or [lower limit, upper limit]",
        )
    return Tolerance(dimension, outright=Band(-half, half))


def _designation(text: str, dimension: str) -> str:
    if dimension != "length":
        raise QuantityError(
            "unknown-tolerance-class",
            f"a tolerance class for {DIMENSIONS[dimension].phrase}",
            found=shown_value(text),
            expected="[lower limit, upper limit] or one half band",
            hint="ISO 2768-1 goes by the length of an angle's shorter side, which no key says",
        )
    try:
        return tolerance_standards.canonical(text, dimension)
    except tolerance_standards.ToleranceClassError as error:
        raise QuantityError(
            error.code, error.message, found=error.found, expected=error.expected, hint=error.hint
        ) from None
