"""Data files: CSV tables that a machine file names, with the unit of every column in its header.

    # a comment, anywhere
    time (s), strut.1 (degC), strut.2 (degC)
    0,        20.0,           20.1

Cells are separated by commas, decimal points are points; blank lines count for nothing. What a
file may hold is said by its reader as `Column`s; every problem of the file is found, not only the
first. `docs/data_files.md` describes the form for users.
"""

from __future__ import annotations

import csv
import hashlib
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.errors import Fault, MachineFileError, Problem
from truepose.files.dimensions import DIMENSIONS
from truepose.files.document import Document, Key
from truepose.files.limits import MOST_COLUMNS
from truepose.files.text_file import FileKind, read_text
from truepose.files.units import FileUnit, QuantityError, shown_value, unit_of
from truepose.files.wording import counted, did_you_mean, nearest, one_of

MOST_PROBLEMS = 10
"""Problems of one kind in one column that are told one by one; the others are counted."""

_KIND = FileKind("a data file (CSV)", ".csv")
_CLOSING = {"(": ")", "[": "]"}
_LINE_END = re.compile(r"\r\n|\r|\n")
_DECIMAL_COMMA = re.compile(r"[+-]?\d++,\d++\Z")
_NUMBER_AND_MORE = re.compile(r"[+-]?[\d.]++\s*+[^\d\s._]")


@dataclass(frozen=True)
class Column:
    """A column that a data file may have.

    `dimension`: a key of `DIMENSIONS`, whose unit the header must name (a `ratio` may do without);
    None for a column of words. `words`: those that may stand there, any where it is empty.
    `blank`: whether a cell may be empty, which then is NaN, or a word of no letters.
    """

    name: str
    dimension: str | None
    required: bool = True
    words: tuple[str, ...] = ()
    blank: bool = False


@dataclass(frozen=True)
class DataTable:
    """What a data file says: columns in SI, only those that the file has.

    `file` is its path for people, `name` what the machine file calls it. `numbers` by column name,
    (n_row,) SI; `texts` likewise for columns of words. `columns`: the names in the file's order.
    `lines` (n_row,): where each row stands, `header_line` where the header does.
    """

    file: str
    name: str
    columns: tuple[str, ...]
    numbers: Mapping[str, Floats]
    texts: Mapping[str, tuple[str, ...]]
    lines: Indices
    units: Mapping[str, FileUnit]
    header_line: int = 1

    @property
    def n_row(self) -> int:
        """How many rows there are, at least one."""
        return len(self.lines)

    def shown(self, column: str, row: int) -> str:
        """A number as the file has it, with its unit, for a message."""
        unit = self.units[column]
        value = float(unit.to_file(self.numbers[column][row]))
        return f"{value:.10g}" + ("" if unit.label == "1" else f" {unit.label}")

    def problem(
        self,
        fault: Fault,
        *,
        row: int | None = None,
        column: str | None = None,
    ) -> Problem:
        """A problem that a reader finds in the values, at the line of `row` (from 0)."""
        line = None if row is None else int(self.lines[row])
        return fault.about(column).at(self.file, line, column)


@dataclass(frozen=True)
class ReadTable:
    """A table as far as it could be read, and what is wrong with it.

    `table` is None where there is no header that makes columns; rows of a wrong number of cells are
    not in it. `unreadable` (n_row,) of each column: cells that are no value, or in no known unit.
    """

    table: DataTable | None
    unreadable: Mapping[str, Flags]
    problems: tuple[Problem, ...]


def read_table(file: str, name: str, text: str, columns: Sequence[Column]) -> ReadTable:
    """The table in the text of a file that no machine file names, problems and all.

    `file`: its path for people, `name` its name without a folder.
    """
    reader = _Reader(file, name, tuple(columns))
    reader.read(text)
    return ReadTable(reader.table, reader.unreadable, tuple(reader.found()))


