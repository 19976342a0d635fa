"""Whether two things that a machine is made of are equal, arrays and all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np


def equal(one: Any, other: Any) -> bool:
    """Whether both are of one type with equal parts; not a number equals not a number."""
    if one is other:
        return True
    if type(one) is not type(other):
        return False
    if isinstance(one, np.ndarray):
        return np.array_equal(one, other, equal_nan=one.dtype.kind in "fc")
    if is_dataclass(one):
        return all(
            equal(getattr(one, each.name), getattr(other, each.name))
            for each in fields(one)
            if each.init
        )
    if isinstance(one, Mapping):
        return one.keys() == other.keys() and all(equal(one[key], other[key]) for key in one)
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(equal, one, other))
    if isinstance(one, float):
        return one == other or (one != one and other != other)
    compared: object = type(one).__eq__
    if compared is object.__eq__ and hasattr(one, "__dict__"):
        return equal(vars(one), vars(other))
    return bool(one == other)
