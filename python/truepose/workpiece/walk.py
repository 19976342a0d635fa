"""The walk along the path of a program: its points in their order, those of elements among them.

A move is divided as for its correction (controllers/gcode/division.py), and its end is always a
point. What belongs to an element has points of its own, evenly spaced, an arc's evenly by angle.
All are in the order of the path, as the flank of a drive's play follows from how it came there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Flags, Floats, Indices
from truepose.compensation.commands import ActualMachine
from truepose.controllers.gcode import _refusals
from truepose.controllers.gcode._axes import MILLIMETRE, Axes
from truepose.controllers.gcode._singularity_crossings import first_crossing
from truepose.controllers.gcode.division import RAPID, SPACING, CannotCorrect, Moves
from truepose.controllers.gcode.program import (
    BATCH,
    PROGRAM,
    ProgramOptions,
    moves_of,
    problems_of,
    reading_of,
)
from truepose.errors import RequestError
from truepose.files.text_file import on_disk, require_input
from truepose.machine import Condition, Machine
from truepose.runs.poses import BLOCK, OK
from truepose.workpiece.stretches import Stretches

MOST_POINTS = 360
"""Points of a feature's elements, all together."""

FEWEST_POINTS = 24
"""Intervals of an element that is not short of them for any other reason."""

FINE = 1.0 / 1024.0
"""Distance of an element's points, in characteristic lengths, where `MOST_POINTS` allow it."""

ANGLE = math.radians(1.0)
"""Angle between the points of an arc of an element, where `MOST_POINTS` allow it."""

RAPID_SPACING = 4.0 * SPACING
"""Greatest distance of two points of a rapid, whose path is no promise."""

ROUNDING = 1e-9
"""Share of a step that is none."""

CLOSED = 1e-9
"""Distance of the ends of a path that is closed, in characteristic lengths."""

_FACTORS = (1, 2, 3, 4, 5, 6, 9, 10, 12, 15, 18, 20, 30, 36, 45, 60, 90, 180)
"""By which points are taken farther from each other: an arc's have their opposites then."""


@dataclass(frozen=True, eq=False)
class PathBatch:
    """Some points of the path, in its order.

    `line` (m,) of the program; `poses` (m, n_commanded) commanded, m and rad; `points` (m, 3): tool
    points, m, machine coordinates; `element` (m,): number of the stretch of elements that it
    belongs to, or -1; `weight` (m,), m: length of the path that it stands for (rapids and starts:
    0); `is_feed` (m,). `joints` (m, n_joint) and `placements` (m, 7) of the nominal machine there.
    """

    line: Indices
    poses: Floats
    points: Floats
    element: Indices
    weight: Floats
    is_feed: Flags
    joints: Floats
    placements: Floats


@dataclass
class StretchExtent:
    """What the moves of one stretch are, all together.

    `size`, m, of the whole path; `needs`, (m, rad) of each of the first moves: of a line its
    length, of an arc its angle; `moves`, and `runs` of them that follow each other; `begin` and
    `end` of the path (n_commanded,).
    """

    size: float = 0.0
    needs: list[tuple[float, float]] = field(default_factory=list)
    moves: int = 0
    runs: int = 0
    begin: Floats | None = None
    end: Floats | None = None

    def add(
        self, size: Floats, turned: Floats, begins_run: Flags, begin: Floats, end: Floats
    ) -> None:
        """More moves (n,), from their pose `begin` to `end`."""
        if self.begin is None:
            self.begin = begin
        self.end = end
        self.size += float(size.sum())
        self.moves += len(size)
        self.runs += int(begins_run.sum())
        room = MOST_POINTS - len(self.needs)
        straight = np.where(turned > 0.0, 0.0, size)
        self.needs += list(zip(straight[:room].tolist(), turned[:room].tolist(), strict=True))

    def is_closed(self, length: float) -> bool:
        """Whether it ends where it began, on a machine of characteristic `length`, m."""
        return (
            self.runs == 1
            and self.begin is not None
            and self.end is not None
            and bool((np.abs(self.begin - self.end) <= CLOSED * length).all())
        )

    def spacing(self, most: int, length: float) -> Spacing:
        """For at most `most` points, of a machine of characteristic `length`, m."""
        closed = self.is_closed(length)
        starts = 0 if closed else self.runs
        if self.moves + starts <= most // 2:
            straight, turned = np.array(self.needs).reshape(-1, 2).T
            line = min(FINE * length, float(straight.sum()) / FEWEST_POINTS) or length
            for factor in _FACTORS:
                counts = intervals(straight, line * factor) + intervals(turned, ANGLE * factor)
                if counts.sum() + starts <= most:
                    return Spacing(line * factor, ANGLE * factor, sparse=False, starts=not closed)
        return Spacing(self.size / most, math.inf, sparse=True, starts=False)