@dataclass
class DataFiles:
    """The data files that one machine file names: each read once, its hash kept.

    Names are relative to the machine file's folder. `problems` collects what is wrong with them;
    `hashes` has the SHA-256 of each file's bytes by its name.
    """

    document: Document
    problems: list[Problem] = field(default_factory=list)
    hashes: dict[str, str] = field(default_factory=dict)

    def read(self, name: str, columns: Sequence[Column], key: Key) -> DataTable | None:
        """The table in the file `name`, which the machine file names at `key`.

        None, and problems, where there is none or it is not good.
        """
        path = Path(self.document.file).parent / name
        try:
            content, text = read_text(path, _KIND)
        except MachineFileError as error:
            self.problems += [self._located(problem, key) for problem in error.problems]
            return None
        self.hashes[name] = hashlib.sha256(content).hexdigest()
        reader = _Reader(str(path), name, tuple(columns))
        table = reader.read(text)
        self.problems += reader.found()
        return table

    def _located(self, problem: Problem, key: Key) -> Problem:
        """A file that is not there is wrong where it is named; what is in it, where it stands."""
        if problem.line is not None:
            return problem
        expected = f"{problem.expected}, relative to the machine file"
        return self.document.problem(replace(problem.fault, expected=expected), key)


class _Reader:
    """Reads one file, problems and all."""

    def __init__(self, file: str, name: str, columns: tuple[Column, ...]) -> None:
        self.file = file
        self.name = name
        self.columns = {column.name: column for column in columns}
        self.table: DataTable | None = None
        self.unreadable: dict[str, Flags] = {}
        self._problems: list[Problem] = []

    def found(self) -> list[Problem]:
        """Every problem; where one kind fills a column, the last one that is told counts on."""
        return cut_short(self._problems)

    def read(self, text: str) -> DataTable | None:
        """The table, None where it has a problem; as far as it could be read it is in `table`."""
        rows = self._rows(text)
        if rows is None:
            return None
        if not rows:
            self._refuse(
                Fault("no-rows", "the file has no header", found="nothing", expected="a header")
            )
            return None
        (line, header), *body = rows
        if not self._separated_by_commas(line, header):
            return None
        if len(header) > MOST_COLUMNS:
            self._refuse(
                Fault(
                    "not-csv",
                    "the header has more cells than any table",
                    found=counted(len(header), "cell"),
                    expected=f"at most {MOST_COLUMNS}",
                ),
                line,
            )
            return None
        placed = self._placed(line, header)
        even = [row for row in body if self._is_even(row, len(header))]
        if not body:
            self._refuse(
                Fault("no-rows", "no row below the header", found="nothing", expected="a row"), line
            )
        lines = np.array([at for at, _ in even], np.intp)
        units: dict[str, FileUnit] = {}
        numbers: dict[str, Floats] = {}
        texts: dict[str, tuple[str, ...]] = {}
        for column, at, unit in placed:
            cells = [cells[at].strip() for _, cells in even]
            wrong = column.dimension is not None and unit is None
            self.unreadable[column.name] = np.full(len(cells), wrong)
            if column.dimension is None:
                texts[column.name] = self._words(column, cells, lines)
            else:
                # Cells are looked at even where the unit is wrong: all problems at once.
                units[column.name] = unit or FileUnit("1")
                numbers[column.name] = self._numbers(column, cells, lines, units[column.name])
        self.table = DataTable(
            self.file,
            self.name,
            tuple(column.name for column, _, _ in placed),
            MappingProxyType(numbers),
            MappingProxyType(texts),
            lines,
            MappingProxyType(units),
            line,
        )
        return None if self._problems else self.table

    def _rows(self, text: str) -> list[tuple[int, list[str]]] | None:
        """(line, cells) of every row that is neither blank nor a comment."""
        lines = _LINE_END.split(text)
        # A comment stays as a blank line, so that the reader's count is the file's.
        reader = csv.reader(
            ("" if line.lstrip().startswith("#") else line for line in lines),
            strict=True,
            skipinitialspace=True,
        )
        rows = []
        start = 1
        try:
            for row in reader:
                if any(cell.strip() for cell in row):
                    rows.append((start, row))
                start = reader.line_num + 1
        except csv.Error as error:
            self._refuse(
                Fault(
                    "not-csv",
                    f"the row cannot be read: {error}",
                    found=lines[start - 1][:80],
                    expected="cells separated by commas",
                    hint='a cell that begins with a quotation mark (") must end with one',
                ),
                start,
            )
            return None
        return rows

    def _separated_by_commas(self, line: int, header: list[str]) -> bool:
        other = {";": "semicolons", "\t": "tabs", "|": "bars"}
        if len(header) == 1 and len(self.columns) > 1:
            for mark, plural in other.items():
                if mark in header[0]:
                    self._refuse(
                        Fault(
                            "not-csv",
                            f"the cells are separated by {plural}",
                            found=shown_value(header[0]),
                            expected="commas between cells, and points in decimal numbers",
                        ),
                        line,
                    )
                    return False
        return True

    def _placed(self, line: int, header: list[str]) -> list[tuple[Column, int, FileUnit | None]]:
        """The columns that the file has, each with its place and unit."""
        placed = []
        first: dict[str, str] = {}
        misspelt: set[str | None] = set()
        for at, cell in enumerate(header):
            name, written = _name_and_unit(cell.strip())
            column = self.columns.get(name)
            if column is None:
                known = list(self.columns)
                misspelt.add(nearest(name, known))
                self._refuse(
                    Fault(
                        "unknown-column",
                        f"nothing reads column {at + 1}"
                        if name
                        else f"column {at + 1} has no name",
                        found=shown_value(cell),
                        expected=one_of(known),
                        hint=did_you_mean(name, known),
                    ),
                    line,
                    name or None,
                )
            elif name in first:
                self._refuse(
                    Fault(
                        "doubled-column",
                        "the column is there twice",
                        found=f"{shown_value(first[name])} and {shown_value(cell)}",
                        expected="every column once",
                    ),
                    line,
                    name,
                )
            else:
                first[name] = cell
                placed.append((column, at, self._unit(column, written, line)))
        for column in self.columns.values():
            if column.required and column.name not in first and column.name not in misspelt:
                self._refuse(
                    Fault(
                        "missing-column",
                        f"there is no column {column.name}",
                        found=one_of([cell.strip() for cell in header]).removeprefix("one of "),
                        expected=self._header_of(column),
                    ),
                    line,
                )
        return placed

    def _unit(self, column: Column, written: str | None, line: int) -> FileUnit | None:
        """The unit that a header names; None where it names none, or none that can be used."""
        if column.dimension is None:
            if written is not None:
                self._refuse(
                    Fault(
                        "wrong-dimension",
                        "a column of words has no unit",
                        found=f"({written})",
                        expected=column.name,
                    ),
                    line,
                    column.name,
                )
            return None
        wanted = DIMENSIONS[column.dimension]
        text = "" if written is None else written.strip()
        if wanted.name == "ratio" and text in ("", "1"):
            return FileUnit("1")
        if not text:
            self._refuse(
                Fault(
                    "no-unit",
                    f"the header names no unit for {wanted.plural}",
                    found=shown_value(column.name),
                    expected=self._header_of(column),
                ),
                line,
                column.name,
            )
            return None
        try:
            return unit_of("1" + text if text.startswith("/") else text, wanted)
        except QuantityError as error:
            expected = f"{wanted.phrase}, such as {self._header_of(column)}"
            self._refuse(replace(error.fault, expected=expected), line, column.name)
            return None

    def _header_of(self, column: Column) -> str:
        """How a header could say it: `"time (s)"`."""
        if column.dimension in (None, "ratio"):
            return shown_value(column.name)
        return f'"{column.name} ({_example_unit(column.dimension)})"'

    def _is_even(self, row: tuple[int, list[str]], wanted: int) -> bool:
        line, cells = row
        if len(cells) == wanted:
            return True
        few = "few" if len(cells) < wanted else "many"
        self._refuse(
            Fault(
                "ragged-row",
                f"the row has too {few} cells",
                found=counted(len(cells), "cell"),
                expected=f"{counted(wanted, 'cell')}, as in the header",
                hint="a decimal number has a point, not a comma" if len(cells) > wanted else None,
            ),
            line,
        )
        return False

    def _numbers(self, column: Column, cells: list[str], lines: Indices, unit: FileUnit) -> Floats:
        """(n_row,) SI; NaN where a cell may be empty and is, or is no number: that is a problem."""
        name, unreadable = column.name, self.unreadable[column.name]
        values = np.full(len(cells), np.nan)
        for at, cell in enumerate(cells):
            if column.blank and not cell:
                continue
            try:
                values[at] = _number(cell)
            except ValueError:
                unreadable[at] = True
                self._no_number(name, cell, int(lines[at]))
        result = unit.to_si(values)
        for at in np.flatnonzero(np.isfinite(values) & ~np.isfinite(result)).tolist():
            unreadable[at] = True
            self._not_finite(name, cells[at], int(lines[at]))
        return result

    def _no_number(self, name: str, cell: str, line: int) -> None:
        if not cell:
            self._refuse(
                Fault("empty-cell", "the cell is empty", found="nothing", expected="a number"),
                line,
                name,
            )
            return
        try:
            float(cell)
        except ValueError:
            pass
        else:
            if "_" not in cell:
                self._not_finite(name, cell, line)
                return
        hint = None
        if _DECIMAL_COMMA.match(cell):
            hint = "a decimal number has a point, not a comma"
        elif _NUMBER_AND_MORE.match(cell):
            hint = "a unit stands in the header, not with the number"
        self._refuse(
            Fault(
                "not-a-number",
                "the cell is not a number",
                found=shown_value(cell),
                expected="a number",
                hint=hint,
            ),
            line,
            name,
        )

    def _not_finite(self, name: str, cell: str, line: int) -> None:
        self._refuse(
            Fault(
                "not-finite",
                "the number is not finite",
                found=shown_value(cell),
                expected="a finite number",
            ),
            line,
            name,
        )

    def _words(self, column: Column, cells: list[str], lines: Indices) -> tuple[str, ...]:
        unreadable = self.unreadable[column.name]
        for at, (cell, line) in enumerate(zip(cells, lines.tolist(), strict=True)):
            if column.blank and not cell:
                continue
            unreadable[at] = not cell or bool(column.words and cell not in column.words)
            if not cell:
                self._refuse(
                    Fault(
                        "empty-cell",
                        "the cell is empty",
                        found="nothing",
                        expected=one_of(column.words) if column.words else "a word",
                    ),
                    line,
                    column.name,
                )
            elif column.words and cell not in column.words:
                self._refuse(
                    Fault(
                        "unknown-choice",
                        f"{shown_value(cell)} is not one of the words that this column allows",
                        found=shown_value(cell),
                        expected=one_of(column.words),
                        hint=did_you_mean(cell, column.words),
                    ),
                    line,
                    column.name,
                )
        return tuple(cells)

    def _refuse(
        self,
        fault: Fault,
        line: int | None = None,
        column: str | None = None,
    ) -> None:
        self._problems.append(fault.about(column).at(self.file, line, column))


