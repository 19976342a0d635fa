"""Machine files in other units, and of machines of other size: every quantity of a file in turn.

Where a file has a quantity, and of which dimension, is what the machine file's schema says
(`docs/machine_file.schema.json`), so that a new key is covered as it comes. How a unit is read is
said here again, in a dozen lines, without the loader and the library that it takes.
"""

from __future__ import annotations

import copy
import json
import math
import re
from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from drive_kinds import turns
from machine_file import File

INCH, POUND = 0.0254, 0.45359237
LBF = POUND * 9.80665

FACTORS = {
    **{"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": INCH, "ft": 12 * INCH},
    **{"rad": 1.0, "deg": math.pi / 180.0},
    **{"kg": 1.0, "g": 1e-3, "lb": POUND, "s": 1.0, "min": 60.0},
    **{"N": 1.0, "kN": 1e3, "lbf": LBF},
    **{"Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "psi": LBF / INCH**2},
    **{"K": 1.0, "delta_degC": 1.0, "delta_degF": 5.0 / 9.0, "degC": 1.0, "degF": 5.0 / 9.0},
    **{"ppm": 1e-6},
}
"""SI value of the units that files of the tests are written in."""

ZEROS = {"degC": 273.15, "degF": 459.67 * 5.0 / 9.0}
"""K, of the zero of a temperature scale."""

SI = {
    **{"length": "m", "angle": "rad", "force": "N", "moment": "N m", "temperature": "K"},
    **{"temperature_difference": "K", "area": "m^2", "stress": "Pa", "stiffness": "N/m"},
    **{"expansion": "1/K", "mass": "kg", "time": "s", "acceleration": "m/s^2"},
    **{"temperature_gradient": "K/m", "torsional_stiffness": "N m/rad", "second_moment": "m^4"},
}
"""A unit of every dimension that a bare number may have."""

CUSTOMARY = {
    **{"length": "in", "angle": "rad", "force": "lbf", "moment": "lbf in"},
    **{"temperature": "degF", "temperature_difference": "delta_degF", "area": "in^2"},
    **{"stress": "psi", "stiffness": "lbf/in", "expansion": "1/delta_degF", "mass": "lb"},
    **{"time": "min", "acceleration": "ft/s^2", "temperature_gradient": "delta_degF/in"},
    **{"torsional_stiffness": "lbf in/rad", "second_moment": "in^4"},
}
"""Inches and pounds."""

Change = Callable[[float, str], float]
"""(value in SI, dimension) -> value in SI."""

_NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*)")
_CLASS = re.compile(r"\s*[A-Za-z]")
_PLUS_MINUS = re.compile(r"\s*(?:±|\+/?-)\s*(?=[\d.])")
_SCHEMA = Path(__file__).parent.parent / "docs" / "machine_file.schema.json"
_OF_PARAMETER = {"m": "length", "rad": "angle", "1": "ratio"}


def bare(
    file: File,
    parameters: Mapping[str, str],
    units: Mapping[str, str] = SI,
    change: Change = lambda value, _: value,
) -> File:
    """The file with every quantity as a bare number of `units`, changed on the way if asked.

    `parameters`, name -> unit, are the machine's: what the keys of [tolerance] stand for. Left as
    they are: classes of tolerances, ratios, and angles told as a rise over a length.
    """
    result = copy.deepcopy(file)
    result["units"] = dict(units)
    walk = _Walk(file.get("units", {}), units, change)
    for table, content in file.items():
        if table in ("schema", "units"):
            continue
        if table == "tolerance":
            result[table] = {
                key: walk.tolerance(value, _dimension(key, parameters))
                for key, value in content.items()
            }
        else:
            result[table] = walk.value(content, _schema()[table])
    return result


def resized(file: File, parameters: Mapping[str, str], factor: float) -> File:
    """A machine `factor` times as large, whose every error in position is as much larger, in SI.

    Lengths go with `factor`; angles, materials and temperatures stay. Areas, forces and masses, of
    which only the weight counts, go with its square, so that parts give way in proportion.
    """
    powers = {
        **{"length": 1, "area": 2, "force": 2, "moment": 3, "stiffness": 1},
        **{"torsional_stiffness": 3, "mass": 2, "temperature_gradient": -1, "second_moment": 4},
    }
    return bare(file, parameters, SI, lambda value, of: value * factor ** powers.get(of, 0))


