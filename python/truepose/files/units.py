"""Units: numbers and text of a machine file to SI, and SI back to the file's own units.

The only module that knows pint, which it imports when the first unit is read that is not one of
`common_units`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Floats
from truepose.errors import ReadingError
from truepose.files.common_units import COMMON
from truepose.files.dimensions import DIMENSIONS, Dimension
from truepose.files.limits import (
    HIGHEST_POWER,
    LARGEST_QUANTITY,
    LONGEST_QUANTITY,
    LONGEST_UNIT,
)

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

# Repeats take all that they can and give nothing back (`++`), here and wherever text is a user's.
_NUMBER = re.compile(r"[+-]?(?:(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+|nan|inf)")
_UNIT = re.compile(rf"[A-Za-zµμ°%_²³⁻¹·*/^() 0-9-]{{1,{LONGEST_UNIT}}}+")
# pint evaluates whatever arithmetic a unit holds, so towers of powers and long digits stay outside.
_LONG_NUMBER = re.compile(r"\d{3}|\d_")
_BRACKET_OR_POWER = re.compile(r"([()])|(\^|\*\*) *+(?:-? *+(\d{1,2}))?|⁻?([¹²³]++)")
_RAISED = str.maketrans("¹²³", "123")
_OFFSET_SCALES = {"degree_Celsius", "degree_Fahrenheit", "degree_Reaumur"}
_RELATIVE_TEMPERATURE = "delta_degree"


class QuantityError(ReadingError):
    """A value that is not the quantity wanted."""


FEW_DIGITS = 10
"""Significant digits of a number that somebody may have written."""

ROUNDED = 5e-15
"""Relative difference below which a number is one of few digits: half of its 15th digit."""

_EXACT_POWERS = 22
"""Powers of ten up to this one are doubles, so that dividing by them rounds once."""


def meant(values: ArrayLike, offset: float = 0.0) -> Floats:
    """Numbers, any shape, without the rounding of a computation: 125 for 124.99999999999999.

    A number that differs relatively by at most `ROUNDED` from one of `FEW_DIGITS` significant
    digits is that one; all others stay as they are to the last bit. Of a difference to an `offset`,
    as on a scale of temperature, the rounding is that of the offset.
    """
    given = np.asarray(values, dtype=np.float64)
    size = np.abs(given)
    usual = np.isfinite(given) & (size > 1e-300) & (size < 1e300)
    size = np.where(usual, size, 1.0)
    places = FEW_DIGITS - 1 - np.floor(np.log10(size)).astype(np.int64)
    usual &= np.abs(places) <= _EXACT_POWERS
    power = 10.0 ** np.where(usual, np.abs(places), 0)
    digits = np.rint(np.where(places >= 0, size * power, size / power))
    few = np.copysign(np.where(places >= 0, digits / power, digits * power), given)
    values_meant: Floats = np.where(
        usual & (np.abs(few - given) <= ROUNDED * np.maximum(size, abs(offset))), few, given
    )
    return values_meant


@dataclass(frozen=True)
class FileUnit:
    """A unit that a file declares: `SI = value * scale + offset`. `label` is the file's word."""

    label: str
    scale: float = 1.0
    offset: float = 0.0

    def to_si(self, value: ArrayLike) -> Floats:
        """Values in this unit, any shape -> SI."""
        with np.errstate(over="ignore"):  # too large a number becomes infinite, which is refused
            return self._scaled(np.asarray(value, dtype=np.float64), self.scale) + self.offset

    def to_file(self, value: ArrayLike) -> Floats:
        """SI values, any shape -> this unit, rounded to what is meant (`meant`)."""
        return meant(self.to_file_exactly(value), self.offset / self.scale)

    def to_file_exactly(self, value: ArrayLike) -> Floats:
        """The same with the rounding of the computation in it."""
        return self._scaled(np.asarray(value, dtype=np.float64) - self.offset, 1.0 / self.scale)

    @staticmethod
    def _scaled(value: Floats, factor: float) -> Floats:
        # 0.3 mm is 0.3 / 1000 m: dividing by the whole number rounds once, multiplying by 0.001
        # rounds twice and shows as 0.30000000000000004 on the way back.
        inverse = 1.0 / factor
        whole = round(inverse)
        if whole > 1 and math.isclose(inverse, whole, rel_tol=1e-15):
            return value / whole
        return value * factor


def default_units() -> dict[str, FileUnit]:
    """The SI unit of every dimension."""
    return {name: FileUnit(dimension.si) for name, dimension in DIMENSIONS.items()}


_ONE_TEMPERATURE = (
    "a temperature is known: of a range ask at both ends, such as --set condition.temperature=26"
)


