"""What a features file and the comments of a program say of a part, checked, all problems at once.

A comment says what a row of the file says, in one line:

    (feature: NAME, KEY value, KEY value, ...)      (feature: bore A, diameter 40 +0.025 0)
    (datum: NAME)                                   (end feature)

What follows a value and its unit is its `tolerance`. A comment holds for the moves behind it, up to
the next comment of these. A name that stands alone is the next element of a feature that was there
before, or of one that the file has without a place.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from pydantic import BaseModel

from truepose.arrays import Indices
from truepose.errors import Fault, MachineFileError, PartError, Problem, in_order
from truepose.files.dimensions import DIMENSIONS
from truepose.files.document import Document, Key, read
from truepose.files.text_file import FileKind
from truepose.files.units import FileUnit, UnitSystem, unit_of
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine, validation
from truepose.machine.validation import Validated
from truepose.workpiece.features._base import Feature
from truepose.workpiece.stretches import (
    UNITS,
    Interval,
    ProgramText,
    Said,
    common_lines,
    holds_at,
    not_there,
    overlap,
    read_text_of,
    trimmed,
)
from truepose.workpiece.tables import DatumTable, FeatureTable, PartTable

FEATURES = FileKind("a file of a part's features (TOML)", ".toml")
SCHEMA = 1
TABLES = ("schema", "units", "part", "datum", "feature")
SEVERAL = ("datum", "feature")

_WITH_LIMITS = re.compile(
    r"([+-]?(?:\d++\.?\d*+|\.\d++)(?:[eE][+-]?\d++)?+(?:\s*+[A-Za-zµμ°]++)?+)\s++([-+±]?\S.*+)"
)
"""A nominal value, with its unit where it has one, and the limits behind it."""

Kinds = Mapping[str, type[Feature]]
Place = tuple[Interval, ...]


@dataclass(frozen=True, eq=False)
class Declared:
    """One feature or datum: `kind` is None of a datum, and `row` of its kind's table too.

    `places` of its elements: the lines of each. `document` and `key` are where it is said.
    """

    table: FeatureTable | DatumTable
    kind: type[Feature] | None
    row: BaseModel | None
    document: Document
    key: Key
    places: tuple[Place, ...] = ()

    @property
    def name(self) -> str:
        """Its name."""
        return self.table.name

    @property
    def datums(self) -> Sequence[str]:
        """Names of the datums that it refers to."""
        return self.table.datums if isinstance(self.table, FeatureTable) else ()

    @property
    def what(self) -> str:
        """For people: the feature "bore A"."""
        return f'the {"datum" if self.kind is None else "feature"} "{self.name}"'

    def problem(self, fault: Fault, *key: str) -> Problem:
        """A problem of it, or of one of its keys."""
        return self.document.problem(fault, (*self.key, *key))


@dataclass(frozen=True, eq=False)
class Declarations:
    """All that is said of a part; places are lines of operations that count.

    `units` of the features file, by dimension: those that it declares.
    `document`: the features file, empty where there is none.
    """

    part: PartTable
    document: Document
    features: tuple[Declared, ...]
    datums: tuple[Declared, ...]
    text: ProgramText
    units: Mapping[str, FileUnit]

    @property
    def every(self) -> tuple[Declared, ...]:
        """Features and datums."""
        return (*self.features, *self.datums)


@dataclass
class _Collected:
    """Rows as they are found, and what is wrong; `names` also of rows that are no good."""

    kinds: Kinds
    rows: list[Declared] = field(default_factory=list)
    names: dict[tuple[str, str], tuple[Document, Key]] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    units: Mapping[str, FileUnit] = field(default_factory=dict)

    def row(self, document: Document, key: Key, units: UnitSystem) -> None:
        """Check one row of `document`."""
        value = document.value(key)
        self._name(value.get("name"), document, key)
        validated = Validated(units)
        table = DatumTable if key[0] == "datum" else FeatureTable
        models: tuple[type[BaseModel], ...] = (table,)
        kind = None
        if table is FeatureTable:
            kind = self.kinds.get(value["kind"]) if isinstance(value.get("kind"), str) else None
            if kind is not None:
                models = (table, kind.table)
            else:
                self.problems += validation.unknown_kind(document, key, value, self.kinds)
                value = {name: value[name] for name in value if name in table.model_fields}
        filled, problems = validation.share_out(document, key, models, value, validated)
        self.problems += problems
        if any(one is None for one in filled.values()) or (kind is None and table is FeatureTable):
            return
        row = None if kind is None else filled[kind.table]
        named = cast("FeatureTable | DatumTable", filled[table])
        self.rows.append(Declared(named, kind, row, document, key))

    def _name(self, name: object, document: Document, key: Key) -> None:
        """Note the name of a row, and refuse one that another has."""
        word = str(key[0])
        if not isinstance(name, str):
            return
        first, at = self.names.setdefault((word, name), (document, key))
        if (first, at) != (document, key):
            self.problems.append(
                document.problem(
                    Fault(
                        "duplicate-name",
                        f'there are two of the {word} "{name}"',
                        found=f'"{name}" also in line {first.line(at)} of {first.file}',
                        expected="a name of its own for each",
                    ),
                    (*key, "name"),
                )
            )


def declared(
    machine: Machine,
    program: Path,
    opened: Path,
    features: Path | None,
    kinds: Kinds,
    feed_lines: Callable[[], Indices],
) -> Declarations:
    """What the file `features` and the comments of the program say.

    `opened`: the file that the program is read from; `feed_lines()`: its lines (n,), in order, that
    move the machine at feed. Raises `PartError` with every problem.
    """
    collected = _Collected(kinds)
    document = _document(features)
    part = _of_file(machine, document, collected)
    addresses = {address for row in collected.rows for address in row.table.addresses()}
    if part.operations is not None:
        addresses |= set(part.operations.addresses())
    text = read_text_of(opened, addresses)
    said = _of_comments(machine, program, text, collected)
    placed = [_placed(row, said, text, str(program), collected) for row in collected.rows]
    operations = _operations(part, document, text, str(program), collected)
    if operations is not None:
        placed = [_counting(row, operations, collected) for row in placed]
    _check_datums(placed, part, document, collected)
    if any(_overlapping(placed)):
        lines = feed_lines()
        for number, row in enumerate(placed):
            trimmed_places = tuple(trimmed(place, lines) for place in row.places)
            placed[number] = replace(row, places=trimmed_places)
        _check_shared(placed, collected)
    raise_all(collected.problems)
    return Declarations(
        part,
        document,
        tuple(row for row in placed if row.kind is not None),
        tuple(row for row in placed if row.kind is None),
        text,
        collected.units,
    )


def raise_all(problems: Iterable[Problem]) -> None:
    """Raise `PartError` with all problems, each once, in the order of files and lines."""
    every = in_order(problems)
    if every:
        raise PartError(*every)


def _document(features: Path | None) -> Document:
    if features is None:
        return Document("", "", "", {}, several=SEVERAL)
    try:
        document = read(features, FEATURES)
    except MachineFileError as error:
        raise PartError(*error.problems) from None
    document.several = SEVERAL
    return document


def _of_file(machine: Machine, document: Document, collected: _Collected) -> PartTable:
    """Check the tables of the features file; `[part]` as far as it is good."""
    data, problems = document.data, collected.problems
    problems += [
        validation.unknown_key(document, (key,), TABLES) for key in data if key not in TABLES
    ]
    if data.get("schema", SCHEMA) != SCHEMA or isinstance(data.get("schema"), bool):
        problems.append(
            document.problem(
                Fault(
                    "unsupported-schema",
                    "this version of truepose does not read such a features file",
                    found=str(data["schema"]),
                    expected=str(SCHEMA),
                ),
                ("schema",),
            )
        )
    declared_units = validation.read_units(document, problems)
    collected.units = declared_units.declared
    units = UnitSystem({**machine.file_units, **collected.units})
    for table in SEVERAL:
        rows = data.get(table, [])
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            problems.append(validation.not_an_array(document, table, rows))
            continue
        for index in range(len(rows)):
            collected.row(document, (table, index), units)
    collected.rows.sort(key=lambda row: document.line(row.key) or 0)
    value = data.get("part", {})
    if not isinstance(value, dict):
        problems.append(validation.not_a_table(document, ("part",), value))
        return PartTable()
    filled, of_part = validation.share_out(
        document, ("part",), (PartTable,), value, Validated(units)
    )
    problems += of_part
    return cast("PartTable", filled[PartTable] or PartTable())


def _of_comments(
    machine: Machine, program: Path, text: ProgramText, collected: _Collected
) -> dict[tuple[str, str], list[Place]]:
    """Check what comments say; the places of features and datums by their names."""
    places: dict[tuple[str, str], list[Place]] = {}
    document = Document(str(program), program.name, "", {table: [] for table in SEVERAL})
    document.several = SEVERAL
    for said in text.said:
        if not said.word:
            continue
        row = _row_of(said, document, collected)
        if row is None:
            continue
        identity = said.word, row["name"]
        again = identity in collected.names
        places.setdefault(identity, []).append((said.place,))
        if again and len(row) == 1:
            continue
        index = len(document.data[said.word])
        document.data[said.word].append(row)
        document.lines[said.word, index] = said.line
        key: Key = (said.word, index)
        if said.word == "feature" and not _find_kind(row, document, key, collected):
            collected.names.setdefault(identity, (document, key))
            continue
        collected.row(document, key, _units_at(said.line, machine, text))
    return places


def _identity(row: Declared) -> tuple[str, str]:
    return ("datum" if row.kind is None else "feature"), row.name


def _units_at(line: int, machine: Machine, text: ProgramText) -> UnitSystem:
    """Bare numbers of a comment: lengths in the program's own unit there, angles in degrees."""
    code = holds_at(line, text.units)
    if code is None:
        return UnitSystem(machine.file_units)
    length = unit_of("in" if code == UNITS[0] else "mm", DIMENSIONS["length"])
    angle = unit_of("deg", DIMENSIONS["angle"])
    return UnitSystem({**machine.file_units, "length": length, "angle": angle})


