"""Every number of a machine file as a field: its key, its text, its unit and what it is.

A field is what `--set KEY=VALUE` can change: a number, a component of a point, a list that is
written as a whole, or a word that is one of a few, as a material. What it means the machine file's
own schema says, as `docs/machine_file.md` has.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache
from typing import Any

import tomlkit
from tomlkit.items import Item

from truepose.errors import Problem, TrueposeError
from truepose.files.dimensions import BY_UNIT
from truepose.files.document import ARRAY_TABLES, NAMELESS_TABLES
from truepose.files.toml_text import TomlError, parse_toml
from truepose.machine import Machine
from truepose.machine.families.parameters import is_of_family
from truepose.machine.reference import json_schema
from truepose.machine.shared_keys import EACH
from truepose.sources import REGISTRY

Json = Mapping[str, Any]

TOLERANCE = "tolerance"
NOT_SHOWN = frozenset({"schema", "units", "calibration", "controller"})
"""Tables that hold no number of the machine."""

_XYZ = "xyz"
_QUANTITY = re.compile(r"\s*[+-]?(?:[\d.]|inf)")
_BY_SETTING = re.compile(r" \(given by --set .*\)\Z", re.DOTALL)
_OF_SETTING = re.compile(r"\A--set .*?: ", re.DOTALL)


@dataclass(frozen=True)
class FileField:
    """One number, or one list of numbers, of a file with its edits."""

    key: str
    text: str
    table: str
    about: str
    unit: str = ""
    dimension: str = ""
    group: bool = False
    choices: tuple[str, ...] = ()
    """What a word may be; empty of what is none."""
    file: str | None = None
    """As it stands in the file without edits; None where that does not have it."""

    def to_json(self) -> dict[str, Any]:
        """As a message has it."""
        return {
            "key": self.key,
            "text": self.text,
            "file": self.file,
            "table": self.table,
            "about": self.about,
            "unit": self.unit,
            "dimension": self.dimension,
            "group": self.group,
            "choices": list(self.choices),
            "edited": self.text != self.file,
        }


def fields_of(
    text: str, machine: Machine, in_file: Mapping[str, str] | None = None
) -> tuple[FileField, ...]:
    """The fields of the text of a machine, in its order.

    `in_file`: by key the texts of the fields of the file without edits; None: it is that file.
    """
    fields = tuple(_Walk(text, machine).fields())
    texts = {field.key: field.text for field in fields} if in_file is None else in_file
    return tuple(replace(field, file=texts.get(field.key)) for field in fields)


def descriptions() -> Mapping[str, str]:
    """What every key means that a field's `about` names: `strut.length_tolerance`."""
    return _descriptions()


def refusal(failure: TrueposeError) -> list[dict[str, Any]]:
    """The problems of an edit in the file's own words, without those of the command line."""

    def plain(problem: Problem) -> Problem:
        message = _OF_SETTING.sub("", _BY_SETTING.sub("", problem.message))
        return replace(problem, message=message)

    return [plain(problem).to_dict() for problem in failure.problems]


@cache
def _schema() -> Json:
    return json_schema(REGISTRY)


@cache
def _descriptions() -> Mapping[str, str]:
    every: dict[str, str] = {}

    def collect(path: str, node: Json) -> None:
        for choice in _choices(node):
            for key, below in choice.get("properties", {}).items():
                name = f"{path}.{key}"
                if "description" in below:
                    every.setdefault(name, str(below["description"]))
                collect(name, below)

    for table, node in _schema()["properties"].items():
        if table not in NOT_SHOWN and table != EACH:
            collect(table, node.get("items", node))
    every[TOLERANCE] = (
        "Band of the parameters that the name, or the pattern, stands for: [lower, upper], or ± "
        "one value, or a class."
    )
    return every


def _choices(node: Json) -> list[Json]:
    """A node, or what it may be one of."""
    return [node, *(one for choice in node.get("anyOf", ()) for one in _choices(choice))]


