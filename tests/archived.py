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
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

Cell = float | str
Key = tuple[str, str]
"""A variable, and the error source that it is of or ""."""
Cells = Mapping[Key, list[Cell]]

RELATIVE = 1e-9
"""Of the largest number of a variable (and source): what two processors may differ by."""
ROUNDING = 1e-9
"""In the units of a file (mm, inch, degrees): a smaller number is of rounding."""
ROUNDING_IN_SI = 1e-12
"""The same in NetCDF."""
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
COMMENT = re.compile(r"#.*|;.*|\([^)]*\)")
SENTENCES = {"doc", "long_name", "origin", "description", "sentence", "reasons", "version", "hash"}


def cells_of(path: Path) -> Cells:
    """What a file holds. Raises where it cannot be read."""
    found: dict[Key, list[Cell]] = defaultdict(list)
    for variable, source, cell in READERS.get(path.suffix, _text)(path):
        found[variable, source].append(cell)
    return found


def differences(archived: Path, present: Path) -> list[Key]:
    """Variables and sources of the archived file that the present one has not, or otherwise.

    What the present file has besides is no difference.
    """
    before, now = cells_of(archived), cells_of(present)
    floor = ROUNDING_IN_SI if archived.suffix == ".nc" else ROUNDING
    if archived.suffix not in READERS:
        floor = _last_digit(archived)
    return [key for key, cells in before.items() if not _same(cells, now.get(key, []), floor)]


def _last_digit(path: Path) -> float:
    """One in the last of the decimals that a printed file has, mm or inch."""
    decimals = [len(each) for each in re.findall(r"\.(\d+)", _code(path))]
    return 1.01 * 10.0 ** -max(decimals, default=0)


def _same(before: list[Cell], now: list[Cell], floor: float) -> bool:
    if len(before) != len(now):
        return False
    sizes = [abs(cell) for cell in before if isinstance(cell, float) and math.isfinite(cell)]
    slack = RELATIVE * max(sizes, default=0.0) + floor
    return all(_close(old, new, slack) for old, new in zip(before, now, strict=True))


def _close(old: Cell, new: Cell, slack: float) -> bool:
    if isinstance(old, str) or isinstance(new, str) or not math.isfinite(old):
        return old == new or (old != old and new != new)
    return abs(old - new) <= slack


def _cell(value: Any) -> Cell:
    if value is None:
        return math.nan
    return value if isinstance(value, str) else float(value)


Rows = Iterator[tuple[str, str, Cell]]


def _json(path: Path) -> Rows:
    """A Dataset as JSON has it, or any other document by its keys."""
    document = json.loads(path.read_text(encoding="utf-8"))
    if "variables" not in document:
        yield from _tree(document, "", "")
        return
    sources = document["coordinates"].get("source", {}).get("values", [])
    for part in ("coordinates", "variables"):
        for name, entry in document[part].items():
            values = np.array(entry["values"], object)
            yield from _array(name, entry["dims"], values, sources)
    yield from _attributes(document["attributes"])


def _netcdf(path: Path) -> Rows:
    with xr.open_dataset(path, engine="h5netcdf") as data:
        sources = [str(name) for name in data["source"].values] if "source" in data.coords else []
        for name, array in data.variables.items():
            yield from _array(str(name), array.dims, array.values.astype(object), sources)
        yield from _attributes({str(name): value for name, value in data.attrs.items()})


def _array(name: str, dims: Any, values: Any, sources: list[str]) -> Rows:
    if "source" not in dims or not sources or name == "source":
        for value in np.ravel(values).tolist():
            yield name, "", _cell(value)
        return
    axis = list(dims).index("source")
    for number, source in enumerate(sources):
        for value in np.ravel(np.take(values, number, axis=axis)).tolist():
            yield name, source, _cell(value)


def _attributes(attributes: Mapping[str, Any]) -> Rows:
    for name, value in attributes.items():
        if isinstance(value, bool | int | float | np.number):
            yield f"attributes.{name}", "", float(value)


def _csv(path: Path) -> Rows:
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            for column, text in row.items():
                try:
                    cell: Cell = float(text) if text else math.nan
                except ValueError:
                    cell = text
                yield column, row.get("source", "") or "", cell


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
            of = name if place == "sources" else source
            yield from _tree(item, place if place == "sources" else f"{place}.{name}", of)
    elif isinstance(value, bool | int | float) or value is None:
        yield place, source, _cell(value)


def _code(path: Path) -> str:
    return COMMENT.sub("", path.read_text(encoding="utf-8"))


def _text(path: Path) -> Rows:
    """A program or a block of settings: numbers outside comments, by what stands before them."""
    for line in _code(path).splitlines():
        end = 0
        for number in NUMBER.finditer(line):
            yield line[end : number.start()].strip() or "number", "", float(number[0])
            end = number.end()


READERS: Mapping[str, Callable[[Path], Rows]] = {
    ".json": _json, ".nc": _netcdf, ".csv": _csv, ".toml": _toml,
}  # fmt: skip
"""By ending; any other file is a text."""