def _row_of(said: Said, document: Document, collected: _Collected) -> dict[str, Any] | None:
    """The keys that a comment says; None, and a problem, where it cannot be read."""
    name, *clauses = (clause.strip() for clause in said.text.split(","))
    row: dict[str, Any] = {"name": name}
    for clause in clauses:
        key, _, value = clause.partition(" ")
        if not key or not value.strip() or key in row or said.word == "datum":
            collected.problems.append(
                Fault(
                    "part-comment",
                    "this comment about the part cannot be read",
                    found=f'"{clause[:60]}"',
                    expected="the name of a datum alone: (datum: A)"
                    if said.word == "datum"
                    else "after the name, between commas, keys once each, with their values: "
                    "(feature: bore A, diameter 40 +0.025 0)",
                ).at(document.file, said.line)
            )
            return None
        nominal = _WITH_LIMITS.fullmatch(value.strip())
        if key == "datums":
            row[key] = value.split()
        elif nominal is not None:
            row[key], row["tolerance"] = nominal[1], nominal[2]
        else:
            row[key] = value.strip()
    return row


def _find_kind(row: dict[str, Any], document: Document, key: Key, collected: _Collected) -> bool:
    """Write the kind of the feature that a comment's keys say into its row, in that kind's keys.

    The name of a kind is the key of its value: `size 100 +-0.05`, `flatness 0.02`.
    """
    common = FeatureTable.model_fields.keys()
    asked = [word for word in row if word not in common]
    kinds = list(collected.kinds.values())
    if "kind" in row:
        kinds = [kind for kind in kinds if kind.kind == row["kind"]]
        if not kinds:
            return True  # what is none is said of every row
    fitting = []
    for kind in kinds:
        fields = kind.table.model_fields
        keys = {word: _key_of(word, kind) for word in asked}
        required = {name for name, one in fields.items() if one.is_required()}
        known = {word: key for word, key in keys.items() if key is not None}
        if asked and len(known) == len(asked) and required <= set(known.values()):
            fitting.append((kind.kind not in asked, kind.kind, known))
    if fitting:
        _, row["kind"], known = min(fitting, key=lambda one: one[0])
        for word, key_of_kind in known.items():
            row[key_of_kind] = row.pop(word)
        return True
    if "kind" in row:
        return True
    named = sorted({word for kind in kinds for word in (kind.kind, *kind.table.model_fields)})
    unknown = next((word for word in asked if word not in named), None)
    hint = None if unknown is None else did_you_mean(unknown, named)
    collected.problems.append(
        document.problem(
            Fault(
                "part-comment",
                "this comment says no feature of any kind",
                found=", ".join(asked) or "a name alone, of no feature before it",
                expected=one_of(named),
                hint=hint or "where several kinds have a key, say which: kind circle",
            ),
            key,
        )
    )
    return False