def _below(node: Json, key: str) -> Json | None:
    """The schema of a key of a table; None where it has none."""
    for choice in _choices(node):
        if key in choice.get("properties", {}):
            schema: Json = choice["properties"][key]
            return schema
    for choice in _choices(node):
        named = choice.get("additionalProperties")
        if isinstance(named, dict):
            return named
    return None


def _of_kind(node: Json, kind: str | None) -> Json:
    """The choice of a table's schema that is of a kind; the whole where there is none."""
    for choice in node.get("anyOf", ()):
        if choice.get("properties", {}).get("kind", {}).get("const") == kind:
            chosen: Json = choice
            return chosen
    return node


class _Walk:
    """The fields of one text."""

    def __init__(self, text: str, machine: Machine) -> None:
        self._toml = tomlkit.parse(text)
        self._machine = machine
        self._declared = machine.file_units
        self._units = self._toml.get("units", {})
        self._angular = {d.name for d in machine.drives if d.coordinate == "angle"}

    def fields(self) -> Iterator[FileField]:
        """All of them, in the file's order."""
        tables = _schema()["properties"]
        for table, value in self._toml.items():
            if table in NOT_SHOWN or table not in tables:
                continue
            node = tables[table]
            if table == EACH:
                for of, shared in value.items():
                    row_schema = node["properties"].get(of, {})
                    yield from self._table(f"{EACH}.{of}", of, f"[{EACH}.{of}]", shared, row_schema)
            elif table == TOLERANCE:
                yield from self._tolerances(value)
            elif table in (*ARRAY_TABLES, *NAMELESS_TABLES):
                for number, row in enumerate(value, start=1):
                    path = f"{table}.{row.get('name', f'#{number}')}"
                    kind = row.get("kind") or self._toml.get(EACH, {}).get(table, {}).get("kind")
                    yield from self._table(path, table, path, row, _of_kind(node["items"], kind))
            else:
                kind = value.get("kind")
                yield from self._table(table, table, f"[{table}]", value, _of_kind(node, kind))

    def _table(
        self, path: str, about: str, table: str, value: Any, node: Json
    ) -> Iterator[FileField]:
        for key, entry in value.items():
            schema = _below(node, key)
            if schema is not None:
                yield from self._entry(f"{path}.{key}", f"{about}.{key}", table, entry, schema)

    def _entry(
        self, path: str, about: str, table: str, entry: Any, schema: Json
    ) -> Iterator[FileField]:
        if isinstance(entry, dict):
            # A table per part, or a quantity that is told in a table: its keys are fields.
            known = about in _descriptions()
            for key, below in entry.items():
                node = _below(schema, key) or schema
                deeper = f"{about}.{key}"
                name = deeper if deeper in _descriptions() or not known else about
                yield from self._entry(f"{path}.{key}", name, table, below, node)
            return
        group = path.startswith(f"{EACH}.")
        choices = _choices_of_word(entry, schema)
        if choices and not path.endswith(".kind"):
            yield FileField(path, str(entry), table, about, group=group, choices=choices)
        if not _is_number(entry, schema):
            return
        dimension, unit = self._unit(path, entry, schema)
        field = FileField(path, _text(entry), table, about, unit, dimension, group)
        if _is_point(entry, schema):
            for axis, component in zip(_XYZ, entry, strict=True):
                dimension, unit = self._unit(path, component, schema)
                yield replace(
                    field,
                    key=f"{path}.{axis}",
                    text=_text(component),
                    unit=unit,
                    dimension=dimension,
                )
        else:
            yield field

    def _tolerances(self, tables: Any) -> Iterator[FileField]:
        for pattern, value in tables.items():
            names = [
                name
                for name in self._machine.parameters
                if name == pattern or fnmatchcase(name, pattern)
            ]
            dimension = ""
            family = self._machine.family
            if is_of_family(pattern) and family is not None and pattern in family.names:
                dimension = family.dimension(pattern)
            elif names:
                at = self._machine.parameters.index(names[0])
                dimension = BY_UNIT[self._machine.units[at]]
            # `--set` takes all behind `tolerance.` for the name, so a table of it is one value.
            if _is_number(value, {}) or _has_numbers(value):
                yield FileField(
                    f"{TOLERANCE}.{pattern}",
                    _text(value),
                    f"[{TOLERANCE}]",
                    TOLERANCE,
                    self._label(dimension) if _has_bare(value) else "",
                    dimension,
                    len(names) != 1,
                )

    def _unit(self, path: str, entry: Any, schema: Json) -> tuple[str, str]:
        """(dimension, unit of a bare number) of an entry; both empty of what has none."""
        dimension = next(
            (
                str(choice["x-dimension"])
                for choice in _parts(schema)
                if choice.get("x-dimension") not in (None, "direction")
            ),
            "",
        )
        _, _, rest = path.partition(".")
        if "x-angular" in schema and rest.partition(".")[0] in self._angular:
            dimension = str(schema["x-angular"])
        return dimension, self._label(dimension) if _has_bare(entry) else ""

    def _label(self, dimension: str) -> str:
        """The unit that the file declares for bare numbers of a dimension."""
        if dimension not in self._units:
            return ""
        return self._declared[dimension].label


