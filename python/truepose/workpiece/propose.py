"""Features that a program has by its own geometry: full circles, opposite walls, flat faces.

What is found is written as a features file to be edited: it is valid as it stands, its tolerances
are the accuracy that the machine file asks for, and what the drawing says goes in their place.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike
from pathlib import Path

import numpy as np

from truepose._kernel import GcodeMoves
from truepose.controllers.gcode._axes import AXES, MILLIMETRE, Axes
from truepose.controllers.gcode.division import LINE, RAPID
from truepose.controllers.gcode.program import (
    BATCH,
    PROGRAM,
    ProgramOptions,
    problems_of,
    reading_of,
)
from truepose.errors import Problem, RequestError
from truepose.files.text_file import on_disk, require_input
from truepose.machine import Machine
from truepose.workpiece.declarations import SCHEMA

SAME = 1e-6
"""m, and rad: what differs by less is the same; a program has six decimals of mm at most."""

LEAST = 1.0 / 32.0
"""Characteristic lengths: a shorter line is no wall, and no pass over a face."""

PASSES = 5
"""Parallel lines that follow each other at one height and are a face."""

OVERLAP = 0.5
"""Share of the shorter of two walls along which they face each other."""

TOLERANCE = 1e-4
"""m, where the machine file asks for no accuracy."""

STEP = 0.5
"""Of a pass: a line across that is shorter leads to the next one."""

MOST_WALLS = 64
"""Lines of a contour, the last ones, among which walls are looked for."""

Z = AXES.index("Z")
TURNING = [AXES.index(name) for name in "ABC"]
PLANES = {17: (2, (0, 1)), 18: (1, (2, 0)), 19: (0, (1, 2))}
"""Of a working plane the axis across it, and its own two, in the order of an arc's centre."""


Place = tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class _Line:
    """A straight line at feed in the plane of X and Y; m. `contour`: of moves without a rapid."""

    first: int
    last: int
    begin: tuple[float, float, float]
    end: tuple[float, float, float]
    contour: int

    @cached_property
    def length(self) -> float:
        """M."""
        return math.dist(self.begin, self.end)

    @cached_property
    def direction(self) -> tuple[float, float]:
        """Unit vector."""
        x, y = self.end[0] - self.begin[0], self.end[1] - self.begin[1]
        return x / self.length, y / self.length

    @property
    def place(self) -> Place:
        """Its ends, in whichever direction and at whichever height it is driven."""
        return tuple(sorted((_rounded(*self.begin[:2]), _rounded(*self.end[:2]))))

    def parallel(self, other: _Line) -> float:
        """+1 or -1 of lines of one or of opposite directions, at the same height; else 0."""
        (a, b), (c, d) = self.direction, other.direction
        if abs(a * d - b * c) > SAME or abs(self.begin[2] - other.begin[2]) > SAME:
            return 0.0
        return math.copysign(1.0, a * c + b * d)

    def left_of(self, other: _Line) -> float:
        """M, how far it is to the left of a parallel line; 0 where it is on it, or not parallel."""
        x, y = other.direction
        off = x * (self.begin[1] - other.begin[1]) - y * (self.begin[0] - other.begin[0])
        return off if abs(off) > SAME and self.parallel(other) else 0.0

    def goes_on(self, line: _Line) -> bool:
        """Whether a line goes on where this one ends, in its direction."""
        return (
            self.contour == line.contour
            and math.dist(self.end, line.begin) <= SAME
            and self.parallel(line) > 0.0
        )

    def is_opposite(self, other: _Line) -> bool:
        """Whether both are walls that face each other, driven in opposite directions."""
        if self.parallel(other) >= 0.0 or self.left_of(other) == 0.0:
            return False
        x, y = self.direction
        (a, b), (c, d) = (
            sorted(x * point[0] + y * point[1] for point in (line.begin, line.end))
            for line in (self, other)
        )
        return min(b, d) - max(a, c) >= OVERLAP * min(b - a, d - c)


@dataclass(frozen=True)
class _Circle:
    """A full turn; m."""

    first: int
    last: int
    radius: float


@dataclass
class _Turn:
    """Arcs about one centre that follow each other, until they close a full turn."""

    first: int
    centre: tuple[float, float]
    radius: float
    plane: int
    height: float
    swept: float = 0.0
    last: int = 0

    def goes_on(self, arc: _Turn) -> bool:
        """Whether an arc is of the same circle."""
        return (
            self.plane == arc.plane
            and math.dist(self.centre, arc.centre) <= SAME
            and abs(self.radius - arc.radius) <= SAME
            and abs(self.height - arc.height) <= SAME
        )