def _key_of(word: str, kind: type[Feature]) -> str | None:
    """The key of a kind's table that a word of a comment is; None: it is none."""
    fields = kind.table.model_fields
    if word in fields:
        return word
    if word == kind.kind:
        return next((key for key in ("nominal", "zone") if key in fields), None)
    return None


def _placed(
    row: Declared,
    said: Mapping[tuple[str, str], list[Place]],
    text: ProgramText,
    program: str,
    collected: _Collected,
) -> Declared:
    """The row with the places of its elements."""
    places: list[Place] = []
    addresses = row.table.addresses()
    for address in addresses:
        place = text.stretches[address]
        if place is None:
            collected.problems.append(row.problem(not_there(row.what, address, text, program)))
        else:
            places.append(place)
    if not addresses:
        places = said.get(_identity(row), [])
        if not places:
            collected.problems.append(
                row.problem(
                    Fault(
                        "part-nowhere",
                        f"nothing says where {row.what} is in the program",
                        found="no lines, n, tool or comment",
                        expected=f'such as lines = "12-15", or (feature: {row.name}) in {program}',
                    )
                )
            )
    if row.kind is None and len(places) > 1:  # a datum is one element
        places = [tuple(sorted(interval for place in places for interval in place))]
    return replace(row, places=tuple(places))


