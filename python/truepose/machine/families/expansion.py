"""`[family]` -> the rows of a document: drives, struts and guides with their joint centres.

They are written into the document before anything else reads it, as if the file had them, so that
all that reads rows need not know. Their line is that of `[family]`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from truepose._kernel import elements
from truepose.arrays import Floats
from truepose.errors import Fault, Problem
from truepose.files.document import Document, Key, named_rows
from truepose.files.settings import apply, of_table
from truepose.files.units import QuantityError, UnitSystem, shown_value
from truepose.files.wording import did_you_mean, one_of
from truepose.machine.families._family import MachineFamily, Row
from truepose.machine.shared_keys import EACH
from truepose.machine.tables import Owners
from truepose.machine.validation import Validated, validate_alone

TABLE = "family"

EQUAL = 1e-8
"""Relative to the largest coordinate: joint centres that differ by less are the same.

Of a machine of half a metre 5 nm: what is left when a file writes nine digits.
"""

_DERIVED = ("drive", "strut", "guide", EACH)
"""Tables about which nothing is known where `[family]` is no good."""


@dataclass(frozen=True)
class Expansion:
    """What became of `[family]`: the machine, and what the file says against it."""

    family: MachineFamily | None = None
    problems: list[Problem] = field(default_factory=list)

    def explains(self, document: Document, problem: Problem) -> bool:
        """Whether a problem of the whole file is only that `[family]` gave no rows."""
        if self.family is not None or TABLE not in document.data:
            return False
        path = problem.path or ""
        if path.split(".")[0] in _DERIVED:
            return problem.code == "missing-key" or path.startswith(EACH)
        return problem.code == "missing-key" and path == "machine.dof"


def expand(
    document: Document, settings: Mapping[str, str] | Sequence[str], owners: Owners
) -> Expansion:
    """Write the rows of `[family]` into the document, settings of `family` first.

    Rows come in the family's order; one that the file has by its name keeps what it says.
    """
    apply(document, of_table(settings, TABLE), owners.free_tables)
    if not isinstance(document.data.get(TABLE), dict):
        return Expansion()
    validated, _ = validate_alone(document, owners, TABLE)  # the whole file's problems come later
    family = validated.family
    if family is None:
        return Expansion()
    return Expansion(family, list(_Expanding(document, family, validated).problems()))


class _Expanding:
    def __init__(self, document: Document, family: MachineFamily, validated: Validated) -> None:
        self.document, self.family, self.units = document, family, validated.units
        self.rows = family.real_rows()
        self.line = document.line((TABLE,))
        # What a calibration found of one joint centre stands in its row, beside the family.
        self.is_calibrated = isinstance(document.data.get("calibration"), dict)
        lengths = [
            np.abs(value).max()
            for row in self.rows
            for key, value in row.numbers.items()
            if _unit(row.table, key)
        ]
        self.size = float(max(lengths, default=1.0))

    def problems(self) -> Iterator[Problem]:
        """Write everything, and say what contradicts it."""
        self._defaults("machine", {"dof": self.family.dof, "commanded": self.family.commanded})
        home = {freedom: f"{value!r} m" for freedom, value in self.family.home().items()}
        self._defaults("workspace", {"home": home} if home else {})
        for table in dict.fromkeys(row.table for row in self.rows):
            rows = self.document.data.get(table, [])
            # Where it is no list of tables, validation says so.
            if isinstance(rows, list) and all(isinstance(row, dict) for row in rows):
                yield from self._table(table, rows)

    def _defaults(self, table: str, values: Mapping[str, Any]) -> None:
        """Keys of a single table that it does not write; of one group, all or none."""
        data = self.document.data.get(table)
        if not isinstance(data, dict) or values.keys() & data.keys():
            return
        for key, value in values.items():
            data[key] = list(value) if isinstance(value, tuple) else value
            self._at_family((table, key))

    def _at_family(self, key: Key) -> None:
        if self.line is not None:
            self.document.lines[key] = self.line

    def _table(self, table: str, given: list[dict[str, Any]]) -> Iterator[Problem]:
        of_family = [row for row in self.rows if row.table == table]
        names = [row.name for row in of_family]
        at: dict[str, int] = {}
        for index, name in named_rows({table: given}, table):
            at.setdefault(name, index)
        rest = [index for index in range(len(given)) if index not in {at.get(n) for n in names}]
        order = [*(at.get(name) for name in names), *rest]
        self._reorder(table, order)
        self.document.data[table] = [{} if i is None else given[i] for i in order]
        for index, row in enumerate(of_family):
            yield from self._row(index, row)
        for index in range(len(names), len(order)):
            yield from self._stranger(table, index, names)

    def _reorder(self, table: str, order: Sequence[int | None]) -> None:
        """Let the lines of the rows go with them."""
        lines = self.document.lines
        moved: dict[Key, int] = {}
        for key in [key for key in lines if len(key) > 1 and key[0] == table]:
            moved[(table, order.index(int(key[1])), *key[2:])] = lines.pop(key)
        lines.update(moved)
        for index, before in enumerate(order):
            if before is None:
                self._at_family((table, index))

    def _stranger(self, table: str, index: int, names: list[str]) -> Iterator[Problem]:
        """A row that the family does not have; one without a name is refused elsewhere."""
        name = self.document.data[table][index].get("name")
        if not isinstance(name, str) or name in names:
            return
        yield self.document.problem(
            Fault(
                "unknown-part",
                f'a {self.family.kind} has no {table} "{name}"',
                found=shown_value(name),
                expected=one_of(f'"{known}"' for known in names),
                hint=did_you_mean(name, names),
            ),
            (table, index, "name"),
        )

    def _row(self, index: int, row: Row) -> Iterator[Problem]:
        data = self.document.data[row.table][index]
        common = self.document.data.get(EACH)
        common = common.get(row.table) if isinstance(common, dict) else None
        common = common if isinstance(common, dict) else {}
        for key, value in {"name": row.name, **row.words, **row.numbers, **row.defaults}.items():
            where: Key = (row.table, index, key)
            shared = key not in data and key in common
            if not shared and key not in data:
                data[key] = self._written(row, key, value)
                self._at_family(where)
            elif key not in row.defaults and not self.is_calibrated:
                said = common[key] if shared else data[key]
                fault = self._contradiction(row, key, value, said)
                if fault is not None:
                    at = (EACH, row.table, key) if shared else where
                    yield self.document.problem(fault, at)

    def _written(self, row: Row, key: str, value: Any) -> Any:
        """A value as a file would have it, exact and without a unit of the file's own."""
        if isinstance(value, str):
            return value
        numbers, unit = value, _unit(row.table, key)
        if unit is None:
            return numbers.tolist()
        texts = [f"{float(number)!r} {unit}" for number in np.atleast_1d(numbers)]
        return texts if numbers.ndim else texts[0]

    def _contradiction(self, row: Row, key: str, value: Any, said: Any) -> Fault | None:
        """What is wrong with a key of the file that the family gives too; None if nothing."""
        part = f"{row.table}.{row.name}.{key}"
        if isinstance(value, str):
            if said == value or not isinstance(said, str):
                return None
            return self._fault(part, shown_value(said), shown_value(value))
        numbers, unit = value, _unit(row.table, key)
        try:
            given = _read(said, numbers.ndim, "ratio" if unit is None else "length", self.units)
        except QuantityError:
            return None  # validation says what is wrong with it
        if unit is None:
            given = given / (float(np.linalg.norm(given)) or 1.0)
        off = float(np.abs(given - numbers).max())
        if off <= EQUAL * (1.0 if unit is None else self.size):
            return None
        return self._fault(part, self._shown(given, unit), self._shown(numbers, unit), off, unit)

    def _fault(
        self, part: str, found: str, expected: str, off: float = 0.0, unit: str | None = None
    ) -> Fault:
        by = f", by up to {self._shown(np.asarray(off), unit)}" if off else ""
        return Fault(
            "family-contradiction",
            f"this is not what [family] gives{by}",
            found=found,
            expected=f"{part} = {expected}, or no such key",
            hint="change the family, or take [family] out and keep the joint centres",
        )

    def _shown(self, numbers: Floats, unit: str | None) -> str:
        if unit is None:
            texts, label = [f"{number:.10g}" for number in np.atleast_1d(numbers)], ""
        else:
            of_file = self.units.shown()["length"]
            texts = [f"{number:.10g}" for number in np.atleast_1d(of_file.to_file(numbers))]
            label = f" {of_file.label}"
        return (f"[{', '.join(texts)}]" if numbers.ndim else texts[0]) + label


def _read(said: Any, ndim: int, dimension: str, units: UnitSystem) -> Floats:
    """A quantity of the file or three of them, SI. Raises `QuantityError`."""
    if not ndim:
        return np.asarray(units.read(said, dimension))
    if not isinstance(said, list) or len(said) != 3:
        raise QuantityError("wrong-type", "expected a list of 3")
    return np.array([units.read(component, dimension) for component in said])


def _unit(table: str, key: str) -> str | None:
    """SI; None of a direction."""
    directions = {
        field["name"]
        for entry in elements()[table]
        for field in entry["fields"]
        if field["dimension"] == "direction"
    }
    return None if key in directions else "m"