@dataclass(frozen=True)
class Spacing:
    """How the points of one stretch are spaced.

    `line`, m, and `arc`, rad: at most between two points of a move; where `sparse`, of the whole
    stretch every `line` metres have one. `starts`: whether a run's first point is one.
    """

    line: float
    arc: float
    sparse: bool
    starts: bool


def intervals(size: Floats, step: Floats | float) -> Floats:
    """(n,) how many equal intervals, no longer than a step, sizes (n,) are; a rounding is none."""
    return np.asarray(np.ceil(size / step * (1.0 - ROUNDING)))


@dataclass(frozen=True, eq=False)
class _Batch:
    """Some moves (n,) of the program, those that move the machine.

    `moves`: as they were read, and `index` (n,) which of them; `size` (n,), m, of their path;
    `rapid` (n,); `turned` (n,), rad, of arcs; `stretch` (n,) of elements, or -1; `begins_run` (n,):
    a stretch begins, or goes on somewhere else; `jumps` (n,): begins where no move ended;
    `begin`, `end` (n, n_commanded) poses.
    """

    moves: Moves
    index: Indices
    size: Floats
    rapid: Flags
    turned: Floats
    stretch: Indices
    begins_run: Flags
    jumps: Flags
    begin: Floats
    end: Floats


class ProgramWalk:
    """The path of one program on one machine, which may be walked as often as one likes.

    `extents`: of each stretch of `chosen`, found in a first walk.
    """

    def __init__(
        self,
        machine: Machine,
        program: Path,
        options: ProgramOptions,
        chosen: Stretches,
        most_points: Sequence[int] | None = None,
        condition: Condition | None = None,
    ) -> None:
        """`most_points` of each stretch; default `MOST_POINTS`.

        Raises `RequestError`: the program's problems with file, line and column (gcode-...),
        bad-correction for an option.
        """
        require_input(program, PROGRAM)
        self.machine = machine
        self.program = program
        self._axes = Axes(machine)
        self._reading = reading_of(options, self._axes)
        self._actual = ActualMachine(machine, condition)
        self._chosen = chosen
        self._start = np.array([self._reading.start[name] for name in self._axes.names])
        self._start = self._start * self._axes.scale
        self._linear = ["xyz".index(name) for name in machine.commanded if name in "xyz"]
        self._from = [at for at, name in enumerate(machine.commanded) if name in "xyz"]
        self.extents = tuple(StretchExtent() for _ in range(chosen.count))
        self._survey()
        length = machine.characteristic_length
        most = most_points or [MOST_POINTS] * chosen.count
        self.spacings = [
            extent.spacing(count, length) for extent, count in zip(self.extents, most, strict=True)
        ]

    def _survey(self) -> None:
        for batch in self._batches():
            for number in np.unique(batch.stretch[batch.stretch >= 0]):
                rows = np.flatnonzero(batch.stretch == number)
                self.extents[number].add(
                    batch.size[rows],
                    batch.turned[rows],
                    batch.begins_run[rows],
                    batch.begin[rows[0]],
                    batch.end[rows[-1]],
                )

    def feed_lines(self) -> Indices:
        """(n,) lines of the program, in order, that move the machine at feed."""
        lines = [batch.moves.line[batch.index[~batch.rapid]] for batch in self._batches()]
        return np.unique(np.concatenate([np.empty(0, np.int64), *lines]))

    def _batches(self) -> Iterator[_Batch]:
        """The program's moves in batches. Raises `RequestError`."""
        last_end, last_stretch = np.full_like(self._start, np.nan), -1
        length = self.machine.characteristic_length
        with on_disk(self.program) as opened:
            with problems_of(self.program):
                reader = self._reading.reader(opened)
            while True:
                with problems_of(self.program):
                    raw = reader.read(BATCH)
                moves = moves_of(raw)
                if moves is None:
                    return
                self._require_possible(moves)
                turn = self._axes.turn(moves.start, moves.end) * length
                size = np.fmax(moves.length * MILLIMETRE, turn)
                moving = np.flatnonzero(~(size == 0.0))
                if not moving.size:
                    continue
                begin = self._axes.poses(moves.start[moving])
                end = self._axes.poses(moves.end[moving])
                rapid = moves.kind[moving] == RAPID
                stretch = np.where(rapid, -1, self._chosen.number_of(moves.line[moving]))
                before = np.concatenate([last_end[np.newaxis], end[:-1]])
                jumps = (begin != before).any(axis=1) & np.isfinite(begin).all(axis=1)
                follows = np.concatenate([[last_stretch], stretch[:-1]]) == stretch
                yield _Batch(
                    moves,
                    moving,
                    size[moving],
                    rapid,
                    np.abs(raw.sweep[moving]),
                    stretch,
                    (stretch >= 0) & (jumps | ~follows),
                    jumps,
                    begin,
                    end,
                )
                last_end, last_stretch = end[-1], int(stretch[-1])

    def _require_possible(self, moves: Moves) -> None:
        refusal = _refusals.of_uncommanded_axis(
            self._axes, moves, self.program
        ) or _refusals.of_long_move(self.machine, moves, self.program)
        if refusal is not None:
            raise refusal

    def is_closed(self, stretch: int) -> bool:
        """Whether a stretch ends where it began, and each of its moves has points."""
        closed = self.extents[stretch].is_closed(self.machine.characteristic_length)
        return closed and not self.spacings[stretch].sparse

    def elements(self) -> list[tuple[Floats, Indices, Indices]]:
        """Of each stretch its points (n, 3), their lines (n,), and their places (n,).

        The places are the numbers of the points among those of all stretches, in the order of the
        path. Raises `RequestError` as `path`.
        """
        points, lines, stretch = [np.empty((0, 3))], [np.empty(0, np.int64)], [np.empty(0, np.intp)]
        for batch in self._walk(elements_only=True):
            points.append(batch.points)
            lines.append(batch.line)
            stretch.append(batch.element)
        of = np.concatenate(stretch)
        places = [np.flatnonzero(of == number) for number in range(self._chosen.count)]
        every, at_line = np.concatenate(points), np.concatenate(lines)
        return [(every[place], at_line[place], place) for place in places]

    def path(self) -> Iterator[PathBatch]:
        """The points of the whole path.

        Raises `RequestError` where the machine cannot go along it: gcode-start, gcode-pose,
        gcode-singularity, with the line.
        """
        return self._walk(elements_only=False)

    def _walk(self, *, elements_only: bool) -> Iterator[PathBatch]:
        gone = np.zeros(self._chosen.count)
        last: Floats | None = None
        for batch in self._batches():
            layout = _Layout(self, batch, gone, elements_only=elements_only)
            for rows in layout.blocks():
                points = self._points(batch, *rows)
                if not elements_only:
                    self._require_way(batch, rows[0], points, last)
                    last = points.poses[-1]
                yield points

    def _points(
        self, batch: _Batch, move: Indices, share: Floats, element: Indices, weight: Floats
    ) -> PathBatch:
        index = batch.index[move]
        poses = self._axes.poses(batch.moves.points(index, share))
        joints, placements, status = self.machine.kernel.place(poses)
        failed = np.flatnonzero(status != OK)
        if failed.size:
            at = int(failed[0])
            raise self._unusable(
                batch, int(index[at]), float(share[at]), STATUS[status[at]], poses[at]
            )
        points = placements[:, :3].copy()
        points[:, self._linear] = poses[:, self._from]
        return PathBatch(
            batch.moves.line[index],
            poses,
            points,
            element,
            weight,
            ~batch.rapid[move],
            joints,
            placements,
        )

    def _unusable(
        self, batch: _Batch, move: int, share: float, status: str, pose: Floats
    ) -> RequestError:
        failure = CannotCorrect(move, share, status, pose, of_program=True)
        if np.array_equal(pose, self._start) and share == 0.0:
            return _refusals.of_start(self.machine, self._axes, failure)
        return _refusals.of_unusable(failure, self.machine, self._axes, batch.moves, self.program)

    def _require_way(
        self, batch: _Batch, move: Indices, points: PathBatch, last: Floats | None
    ) -> None:
        """Refuse what leads through a singularity, from `last` (n_commanded,) on."""
        ends = points.poses
        begins = np.concatenate([ends[:1] if last is None else last[np.newaxis], ends[:-1]])
        crossing = first_crossing(self._actual, begins, ends, points.weight, alone=~points.is_feed)
        if crossing is not None:
            index = int(batch.index[move[crossing]])
            raise self._unusable(batch, index, 1.0, "singular", ends[crossing])


