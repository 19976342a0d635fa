"""What a source is built from: the machine, and the source's own share of the file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Protocol, TypeAlias, TypeVar

from pydantic import BaseModel

from truepose._kernel import Machine as KernelMachine
from truepose.errors import Fault, Problem
from truepose.files.data_file import Column, DataFiles, DataTable
from truepose.files.document import Document
from truepose.files.tolerance import Band, Tolerance, read_tolerance
from truepose.files.tolerance_standards import ToleranceClassError
from truepose.files.units import QuantityError
from truepose.files.wording import did_you_mean
from truepose.machine.condition import Condition
from truepose.machine.families.parameters import FamilyParameters
from truepose.machine.limbs import Limb
from truepose.machine.parts import Body, Drive, Guide, Strut
from truepose.machine.validation import Validated

Model = TypeVar("Model", bound=BaseModel)


class ErrorSource(Protocol):
    """An error source as the loader and the machine see it: the keys it reads, how it is built.

    What it does is the business of `sources`.
    """

    name: ClassVar[str]
    doc: ClassVar[str]
    tables: ClassVar[Mapping[str, type[BaseModel]]]

    @classmethod
    def build(cls, parts: SourceBuilder) -> ErrorSource | None:
        """The source, or None where the file says nothing about it."""
        ...


SourceType: TypeAlias = type[ErrorSource]


class SourceBuilder:
    """The parts of one file, SI. Problems that a source finds are collected, not raised."""

    def __init__(
        self,
        document: Document,
        validated: Validated,
        kernel: KernelMachine,
        *,
        drives: tuple[Drive, ...],
        struts: tuple[Strut, ...],
        bodies: tuple[Body, Body, Body],
        guides: tuple[Guide, ...] = (),
        limbs: tuple[Limb, ...] = (),
        condition: Condition,
        data_files: DataFiles,
        family: FamilyParameters | None = None,
    ) -> None:
        self.kernel = kernel
        self.drives = drives
        self.struts = struts
        self.platform, self.frame, self.tool = bodies
        self.carriages = tuple(drive.carriage for drive in drives if drive.carriage is not None)
        self.guides = guides
        self.limbs = limbs
        self.condition = condition
        self.family = family
        self.problems: list[Problem] = []
        self._document = document
        self._validated = validated
        self._units = validated.units
        self._data_files = data_files

    def rows(self, model: type[Model]) -> tuple[Model, ...]:
        """What each drive or strut says in the keys of `model`, in the file's order."""
        return self._validated.rows(model)

    def table(self, model: type[Model]) -> Model | None:
        """What a single table says in the keys of `model`; None where there is no such table."""
        return self._validated.table(model)

    def has(self, path: str) -> bool:
        """Whether the file writes a key: `condition.force`, `strut.1.length_tolerance`."""
        return self._document.has(path)

    def is_set(self, path: str) -> bool:
        """Whether a setting, not the file, writes a key."""
        return self._document.setting(self._document.key(path)) is not None

    def tolerance(self, value: object, dimension: str, path: str) -> Tolerance | None:
        """A raw value of the file as a tolerance; None, and a problem, where it is none."""
        try:
            return read_tolerance(value, dimension, self._units)
        except QuantityError as error:
            self.refuse(error.fault, path)
            return None

    def band(self, tolerance: Tolerance, nominal: float, path: str) -> Band | None:
        """The band for a nominal size in m; None, and a problem, where the standard has none."""
        try:
            return tolerance.band(nominal)
        except ToleranceClassError as error:
            self.refuse(error.fault, path)
            return None

    def data_file(self, name: str, columns: Sequence[Column], path: str) -> DataTable | None:
        """The table in the data file `name` (relative to the machine file), SI.

        `columns` are those that it may have; `path` is the key that names the file, as in
        `drive.d1.actuator.table`. None, and every problem of the file with its line, where it is
        not good. What only the source can judge (an order, a range) it says afterwards with
        `parts.problems.append(table.problem(Fault(...), row=..., column=...))`.

            columns = (
                Column("position", "length"),
                Column("direction", None, words=("up", "down")),
                Column("deviation", "length"),
            )
            table = parts.data_file(row.table, columns, f"drive.{drive.name}.actuator.table")
            if table is not None:
                positions = table.numbers["position"]  # (n_row,) m
                directions = table.texts["direction"]  # n_row words

        The file's hash goes into `Machine.data_files` and every result.
        """
        return self._data_files.read(name, columns, self._document.key(path))

    def refuse(self, fault: Fault, path: str) -> None:
        """Record a problem at `path`; the load fails after every source was asked."""
        self.problems.append(self._document.problem(fault, self._document.key(path)))

    def record(self, problem: Problem) -> None:
        """Record a problem that a source also raises when a condition given later brings it up."""
        self.refuse(problem.fault, problem.path or "")

    def suggest(self, word: str, possible: Iterable[str]) -> str | None:
        """`did you mean "..."?`, or None where nothing is near."""
        return did_you_mean(word, possible)