class UnitSystem:
    """The units that one file declares for its bare numbers, and the reader of its quantities."""

    def __init__(
        self, declared: Mapping[str, FileUnit], broken: frozenset[str] = frozenset()
    ) -> None:
        """`declared`: by dimension; `broken`: declared, but wrongly, and already reported."""
        self.declared = dict(declared)
        self._broken = broken

    def shown(self) -> dict[str, FileUnit]:
        """Unit of every dimension for output: the declared one, else SI."""
        return default_units() | self.declared

    def read(self, value: object, dimension: str) -> float:
        """One finite number in SI from a bare number or from text with a unit.

        Raises `QuantityError`.
        """
        wanted = DIMENSIONS[dimension]
        if isinstance(value, str):
            result = self._from_text(value, wanted)
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            result = self._from_number(value, wanted)
        else:
            raise QuantityError(
                "wrong-type",
                f"expected {wanted.phrase}, found {type_phrase(value)}",
                found=shown_value(value),
                expected=_expected(wanted),
                hint=_ONE_TEMPERATURE if wanted.name == "temperature" else None,
            )
        if not math.isfinite(result):
            raise _not_finite(value, wanted)
        if abs(result) > LARGEST_QUANTITY:
            raise QuantityError(
                "too-large",
                f"expected {wanted.phrase}, found a number far too large for any machine",
                found=shown_value(value),
                expected=f"a number of at most {LARGEST_QUANTITY:g} in SI units: "
                f"{_expected(wanted)}",
            )
        return result

    def _from_number(self, value: float, wanted: Dimension) -> float:
        try:
            number = float(value)
        except OverflowError:
            raise _not_finite(value, wanted) from None
        if wanted.name == "ratio" or not math.isfinite(number):
            return number
        unit = self.declared.get(wanted.name) or self._derived(wanted.name)
        if unit is None:
            if wanted.name in self._broken:
                return number
            raise QuantityError(
                "no-unit",
                f"no unit declared for {wanted.phrase}",
                found=f"the bare number {shown_value(value)}",
                expected=_expected(wanted),
                hint=f'write {wanted.name} = "..." under [units], or the unit with the number, '
                f'as in "{wanted.example}"',
            )
        return float(unit.to_si(number))

    def _derived(self, dimension: str) -> FileUnit | None:
        """A temperature difference goes by the declared temperature's degree."""
        if dimension == "temperature_difference" and "temperature" in self.declared:
            return FileUnit(self.declared["temperature"].label, self.declared["temperature"].scale)
        return None

    def _from_text(self, text: str, wanted: Dimension) -> float:
        if len(text) > LONGEST_QUANTITY:
            raise QuantityError(
                "too-long",
                f"expected {wanted.phrase}, found a text of {len(text)} characters",
                found=shown_value(text),
                expected=f"at most {LONGEST_QUANTITY} characters: {_expected(wanted)}",
            )
        plain = text.strip()
        match = _NUMBER.match(plain)
        if match is None:
            raise QuantityError(
                "unknown-unit",
                f"expected {wanted.phrase}, found text that is not a number with a unit",
                found=shown_value(text),
                expected=_expected(wanted),
            )
        number, unit_text = float(match[0]), plain[match.end() :].strip()
        if not unit_text:
            return self._from_number(number, wanted)
        if unit_text.startswith("/"):
            unit_text = "1" + unit_text
        return float(unit_of(unit_text, wanted, found=shown_value(text)).to_si(number))


def unit_of(text: str, wanted: Dimension, *, found: str | None = None) -> FileUnit:
    """The unit written as `text`, which must measure the `wanted` dimension.

    Raises `QuantityError` (`unknown-unit`, `wrong-dimension`); `found` is what it then shows.
    """
    common = COMMON[wanted.name].get(text)
    if common is not None:
        return FileUnit(text, *common)
    return parsed_unit(text, wanted, found=found)


def parsed_unit(text: str, wanted: Dimension, *, found: str | None = None) -> FileUnit:
    """The same of any unit, as pint knows it."""
    found = found or shown_value(text)
    unit = _parsed(text)
    if unit is None:
        raise QuantityError(
            "unknown-unit",
            f"unknown unit {shown_value(text)}",
            found=found,
            expected=_expected(wanted),
            hint=_unit_hint(text, wanted),
        )
    if not _measures(unit, wanted.name):
        actual = _kind(unit)
        raise QuantityError(
            "wrong-dimension",
            f"expected {wanted.phrase}, found {actual}",
            found=f"{found}, {actual}",
            expected=_expected(wanted),
            hint=_dimension_hint(unit, wanted),
        )
    result = _file_unit(text, unit, wanted)
    if not 1.0 / LARGEST_QUANTITY <= result.scale <= LARGEST_QUANTITY:
        raise QuantityError(
            "too-large",
            f"a unit of no size that anything has: {result.scale:g} in SI units",
            found=found,
            expected=f"a unit of {1.0 / LARGEST_QUANTITY:g} to {LARGEST_QUANTITY:g} in SI units",
        )
    return result


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


