"""Edits of a machine file's text that leave all else as its author wrote it, comments included."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Collection, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit
from tomlkit.items import AoT, Array, InlineTable, Table

from truepose.arrays import Floats
from truepose.errors import RequestError
from truepose.files.dimensions import BY_UNIT, DIMENSIONS
from truepose.files.document import ARRAY_TABLES, MACHINE_FILE, Document, document_of, read
from truepose.files.one_run import real_path
from truepose.files.settings import apply, of_table
from truepose.files.text_file import read_text
from truepose.files.units import UnitSystem, meant
from truepose.machine import Machine, validation
from truepose.machine.families.expansion import TABLE as FAMILY
from truepose.machine.families.expansion import expand
from truepose.machine.families.parameters import FamilyParameters, is_of_family
from truepose.machine.families.text import row_tables, write_rows
from truepose.machine.shared_keys import share_each
from truepose.machine.tables import owners
from truepose.sources import REGISTRY

_NAMES_A_FILE = ("table", "data", "poses", "temperature_log")
"""Keys whose value may be the name of a CSV file."""

_NUMBER = re.compile(r"[+-]?[\d.]++(?:[eE][+-]?\d++)?+")
_LENGTH_TOLERANCE = "length_tolerance"
_XYZ = "xyz"

CORRELATION_NOTE = "# of what was calibrated: row i has name i + 1 with names 1 to i"


class MachineText:
    """The text of a machine file, with the machine's settings written into it.

    Raises `RequestError` (calibration-file-changed) where the file is not the one that the machine
    was read from. `text`: what stands in it, if it is not to be read again; its warnings then stay.
    """

    def __init__(
        self, original: Path, machine: Machine, changed: RequestError, text: str | None = None
    ) -> None:
        if text is None:
            _, content = read_text(original, MACHINE_FILE)
            self._document = read(original)
            self.toml = tomlkit.parse(_without_warnings(content, machine))
        else:
            self._document = document_of(original, text.encode(), text)
            self.toml = tomlkit.parse(text)
        if self._document.file_hash != machine.file_hash:
            raise changed
        owned = owners(source.tables for source in REGISTRY)
        expand(self._document, machine.settings, owned)
        self._units: UnitSystem = validation.units_of(self._document)
        self._machine = machine
        self._folder = original.parent
        # The settings go into the text, and into what was read, which says what rows share.
        written = Document(self._document.file, self._document.name, "", self.toml)
        apply(written, of_table(dict(machine.settings), FAMILY), owned.free_tables)
        if any(path.split(".")[0] in ARRAY_TABLES for path in machine.settings):
            self.write_rows()
        apply(written, dict(machine.settings), owned.free_tables)
        share_each(self._document, dict(machine.settings), owned.free_tables)
        apply(self._document, dict(machine.settings), owned.free_tables)

    @property
    def document(self) -> Document:
        """What was read, as validated: settings, and what rows share, stand in it."""
        return self._document

    def write_rows(self) -> None:
        """Write the rows that the machine's family gives, with all of their geometry."""
        if self._machine.family is not None:
            write_rows(
                self.toml,
                self._document,
                self._machine.family.family,
                lambda value: self.written(value, "length", None),
            )

    def write_rows_for_family(self) -> None:
        """Write them in place of `[family]`."""
        self.write_rows()
        self.toml.pop(FAMILY, None)

    # --- values

    def set_family(self, family: FamilyParameters, names: Collection[str]) -> None:
        """Write the parameters `names` of the family, each limb's own where they differ."""
        table = self.toml[FAMILY]
        for key in dict.fromkeys(name.split(".")[1] for name in names):
            values = np.atleast_1d(family.family.values()[key])
            dimension, old = family.dimension(f"{FAMILY}.{key}"), table.get(key)
            given = old if isinstance(old, list) else [old] * values.size
            alike = not isinstance(old, list) and old is not None and np.ptp(values) == 0.0
            written = [
                self.written(float(value), dimension, one)
                for value, one in zip(values, given, strict=True)
            ]
            table[key] = written[0] if alike else written

    def set_parameter(self, name: str, value: float) -> None:
        """Write a parameter (no direction's) of the kernel, SI."""
        table, part, key, component = _place(name)
        row = self.row(table, part)
        dimension = BY_UNIT[self._machine.units[self._machine.parameters.index(name)]]
        if component is None:
            row[key] = self.written(value, dimension, row.get(key))
            return
        self._own_list(row, table, part, key, dimension)
        at = _XYZ.index(component)
        row[key][at] = self.written(value, dimension, row[key][at])

    def set_direction(self, table: str, part: str, key: str, axis: Floats) -> None:
        """Write a direction (3,), plain numbers."""
        row = self.row(table, part)
        if isinstance(row.get(key), Array):
            for at, component in enumerate(meant(axis)):
                row[key][at] = float(component)
        else:
            row[key] = [float(component) for component in meant(axis)]

    def set_property(self, path: str, dimension: str, value: float) -> None:
        """Write a property of a part, such as `strut.1.expansion`, SI."""
        path, _, key = path.rpartition(".")
        table, _, part = path.partition(".")
        row = self.row(table, part)
        row[key] = self.written(value, dimension, row.get(key))

    def row(self, table: str, part: str) -> Any:
        """The row or table of the text that a part's keys are written in."""
        if table == "tool":
            return self.toml["machine"]
        if not part:
            if table not in self.toml:
                self.toml[table] = tomlkit.table()
            return self.toml[table]
        rows = self.toml.get(table, ())
        if self._machine.family is not None:
            names = [row.get("name") for row in rows]
            if part not in names:  # one that the family gives
                rows = row_tables(self.toml, self._document, table)
        return next(row for row in rows if row.get("name") == part)

    def written(self, value: float, dimension: str, old: Any) -> float | str:
        """An SI value as the file writes such: with the unit of the `old` one, or the declared.

        Of the numbers next to it the one of few digits, else the one that is read nearest.
        """
        unit = None
        match = _NUMBER.match(old.strip()) if isinstance(old, str) else None
        if match is not None and match.end() < len(old.strip()):
            unit = old.strip()[match.end() :].lstrip()
        elif dimension not in self._units.declared and dimension != "ratio":
            unit = DIMENSIONS[dimension].si

        def form(number: float) -> float | str:
            return number if unit is None else f"{number!r} {unit}"

        # Where the scale has no offset, which no parameter's has, reading is a multiplication.
        scale = self._units.read(form(1.0), dimension)
        start = value / scale
        near = [start, math.nextafter(start, math.inf), math.nextafter(start, -math.inf)]

        def off(number: float) -> float:
            return abs(self._units.read(form(number), dimension) - value)

        few = float(meant(start))
        return form(few if few in near else min(near, key=off))

    def set_coverage(self, at: str) -> bool:
        """Write at which coverage the accuracy is asked, where the file asks one and says none.

        Returns whether it did.
        """
        table = self.toml.get("accuracy")
        if not table or "at" in table:
            return False
        # What stands below its last key, tomlkit takes for the table's: comments of the next one.
        body = table.value.body if isinstance(table, Table) else []
        last = max((place for place, (key, _) in enumerate(body) if key is not None), default=-1)
        below = body[last + 1 :]
        del body[last + 1 :]
        table["at"] = at
        body.extend(below)
        return True

    def set_controller(self, holds: str) -> None:
        """Write which geometry the controller works with."""
        if "controller" in self.toml:
            self.toml["controller"]["holds"] = holds
        else:
            self.append(f'[controller]\nholds = "{holds}"\n')

    # --- tolerances

    def set_tolerance(self, name: str, stated: Mapping[str, Any]) -> None:
        """Write the tolerance of a parameter, also a family's, in place of all that is said of it.

        `stated`: keys of a tolerance's table, `standard_deviation` and `band` in SI.
        """
        family = self._machine.family
        if family is not None and is_of_family(name):
            at, dimension = -1, family.dimension(name)
        else:
            at = self._machine.parameters.index(name)
            dimension = BY_UNIT[self._machine.units[at]]
        written: dict[str, Any] = dict(stated)
        if "band" in written:
            written["band"] = [self.written(end, dimension, None) for end in written["band"]]
        if "standard_deviation" in written:
            deviation = self.written(written["standard_deviation"], dimension, None)
            written["standard_deviation"] = deviation
        inline = inline_table(written)
        for index, column in enumerate(self._machine.kernel.length_parameters[: self._n_strut]):
            if column == at and _LENGTH_TOLERANCE in self._document.data["strut"][index]:
                row = self.row("strut", self._machine.struts[index].name)
                _put(row, _LENGTH_TOLERANCE, inline)
                return
        if "tolerance" not in self.toml:
            self.toml["tolerance"] = tomlkit.table()
        _put(self.toml["tolerance"], name, inline)

    @property
    def _n_strut(self) -> int:
        return len(self._machine.struts)

    def forget_correlations(self, names: Collection[str], kept: Mapping[str, int]) -> list[str]:
        """Take what is called `names` (parameters and groups) out of all correlations.

        `kept`: names of the other parameters and groups, with the number of their variable. Returns
        the comments of the tables that are gone.
        """
        rows = self.toml.get("correlation")
        comments: list[str] = []
        if rows is None:
            return comments
        for index in reversed(range(len(rows))):
            left = _without(rows[index], names, kept)
            if left is None:
                continue
            if left:
                rows[index].update(left)
                for key in [key for key in rows[index] if key not in left]:
                    del rows[index][key]
                continue
            text = rows[index].as_string().splitlines() if isinstance(rows, AoT) else []
            notes = [line.strip() for line in text if line.strip().startswith("#")]
            comments = [line for line in notes if line != CORRELATION_NOTE] + comments
            del rows[index]
        if not rows:
            del self.toml["correlation"]
        return comments

    def add_correlation(self, between: Sequence[str], correlation: Floats) -> None:
        """Write the correlation matrix (n, n) of the variables called `between`, all digits."""
        lines = [
            "[" + ", ".join(repr(float(coefficient)) for coefficient in correlation[at, :at]) + "]"
            for at in range(1, len(between))
        ]
        names = ", ".join(tomlkit.item(name).as_string() for name in between)
        matrix = "".join(f"    {line},\n" for line in lines)
        body = f"between = [{names}]\nmatrix = [\n{matrix}]\n"
        rows = self.toml.get("correlation")
        if rows is None or isinstance(rows, AoT):
            self.append(f"[[correlation]]\n{CORRELATION_NOTE}\n{body}")
            return
        rows.append(inline_table(tomlkit.parse(body).unwrap()))

    # --- the file

    def append(self, text: str) -> None:
        """Write whole tables at the end."""
        before = self.text()
        between = "" if before.endswith("\n\n") else "\n" if before.endswith("\n") else "\n\n"
        self.toml = tomlkit.parse(f"{before}{between}{text}")

    def move_to(self, file: Path) -> None:
        """Rewrite relative names of data files for a machine file of another name.

        They are whole names where that is a link into another folder: the file is read by both.
        """
        old, new = self._folder.resolve(), file.parent.resolve()
        linked = real_path(file).parent != new
        if old == new and not linked:
            return
        names = {
            name: Path(old / name if linked else os.path.relpath(old / name, new)).as_posix()
            for name in self._machine.data_files
            if not Path(name).is_absolute()
        }
        for key, value in self.toml.items():
            if key != "calibration":
                _rename(value, names)

    def text(self) -> str:
        """The text as it stands."""
        return tomlkit.dumps(self.toml)

    # --- inside

    def _own_list(self, row: Any, table: str, part: str, key: str, dimension: str) -> None:
        """Give a row a list of its own where it has the shared or the usual one."""
        if key in row:
            return
        path = f"{table}.{part}.{key}" if part else f"{table}"
        names = [f"{path}.{axis}" for axis in _XYZ]
        shared = self._document.value((*self._document.key(f"{table}.{part}"), key))
        nominal = dict(zip(self._machine.parameters, self._machine.kernel.nominal, strict=True))
        # What a family gave stands in the document in m; the file may have another unit.
        by_hand = isinstance(shared, list) and self._machine.family is None
        values_given = shared if by_hand else [None] * len(_XYZ)
        row[key] = [
            value if value is not None else self.written(float(nominal[name]), dimension, None)
            for name, value in zip(names, values_given, strict=True)
        ]


