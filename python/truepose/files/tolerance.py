"""A tolerance as a machine file writes it: two limits, one half band, or a class of a standard.

Or a table with what else is known: how it is distributed, which values were measured, and what
varies with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, TypeVar

from truepose.files import tolerance_standards
from truepose.files.dimensions import DIMENSIONS
from truepose.files.units import QuantityError, UnitSystem, shown_value, type_phrase
from truepose.files.varies import HINT, MACHINE, RUN, VISIT
from truepose.files.wording import did_you_mean, one_of
from truepose.probability.distributions import student_deviation

Value = TypeVar("Value")
Read = Callable[[object], float]
"""Reads one value of the file, SI. Raises `QuantityError`."""

DISTRIBUTIONS = (
    "uniform",
    "triangular",
    "arcsine",
    "two-point",
    "normal",
    "student-t",
    "discrete",
    "empirical",
)
"""Words for how a tolerance is distributed in its band."""

ENDLESS = ("normal", "student-t")
"""Those without an end, whose band is so many standard deviations."""

LISTED = ("discrete", "empirical")
"""Those of listed values."""

LEAST_DOF = 2.0
"""Student's distribution has a standard deviation only above so many degrees of freedom."""

VARIES = (MACHINE, RUN, VISIT)
"""What a tolerance may vary with."""

DEFAULT_SIGMAS = 3.0
"""The half band of a normal distribution, in standard deviations, where nothing says it."""

TABLE_KEYS = {
    "band": "the limits, one half band, or a class",
    "standard_deviation": "in place of band: a normal or student-t distribution about nominal",
    "scale": "in place of band: the scale of a student-t distribution, as JCGM 101 has it",
    "values": "in place of band: list of the deviations that there are, or that were measured",
    "data": "in place of values: CSV file of measured deviations, in a column `deviation`",
    "distribution": one_of(DISTRIBUTIONS).removeprefix("one of "),
    "sigmas": "of a normal or student-t distribution: the half band in standard deviations",
    "dof": "of a student-t distribution: its degrees of freedom, more than 2",
    "probabilities": "of a discrete distribution: list of the probability of each of `values`",
    "group": "what varies together has one name",
    "sign": "-1 where it varies the other way than its group",
    "varies": "with machine (default), with run, or with visit, as what never repeats does",
}
"""Keys of a tolerance that is written as a table."""

_BANDS = ("band", "standard_deviation", "scale", "values", "data")
"""Keys of a table that say how wide a tolerance is, of which it has one."""

_USUAL = {"standard_deviation": "normal", "scale": "student-t"}
"""Distribution of a tolerance that has the key and does not name one."""

_PLUS_MINUS = re.compile(r"\s*+(?:±|\+/?-)\s*+(?=[\d.])")
_CLASS = re.compile(r"\s*+[A-Za-z]")


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
    """A band outright, a class of a length whose band depends on the nominal size, or values.

    `distribution`: one of `DISTRIBUTIONS`; of a normal or student-t one the half band is `sigmas`
    standard deviations. A discrete or empirical one has `values`, deviations from nominal, and
    `probabilities`, or the name of the file of them, `data`. Tolerances of one `group` vary
    together, each with its `sign` (+1 or -1). `varies`: one of `VARIES`.
    """

    dimension: str
    outright: Band | None = None
    designation: str | None = None
    distribution: str = DISTRIBUTIONS[0]
    sigmas: float = DEFAULT_SIGMAS
    group: str | None = None
    sign: float = 1.0
    dof: float | None = None
    values: tuple[float, ...] = ()
    probabilities: tuple[float, ...] = ()
    data: str | None = None
    varies: str = MACHINE

    def band(self, nominal: float) -> Band:
        """The band for a nominal size in m; not of listed values, whose band is their own.

        Raises `tolerance_standards.ToleranceClassError`.
        """
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
    band = read_within(value, lambda limit: units.read(limit, dimension), phrase, known=False)
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
    given = [key for key in _BANDS if key in table]
    if len(given) != 1:
        raise QuantityError(
            "excluding-keys" if given else "missing-key",
            "a tolerance is given by a band, by a standard deviation, by a scale or by its values",
            found=" and ".join(given) or shown_value(dict(table)),
            expected=one_of(_BANDS),
        )
    distribution = _distribution(table)
    sigmas, dof = _sigmas(table, distribution), _dof(table, distribution)
    group, sign = _group(table)
    stated = Tolerance(dimension)
    if "band" in table:
        stated = _read_key("band", lambda: _read_band(table["band"], dimension, units))
    elif "standard_deviation" in table:
        deviation = _read_width(table, "standard_deviation", dimension, units)
        stated = Tolerance(dimension, outright=Band(-sigmas * deviation, sigmas * deviation))
    elif "scale" in table:
        assert dof is not None  # a scale goes with student-t alone, and that with dof
        deviation = student_deviation(_read_width(table, "scale", dimension, units), dof)
        stated = Tolerance(dimension, outright=Band(-sigmas * deviation, sigmas * deviation))
    return replace(
        stated,
        distribution=distribution,
        sigmas=sigmas,
        dof=dof,
        values=_read_key("values", lambda: _values(table, dimension, units)),
        probabilities=_probabilities(table, distribution),
        data=_data(table),
        group=group,
        sign=sign,
        varies=_varies(table),
    )