def cut_short(problems: Iterable[Problem]) -> list[Problem]:
    """The first problems of every kind and column; the last one that is told counts the others."""
    by_kind: dict[tuple[str, str | None], list[Problem]] = {}
    for problem in problems:
        by_kind.setdefault((problem.code, problem.path), []).append(problem)
    told = []
    for same in by_kind.values():
        more = len(same) - MOST_PROBLEMS
        told += same[:MOST_PROBLEMS]
        if more > 0:
            last = told.pop()
            told.append(replace(last, message=f"{last.message}, and in {more} more rows"))
    return told


def _name_and_unit(header: str) -> tuple[str, str | None]:
    """The name in a header's cell, and what stands in brackets behind it, if anything does."""
    start = next((at for at, mark in enumerate(header) if mark in _CLOSING), None)
    if start is None or not header.endswith(_CLOSING[header[start]]):
        return header, None
    return header[:start].rstrip(), header[start + 1 : -1] or None


def _number(cell: str) -> float:
    """A finite number, with a decimal point. Raises `ValueError`."""
    value = float(cell)  # takes "nan", "inf" and "1_000" too
    if not math.isfinite(value) or "_" in cell:
        raise ValueError(cell)
    return value


def _example_unit(dimension: str) -> str:
    """The unit of a dimension's example: "mm" of "12.5 mm"."""
    return DIMENSIONS[dimension].example.partition(" ")[2]
