"""JSON: every variable with its dims, units and values, in the units of the machine file.

Numbers have the digits that give the same double back; what is missing is null.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from truepose.reporting.result import Result, Values

ROWS = 4096
"""Rows of the first axis turned into text at once."""


def text(result: Result) -> Iterator[str]:
    """The document in pieces, so that a large one never stands in memory as a whole."""
    dataset = result.dataset
    head = {
        "command": result.command,
        "attributes": {
            str(name): _json_value(value)
            for name, value in dataset.attrs.items()
            if not str(name).startswith("accuracy")  # SI there, in file units below
        },
        "accuracy": result.accuracy(),
        "units": result.units(),
        "sizes": {str(dim): size for dim, size in dataset.sizes.items() if dim != "left_out"},
        "left_out": result.left_out(),
    }
    yield _dumped(head)[:-1]
    for title, names in (
        ("coordinates", result.coordinates()),
        ("variables", result.variables()),
    ):
        yield f',\n"{title}": {{'
        for number, name in enumerate(names):
            yield ("," if number else "") + "\n " + json.dumps(name) + ": "
            yield from _variable(result, result.values(name))
        yield "}"
    yield "}\n"


def write(result: Result, path: Path) -> None:
    """Write the document to `path`."""
    with path.open("w", encoding="utf-8") as file:
        file.writelines(text(result))


def _variable(result: Result, values: Values) -> Iterator[str]:
    units: str | dict[str, str] = values.units[0]
    if values.mixed:
        # The two axes of a covariance are both named: {"x x": "mm^2", "x rx": "mm deg", ...}.
        labels = product(*(result.labels(values.dims[axis]) for axis in values.mixed))
        units = dict(zip(map(" ".join, labels), values.units, strict=True))
    head = {"dims": list(values.dims), "units": units, "long_name": values.long_name}
    yield _dumped(head)[:-1] + ', "values": '
    if values.array.ndim == 0:
        yield _dumped(_json_value(values.array)) + "}"
        return
    yield "["
    for start in range(0, len(values.array), ROWS):
        yield (", " if start else "") + _rows(values.array[start : start + ROWS])
    yield "]}"


def _rows(block: NDArray[np.generic]) -> str:
    """Rows of an array as JSON without the outer brackets."""
    if block.dtype.kind == "f" and not np.isfinite(block).all():
        plain: NDArray[np.object_] = block.astype(object)
        plain[~np.isfinite(block)] = None
        return _dumped(plain.tolist())[1:-1]
    return _dumped(block.tolist())[1:-1]


def _json_value(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _dumped(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