def _read_key(key: str, read: Callable[[], Value]) -> Value:
    """What `read` returns; its error says which key of the table it is about."""
    try:
        return read()
    except QuantityError as error:
        error.message = f"{key}: {error.message}"
        raise


def _read_width(table: Mapping[str, Any], key: str, dimension: str, units: UnitSystem) -> float:
    """A standard deviation, or a scale."""
    value, phrase = table[key], key.replace("_", " ")
    width = _read_key(key, lambda: units.read(value, dimension))
    if width < 0.0:
        raise QuantityError(
            "negative",
            f"{key}: a {phrase} is zero or more",
            found=shown_value(value),
            expected=f"a {phrase} of zero or more",
        )
    return width


def _distribution(table: Mapping[str, Any]) -> str:
    """The word for it: the one written, or the one that the other keys go with."""
    listed = "values" in table or "data" in table
    if listed:
        usual = "discrete" if "probabilities" in table else "empirical"
    else:
        usual = next((word for key, word in _USUAL.items() if key in table), DISTRIBUTIONS[0])
    word = table.get("distribution", usual)
    if word not in DISTRIBUTIONS:
        raise QuantityError(
            "unknown-choice" if isinstance(word, str) else "wrong-type",
            f"distribution: {shown_value(word)} is not one of the allowed words",
            found=shown_value(word),
            expected=one_of(f'"{name}"' for name in DISTRIBUTIONS),
            hint=did_you_mean(word, DISTRIBUTIONS) if isinstance(word, str) else None,
        )
    if "standard_deviation" in table and word not in ENDLESS:
        raise QuantityError(
            "excluding-keys",
            "a standard deviation is that of a normal or student-t distribution",
            found=f'standard_deviation and distribution = "{word}"',
            expected='band, or distribution = "normal"',
        )
    if "scale" in table and word != _USUAL["scale"]:
        raise QuantityError(
            "excluding-keys",
            "a scale is that of a student-t distribution",
            found=f'scale and distribution = "{word}"',
            expected='scale and dof, or standard_deviation and distribution = "normal"',
        )
    if listed != (word in LISTED):
        raise QuantityError(
            "excluding-keys" if listed else "missing-key",
            "a discrete or empirical distribution is one of listed values",
            found=f"{'values' if 'values' in table else 'data' if listed else 'no values'} and "
            f'distribution = "{word}"',
            expected='values and distribution = "discrete" or "empirical"',
        )
    if "data" in table and word == "discrete":
        raise QuantityError(
            "excluding-keys",
            "a file of measured deviations is an empirical distribution",
            found="data and a distribution that is discrete",
            expected='values and probabilities, or distribution = "empirical"',
        )
    return str(word)