def _operations(
    part: PartTable, document: Document, text: ProgramText, program: str, collected: _Collected
) -> Place | None:
    """The lines of the operations that count; None: all do."""
    if part.operations is None:
        return None
    lines: list[Interval] = []
    for address in part.operations.addresses():
        place = text.stretches[address]
        if place is None:
            fault = not_there("an operation", address, text, program)
            collected.problems.append(document.problem(fault, ("part", "operations")))
        else:
            lines += place
    return tuple(sorted(lines)) if lines else None


def _counting(row: Declared, operations: Place, collected: _Collected) -> Declared:
    """The row with only those lines of its places that count."""
    places = tuple(common_lines(place, operations) for place in row.places)
    if any(not place for place in places):
        collected.problems.append(
            row.problem(
                Fault(
                    "part-not-there",
                    f"{row.what} is in no operation that counts",
                    found="lines outside of [part] operations",
                    expected="lines of those operations",
                )
            )
        )
    return replace(row, places=places)


def _check_datums(
    rows: Sequence[Declared], part: PartTable, document: Document, collected: _Collected
) -> None:
    """Refuse datums that there are not."""
    named = [name for word, name in collected.names if word == "datum"]

    def refuse(name: str, document: Document, key: Key) -> None:
        fault = Fault(
            "unknown-datum",
            f'there is no datum "{name}"',
            found=name,
            expected=one_of(named) if named else f'[[datum]] with name = "{name}"',
            hint=did_you_mean(name, named),
        )
        collected.problems.append(document.problem(fault, key))

    for row in rows:
        for name in row.datums:
            if name not in named:
                refuse(name, row.document, (*row.key, "datums"))
    for name in part.datums:
        if name not in named:
            refuse(name, document, ("part", "datums"))
    if part.alignment == "datums" and not part.datums:
        collected.problems.append(
            document.problem(
                Fault(
                    "missing-key",
                    "the frame of which datums is not said",
                    found='alignment = "datums" and no datums',
                    expected='datums = ["A", "B", "C"] in [part]',
                ),
                ("part", "alignment"),
            )
        )


def _overlapping(rows: Sequence[Declared]) -> Iterator[tuple[Declared, Declared, Interval]]:
    """Each row that shares lines with one before it, that one, and the lines.

    All the lines of an element may be another's as well: a wall is straight, and square to a datum.
    """
    places = [(row, place) for row in rows for place in row.places]
    for number, (row, place) in enumerate(places):
        for other, others in places[:number]:
            common = overlap(place, others)
            if common is None:
                continue
            twice = row.kind is other.kind and list(row.datums) == list(other.datums)
            if place != others or twice or row is other:
                yield row, other, common
                break


def _check_shared(rows: Sequence[Declared], collected: _Collected) -> None:
    """Refuse lines that two have in part, and a feature that is there twice."""
    for row, other, (first, last) in _overlapping(rows):
        where = f"line {first}" if first == last else f"lines {first} to {last}"
        collected.problems.append(
            row.problem(
                Fault(
                    "part-shared",
                    f"{row.what} shares lines with {other.what}",
                    found=f"{where} in both",
                    expected="lines of its own, or all lines of the same element where one wall "
                    "or bore has features of several kinds",
                )
            )
        )


__all__ = ["Declarations", "Declared", "Kinds", "declared", "raise_all"]