@dataclass
class _Search:
    """One reading of a program; what is kept is bounded by what is proposed.

    `circles`, `pairs` of walls and `faces`: the last of each place; `others`: how many circles
    before it had that centre. `_waiting`: lines that may yet become a face, those of them that are
    passes in `_passes`.
    """

    least: float
    circles: dict[tuple[int, ...], _Circle] = field(default_factory=dict)
    others: dict[tuple[int, ...], int] = field(default_factory=dict)
    pairs: dict[tuple[Place, ...], tuple[_Line, _Line]] = field(default_factory=dict)
    faces: dict[tuple[Place, ...], tuple[_Line, _Line, int]] = field(default_factory=dict)
    _turn: _Turn | None = None
    _line: _Line | None = None
    _passes: list[_Line] = field(default_factory=list)
    _waiting: list[_Line] = field(default_factory=list)
    _walls: deque[_Line] = field(default_factory=lambda: deque(maxlen=MOST_WALLS))

    def other(self) -> None:
        """A move of which no feature is made."""
        self._turn = None
        self._end_line()

    def arc(self, line: int, arc: _Turn, sweep: float) -> None:
        """An arc at one height, which would begin a turn of its own."""
        self._end_line()
        turn = self._turn
        if turn is None or not turn.goes_on(arc) or turn.swept * sweep < 0.0:
            turn = self._turn = arc
        turn.swept += sweep
        turn.last = line
        if abs(turn.swept) >= 2.0 * math.pi - SAME:
            key = (turn.plane, *_rounded(*turn.centre))
            self.others[key] = self.others.get(key, -1) + 1
            self.circles.pop(key, None)
            self.circles[key] = _Circle(turn.first, turn.last, turn.radius)
            self._turn = None

    def straight(self, line: _Line) -> None:
        """A line at one height; what follows in the same direction goes on with it."""
        self._turn = None
        before = self._line
        if before is not None and before.goes_on(line):
            self._line = _Line(before.first, line.last, before.begin, line.end, line.contour)
            return
        self._end_line()
        self._line = line

    def _end_line(self) -> None:
        """The line is as long as it is: it is a pass, a step to the next one, or neither."""
        line, self._line = self._line, None
        if line is None or line.length < self.least:
            return
        before = self._passes[-1] if self._passes else None
        if before is not None and not line.parallel(before) and line.length < STEP * before.length:
            self._waiting.append(line)
            return
        if before is not None and not self._is_next(line):
            self._end_passes()
        self._passes.append(line)
        self._waiting.append(line)

    def _is_next(self, line: _Line) -> bool:
        """Whether a line is the next pass, on the same side of the last as that of the others."""
        last = self._passes[-1]
        off = line.left_of(last)
        if len(self._passes) == 1 or off == 0.0:
            return off != 0.0
        return off * last.left_of(self._passes[-2]) * last.parallel(self._passes[-2]) > 0.0

    def _end_passes(self) -> None:
        """Passes are a face where they are enough, else walls."""
        passes, waiting = self._passes, self._waiting
        self._passes, self._waiting = [], []
        if len(passes) >= PASSES:
            key = passes[0].place, passes[-1].place
            self.faces.pop(key, None)
            self.faces[key] = passes[0], passes[-1], len(passes)
            return
        for line in waiting:
            if self._walls and self._walls[-1].contour != line.contour:
                self._end_walls()
            self._walls.append(line)

    def _end_walls(self) -> None:
        """Keep the last pair of opposite walls of a contour in each direction."""
        walls = list(self._walls)
        self._walls.clear()
        done: list[_Line] = []
        for number in range(len(walls) - 1, 0, -1):
            line = walls[number]
            if any(line.parallel(other) for other in done):
                continue
            before = reversed(walls[:number])
            partner = next((other for other in before if line.is_opposite(other)), None)
            if partner is not None:
                done.append(line)
                key = tuple(sorted((partner.place, line.place)))
                self.pairs.pop(key, None)
                self.pairs[key] = partner, line

    def finish(self) -> None:
        """The program has ended."""
        self._end_line()
        self._end_passes()
        self._end_walls()


def _rounded(*values: float) -> tuple[int, ...]:
    return tuple(round(value / (10.0 * SAME)) for value in values)


