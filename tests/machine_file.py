"""Machine files as plain tables: read, changed in a test, written as text and loaded.

A file is the nested dict that TOML makes of it, in the file's own units. `rows_of` has done with
`[each.*]`, so that a test may change one row without asking where its keys stand.
"""

from __future__ import annotations

import copy
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import truepose as tp
from truepose.machine import Machine

File = dict[str, Any]
Row = dict[str, Any]

ROWS = ("drive", "strut", "guide", "limb")
"""The array tables, whose rows have a name each."""

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def file_of(text: str) -> File:
    """The tables of a machine file's text; what `[each.*]` says stands in every row."""
    file = tomllib.loads(text)
    for table, common in file.pop("each", {}).items():
        for row in file.get(table, []):
            for key, value in common.items():
                row.setdefault(key, copy.deepcopy(value))
    return file


def file_at(path: Path) -> File:
    """The tables of a machine file."""
    return file_of(path.read_text(encoding="utf-8"))


def rows_of(file: File, *tables: str) -> Iterator[Row]:
    """Every row of the array tables named."""
    for table in tables:
        yield from file.get(table, [])


def text_of(file: File) -> str:
    """TOML of the tables, to the last digit."""
    lines = [f"{_key(key)} = {_value(value)}" for key, value in file.items() if _plain(value)]
    for table, content in file.items():
        if isinstance(content, dict):
            lines += [f"[{_key(table)}]", *_lines(content)]
        elif not _plain(content):
            for row in content:
                lines += [f"[[{_key(table)}]]", *_lines(row)]
    return "\n".join([*lines, ""])


def loaded(file: File, *settings: str, beside: Path | None = None) -> Machine:
    """The machine of a file; its data files, where it has any, are those in the folder `beside`."""
    with TemporaryDirectory() as folder:
        path = (beside or Path(folder)) / "machine.toml"
        path.write_text(text_of(file), encoding="utf-8")
        return tp.load(path, settings)


def _plain(value: object) -> bool:
    """Whether a top-level value is neither a table nor an array of tables."""
    return not isinstance(value, (dict, list))


def _lines(table: Row) -> list[str]:
    return [f"{_key(key)} = {_value(value)}" for key, value in table.items()]


def _key(name: str) -> str:
    return name if _BARE.fullmatch(name) else _text(name)


def _text(value: str) -> str:
    escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'


def _value(value: Any) -> str:
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{_key(key)} = {_value(each)}' for key, each in value.items())} }}"
    # A NumPy scalar is written as the Python number it is.
    return repr(value if isinstance(value, int) else float(value))