def _place(name: str) -> tuple[str, str, str, str | None]:
    """Table, part, key and component of a parameter that is no direction's."""
    words = name.split(".")
    if words[0] == "tool":
        return "tool", "", "tool", words[1]
    return words[0], words[1], words[2], words[3] if len(words) > 3 else None


def _put(table: Any, key: str, inline: InlineTable) -> None:
    """Write a value; one that stands as a table of its own stays one."""
    old = table.get(key)
    if isinstance(old, Table):
        old.clear()
        old.update(inline.unwrap())
    else:
        table[key] = inline


def inline_table(values: Mapping[str, Any]) -> InlineTable:
    """An inline table, with the spaces that people put into one."""
    keys = ", ".join(f"{key} = {tomlkit.item(value).as_string()}" for key, value in values.items())
    table = tomlkit.value(f"{{ {keys} }}")
    assert isinstance(table, InlineTable)
    return table


def _without(
    row: Mapping[str, Any], names: Collection[str], kept: Mapping[str, int]
) -> dict[str, Any] | None:
    """A row of `[[correlation]]` without `names`; None where it has none, empty if none stay."""
    every = [*names, *kept]
    names_listed = [
        name
        for word in row["between"]
        for name in ([word] if word in every else [n for n in every if fnmatchcase(n, word)])
    ]
    if not any(name in names for name in names_listed):
        return None
    stay = [at for at, name in enumerate(names_listed) if name not in names]
    # A group is one variable, of which one name is enough.
    single = list({kept[names_listed[at]]: at for at in reversed(stay)}.values())[::-1]
    if len(single) < 2:
        return {}
    left: dict[str, Any] = {"between": [names_listed[at] for at in single]}
    if "coefficient" in row:
        return left | {"coefficient": row["coefficient"]}
    matrix = row["matrix"]
    return left | {
        "matrix": [[matrix[i - 1][j] for j in single if j < i] for i in single if i != single[0]]
    }


def _rename(value: Any, names: Mapping[str, str]) -> None:
    """Write new names of data files wherever a key names one."""
    if isinstance(value, Mapping):
        for key, entry in value.items():
            if isinstance(entry, str) and key in _NAMES_A_FILE and entry in names:
                value[key] = names[entry]  # type: ignore[index]
            else:
                _rename(entry, names)
    elif isinstance(value, list):
        for entry in value:
            _rename(entry, names)


def warning_comment(warning: str) -> str:
    """The line at the top of a file that was forced."""
    return "# WARNING: " + " ".join(warning.split())


def _without_warnings(text: str, machine: Machine) -> str:
    """The text without the warnings of an earlier calibration, which the new one supersedes."""
    if machine.calibration is None:
        return text
    gone = {warning_comment(warning) for warning in machine.calibration.warning}
    return "".join(line for line in text.splitlines(keepends=True) if line.strip() not in gone)