class _Layout:
    """Where the points of a batch lie."""

    def __init__(
        self, walk: ProgramWalk, batch: _Batch, gone: Floats, *, elements_only: bool
    ) -> None:
        """`gone` (n_stretch,), m, along each stretch so far, is brought on."""
        self._batch = batch
        of = batch.stretch
        length = walk.machine.characteristic_length
        spacing = np.where(batch.rapid, RAPID_SPACING, SPACING) * length
        known = np.isfinite(batch.begin).all(axis=1)
        plain = np.where(known, np.maximum(intervals(batch.size, spacing), 1.0), 1.0)
        kept, start = np.zeros(of.size), np.zeros(of.size, np.bool_)
        for number in np.unique(of[of >= 0]):
            rows, fit = of == number, walk.spacings[number]
            size = batch.size[rows]
            if fit.sparse:
                way = gone[number] + np.cumsum(size)
                stations = np.floor(np.append(gone[number], way) / fit.line * (1.0 + ROUNDING))
                kept[rows] = np.diff(stations)
                gone[number] = way[-1]
            else:
                turned = batch.turned[rows]
                wanted = np.where(
                    turned > 0.0, intervals(turned, fit.arc), intervals(size, fit.line)
                )
                kept[rows] = np.maximum(wanted, 1.0)
                start[rows] = fit.starts & batch.begins_run[rows]
        # Between two points of an element there are others where they are far from each other.
        self._between = np.maximum(np.ceil(plain / np.maximum(kept, 1.0)), 1.0).astype(np.intp)
        if elements_only:
            self._between[:] = 1
            count = kept
            self._first = np.where(start, 0, 1)
        else:
            count = np.maximum(kept, 1.0) * self._between
            self._first = np.where(start | batch.jumps, 0, 1)
        self._count = count.astype(np.intp)
        self._kept = kept > 0.0
        self._start = start

    def blocks(self) -> Iterator[tuple[Indices, Floats, Indices, Floats]]:
        """Of points, about a block at a time: their move, share, stretch or -1, and weight."""
        points = np.where(self._count > 0, self._count + 1 - self._first, 0)
        block = (np.cumsum(points) - 1) // BLOCK
        for number in np.unique(block[points > 0]):
            moves = np.flatnonzero((block == number) & (points > 0))
            yield from self._of(moves, points[moves])

    def _of(
        self, moves: Indices, points: Indices
    ) -> Iterator[tuple[Indices, Floats, Indices, Floats]]:
        move = np.repeat(moves, points)
        place = np.arange(move.size) - np.repeat(np.cumsum(points) - points, points)
        place = place + self._first[move]
        count = self._count[move]
        batch = self._batch
        on_element = np.where(place == 0, self._start[move], place % self._between[move] == 0)
        element = np.where(on_element & self._kept[move], batch.stretch[move], -1)
        weight = np.where((place == 0) | batch.rapid[move], 0.0, batch.size[move] / count)
        share = place / count
        for begin in range(0, move.size, BLOCK):
            rows = slice(begin, begin + BLOCK)
            yield move[rows], share[rows], element[rows], weight[rows]


__all__ = ["MOST_POINTS", "PathBatch", "ProgramWalk", "Spacing", "StretchExtent"]