def propose_features(
    machine: Machine, program: str | PathLike[str], options: ProgramOptions | None = None
) -> str:
    """The text of a features file with what the program has by its own geometry.

    Raises `RequestError`: nothing-found where it has nothing of that, the program's own problems
    (gcode-...), bad-correction for an option.
    """
    path = Path(program)
    require_input(path, PROGRAM)
    search = _Search(LEAST * machine.characteristic_length)
    with on_disk(path) as opened, problems_of(path):
        reader = reading_of(options or ProgramOptions(), Axes(machine)).reader(opened)
        contour = 0
        while len(moves := reader.read(BATCH)):
            contour = _look_at(moves, search, contour)
    search.finish()
    if not (search.circles or search.pairs or search.faces):
        raise RequestError(
            Problem(
                "nothing-found",
                "the program has no feature that is found by its geometry",
                str(path),
                found="no full circle of arcs, no two opposite walls of one contour, no face of "
                f"{PASSES} parallel passes",
                expected="one of them",
                hint="name the features yourself, in a file or in comments of the program",
            )
        )
    return _text(machine, path, search)


def _look_at(moves: GcodeMoves, search: _Search, contour: int) -> int:
    """Some moves more; returns the number of the contour that they end in."""
    start, end = moves.start * MILLIMETRE, moves.end * MILLIMETRE
    for points in (start, end):
        points[np.isnan(points)] = 0.0  # an axis that the machine does not have
    lines, kinds, planes = moves.line.tolist(), moves.kind.tolist(), moves.plane.tolist()
    centres, sweeps = (moves.centre * MILLIMETRE).tolist(), moves.sweep.tolist()
    begins, ends = start[:, :3].tolist(), end[:, :3].tolist()
    turned = (start[:, TURNING] != end[:, TURNING]).any(axis=1).tolist()
    for number, (line, kind) in enumerate(zip(lines, kinds, strict=True)):
        begin, last = begins[number], ends[number]
        if kind == RAPID:
            contour += 1
            search.other()
        elif turned[number]:
            search.other()
        elif kind == LINE:
            if begin == last:
                continue
            if abs(begin[2] - last[2]) > SAME:
                search.other()
            else:
                search.straight(_Line(line, line, tuple(begin), tuple(last), contour))
        else:
            across, along = PLANES[planes[number]]
            if abs(begin[across] - last[across]) > SAME:
                search.other()
                continue
            radius = math.dist([begin[axis] for axis in along], centres[number])
            turn = _Turn(line, tuple(centres[number]), radius, planes[number], begin[across])
            search.arc(line, turn, sweeps[number])
    return contour


def _text(machine: Machine, path: Path, search: _Search) -> str:
    """The features file."""
    shown = machine.shown.length
    target = machine.accuracy.target

    def length(value: float) -> str:
        return f'"{value * shown.per_si:.9g} {shown.label}"'

    zone = length(TOLERANCE if target is None else target)
    limits = f'"+-{zone[1:]}'
    whence = "a tenth of a millimetre" if target is None else "the accuracy asked of the machine"
    blocks = [
        f"# Features that were found in {path.name}: sizes are those of the path of the tool.\n"
        f"# Fill in what the drawing says: every tolerance here is {whence},\n"
        "# every name is a number. Take out what is no feature of the part.\n"
        f"schema = {SCHEMA}\n\n"
        "[part]\n"
        'alignment = "clamped"   # or "best-fit", or "datums" with datums = ["A", "B"]\n'
        "tool_radius = 0         # the path is the surface; with the radius of the tool give each\n"
        '                        # size its side = "inside" or "outside", and the size itself\n'
    ]
    for number, (key, circle) in enumerate(search.circles.items(), 1):
        others = search.others[key]
        note = f"   # the last of {others + 1} about this centre" if others else ""
        blocks.append(
            f'[[feature]]\nname = "circle {number}"\nkind = "circle"\n'
            f"lines = {_lines(circle.first, circle.last)}{note}\n"
            f"diameter = {length(2.0 * circle.radius)}\n"
            f"tolerance = {limits}   # fill in\n"
            f"roundness = {zone}   # fill in, or take out\n"
            f"position = {zone}   # fill in, or take out\n"
        )
    for number, (first, second) in enumerate(search.pairs.values(), 1):
        blocks.append(
            f'[[feature]]\nname = "width {number}"\nkind = "size"\n'
            f"lines = [{_lines(first.first, first.last)}, {_lines(second.first, second.last)}]\n"
            f"nominal = {length(abs(second.left_of(first)))}\n"
            f"tolerance = {limits}   # fill in\n"
        )
    for number, (begin, end, count) in enumerate(search.faces.values(), 1):
        blocks.append(
            f'[[feature]]\nname = "face {number}"\nkind = "flatness"\n'
            f"lines = {_lines(begin.first, end.last)}   # {count} passes at one height\n"
            f"zone = {zone}   # fill in\n"
        )
    return "\n".join(blocks)


def _lines(first: int, last: int) -> str:
    return f'"{first}"' if first == last else f'"{first}-{last}"'


__all__ = ["propose_features"]
