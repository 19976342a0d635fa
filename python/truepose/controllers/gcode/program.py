"""A program of G-code as it is read for a machine, and what it does not say of itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

from truepose._kernel import GcodeError, GcodeMoves, GcodeReader
from truepose.controllers.gcode._axes import Axes
from truepose.controllers.gcode.division import Moves
from truepose.controllers.gcode.work_offsets import Positions, WorkOffsets, named, work_offsets
from truepose.errors import Problem, RequestError
from truepose.files.text_file import FileKind

BATCH = 8192
"""Moves worked on at a time."""

PROGRAM = FileKind("a program of G-code", ".ngc")

HINTS = {
    "gcode-no-offset": "say what it is: --offset G54 x=..,y=.., or --var with LinuxCNC's parameter "
    "file, or take the code out to be in machine coordinates",
    "gcode-no-units": "or say what holds at first: --units mm",
    "gcode-block-delete": "say what the operator's switch is: --block-delete on",
}
"""What helps against problems of a program that an option solves."""

Refuse = Callable[[str, object, str], None]
"""Takes what cannot be: what, found, expected."""


@dataclass(frozen=True)
class ProgramOptions:
    """What a program does not say of itself.

    `units`: "mm" or "inch" before G20 or G21. `start`: where the machine stands at first, by axis,
    m and rad, machine coordinates; default home. `offsets` of "G54" to "G59.3", by axis, m and rad,
    with r, the rotation about Z; `parameter_file`: LinuxCNC's, which has them all. `block_delete`:
    whether lines that begin with / are left out.
    """

    units: str | None = None
    start: Positions | None = None
    offsets: Mapping[str, Positions] | None = None
    parameter_file: str | PathLike[str] | None = None
    block_delete: bool | None = None

    def reading(self, axes: Axes, refuse: Refuse) -> ProgramReading:
        """The options in the interpreter's form; `refuse` takes what cannot be.

        Raises `RequestError` for the parameter file.
        """
        if self.units not in (None, "mm", "inch"):
            refuse("unit", self.units, "mm or inch")
        parameters = None if self.parameter_file is None else Path(self.parameter_file)
        begin = {**axes.home(), **named(self.start or {}, "start", refuse)}
        shifted = work_offsets(axes.machine, self.offsets, parameters, refuse)
        return ProgramReading(axes.names, self.units, begin, shifted, self.block_delete)


@dataclass(frozen=True)
class ProgramReading:
    """How a program is read; coordinates by the axes' letters, mm and degrees."""

    axes: str
    units: str | None
    start: dict[str, float]
    offsets: WorkOffsets
    block_delete: bool | None

    def arguments(self) -> dict[str, Any]:
        """What both readers of the kernel take."""
        return {
            "units": self.units,
            "start": self.start,
            "offsets": self.offsets.systems,
            "system": self.offsets.active,
            "block_delete": self.block_delete,
            "axes": self.axes,
        }

    def reader(self, program: Path) -> GcodeReader:
        """What reads a program as the controller does."""
        return GcodeReader(program, **self.arguments())


def reading_of(options: ProgramOptions, axes: Axes) -> ProgramReading:
    """The options in the interpreter's form. Raises `RequestError`, all at once."""
    problems: list[Problem] = []

    def refuse(name: str, found: object, expected: str) -> None:
        problems.append(bad_option(name, found, expected))

    reading = options.reading(axes, refuse)
    if problems:
        raise RequestError(*problems)
    return reading


def bad_option(name: str, found: object, expected: str) -> Problem:
    """The problem that an option of a program cannot be what it is."""
    return Problem(
        "bad-correction",
        f"a program cannot be read or corrected with this {name}",
        found=str(found),
        expected=expected,
    )


def moves_of(moves: GcodeMoves) -> Moves | None:
    """The moves as arrays, each made once; None behind the last."""
    if not len(moves):
        return None
    return Moves(
        moves.line,
        moves.kind,
        moves.start,
        moves.end,
        moves.length,
        moves.points,
        moves.speed,
        moves.stops,
    )


@contextmanager
def problems_of(program: Path) -> Iterator[None]:
    """The interpreter's refusals as problems of the program's file."""
    try:
        yield
    except GcodeError as refusal:
        raise RequestError(
            Problem(
                refusal.code,
                refusal.message,
                file=str(program),
                line=refusal.line,
                column=refusal.column,
                found=refusal.found,
                expected=refusal.expected,
                hint=HINTS.get(refusal.code, refusal.hint),
            )
        ) from None


__all__ = [
    "BATCH",
    "PROGRAM",
    "ProgramOptions",
    "ProgramReading",
    "bad_option",
    "moves_of",
    "problems_of",
    "reading_of",
]
