"""A file of measurements -> `Measurements`; `docs/measurements.md` describes the form for users.

#: [instrument.tracker]
#: kind = "position"
#: frame = "unknown"
#: uncertainty = "10 um"
command.x (mm), command.y (mm), x (mm),   y (mm)
0,              200,            1310.252, 640.108
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.instruments import REGISTRY
from truepose.calibration.measurements.assembly_modes import HOME, OTHER
from truepose.calibration.measurements.columns import (
    TO,
    UNCERTAINTY,
    WRENCH,
    MeasurementRows,
    reading_columns,
)
from truepose.calibration.measurements.declarations import (
    Header,
    read_header,
    reserved_names,
    separated,
)
from truepose.calibration.measurements.measurements import Measurements
from truepose.calibration.measurements.rows import measurements_in
from truepose.calibration.observables import parameter_column
from truepose.errors import Fault, MachineFileError, Problem, RequestError
from truepose.files.data_file import Column, DataTable, ReadTable, cut_short, read_table
from truepose.files.dimensions import FREEDOMS
from truepose.files.text_file import FileKind, read_text
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Machine
from truepose.machine.condition import DEFAULT_PART
from truepose.sources.tolerance import bands_of

INSTRUMENT, SET, ID = "instrument", "set", "id"
ASSEMBLY_MODE = "assembly_mode"
FIT, CHECK = "fit", "check"

_KIND = FileKind("a file of measurements (CSV)", ".csv")

_OF_MACHINE = {
    "joint.": "joints",
    "command.": "freedoms that can be commanded",
    TO + "joint.": "joints",
    TO + "command.": "freedoms that can be commanded",
    "strut.": "struts",
}
"""Beginnings of columns that name something of the machine, and what."""

_PARAMETER = parameter_column("")


def read_measurements(path: str | Path, machine: Machine) -> Measurements:
    """The measurements in a file, of this machine.

    Raises `RequestError` with every problem of the file, each with its line: what is no table, what
    is not declared, a reading that the machine or the instrument cannot have.
    """
    try:
        content, text = read_text(Path(path), _KIND)
    except MachineFileError as error:
        raise RequestError(*error.problems) from None
    return measurements_of_text(path, content, text, machine)


def measurements_of_text(
    path: str | Path, content: bytes, text: str, machine: Machine
) -> Measurements:
    """The measurements that a file at `path` has, or would have, with such bytes and their text.

    Raises `RequestError` with every problem of them.
    """
    file = str(path)
    head, csv_text = separated(text)
    header = read_header(head, file, Path(path).name, reserved_names(machine))
    read = read_table(file, Path(path).name, csv_text, _columns(machine))
    reading = _Reading(machine, header, read, file)
    measurements = reading.measurements()
    problems = cut_short(dict.fromkeys(reading.problems))
    if problems:
        problems.sort(key=lambda problem: (problem.line is None, problem.line or 0))
        raise RequestError(*problems)
    assert measurements is not None
    return dataclasses.replace(
        measurements, file=Path(path).name, file_hash=hashlib.sha256(content).hexdigest()
    )


def _columns(machine: Machine) -> list[Column]:
    """Every column that a file of measurements of the machine may have."""

    def may(name: str, dimension: str | None, words: tuple[str, ...] = ()) -> Column:
        return Column(name, dimension, required=False, words=words, blank=True)

    columns = [Column(INSTRUMENT, None, required=False)]
    for beginning in ("", TO):
        columns += [
            may(f"{beginning}command.{freedom}", FREEDOMS[freedom]) for freedom in machine.commanded
        ]
        columns += [
            may(f"{beginning}joint.{drive.name}", drive.coordinate) for drive in machine.drives
        ]
    for name, reading in reading_columns(machine).items():
        columns += [may(name, reading.dimension), may(name + UNCERTAINTY, reading.dimension)]
    columns += [may(f"temperature.{part}", "temperature") for part in _parts(machine)]
    columns += [may(name, dimension) for name, dimension in WRENCH.items()]
    columns.append(may(ASSEMBLY_MODE, None, (HOME, OTHER)))
    return [*columns, may(SET, None, (FIT, CHECK)), may(ID, None)]


def _parts(machine: Machine) -> tuple[str, ...]:
    return (DEFAULT_PART, *machine.parts)


@dataclass
class _Reading:
    """Makes measurements of one file and collects every problem in it."""

    machine: Machine
    header: Header
    read: ReadTable
    file: str
    problems: list[Problem] = field(default_factory=list)

    def measurements(self) -> Measurements | None:
        """The measurements; None where problems leave nothing to make them of."""
        self.problems += self.header.problems
        self.problems += self._of_this_machine(self.read.problems)
        self._check_machine()
        self._check_declared()
        table = self.read.table
        if table is None:
            return None
        self._check_columns(table)
        codes = {problem.code for problem in self.problems}
        if not table.n_row or "nothing-measured" in codes:
            return None
        commands = self._stacked(table, "command.", self.machine.commanded)
        joints = self._stacked(table, "joint.", self.machine.joints)
        to_commands = self._stacked(table, TO + "command.", self.machine.commanded)
        to_joints = self._stacked(table, TO + "joint.", self.machine.joints)
        readings = reading_columns(self.machine)
        rows = MeasurementRows(
            instrument=self._instruments(table),
            readings={name: table.numbers[name] for name in table.columns if name in readings},
            uncertainties={
                name: values for name, values in table.numbers.items() if name.endswith(UNCERTAINTY)
            },
            held_out=np.array([w == CHECK for w in table.texts.get(SET, ("",) * table.n_row)]),
            lines=table.lines,
            commands=commands if joints is None else None,
            joints=joints,
            to_commands=to_commands if joints is None else None,
            to_joints=to_joints,
            temperatures={
                part: table.numbers[f"temperature.{part}"]
                for part in _parts(self.machine)
                if f"temperature.{part}" in table.numbers
            },
            wrench={name: table.numbers[name] for name in WRENCH if name in table.numbers},
            unreadable=self.read.unreadable,
            whole=self.header.whole,
            other_mode=np.array([w == OTHER for w in table.texts.get(ASSEMBLY_MODE, ())])
            if ASSEMBLY_MODE in table.texts
            else None,
        )
        misnamed = not codes.isdisjoint(
            ("unknown-column", "unknown-parameter", "doubled-column", "other-machine")
        )
        report = _Report(table, self.problems, misnamed)
        return measurements_in(self.machine, self.header.instruments, rows, report)

    def _of_this_machine(self, problems: Iterable[Problem]) -> Iterator[Problem]:
        """Columns of unknown joints, freedoms, struts mean another machine; others are misspelt."""
        strange: dict[str, list[Problem]] = {}
        for problem in problems:
            word = problem.path or ""
            beginning = next((prefix for prefix in _OF_MACHINE if word.startswith(prefix)), None)
            if problem.code != "unknown-column":
                yield problem
            elif beginning is not None and not self._knows(word):
                strange.setdefault(beginning, []).append(problem)
            elif word.startswith(_PARAMETER):
                yield self._no_parameter(problem, word.removeprefix(_PARAMETER))
            elif word.startswith("temperature."):
                part = word.removeprefix("temperature.")
                yield replace(
                    problem,
                    code="unknown-part",
                    message=f'{word}: the machine has no part "{part}"',
                    expected=one_of(_parts(self.machine)),
                    hint=did_you_mean(part, _parts(self.machine)),
                )
            else:
                known = self._words_beside(word)
                yield replace(problem, expected=one_of(known, limit=40))
        for beginning, same in strange.items():
            paths = [(problem.path or "").removeprefix(beginning) for problem in same]
            names = dict.fromkeys(path.partition(".")[0] for path in paths)
            own = self._own(beginning)
            near = next((hint for hint in (did_you_mean(n, own) for n in names) if hint), None)
            yield Problem(
                "other-machine",
                f"the file is of a machine with other {_OF_MACHINE[beginning]}",
                self.file,
                same[0].line,
                same[0].path,
                found=", ".join(beginning + name for name in names),
                expected=f"{', '.join(beginning + name for name in own)} of {self.machine.name}",
                hint=near if len(names) == 1 else None,
            )

    def _no_parameter(self, problem: Problem, name: str) -> Problem:
        """A column `parameter.NAME` of what is none, or of a group that has no value."""
        known = [
            column.removeprefix(_PARAMETER)
            for column in reading_columns(self.machine)
            if column.startswith(_PARAMETER)
        ]
        bands = bands_of(self.machine)
        for number, group in ({} if bands is None else bands.group_names).items():
            if group != name:
                continue
            assert bands is not None
            own = bands.parameters[bands.groups == number].tolist()
            members = [_PARAMETER + self.machine.parameters[at] for at in own]
            return replace(
                problem,
                code="unknown-parameter",
                message=f"{_PARAMETER}{name}: the parameters of this group are not of one size, so "
                "that it has no value of its own",
                expected=f"the value of one of them: {one_of(members, limit=8)}",
                hint=None,
            )
        return replace(
            problem,
            code="unknown-parameter",
            message=f"{_PARAMETER}{name}: the machine has no parameter {name}",
            expected=one_of((_PARAMETER + each for each in known), limit=8),
            hint=did_you_mean(name, known),
        )

    def _own(self, beginning: str) -> tuple[str, ...]:
        if beginning.endswith("joint."):
            return self.machine.joints
        if beginning.endswith("command."):
            return self.machine.commanded
        return tuple(strut.name for strut in self.machine.struts)

    def _knows(self, column: str) -> bool:
        """Whether the machine has the strut that a column names: then its end is misspelt."""
        strut = column.partition(".")[2]
        return column.startswith("strut.") and any(
            strut.startswith(f"{known.name}.") for known in self.machine.struts
        )

    def _words_beside(self, column: str) -> list[str]:
        """The columns that an unknown one may be a misspelling of, shortened."""
        if column.startswith("strut."):
            name = next(
                (s.name for s in self.machine.struts if column.startswith(f"strut.{s.name}.")), "1"
            )
            return [
                known
                for known in reading_columns(self.machine)
                if known.startswith(f"strut.{name}.")
            ]
        return [
            INSTRUMENT,
            *(f"command.{freedom}" for freedom in self.machine.commanded),
            *(f"joint.{joint}" for joint in self.machine.joints),
            *(
                name
                for name, column in reading_columns(self.machine).items()
                if column.strut < 1 and not name.startswith(_PARAMETER)
            ),
            _PARAMETER + self.machine.parameters[0],
            "temperature.default",
            *WRENCH,
            ASSEMBLY_MODE,
            SET,
            ID,
        ]

    def _check_machine(self) -> None:
        written = self.header.machine
        if written is None or written == self.machine.name:
            return
        self.problems.append(
            Problem(
                "other-machine",
                "the file is of another machine",
                self.file,
                self.header.machine_line,
                "machine",
                found=f'machine = "{written}"',
                expected=f'machine = "{self.machine.name}", or no such line',
            )
        )

    def _check_declared(self) -> None:
        if self.header.declared or any(p.code == "not-toml" for p in self.header.problems):
            return
        if any(problem.path == "instrument" for problem in self.header.problems):
            return
        self.problems.append(
            Problem(
                "missing-key",
                "the file declares no instrument",
                self.file,
                path="instrument",
                found="no line #: [instrument.NAME]",
                expected="kind, frame and uncertainty of an instrument in lines that begin with #:",
                hint='such as "#: [instrument.tracker]", "#: kind = ...", "#: frame = ..."',
            )
        )

    def _check_columns(self, table: DataTable) -> None:
        """Whether there are columns of commands or joints, and of readings."""
        strange = [p.path for p in self.problems if p.code == "other-machine" and p.path]
        unknown = any(
            p.code in ("unknown-column", "unknown-part", "unknown-parameter") for p in self.problems
        )
        columns = table.columns
        beginnings = [
            beginning
            for beginning in ("command.", "joint.")
            if any(column.removeprefix(TO).startswith(beginning) for column in (*columns, *strange))
        ]
        if len(beginnings) > 1:
            self._tell(
                Fault(
                    "excluding-columns",
                    "the file has both joints and commanded poses",
                    found=", ".join(
                        column
                        for column in columns
                        if column.removeprefix(TO).startswith(("command.", "joint."))
                    ),
                    expected="either columns command.* or columns joint.*",
                    hint="what the controller was sent counts",
                )
            )
        kinds = [REGISTRY[instrument.kind] for instrument in self.header.instruments]
        posed = not kinds or any(kind.poses for kind in kinds)
        if not beginnings and not unknown and posed:
            commands = ", ".join(f"command.{freedom}" for freedom in self.machine.commanded)
            joints = ", ".join(f"joint.{joint}" for joint in self.machine.joints)
            self._tell(
                Fault(
                    "missing-column",
                    "nothing says where the machine was commanded to",
                    found=", ".join(columns) or "no column",
                    expected=f"{commands}; or {joints}",
                )
            )
        two = any(kind.poses == 2 for kind in kinds) or any(c.startswith(TO) for c in columns)
        wanted = [beginnings[0]] if len(beginnings) == 1 else []
        wanted += [TO + beginning for beginning in wanted if two]
        for beginning in wanted:
            of_machine = [beginning + name for name in self._own(beginning)]
            lacking = [column for column in of_machine if column not in columns]
            if lacking and not any(column.startswith(beginning) for column in strange):
                self._tell(
                    Fault(
                        "missing-column",
                        f"there is no column {', '.join(lacking)}",
                        found=", ".join(
                            column for column in columns if column.startswith(beginning)
                        )
                        or "no such column",
                        expected=", ".join(of_machine),
                    )
                )
        readings = [column for column in columns if column in reading_columns(self.machine)]
        silent = any(kind.optional or kind.fixed for kind in kinds)
        wrong = unknown or any(column.startswith("strut.") for column in strange)
        if not readings and not silent and not wrong:
            self._tell(
                Fault(
                    "nothing-measured",
                    "no column holds what was measured",
                    found=", ".join(columns) or "no column",
                    expected="x, y, z, a, b, c, distance, strut.*.length, strut.*.direction.x, "
                    "strut.*.angle or parameter.*",
                )
            )
        elif readings and not self.header.declared:
            return
        if INSTRUMENT not in columns and len(self.header.declared) > 1:
            self._tell(
                Fault(
                    "missing-column",
                    "there is no column instrument, but more than one instrument",
                    found=", ".join(self.header.declared),
                    expected="a column instrument with the name of one in each row",
                )
            )

    def _tell(self, fault: Fault) -> None:
        """A problem of the header of the table."""
        line = None if self.read.table is None else self.read.table.header_line
        self.problems.append(fault.at(self.file, line))

    def _stacked(self, table: DataTable, beginning: str, names: tuple[str, ...]) -> Floats | None:
        """(n_row, n) of columns that are all there, else None."""
        columns = [table.numbers.get(beginning + name) for name in names]
        present = [column for column in columns if column is not None]
        return np.stack(present, axis=1) if len(present) == len(names) else None

    def _instruments(self, table: DataTable) -> Indices:
        """(n_row,) each row's instrument, -1 where none that is declared and valid is named."""
        numbers = {
            instrument.name: number for number, instrument in enumerate(self.header.instruments)
        }
        words = table.texts.get(INSTRUMENT)
        declared = self.header.declared
        if words is None:
            only = numbers.get(declared[0], -1) if len(declared) == 1 else -1
            return np.full(table.n_row, only, np.intp)
        for row, word in enumerate(words):
            if word and declared and word not in declared:
                self.problems.append(
                    table.problem(
                        Fault(
                            "unknown-instrument",
                            "the instrument is not declared",
                            found=word,
                            expected=one_of(declared),
                            hint=did_you_mean(word, declared)
                            or f'declare it above: "#: [instrument.{word[:40]}]"',
                        ),
                        row=row,
                        column=INSTRUMENT,
                    )
                )
        return np.array([numbers.get(word, -1) for word in words], np.intp)


@dataclass
class _Report:
    """Problems of rows, at their line of the file.

    `misnamed`: a column has a wrong name, so that one that is missing may be that one.
    """

    table: DataTable
    problems: list[Problem]
    misnamed: bool

    def __call__(self, fault: Fault, *, row: int | None = None, column: str | None = None) -> None:
        if fault.code == "missing-column" and self.misnamed:
            return
        problem = self.table.problem(fault, row=row, column=column)
        if row is None:
            problem = replace(problem, line=self.table.header_line)
        self.problems.append(problem)

    def shown(self, column: str, row: int) -> str:
        """A number as the file has it, with its unit."""
        if math.isnan(self.table.numbers[column][row]):
            return "nothing"
        return self.table.shown(column, row)
