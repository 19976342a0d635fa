"""Tolerance classes by nominal size: ISO 2768-1 (general tolerances) and ISO 286-1 (IT classes).

The tables are package data, one CSV each, in the units of the standards. Sizes are in ranges "over
... up to and including ...". docs/tolerance_standards.md says which cells want confirming against
the standards themselves.
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache
from importlib.resources import files

from truepose.errors import ReadingError

_MM = 1e-3
_UM = 1e-6
_ARCMIN = math.pi / 180.0 / 60.0


@dataclass(frozen=True)
class Standard:
    """One table: how its classes are written, where the numbers are and what they mean."""

    title: str
    prefix: str
    table: str
    dimension: str
    unit: float
    half: float
    """Half band per number of the table: 1 where it is +-value, 1/2 where it is the whole width."""


STANDARDS = (
    Standard("ISO 2768-1 linear", "ISO 2768-", "iso2768_1_linear_mm.csv", "length", _MM, 1.0),
    Standard(
        "ISO 2768-1 angular", "ISO 2768-", "iso2768_1_angular_arcmin.csv", "angle", _ARCMIN, 1.0
    ),
    Standard("ISO 286-1", "", "iso286_it_um.csv", "length", _UM, 0.5),
)


class ToleranceClassError(ReadingError):
    """A class that no table has, or that has no value for a size."""


@dataclass(frozen=True)
class _Row:
    over: float
    up_to: float
    values: dict[str, float | None]


@cache
def _table(standard: Standard) -> tuple[_Row, ...]:
    text = (files("truepose.files") / "data" / standard.table).read_text(encoding="utf-8")
    rows = []
    for row in csv.DictReader(text.splitlines()):
        over, up_to = float(row.pop("over_mm")), row.pop("up_to_mm")
        values = {name: float(cell) if cell else None for name, cell in row.items()}
        rows.append(_Row(over, float(up_to) if up_to else math.inf, values))
    return tuple(rows)


def designations(dimension: str = "length") -> tuple[str, ...]:
    """Every class that can be written for a tolerance of this dimension, as it is written."""
    return tuple(
        standard.prefix + name
        for standard in STANDARDS
        if standard.dimension == dimension
        for name in _table(standard)[0].values
    )


def _normalised(designation: str) -> str:
    """ISO 2768-mK, iso 2768 m, "it 7": the same class however it is spaced and capitalised."""
    text = re.sub(r"[\s_-]++", "", designation).upper()
    return re.sub(r"^ISO2768(1(?=[A-Z]))?", "ISO2768", text)


def canonical(designation: str, dimension: str = "length") -> str:
    """The class as the tables name it. Raises `ToleranceClassError` for one that they lack."""
    known = {_normalised(name): name for name in designations(dimension)}
    plain = _normalised(designation)
    if plain in known:
        return known[plain]
    near = get_close_matches(plain, known, n=1)
    raise ToleranceClassError(
        "unknown-tolerance-class",
        "unknown tolerance class",
        found=f'"{designation}"',
        expected=" or ".join(f'"{example}"' for example in _examples(dimension)),
        hint=f'did you mean "{known[near[0]]}"?' if near else None,
    )


def _examples(dimension: str) -> tuple[str, ...]:
    names = designations(dimension)
    return (names[0], names[-1])


def half_band(designation: str, nominal: float, dimension: str = "length") -> float:
    """Half band of a class: the tolerance is +- this about the nominal size.

    `nominal` is the size in m that picks the range: the length itself, or for an angle the length
    of its shorter side. The result is in m, or in rad for `dimension="angle"`. ISO 2768-1 states
    the half band; ISO 286-1 states the whole width of an IT class, which is taken symmetric.

    Raises `ToleranceClassError` for an unknown class and for a size to which the standard gives
    this class no value.
    """
    name = canonical(designation, dimension)
    standard = next(
        standard
        for standard in STANDARDS
        if standard.dimension == dimension and name in designations_of(standard)
    )
    key = name.removeprefix(standard.prefix)
    # The tables' limits are whole tenths of a millimetre; 0.003 m / 1e-3 must not fall above 3.
    size = round(abs(nominal) / _MM, 9)
    for row in _table(standard):
        value = row.values[key]
        if row.over < size <= row.up_to and value is not None:
            return value * standard.unit * standard.half
    covered = [row for row in _table(standard) if row.values[key] is not None]
    raise ToleranceClassError(
        "tolerance-out-of-range",
        f"{standard.title} gives {name} no value for {size:g} mm",
        found=f"{name} on {size:g} mm",
        expected=f"a size over {covered[0].over:g} mm and up to {covered[-1].up_to:g} mm, "
        "or the limits outright",
    )


def designations_of(standard: Standard) -> tuple[str, ...]:
    """The classes of one table, as they are written in a machine file."""
    return tuple(standard.prefix + name for name in _table(standard)[0].values)
