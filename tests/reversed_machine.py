"""The machine file whose every deviation has the other sign: bands, loads, heat, known errors.

[-a, b] becomes [-b, a]; what is warmer than the reference becomes as much colder; forces pull where
they pushed, and down is up. For files of bare numbers (`machine_file_units.bare`), in rad and K.
"""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np

from machine_file import File, Row, rows_of
from reference_kinematics import angles_of, rotation_of

REFERENCE = 293.15
"""K, where a file says none (ISO 1)."""


def reversed_file(file: File) -> File:
    """The same machine with all its deviations negated."""
    result = copy.deepcopy(file)
    for key, band in result.get("tolerance", {}).items():
        result["tolerance"][key] = _band(band)
    for strut in rows_of(result, "strut"):
        if "length_tolerance" in strut:
            strut["length_tolerance"] = _band(strut["length_tolerance"])
        if "screw" in strut:
            strut["screw"]["lead"] *= -1
    for drive in rows_of(result, "drive"):
        _drive(drive)
    _condition(result.setdefault("condition", {}))
    # Half a turn about a level axis takes down to up.
    given = result.get("mounting", {})
    mounting = rotation_of([given.get(name, 0.0) for name in "abc"])
    angles = angles_of(np.diag([1.0, -1.0, -1.0]) @ mounting)
    result["mounting"] = dict(zip("abc", angles.tolist(), strict=True))
    return result


def _band(value: Any) -> Any:
    """Of a tolerance; one number or class is as wide to either side."""
    if isinstance(value, list):
        return [_negated(each) for each in reversed(value)]
    if isinstance(value, dict):
        result = dict(value)
        if "band" in value:
            result["band"] = _band(value["band"])
        if "values" in value:
            result["values"] = [-each for each in value["values"]]
        return result
    return value


def _negated(value: float | str) -> float | str:
    if not isinstance(value, str):
        return -value
    return value[1:] if value.startswith("-") else f"-{value}"


def _known(value: Any) -> Any:
    """Of what is known where it is one number."""
    if isinstance(value, list):
        return _band(value)
    return value if isinstance(value, str) and value.startswith("+-") else _negated(value)


def _drive(drive: Row) -> None:
    for table, key in (("sensor", "scale_error"), ("actuator", "lead_error")):
        if key in drive.get(table, {}):
            drive[table][key] = _known(drive[table][key])
    periodic = drive.get("actuator", {}).get("periodic", {})
    if "phase" in periodic:
        periodic["phase"] += math.pi
    guideway = drive.get("guideway", {})
    for entry in guideway.get("straightness", []):
        if entry.get("known", False):
            entry["amplitude"] *= -1
    for key in ("squareness", "parallelism"):
        if key in guideway:
            guideway[key] = _band(guideway[key])


def _condition(condition: Row) -> None:
    if "temperature" in condition:
        reference = condition.get("reference_temperature", REFERENCE)
        given = condition["temperature"]
        parts = given if isinstance(given, dict) else {"default": given}
        condition["temperature"] = {name: 2 * reference - each for name, each in parts.items()}
    for name, gradient in condition.get("gradient", {}).items():
        each = [-value for value in gradient] if isinstance(gradient, list) else -gradient
        condition["gradient"][name] = each
    for key in ("force", "moment", "acceleration"):
        if key in condition:
            condition[key] = {name: -value for name, value in condition[key].items()}
