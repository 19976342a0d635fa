"""Work offsets: where the coordinate systems of a program stand, which only the controller knows.

LinuxCNC keeps them in the parameter file that its INI names, a number and a value a line: 5220 is
the system that is active, from 5221 on each has twenty numbers, of which the first nine are X to W
and the tenth is the rotation about Z in degrees; 5210 says whether the offset of G92, 5211 to 5219,
is in force (LinuxCNC's manual, G-code, Numbered parameters). Lengths are in the machine's units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from truepose.controllers.gcode._axes import AXES, DEGREE, LINEAR, MILLIMETRE, scale_of
from truepose.errors import Problem, RequestError
from truepose.files.text_file import FileKind, require_input
from truepose.files.wording import one_of
from truepose.machine import Machine

SYSTEMS = ("G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3")
"""Coordinate systems that may be given an offset."""

ROTATION = "R"
"""About Z: X and Y of a program are turned by it, then the origin is added."""

ACTIVE, FIRST, EACH, TURN = 5220, 5221, 20, 9
G92_IN_FORCE, G92 = 5210, 5211
"""Numbers of LinuxCNC's parameters."""

PARAMETER_FILE = FileKind("the file that PARAMETER_FILE of LinuxCNC's INI names", ".var")

MOST_BYTES = 1 << 20
"""Of a parameter file: LinuxCNC's has some ten thousand."""

LONGEST, LONGEST_NAME = 200, 40
"""Characters of what is said in a comment, and of a file's name in it."""

Positions = Mapping[str, float]
"""Coordinates by axis, x y z a b c u v w, m and rad; of an offset also r, rad."""

Refuse = Callable[[str, object, str], None]


@dataclass(frozen=True)
class WorkOffsets:
    """`systems`: by name, coordinates by letter, mm and degrees; `active`: which holds at first.

    `file`: the name of the controller's, where that says them. A program that selects another
    system is refused; before any is selected the active one holds, and where nothing is known of
    that, machine coordinates.
    """

    systems: dict[str, dict[str, float]] = field(default_factory=dict)
    active: str = "G54"
    file: str = ""

    @property
    def words(self) -> str:
        """What is taken for granted, for people and for the written program's first comment."""
        if not self.systems:
            return "in machine coordinates, no work offset"
        names = sorted(self.systems, key=SYSTEMS.index)
        shown = []
        for name in names:
            moved = [f"{axis}{value:.6g}" for axis, value in self.systems[name].items() if value]
            if moved or not self.file:
                shown.append(f"{name} {' '.join(moved) or '0'}")
        if self.file:
            shown.append(f"others of {self.file} 0")
        first = (
            f"{self.active} first" if self.active in self.systems else "machine coordinates first"
        )
        text = f"work offsets in mm and deg: {', '.join(shown)}; {first}"
        if len(text) <= LONGEST:
            return text
        whence = f"of {self.file}" if self.file else "as they were given"
        return f"work offsets {whence}, {' '.join(names)}; {first}"


def work_offsets(
    machine: Machine,
    offsets: Mapping[str, Positions] | None,
    parameter_file: Path | None,
    refuse: Refuse,
) -> WorkOffsets:
    """Those of a controller's parameter file, and those that were given, which come first.

    `refuse(what, found, expected)` takes what cannot be. Raises `RequestError` for the file.
    """
    known = WorkOffsets() if parameter_file is None else read_parameters(parameter_file, machine)
    systems = dict(known.systems)
    for name, offset in (offsets or {}).items():
        if name.upper() not in SYSTEMS:
            refuse("offset", name, one_of(SYSTEMS))
            continue
        systems[name.upper()] = named(offset, f"offset {name}", refuse, rotation=True)
    return WorkOffsets(systems, known.active, known.file)


def named(
    position: Positions, what: str, refuse: Refuse, *, rotation: bool = False
) -> dict[str, float]:
    """Coordinates by the axes' letters, mm and degrees."""
    letters = AXES + ROTATION if rotation else AXES
    coordinates = {}
    for name, value in position.items():
        letter = name.upper()
        if len(letter) != 1 or letter not in letters:
            refuse(what, name, f"axes, {one_of(tuple(letters.lower()))}")
        elif not math.isfinite(value):
            refuse(what, value, "finite coordinates, m and rad")
        else:
            scale = DEGREE if letter == ROTATION else scale_of(letter)
            coordinates[letter] = float(value) / scale
    return coordinates


def read_parameters(path: Path, machine: Machine) -> WorkOffsets:
    """The offsets in LinuxCNC's parameter file, lengths in mm or inches as the machine's file has.

    Raises `RequestError` (file-missing, file-unreadable, bad-correction).
    """
    values = dict(_lines(path))
    in_force = [values.get(G92 + axis, 0.0) for axis in range(len(AXES))]
    if values.get(G92_IN_FORCE, 0.0) and any(in_force):
        raise _problem(
            path,
            None,
            "an offset of G92 is in force in this parameter file",
            "5210 is 1",
            "no offset of G92: run G92.1 before, which clears it",
        )
    active = values.get(ACTIVE, 1.0)
    if active not in range(1, len(SYSTEMS) + 1):
        expected = f"a number from 1 (G54) to {len(SYSTEMS)} (G59.3)"
        raise _problem(path, None, "5220 is no coordinate system", f"{active:g}", expected)
    inches = MILLIMETRE * machine.shown.length.per_si
    systems = {}
    for number, name in enumerate(SYSTEMS):
        first = FIRST + EACH * number
        offset = {
            letter: values.get(first + axis, 0.0) / (inches if letter in LINEAR else 1.0)
            for axis, letter in enumerate(AXES)
        }
        systems[name] = {**offset, ROTATION: values.get(first + TURN, 0.0)}
    name = "".join(c for c in path.name if c.isascii() and c.isprintable() and c not in "()%")
    return WorkOffsets(systems, SYSTEMS[int(active) - 1], name[:LONGEST_NAME])


def _lines(path: Path) -> Iterator[tuple[int, float]]:
    require_input(path, PARAMETER_FILE)
    try:
        with path.open("rb") as file:
            text = file.read(MOST_BYTES + 1)
    except OSError as failure:
        raise RequestError(
            Problem(
                "file-unreadable",
                "the parameter file cannot be read",
                file=str(path),
                found=failure.strerror or "a failure",
                expected="a file that can be read",
            )
        ) from None
    if len(text) > MOST_BYTES:
        expected = f"at most {MOST_BYTES} bytes"
        raise _problem(path, None, "this is no parameter file", "a larger file", expected)
    for number, line in enumerate(text.decode("utf-8", "replace").splitlines(), 1):
        parts = line.split()
        if not parts:
            continue
        expected = "a parameter's number and its value"
        try:
            key, value = parts[:2]
            parameter = int(key), float(value)
        except ValueError:
            raise _problem(path, number, "this line cannot be read", line[:60], expected) from None
        if not math.isfinite(parameter[1]):
            raise _problem(path, number, "this value is not finite", line[:60], expected)
        yield parameter


def _problem(path: Path, line: int | None, message: str, found: str, expected: str) -> RequestError:
    return RequestError(
        Problem(
            "bad-correction", message, file=str(path), line=line, found=found, expected=expected
        )
    )


__all__ = ["SYSTEMS", "Positions", "WorkOffsets", "named", "work_offsets"]
