"""What plotly.js reads, as JSON that may stand in a page: arrays as the bytes of their numbers."""

from __future__ import annotations

import base64
import json
import math
from typing import Any

import numpy as np

_SHORT = {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4",
          "uint32": "u4", "float32": "f4", "float64": "f8"}  # fmt: skip
"""plotly.js's names of the types that it reads as bytes."""
_NARROW = ("int8", "int16", "int32")


def as_json(value: Any) -> str:
    """`value` of dictionaries, lists and arrays as JSON; a number that is not finite is null.

    No text in it can end the script in which it stands.
    """
    text = json.dumps(_plain(value), allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    if isinstance(value, np.ndarray):
        return _bytes_of(value)
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _bytes_of(values: np.ndarray) -> Any:
    """plotly.js's typed array, or a list where there is no such type; whole numbers are narrowed.

    JavaScript has no whole numbers of eight bytes in its arrays.
    """
    if values.dtype == np.int64 and values.size:
        ends = (values.min(), values.max())
        for name in _NARROW:
            if np.iinfo(name).min <= ends[0] and ends[1] <= np.iinfo(name).max:
                values = values.astype(name)
                break
    short = _SHORT.get(values.dtype.name)
    if short is None or not values.size:
        return _plain(values.tolist())
    little = np.ascontiguousarray(values, values.dtype.newbyteorder("<"))
    spec = {"dtype": short, "bdata": base64.b64encode(little.tobytes()).decode("ascii")}
    if values.ndim > 1:
        spec["shape"] = ", ".join(map(str, values.shape))
    return spec
