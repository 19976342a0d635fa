"""The rows that a family gives, written into the text of a machine file.

A text is what tomlkit makes of it: all else stays as its author wrote it, comments included.
"""

from __future__ import annotations

from collections.abc import Callable, MutableMapping
from typing import Any

import tomlkit

from truepose.files.document import Document
from truepose.machine.families._family import MachineFamily

Written = Callable[[float], Any]
"""A length in m as the file writes one."""


def write_rows(
    toml: MutableMapping[str, Any], document: Document, family: MachineFamily, written: Written
) -> None:
    """Write every row of the family with all of its geometry, in the family's order.

    `document`: the same file as read, in which `expand` wrote the rows. A key that the text's row
    has stays as it is. What the family says of `[machine]` and home is written likewise.
    """
    rows = family.real_rows()
    for table in dict.fromkeys(row.table for row in rows):
        own = row_tables(toml, document, table)
        keys = {
            row.name: {**row.words, **row.numbers, **row.defaults}
            for row in rows
            if row.table == table
        }
        for text, row in zip(own, document.data[table], strict=True):
            for key in keys.get(row["name"], ()):
                if key not in text:
                    text[key] = _value(row[key], written)
    for table, names in (("machine", ("dof", "commanded")), ("workspace", ("home",))):
        data = document.data.get(table, {})
        for key in names:
            if key in data and key not in toml[table]:
                toml[table][key] = _value(data[key], written)


def row_tables(toml: MutableMapping[str, Any], document: Document, table: str) -> Any:
    """The rows of a table of the text, those of the document that it lacks made, in its order."""
    names = [row["name"] for row in document.data[table]]
    there = {row["name"]: row for row in toml.get(table, ())}
    if list(there) == names:
        return toml[table]
    tables = tomlkit.aot()
    for name in names:
        row = there.get(name)
        if row is None:
            row = tomlkit.table()
            row["name"] = name
        tables.append(row)
    toml[table] = tables
    return toml[table]


def _value(value: Any, written: Written) -> Any:
    if isinstance(value, list):
        return [_value(entry, written) for entry in value]
    if isinstance(value, dict):
        inline = tomlkit.inline_table()
        inline.update({key: _value(entry, written) for key, entry in value.items()})
        return inline
    if isinstance(value, str) and value.endswith(" m"):
        return written(float(value.removesuffix(" m")))
    return value