@cache
def _parsed(text: str) -> Any | None:
    """The pint unit, or None for text that is none."""
    if not _UNIT.fullmatch(text) or _LONG_NUMBER.search(text) or _power(text) > HIGHEST_POWER:
        return None
    try:
        return _registry().parse_units(text)
    except Exception:  # pint lets the errors of Python's tokenizer and parser through
        return None


def _power(text: str) -> float:
    """The highest power in a unit's text, those of brackets multiplied: 6 of "(m^2)^3".

    Infinite where what stands above is no plain number: "m^(2)", "m^2^3", "m^2³".
    """
    highest = [1]  # in each bracket that is open, the whole text first
    base, base_end, power_end = 1, 0, 0  # the last bracket that closed; where it and a power end
    for match in _BRACKET_OR_POWER.finditer(text):
        bracket, sign, number, raised = match.groups()
        if bracket == "(":
            highest.append(1)
        elif bracket:
            base, base_end = highest.pop() if len(highest) > 1 else 1, match.end()
            highest[-1] = max(highest[-1], base)
        elif (sign and not number) or (power_end and not text[power_end : match.start()].strip()):
            return math.inf
        else:
            of_bracket = base_end and not text[base_end : match.start()].strip()
            by = int(number or raised.translate(_RAISED))
            highest[-1] = max(highest[-1], by * (base if of_bracket else 1))
            power_end = match.end()
    return max(highest)


def _is_relative(unit: Any) -> bool:
    return str(unit).startswith(_RELATIVE_TEMPERATURE)


def _measures(unit: Any, dimension: str) -> bool:
    """Whether `unit` is one of `dimension`; an angle is told from a plain number by its radian."""
    registry = _registry()
    if dimension == "angle":
        return bool(registry.get_root_units(unit)[1] == registry.radian)
    if dimension == "ratio":
        return bool(
            unit.dimensionless and registry.get_root_units(unit)[1] == registry.dimensionless
        )
    if dimension == "temperature" and _is_relative(unit):
        return False
    if dimension == "temperature_difference" and str(unit) in _OFFSET_SCALES:
        return False
    return bool(
        unit.dimensionality == registry.parse_units(DIMENSIONS[dimension].si).dimensionality
    )


def _kind(unit: Any) -> str:
    """What `unit` measures, in words."""
    for dimension in DIMENSIONS.values():
        if _measures(unit, dimension.name):
            return dimension.phrase
    return f"a quantity in {unit:~P}"


def _file_unit(text: str, unit: Any, wanted: Dimension) -> FileUnit:
    registry = _registry()
    if wanted.name == "temperature":
        zero = float(registry.Quantity(0.0, unit).to("K").magnitude)
        step = registry.get_root_units(unit)[0]
        return FileUnit(text, float(step), zero)
    scale = registry.Quantity(1.0, unit).to(wanted.si if wanted.si != "1" else "").magnitude
    return FileUnit(text, float(scale))


def _expected(wanted: Dimension) -> str:
    if wanted.name == "ratio":
        return wanted.phrase
    return f'{wanted.phrase}, such as "{wanted.example}"'


def _unit_hint(text: str, wanted: Dimension) -> str | None:
    if text[:1].isdecimal() or text[:1] in (".", ","):
        return "a decimal point is a point, and a number has no spaces or commas"
    if wanted.name == "temperature" and text.strip().upper() in {"C", "F", "CELSIUS"}:
        return 'write "degC" or "degF"'
    return None


def _dimension_hint(unit: Any, wanted: Dimension) -> str | None:
    if wanted.name == "temperature" and _kind(unit) != DIMENSIONS["temperature_difference"].phrase:
        return 'a temperature is written in "degC", "K" or "degF"'
    if wanted.name == "temperature_difference":
        return 'a difference is written in "K" or "delta_degC"; "degC" is a point on the scale'
    return None


def _not_finite(value: object, wanted: Dimension) -> QuantityError:
    return QuantityError(
        "not-finite",
        f"expected {wanted.phrase}, found a number that is not finite",
        found=shown_value(value),
        expected=f"a finite number: {_expected(wanted)}",
    )


def shown_value(value: object) -> str:
    """A value of the file as its author wrote it, shortened."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int) and value.bit_length() > 128:
        return "a whole number of more than 38 digits"
    if isinstance(value, tuple):
        value = list(value)
    text = f'"{value}"' if isinstance(value, str) else str(value)
    return text if len(text) <= 80 else text[:77] + "..."


def type_phrase(value: object) -> str:
    """What kind of TOML value this is, with its article."""
    if isinstance(value, bool):
        return "true or false"
    if isinstance(value, str):
        return "text"
    if isinstance(value, (int, float)):
        return "a number"
    if isinstance(value, (list, tuple)):
        return "a list"
    if isinstance(value, dict):
        return "a table"
    return "a date or time"