def si_value(text: str) -> float:
    """A number with its unit, such as "8 um / 300 mm" or "15 N m", in SI; no temperatures."""
    match = _NUMBER.match(text)
    if match is None:
        raise ValueError(f"no number: {text!r}")
    above, *below = match[2].split("/")
    value = float(match[1]) * _product(above)
    for each in below:
        value /= _product(each)
    return value


def _product(text: str) -> float:
    value = 1.0
    for factor in text.replace("*", " ").split():
        unit, _, power = factor.partition("^")
        value *= FACTORS[unit] ** int(power or 1) if unit in FACTORS else float(factor)
    return value


@cache
def _schema() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(_SCHEMA.read_text(encoding="utf-8"))["properties"]
    return found


def _dimension(key: str, parameters: Mapping[str, str]) -> str:
    (unit,) = {unit for name, unit in parameters.items() if fnmatchcase(name, key)}
    return _OF_PARAMETER[unit]


class _Walk:
    """Goes through the tables of one file with their schema."""

    def __init__(
        self, declared: Mapping[str, str], units: Mapping[str, str], change: Change
    ) -> None:
        self.declared = declared
        self.units = units
        self.change = change

    def value(self, value: Any, schema: Mapping[str, Any], *, angular: bool = False) -> Any:
        """A value of the file; `angular`: of a drive whose coordinate is an angle."""
        dimension = schema.get("x-angular" if angular and "x-angular" in schema else "x-dimension")
        if "x-grid" in schema:
            assert dimension is not None
            return [*(self.quantity(each, dimension) for each in value[:2]), value[2]]
        if "x-tolerance" in schema:
            assert dimension is not None
            return self.tolerance(value, dimension)
        if dimension in ("direction", "ratio") or "x-slope" in schema:
            return value
        if dimension is not None:
            return self.every(value, dimension)
        if isinstance(value, dict):
            kind = _of_kind(schema, value)
            angular = angular or turns(value.get("kind", ""))
            # A table of any keys has one schema for them all.
            others = kind.get("additionalProperties") or {}
            return {
                key: self.value(each, kind.get("properties", {}).get(key, others), angular=angular)
                for key, each in value.items()
            }
        if isinstance(value, list):
            firsts = schema.get("prefixItems", [])
            rest = schema.get("items", {})
            each_schema = [*firsts, *[rest] * (len(value) - len(firsts))]
            return [
                self.value(e, s, angular=angular) for e, s in zip(value, each_schema, strict=True)
            ]
        return value

    def every(self, value: Any, dimension: str) -> Any:
        """Quantities of one dimension: one, a list, or a table of any names."""
        if isinstance(value, dict):
            return {key: self.every(each, dimension) for key, each in value.items()}
        if isinstance(value, list):
            return [self.every(each, dimension) for each in value]
        return self.quantity(value, dimension)

    def tolerance(self, value: Any, dimension: str) -> Any:
        if dimension == "ratio" or (isinstance(value, str) and _CLASS.match(value)):
            return value
        if isinstance(value, dict):
            bands = ("band", "standard_deviation", "values")
            return {
                key: self.tolerance(each, dimension) if key in bands else each
                for key, each in value.items()
            }
        if isinstance(value, str):
            value = _PLUS_MINUS.sub("", value)
        return self.every(value, dimension)

    def quantity(self, value: float | str, dimension: str) -> float:
        si = self.change(self.read(value, dimension), dimension)
        unit = self.units[dimension]
        zero = ZEROS.get(unit, 0.0) if dimension == "temperature" else 0.0
        return (si - zero) / si_value(f"1 {unit}" if unit[0] != "1" else unit)

    def read(self, value: float | str, dimension: str) -> float:
        """In SI."""
        if isinstance(value, str):
            number = _NUMBER.match(value)
            assert number is not None
            if dimension != "temperature":
                return si_value(value)
            magnitude, unit = float(number[1]), number[2].strip()
        else:
            magnitude, unit = float(value), self.declared[dimension]
        if dimension == "temperature":
            return magnitude * FACTORS[unit] + ZEROS.get(unit, 0.0)
        return magnitude * si_value(f"1 {unit}" if unit[0] != "1" else unit)


def _of_kind(schema: Mapping[str, Any], row: Mapping[str, Any]) -> Mapping[str, Any]:
    """The schema of a row of this kind."""
    for each in schema.get("anyOf", []):
        properties = each.get("properties", {})
        if properties.get("kind", {}).get("const") == row.get("kind"):
            found: Mapping[str, Any] = each
            return found
    return schema