def _sigmas(table: Mapping[str, Any], distribution: str) -> float:
    if "sigmas" not in table:
        return DEFAULT_SIGMAS
    if distribution not in ENDLESS:
        raise QuantityError(
            "excluding-keys",
            "only a normal or student-t distribution has a band of so many standard deviations",
            found=f"sigmas and a distribution that is {distribution}",
            expected='distribution = "normal", or no sigmas',
        )
    sigmas = _unitless(table["sigmas"], "sigmas", such_as="2")
    if sigmas <= 0.0:
        raise QuantityError(
            "not-positive",
            "sigmas: a band is a number of standard deviations above zero",
            found=shown_value(table["sigmas"]),
            expected="a plain number above zero, such as 2",
        )
    return sigmas


def _dof(table: Mapping[str, Any], distribution: str) -> float | None:
    student = distribution == "student-t"
    if student != ("dof" in table):
        raise QuantityError(
            "missing-key" if student else "excluding-keys",
            "a student-t distribution, and no other, has degrees of freedom",
            found="no dof" if student else f"dof and a distribution that is {distribution}",
            expected='distribution = "student-t" and dof, such as dof = 4',
        )
    if not student:
        return None
    dof = _unitless(table["dof"], "dof", such_as="4")
    if dof <= LEAST_DOF:
        raise QuantityError(
            "too-few-degrees-of-freedom",
            "dof: a student-t distribution has no standard deviation with so few",
            found=shown_value(table["dof"]),
            expected=f"a plain number above {LEAST_DOF:g}, such as 4",
        )
    return dof


def _unitless(value: object, key: str, *, such_as: str) -> float:
    """A finite number without a unit."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise QuantityError(
            "wrong-type",
            f"{key}: expected a plain number, found {type_phrase(value)}",
            found=shown_value(value),
            expected=f"a plain number, such as {such_as}",
        )
    if not math.isfinite(value):
        raise QuantityError(
            "not-finite",
            f"{key}: not a finite number",
            found=shown_value(value),
            expected=f"a plain number, such as {such_as}",
        )
    return float(value)


def _values(table: Mapping[str, Any], dimension: str, units: UnitSystem) -> tuple[float, ...]:
    if "values" not in table:
        return ()
    listed = _filled_list(table["values"], DIMENSIONS[dimension].plural)
    return tuple(units.read(text, dimension) for text in listed)


def _probabilities(table: Mapping[str, Any], distribution: str) -> tuple[float, ...]:
    discrete = distribution == "discrete"
    if discrete != ("probabilities" in table):
        raise QuantityError(
            "missing-key" if discrete else "excluding-keys",
            "a discrete distribution, and no other, has probabilities",
            found="no probabilities"
            if discrete
            else f"probabilities and a distribution that is {distribution}",
            expected='values and probabilities, or distribution = "empirical"',
            hint="values that are all as likely are an empirical distribution"
            if discrete
            else None,
        )
    if not discrete:
        return ()
    listed = _read_key(
        "probabilities", lambda: _filled_list(table["probabilities"], "plain numbers")
    )
    return tuple(_unitless(text, "probabilities", such_as="0.5") for text in listed)


def _filled_list(value: object, phrase: str) -> list[Any]:
    if not isinstance(value, list) or not value:
        raise QuantityError(
            "wrong-type",
            f"expected a list of {phrase}, found "
            f"{'an empty one' if value == [] else type_phrase(value)}",
            found=shown_value(value),
            expected=f"a list of {phrase}",
        )
    return value


def _data(table: Mapping[str, Any]) -> str | None:
    name = table.get("data")
    if name is not None and (not isinstance(name, str) or not name.strip()):
        raise QuantityError(
            "wrong-type",
            "data: expected the name of a CSV file",
            found=shown_value(name),
            expected='the name of a file, such as "measured.csv"',
        )
    return name


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
            f"sign: {shown_value(sign)} is not a sign",
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


def _varies(table: Mapping[str, Any]) -> str:
    word = table.get("varies", MACHINE)
    if word not in VARIES:
        raise QuantityError(
            "unknown-choice" if isinstance(word, str) else "wrong-type",
            f"varies: a tolerance does not vary with {shown_value(word)}",
            found=shown_value(word),
            expected=one_of(f'"{one}"' for one in VARIES),
            hint=HINT,
        )
    return str(word)


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
        raise QuantityError(**asdict(error.fault)) from None