def _parts(schema: Json) -> Iterator[Json]:
    """A schema, its choices, and those of its list's members."""
    for choice in _choices(schema):
        yield choice
        for member in (*choice.get("prefixItems", ()), choice.get("items", {})):
            if isinstance(member, dict) and member:
                yield from _choices(member)


def _choices_of_word(entry: Any, schema: Json) -> tuple[str, ...]:
    """The words that a word may be exchanged for; what a part is, its kind, is none."""
    for choice in _choices(schema):
        words = choice.get("enum", ())
        if entry in words and len(words) > 1 and all(isinstance(word, str) for word in words):
            return tuple(words)
    return ()


def _is_number(entry: Any, schema: Json) -> bool:
    """Whether an entry is a number, a quantity as text, or a list of such."""
    if isinstance(entry, bool):
        return False
    if isinstance(entry, int | float):
        return True
    if isinstance(entry, str):
        return _QUANTITY.match(entry) is not None and schema.get("type") != "string"
    if isinstance(entry, list):
        return any(_is_number(member, schema) or _has_numbers(member) for member in entry)
    return False


def _has_numbers(entry: Any) -> bool:
    """Whether there is a number anywhere in a list or a table of a list."""
    below = entry.values() if isinstance(entry, dict) else entry if isinstance(entry, list) else ()
    return any(_is_number(member, {}) or _has_numbers(member) for member in below)


def _has_bare(entry: Any) -> bool:
    """Whether an entry is, or holds, a number without a unit of its own."""
    if isinstance(entry, list):
        return any(map(_has_bare, entry))
    return isinstance(entry, int | float)


def _is_point(entry: Any, schema: Json) -> bool:
    """Whether a list is of components along x, y and z, which can be changed one by one."""
    alone = not schema.get("x-grid") and "x-poses" not in schema and "x-per-limb" not in schema
    plain = isinstance(entry, list) and not any(isinstance(m, dict | list) for m in entry)
    return alone and plain and len(entry) == len(_XYZ)


def _text(entry: Any) -> str:
    """What a field shows, on one line, and what `--set` reads as the same value."""
    if isinstance(entry, str):
        plain = str(entry)
        try:
            parse_toml(f"value = {plain}")
        except TomlError:
            return plain
    if isinstance(entry, dict):
        keys = (f"{tomlkit.key(key).as_string()} = {_text_of(of)}" for key, of in entry.items())
        return f"{{ {', '.join(keys)} }}"
    written = entry if isinstance(entry, Item) else tomlkit.item(entry)
    text: str = written.as_string()
    return text if "\n" not in text else f"[{', '.join(map(_text_of, entry))}]"


def _text_of(entry: Any) -> str:
    """The same inside of a list or a table, where a text has its marks."""
    if isinstance(entry, str):
        marked: str = tomlkit.item(str(entry)).as_string()
        return marked
    return _text(entry)


__all__ = ["FileField", "descriptions", "fields_of", "refusal"]
