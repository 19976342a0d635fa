"""A tolerance as a machine file writes it: two limits, one half band, or a class of a standard.

Or a table of these with what else is known: how it is distributed, and what varies with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from truepose.machine import tolerance_standards
from truepose.machine.dimensions import DIMENSIONS
from truepose.machine.suggestion import did_you_mean, one_of
from truepose.machine.units import QuantityError, UnitSystem, shown_value, type_phrase

Value = TypeVar("Value")
Read = Callable[[object], float]
"""Reads one value of the file, SI. Raises `QuantityError`."""

DISTRIBUTIONS = ("uniform", "triangular", "normal")
"""Words for how a tolerance is distributed in its band."""

DEFAULT_SIGMAS = 3.0
"""The half band of a normal distribution, in standard deviations, where nothing says it."""

TABLE_KEYS = {
    "band": "the limits, one half band, or a class",
    "standard_deviation": "in place of band: a normal distribution about the nominal value",
    "distribution": one_of(DISTRIBUTIONS).removeprefix("one of "),
    "sigmas": "of a normal distribution: the half band in standard deviations",
    "group": "what varies together has one name",
    "sign": "-1 where it varies the other way than its group",
}
"""Keys of a tolerance that is written as a table."""

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
    """Either a band outright or, of a length, a class whose band depends on the nominal size.

    `distribution`: one of `DISTRIBUTIONS`; of a normal one the half band is `sigmas` standard
    deviations. Tolerances of one `group` vary together, each with its `sign` (+1 or -1).
    """

    dimension: str
    outright: Band | None = None
    designation: str | None = None
    distribution: str = DISTRIBUTIONS[0]
    sigmas: float = DEFAULT_SIGMAS
    group: str | None = None
    sign: float = 1.0

    def band(self, nominal: float) -> Band:
        """The band for a nominal size in m. Raises `tolerance_standards.ToleranceClassError`."""
        if self.outright is not None:
            return self.outright
        if self.designation is None:
            raise ValueError("a tolerance is a band or a designation")
        half = tolerance_standards.half_band(self.designation, nominal, self.dimension)
        return Band(-half, half)


def read_tolerance(value: object, dimension: str, units: UnitSystem) -> Tolerance:
    """`[lower, upper]`, `0.02` (+- 0.02), `"+-0.02 mm"`, `"IT7"`, or a table -> Tolerance.

    Raises `QuantityError`.
    """
    if isinstance(value, dict):
        return _from_table(value, dimension, units)
    return _read_band(value, dimension, units)


def _read_band(value: object, dimension: str, units: UnitSystem) -> Tolerance:
    if isinstance(value, str) and _CLASS.match(value):
        return Tolerance(dimension, designation=_designation(value, dimension))
    phrase = f"a tolerance ({DIMENSIONS[dimension].phrase})"
    if isinstance(value, bool) or not isinstance(value, (int, float, str, list)):
        raise QuantityError(
            "wrong-type",
            f"expected {phrase}, found {type_phrase(value)}",
            found=shown_value(value),
            expected="[lower limit, upper limit], one half band, or a class of a standard",
        )
    band = read_within(value, lambda each: units.read(each, dimension), phrase, known=False)
    return Tolerance(dimension, outright=band)


def read_within(value: object, read: Read, phrase: str, *, known: bool) -> Band:
    """`[lower, upper]`, `"+-0.02 mm"`, or one value -> Band; `read` reads each, `phrase` names it.

    One value without a plus-minus sign is known outright where `known`, else it is a half band.
    Raises `QuantityError`.
    """
    if isinstance(value, list):
        if len(value) != 2:
            raise QuantityError(
                "wrong-type",
                f"expected {phrase}, found a list of {len(value)}",
                found=shown_value(value),
                expected="[lower limit, upper limit]",
            )
        lower, upper = map(read, value)
        if upper < lower:
            raise QuantityError(
                "tolerance-reversed",
                "the upper limit is below the lower one",
                found=shown_value(value),
                expected="[lower limit, upper limit]",
            )
        return Band(lower, upper)
    if isinstance(value, str) and _PLUS_MINUS.match(value):
        value, known = _PLUS_MINUS.sub("", value, count=1), False
    one = read(value)
    if known:
        return Band(one, one)
    if one < 0.0:
        raise QuantityError(
            "negative",
            "a half band is zero or more",
            found=shown_value(value),
            expected="a half band of zero or more, or [lower limit, upper limit]",
        )
    return Band(-one, one)


def _from_table(table: Mapping[str, Any], dimension: str, units: UnitSystem) -> Tolerance:
    for key in table:
        if key not in TABLE_KEYS:
            raise QuantityError(
                "unknown-key",
                "a tolerance has no such key",
                found=key,
                expected=one_of(TABLE_KEYS),
                hint=did_you_mean(key, TABLE_KEYS),
            )
    distribution = _distribution(table)
    sigmas = _sigmas(table, distribution)
    if ("band" in table) == ("standard_deviation" in table):
        both = "band" in table
        raise QuantityError(
            "excluding-keys" if both else "missing-key",
            "a tolerance is given by a band or by a standard deviation",
            found="band and standard_deviation" if both else shown_value(dict(table)),
            expected="one of band, standard_deviation",
        )
    if "band" in table:
        stated = _read_key("band", lambda: _read_band(table["band"], dimension, units))
    else:
        deviation = _read_key("standard_deviation", lambda: _standard(table, dimension, units))
        stated = Tolerance(dimension, outright=Band(-sigmas * deviation, sigmas * deviation))
    group, sign = _group(table)
    return replace(stated, distribution=distribution, sigmas=sigmas, group=group, sign=sign)


def _read_key(key: str, read: Callable[[], Value]) -> Value:
    """What `read` returns; its error says which key of the table it is about."""
    try:
        return read()
    except QuantityError as error:
        error.message = f"{key}: {error.message}"
        raise


def _standard(table: Mapping[str, Any], dimension: str, units: UnitSystem) -> float:
    value = table["standard_deviation"]
    deviation = units.read(value, dimension)
    if deviation < 0.0:
        raise QuantityError(
            "negative",
            "a standard deviation is zero or more",
            found=shown_value(value),
            expected="a standard deviation of zero or more",
        )
    return deviation


def _distribution(table: Mapping[str, Any]) -> str:
    stated = "standard_deviation" in table
    word = table.get("distribution", "normal" if stated else DISTRIBUTIONS[0])
    if word not in DISTRIBUTIONS:
        raise QuantityError(
            "unknown-choice" if isinstance(word, str) else "wrong-type",
            f"distribution: {shown_value(word)} is none of the words that it takes",
            found=shown_value(word),
            expected=one_of(f'"{each}"' for each in DISTRIBUTIONS),
            hint=did_you_mean(word, DISTRIBUTIONS) if isinstance(word, str) else None,
        )
    if stated and word != "normal":
        raise QuantityError(
            "excluding-keys",
            "a standard deviation is that of a normal distribution",
            found=f'standard_deviation and distribution = "{word}"',
            expected=f'band, or distribution = "{DISTRIBUTIONS[-1]}"',
        )
    return str(word)


def _sigmas(table: Mapping[str, Any], distribution: str) -> float:
    if "sigmas" not in table:
        return DEFAULT_SIGMAS
    if distribution != "normal":
        raise QuantityError(
            "excluding-keys",
            "only a normal distribution has a band of so many standard deviations",
            found=f"sigmas and a distribution that is {distribution}",
            expected='distribution = "normal", or no sigmas',
        )
    sigmas = table["sigmas"]
    if isinstance(sigmas, bool) or not isinstance(sigmas, (int, float)):
        raise QuantityError(
            "wrong-type",
            f"sigmas: expected a plain number, found {type_phrase(sigmas)}",
            found=shown_value(sigmas),
            expected="a plain number, such as 2",
        )
    if not (math.isfinite(sigmas) and sigmas > 0.0):
        raise QuantityError(
            "not-positive" if math.isfinite(sigmas) else "not-finite",
            "sigmas: a band is a number of standard deviations above zero",
            found=shown_value(sigmas),
            expected="a plain number above zero, such as 2",
        )
    return float(sigmas)


def _group(table: Mapping[str, Any]) -> tuple[str | None, float]:
    group, sign = table.get("group"), table.get("sign", 1)
    if group is not None and (not isinstance(group, str) or not group.strip()):
        raise QuantityError(
            "bad-name" if isinstance(group, str) else "wrong-type",
            "group: a group is named by text that is not empty",
            found=shown_value(group),
            expected='a name, such as "drilled in one set-up"',
        )
    if isinstance(sign, bool) or sign not in (-1, 1):
        raise QuantityError(
            "unknown-choice",
            f"sign: {shown_value(sign)} is no sign",
            found=shown_value(sign),
            expected="1 or -1",
        )
    if "sign" in table and group is None:
        raise QuantityError(
            "missing-key",
            "a sign says how a tolerance varies with its group, and there is no group",
            found="sign, but no group",
            expected='group, such as group = "drilled in one set-up"',
        )
    return group, float(sign)


def _designation(text: str, dimension: str) -> str:
    if dimension != "length":
        raise QuantityError(
            "unknown-tolerance-class",
            f"a tolerance class for {DIMENSIONS[dimension].phrase}",
            found=shown_value(text),
            expected="[lower limit, upper limit] or one half band",
            hint="ISO 2768-1 goes by the length of an angle's shorter side, which no key says"
            if dimension == "angle"
            else None,
        )
    try:
        return tolerance_standards.canonical(text, dimension)
    except tolerance_standards.ToleranceClassError as error:
        raise QuantityError(
            error.code, error.message, found=error.found, expected=error.expected, hint=error.hint
        ) from None
