"""What stands in a file of results, by variable and source, and how two such files differ.

A variable of a source is apart from those of the others, so that what one source changes can be
said of it alone. Sentences are not looked at: only numbers, and words that are answers in a table
(`ok`, `dominant`).
"""

from __future__ import annotations

import csv
import json
import math
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

Cell = float | str
Key = tuple[str, str]
"""A variable, and the error source that it is of or ""."""

RELATIVE = 3e-9
"""Of the largest number of a variable (and source): what processors may differ by, a fit most."""
ROUNDING = 1e-9
"""A smaller number is of rounding: mm, inches, degrees, shares; in SI a thousandth of it, and of
squares a thousandth again, a millionth in SI: of errors of a micrometre or a microradian."""

NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
COMMENT = re.compile(r"#.*|;.*|\([^)]*\)")
SENTENCES = {"doc", "origin", "description", "sentence", "reasons", "version", "hash"}


@dataclass
class Column:
    """The numbers and words of a variable, in their order, and below what a number is rounding."""

    rounding: float
    cells: list[Cell] = field(default_factory=list)

    def same(self, other: Column | None) -> bool:
        """Whether another has the same, within RELATIVE of this one's largest number."""
        if other is None or len(self.cells) != len(other.cells):
            return False
        numbers = [abs(cell) for cell in self.cells if not isinstance(cell, str)]
        slack = RELATIVE * max(filter(math.isfinite, numbers), default=0.0) + self.rounding
        return all(_close(*pair, slack) for pair in zip(self.cells, other.cells, strict=True))


def columns_of(path: Path) -> Mapping[Key, Column]:
    """What a file holds. Raises where it cannot be read."""
    found: dict[Key, Column] = {}
    for variable, source, rounding, cell in READERS.get(path.suffix, _text)(path):
        found.setdefault((variable, source), Column(rounding)).cells.append(cell)
    return found


def differences(archived: Path, present: Path) -> list[Key]:
    """Variables and sources of the archived file that the present one has not, or otherwise.

    What the present file has besides is no difference.
    """
    now = columns_of(present)
    return [key for key, column in columns_of(archived).items() if not column.same(now.get(key))]


def _close(old: Cell, new: Cell, slack: float) -> bool:
    if isinstance(old, str) or isinstance(new, str):
        return old == new
    return old == new or (math.isnan(old) and math.isnan(new)) or abs(old - new) <= slack


def _cell(value: Any) -> Cell:
    if value is None:
        return math.nan
    return value if isinstance(value, str) else float(value)


def _rounding(units: str, *, si: bool = False) -> float:
    """Of a variable in `units`, such as `mm`, `m`, `in^2`, `m rad` or `1`."""
    of_tool = bool(re.search(r"[a-z]", units))
    square = bool(re.search(r"\^2|[a-z] [a-z]", units))
    return (
        ROUNDING * (1e-3 if si and of_tool else 1.0) * ((1e-6 if si else 1e-3) if square else 1.0)
    )


Rows = Iterator[tuple[str, str, float, Cell]]
"""Variable, source, rounding, cell."""


def _json(path: Path) -> Rows:
    """A Dataset as JSON has it, or any other document by its keys."""
    document = json.loads(path.read_text(encoding="utf-8"))
    if "variables" not in document:
        yield from _tree(document, "", "")
        return
    sources = document["coordinates"].get("source", {}).get("values", [])
    for name, entry in [*document["coordinates"].items(), *document["variables"].items()]:
        values, units = np.array(entry["values"], object), entry["units"]
        units = units if isinstance(units, str) else next(iter(units.values()))
        yield from _array(name, entry["dims"], values, sources, _rounding(str(units)))
    yield from _attributes(document["attributes"])


def _netcdf(path: Path) -> Rows:
    with xr.open_dataset(path, engine="h5netcdf") as data:
        sources = [str(name) for name in data["source"].values] if "source" in data.coords else []
        for name, array in data.variables.items():
            rounding = _rounding(array.attrs.get("units", "m"), si=True)
            values = array.values.astype(object)
            yield from _array(str(name), array.dims, values, sources, rounding)
        yield from _attributes({str(name): value for name, value in data.attrs.items()})


def _array(
    name: str, dims: Sequence[Any], values: Any, sources: Sequence[str], rounding: float
) -> Rows:
    if "source" not in dims or not sources or name == "source":
        for value in np.ravel(values).tolist():
            yield name, "", rounding, _cell(value)
        return
    for number, source in enumerate(sources):
        of_source = np.take(values, number, axis=list(dims).index("source"))
        for value in np.ravel(of_source).tolist():
            yield name, source, rounding, _cell(value)


def _attributes(attributes: Mapping[str, Any]) -> Rows:
    for name, value in attributes.items():
        if isinstance(value, bool | int | float | np.number):
            yield f"attributes.{name}", "", ROUNDING, float(value)


def _csv(path: Path) -> Rows:
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            for column, text in row.items():
                rounding = _rounding(column.partition("[")[2])
                try:
                    cell: Cell = float(text) if text else math.nan
                except ValueError:
                    cell = text
                yield column, row.get("source") or "", rounding, cell


def _toml(path: Path) -> Rows:
    yield from _tree(tomllib.loads(path.read_text(encoding="utf-8")), "", "")


def _tree(value: Any, place: str, source: str) -> Rows:
    """Leaves by their keys; rows of a list by their name where they have one."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            if key not in SENTENCES:
                yield from _tree(item, f"{place}.{key}".lstrip("."), source)
    elif isinstance(value, list):
        for number, item in enumerate(value):
            name = str(number)
            if isinstance(item, Mapping):
                name = str(item.get("name", item.get("parameter", number)))
            if place == "sources":
                yield from _tree(item, place, name)
            else:
                yield from _tree(item, f"{place}.{name}", source)
    elif isinstance(value, bool | int | float) or value is None:
        yield place, source, ROUNDING, _cell(value)


def _text(path: Path) -> Rows:
    """A program or a block of settings: numbers outside comments, by what stands before them."""
    text = COMMENT.sub("", path.read_text(encoding="utf-8"))
    decimals = max((len(each) for each in re.findall(r"\.(\d+)", text)), default=0)
    last_digit = 1.01 * 10.0**-decimals
    for line in text.splitlines():
        end = 0
        for number in NUMBER.finditer(line):
            yield line[end : number.start()].strip() or "number", "", last_digit, float(number[0])
            end = number.end()


READERS: Mapping[str, Callable[[Path], Rows]] = {
    ".json": _json, ".nc": _netcdf, ".csv": _csv, ".toml": _toml,
}  # fmt: skip
"""By ending; any other file is a text."""
