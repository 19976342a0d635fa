"""A machine file as read: its TOML document, where each key stands, what `--set` changed."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from truepose.errors import Fault, MachineFileError, Problem
from truepose.files.text_file import FileKind, read_text
from truepose.files.toml_text import TomlError, lines_of, parse_toml

Key = tuple[str | int, ...]
"""Where a value stands: keys of tables and numbers of list items, from the top."""

ARRAY_TABLES = ("drive", "strut", "guide", "limb")
"""The tables of which a file has several, told apart by their `name`."""

NAMELESS_TABLES = ("correlation",)
"""The tables of which a file has several that have no name: `correlation.#1` is the first."""

SEVERAL = (*ARRAY_TABLES, *NAMELESS_TABLES)
"""All of which a file may have several."""


@dataclass
class Document:
    """One machine file. `data` is the TOML document after the settings are applied."""

    file: str
    name: str
    file_hash: str
    data: dict[str, Any]
    lines: dict[Key, int] = field(default_factory=dict)
    settings: dict[str, str] = field(default_factory=dict)
    set_keys: dict[Key, str] = field(default_factory=dict)
    """What a setting wrote: the key, and the setting as it was given."""
    shared: dict[Key, Key] = field(default_factory=dict)
    """Keys of rows that `[each.*]` gave, and where: `("strut", 0, "material")`."""
    several: tuple[str, ...] = SEVERAL
    """The tables of which a file of this kind may have several."""
    text: str = ""
    """What was read, before settings."""

    def line(self, key: Key) -> int | None:
        """Line of `key`, or of the nearest table round it; None for what a setting wrote."""
        if self.setting(key) is not None:
            return None
        for length in range(len(key), 0, -1):
            if key[:length] in self.lines:
                return self.lines[key[:length]]
        return None

    def setting(self, key: Key) -> str | None:
        """The setting that wrote `key` or something round it, as it was given."""
        for length in range(len(key), 0, -1):
            if key[:length] in self.set_keys:
                return self.set_keys[key[:length]]
        if key in self.lines:
            return None
        # A table that the file does not have is there because of a setting inside it.
        inside = [at for at in self.set_keys if at[: len(key)] == key]
        return self.set_keys[inside[0]] if inside and key else None

    def written(self, key: Key) -> Key:
        """Where `key` is written: in its row, or in the table that every row shares."""
        for length in range(len(key), 0, -1):
            if key[:length] in self.set_keys:
                return key
            if key[:length] in self.shared:
                return (*self.shared[key[:length]], *key[length:])
        return key

    def path(self, key: Key) -> str:
        """`key` for people: rows of an array by their name, list items by their number."""
        words: list[str] = []
        value: Any = self.data
        for part in key:
            value = _item(value, part)
            if not isinstance(part, int):
                words.append(part)
            elif len(words) == 1 and words[0] in self.several:
                name = value.get("name") if isinstance(value, dict) else None
                words.append(str(name) if isinstance(name, (str, int)) else f"#{part + 1}")
            else:
                words[-1] += f"[{part}]"
        return ".".join(words)

    def key(self, path: str) -> Key:
        """The key that `path` names, as far as the document goes along with it."""
        parts: list[str | int] = []
        value: Any = self.data
        words = path.split(".")
        while words:
            step = _step(value, words)
            if step is None:
                return (*parts, ".".join(words)) if isinstance(value, dict) else tuple(parts)
            part, taken = step
            parts.append(part)
            value = _item(value, part)
            words = words[taken:]
        return tuple(parts)

    def value(self, key: Key) -> Any:
        """What stands at `key`; None where there is nothing."""
        value: Any = self.data
        for part in key:
            value = _item(value, part)
        return value

    def has(self, path: str) -> bool:
        """Whether the file (or a setting) writes the key that `path` names."""
        return self.value(self.key(path)) is not None

    def problem(self, fault: Fault, key: Key = ()) -> Problem:
        """A problem at `key`, with its line, or with the setting that caused it."""
        key = self.written(key)
        path = self.path(key) or None
        setting = self.setting(key)
        fault = fault.about(path)
        if setting is not None:
            fault = replace(fault, message=f"{fault.message} (given by --set {setting})")
        return fault.at(self.file, self.line(key), path)


def _item(value: Any, part: str | int) -> Any:
    """One step into a document, None where there is nothing."""
    if isinstance(value, dict):
        return value.get(str(part)) if not isinstance(part, int) else None
    if isinstance(value, list) and isinstance(part, int) and part < len(value):
        return value[part]
    return None


def _step(value: Any, words: list[str]) -> tuple[str | int, int] | None:
    """The part of `value` that `words` begin with, and how many words its name takes.

    A name may itself hold points (`"strut.1"` in a table per part), so the longest wins.
    """
    for taken in range(len(words), 0, -1):
        word = ".".join(words[:taken])
        if isinstance(value, dict) and word in value:
            return word, taken
        if isinstance(value, list):
            for index, row in enumerate(value):
                named = row.get("name", f"#{index + 1}") if isinstance(row, dict) else None
                if named is not None and str(named) == word:
                    return index, taken
    return None


MACHINE_FILE = FileKind("a machine file (TOML)", ".toml")


def read(path: str | Path, kind: FileKind = MACHINE_FILE) -> Document:
    """Read a machine file, or one of another kind.

    Raises `MachineFileError` for what is no readable TOML text.
    """
    content, text = read_text(Path(path), kind)
    return document_of(path, content, text, kind)


def document_of(
    path: str | Path, content: bytes, text: str, kind: FileKind = MACHINE_FILE
) -> Document:
    """The document that a file at `path` is, or would be, with such bytes and the text of them.

    Raises `MachineFileError` (not-toml).
    """
    file = str(path)
    try:
        data = parse_toml(text)
    except TomlError as error:
        raise MachineFileError(_not_toml(error, file, text, kind)) from None
    file_hash = hashlib.sha256(content).hexdigest()
    return Document(file, Path(path).name, file_hash, data, lines_of(text), text=text)


def _not_toml(error: TomlError, file: str, text: str, kind: FileKind) -> Problem:
    all_lines = text.split("\n")
    found = None
    if error.line is not None and error.line <= len(all_lines):
        found = all_lines[error.line - 1].strip()[:80]
    return Problem(
        "not-toml",
        f"the file is not TOML: {error.reason}",
        file,
        error.line,
        found=found or None,
        expected=kind.phrase,
        hint=next((hint for slip, hint in _SLIPS if found and slip.search(found)), None),
    )


_SLIPS = (
    (
        re.compile(r"=\s*+[-+]?+\d++,\d++\s*+(#|$)"),
        "a number has a decimal point: 250.5, not 250,5",
    ),
    (
        re.compile(r"=\s*+[-+]?+[\d.]++\s*+[A-Za-zµ°%][^\"]*+$"),
        'a value with its unit stands in quotation marks: "0.2 mm"',
    ),
)
"""What people write in place of TOML, and what they are told."""


def named_rows(data: Mapping[str, Any], table: str) -> list[tuple[int, str]]:
    """(row, name) of the rows of an array table that have a proper name."""
    rows = data.get(table)
    if not isinstance(rows, list):
        return []
    return [
        (index, row["name"])
        for index, row in enumerate(rows)
        if isinstance(row, dict) and isinstance(row.get("name"), str)
    ]
