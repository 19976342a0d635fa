"""What a study varies: `KEY=VALUES`, where a key is one that `--set` takes.

    strut.*.stiffness=30:120:4 N/um      four values from 30 to 120, as a grid has them
    strut.*.stiffness=30:120 N/um        any value in between, for designs that draw points
    strut.*.material=steel,invar         these two
    each:strut.*.stiffness=30,60 N/um    each strut for itself

A pattern is one variable: all that it names has the same value in a variant. Every value is kept as
the text that `--set` takes, so that a variant is the file with some settings and nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.files.settings import unquoted
from truepose.files.units import meant, shown_value
from truepose.files.wording import did_you_mean
from truepose.machine import Machine

EACH = "each:"
"""Before a pattern: what it names varies one by one."""

MOST_LEVELS = 100_000
"""Values of one variable."""

EXAMPLE = 'KEY=VALUES, such as strut.*.stiffness="30:120:4 N/um" or strut.*.material=steel,invar'

_NUMBER = re.compile(r"[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+")
_UNIT = re.compile(r"(?:[A-Za-zµμ°%/1][^\"'\[\]{}=]*+)?+")
_OPENS, _CLOSES = "[{(", ")}]"


@dataclass(frozen=True)
class VariedKey:
    """One variable of a study.

    `levels`: the values it has, as `--set` takes them; none where it is continuous. `numbers`: the
    same as numbers in `unit`, none where they are words. `ends`: of a continuous one, in `unit`.
    `changes`: the keys of the file that it sets, patterns resolved.
    """

    key: str
    levels: tuple[str, ...] = ()
    numbers: tuple[float, ...] = ()
    unit: str = ""
    ends: tuple[float, float] | None = None
    changes: tuple[str, ...] = ()

    @property
    def is_continuous(self) -> bool:
        """Whether it has any value between two ends."""
        return self.ends is not None

    @property
    def is_number(self) -> bool:
        """Whether its values are numbers, and no words."""
        return self.is_continuous or bool(self.numbers)

    def at_levels(self, numbers: Indices) -> tuple[list[str], Floats]:
        """Settings, and values (n,) in `unit`, at the levels numbered so; NaN of words."""
        values = np.array(self.numbers or [np.nan] * len(self.levels))
        return [self.levels[number] for number in numbers.tolist()], values[numbers]

    def at_shares(self, shares: Floats) -> tuple[list[str], Floats]:
        """The same at shares (n,) in [0, 1) of the way from the first value to the last.

        Levels are strata of equal width.
        """
        if self.ends is None:
            count = len(self.levels)
            numbers = np.minimum((shares * count).astype(np.intp), count - 1)
            return self.at_levels(numbers)
        low, high = self.ends
        values = low + shares * (high - low)
        return [_written(value, self.unit) for value in values.tolist()], values

    def tried(self, most: int) -> list[str]:
        """Values that stand for all: the ends, or levels spread evenly where there are more."""
        if self.ends is not None:
            return [_written(end, self.unit) for end in self.ends]
        chosen = np.unique(np.linspace(0, len(self.levels) - 1, most).round().astype(np.intp))
        return [self.levels[number] for number in chosen.tolist()]


def read_varied(vary: Mapping[str, str] | Sequence[str], machine: Machine) -> tuple[VariedKey, ...]:
    """The variables of `["KEY=VALUES", ...]`, or of a dict of them, in their order.

    Names are those of the `machine`. Raises `RequestError` (bad-vary) with all that cannot be read.
    """
    given = [f"{k}={v}" for k, v in vary.items()] if isinstance(vary, Mapping) else list(vary)
    problems: list[Problem] = []
    varied: list[VariedKey] = []
    if not given:
        problems.append(_bad("nothing is varied", "no variable", EXAMPLE))
    for text in given:
        try:
            varied += _read(text, machine)
        except _UnreadableError as failure:
            problems.append(failure.problem)
    problems += _twice(varied)
    if problems:
        raise RequestError(*problems)
    return tuple(varied)


class _UnreadableError(Exception):
    def __init__(self, text: str, message: str, given: str, expected: str, hint: str = "") -> None:
        super().__init__(message)
        shown = text if len(text) <= 80 else text[:77] + "..."
        self.problem = _bad(f"--vary {shown}: {message}", given, expected, hint or None)


def _bad(message: str, given: str, expected: str, hint: str | None = None) -> Problem:
    return Problem("bad-vary", message, found=given, expected=expected, hint=hint)


def _read(text: str, machine: Machine) -> Iterator[VariedKey]:
    path, equals, values = (part.strip() for part in text.partition("="))
    independent = path.startswith(EACH)
    key = unquoted(path.removeprefix(EACH))
    if not (equals and values and key and all(key.split("."))):
        raise _UnreadableError(text, "not a key and its values", shown_value(text), EXAMPLE)
    if key.split(".")[0] == "workspace":
        raise _UnreadableError(
            text,
            "the poses of a study are those of its base file",
            key,
            "a key of another table",
            "change the workspace with --set, for all variants",
        )
    levels, numbers, unit, ends = _values(text, values)
    changes = _changed(key, machine)
    if independent and changes == (key,) and ("*" in key or "?" in key or "[" in key):
        raise _UnreadableError(
            text,
            "the pattern names nothing",
            key,
            "a pattern over rows of the machine, such as each:strut.*.stiffness",
            did_you_mean(key.split(".")[0], _rows(machine)) or "",
        )
    for one in changes if independent else (key,):
        own = (one,) if independent else changes
        yield VariedKey(one, levels, numbers, unit, ends, own)


_Values = tuple[tuple[str, ...], tuple[float, ...], str, tuple[float, float] | None]


def _values(text: str, values: str) -> _Values:
    parts = _split(values, ":")
    if len(parts) > 1 and _number_and_unit(parts[0]) is not None:
        return _range(text, values, parts)
    levels = [part.strip() for part in _split(values, ",")]
    if not all(levels):
        raise _UnreadableError(text, "an empty value", shown_value(values), "values between commas")
    both = [_number_and_unit(level) for level in levels]
    pairs = [pair for pair in both if pair is not None]
    unit = ""
    if len(pairs) == len(levels):
        numbers = [number for number, _ in pairs]
        unit = _one_unit(text, [own for _, own in pairs])
        levels = [_written(number, unit) for number in numbers]
    else:
        numbers = []
    if len(set(levels)) < len(levels):
        twice = next(level for level in levels if levels.count(level) > 1)
        raise _UnreadableError(text, "a value twice", twice, "each value once")
    if len(levels) > MOST_LEVELS:
        raise _too_many(text, len(levels))
    return tuple(levels), tuple(numbers), unit, None


def _range(text: str, values: str, parts: list[str]) -> _Values:
    """`from:to:count UNIT`, or `from:to UNIT`."""
    expected = "from:to:count with one unit, such as 30:120:4 N/um, or from:to"
    both = [_number_and_unit(part) for part in parts]
    pairs = [pair for pair in both if pair is not None]
    if len(parts) not in (2, 3) or len(pairs) < len(parts):
        raise _UnreadableError(text, "not a range", shown_value(values), expected)
    (start, _), (stop, _), *last = pairs
    units = [own for _, own in pairs]
    # The count may bring the unit of all, and need not repeat that of the ends.
    unit = _one_unit(text, units[:2] if last and not units[2] else units)
    if not last:
        if start >= stop:
            raise _UnreadableError(
                text, "the ends are equal or reversed", shown_value(values), expected
            )
        return (), (), unit, (start, stop)
    count = last[0][0]
    if not count.is_integer() or count < 1:
        raise _UnreadableError(
            text, "the count is not a whole number above zero", f"{count:g}", expected
        )
    if count > MOST_LEVELS:
        raise _too_many(text, count)
    if (count == 1) != (start == stop):
        one = "one value with two different ends" if count == 1 else "several values between equal"
        raise _UnreadableError(text, f"{one} ends", shown_value(values), expected)
    numbers = meant(np.linspace(start, stop, int(count))).tolist()
    return tuple(_written(number, unit) for number in numbers), tuple(numbers), unit, None


def _too_many(text: str, count: float) -> _UnreadableError:
    return _UnreadableError(
        text, "too many values of one variable", f"{count:,.0f}", f"at most {MOST_LEVELS:,}"
    )


def _one_unit(text: str, units: list[str]) -> str:
    """The unit of all: all say it, or the last does for all, or none. Raises for others."""
    unit = units[-1]
    if any(own not in ("", unit) for own in units) or len(set(units[:-1])) > 1:
        shown = ", ".join(dict.fromkeys(own or "no unit" for own in units))
        raise _UnreadableError(
            text,
            "mixed units",
            shown,
            "one unit for all values, with each of them or after the last",
        )
    return unit


def _number_and_unit(text: str) -> tuple[float, str] | None:
    """`57.5 N/um` -> (57.5, "N/um"); None of what is no number with a unit, or without."""
    match = _NUMBER.match(text.strip())
    if match is None:
        return None
    unit = text.strip()[match.end() :].strip()
    return (float(match[0]), unit) if _UNIT.fullmatch(unit) else None


def _written(number: float, unit: str) -> str:
    """As `--set` takes it: the shortest digits that are this very number."""
    digits = repr(number).removesuffix(".0")
    return f"{digits} {unit}" if unit else digits


def _split(text: str, mark: str) -> list[str]:
    """The parts between marks that stand in no bracket and no quotation marks."""
    parts, depth, quote, start = [], 0, "", 0
    for at, character in enumerate(text):
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'":
            quote = character
        elif character in _OPENS:
            depth += 1
        elif character in _CLOSES:
            depth -= 1
        elif character == mark and depth <= 0:
            parts.append(text[start:at])
            start = at + 1
    return [*parts, text[start:]]


def _rows(machine: Machine) -> dict[str, list[str]]:
    """Names of the rows of the tables that have some."""
    return {
        "drive": [drive.name for drive in machine.drives],
        "strut": [strut.name for strut in machine.struts],
        "guide": [guide.name for guide in machine.guides],
        "limb": [limb.name for limb in machine.limbs],
    }


def _changed(key: str, machine: Machine) -> tuple[str, ...]:
    """The keys that a setting of `key` changes: those of all rows that its pattern names."""
    table, _, rest = key.partition(".")
    if table == "tolerance":
        matching = [name for name in machine.parameters if fnmatchcase(name, rest)]
        return tuple(f"{table}.{name}" for name in matching) or (key,)
    words = rest.split(".")
    names = _rows(machine).get(table, [])
    # A name may hold points itself: the longest one that there is, as `--set` takes it.
    for taken in range(len(words) - 1, 0, -1):
        pattern = ".".join(words[:taken])
        matching = [name for name in names if fnmatchcase(name, pattern)]
        if matching:
            below = ".".join(words[taken:])
            return tuple(f"{table}.{name}.{below}" for name in matching)
    return (key,)


def _twice(varied: Sequence[VariedKey]) -> Iterator[Problem]:
    """Keys that two variables set: the later one would win, and the plan would not say so."""
    owner: dict[str, str] = {}
    for variable in varied:
        for change in variable.changes:
            if change in owner:
                yield _bad(
                    f"two variables set {change}",
                    f"{owner[change]} and {variable.key}",
                    "each key in one variable",
                )
                break
            owner[change] = variable.key


__all__ = ["EACH", "VariedKey", "read_varied"]
