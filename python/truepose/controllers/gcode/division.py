"""Division: into how many pieces a move is cut so that the corrected tool stays on its path.

A move asks the tool to follow a path X(s). What is written are pieces that end at corrected poses;
between two ends the controller interpolates by itself, in pose (it solves its nominal inverse in
every cycle) or in joints. Both take the actual machine off the path, and how far is computed at
interior points of every piece, with the known deviations of that very point:

    in pose     forward(inverse(p(t), nominal), nominal + shifts(X)) - X,  p(t) between the ends
    in joints   forward(q(t), nominal + shifts(X)) - X,                    q(t) between the ends

A piece that is off by more than the tolerance is cut into as many as bring a deviation that grows
with the square of the length within it, and each of those is looked at again.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from truepose._kernel import STATUS
from truepose.arrays import Codes, Flags, Floats, Indices
from truepose.compensation.commands import NO_DEVIATION, ActualMachine, PoseDeviations, blocks
from truepose.controllers.gcode._axes import MILLIMETRE, Axes
from truepose.controllers.gcode._measure import Measure
from truepose.controllers.gcode._pieces import Nodes, Pieces, SamplePoints, joined, selected
from truepose.controllers.gcode._singularity_crossings import first_crossing, singularity_crossings
from truepose.files.limits import MOST_PIECES
from truepose.runs.displacement import ParameterDeviation
from truepose.runs.poses import BLOCK, OK

RAPID, LINE = 0, 1

SPACING = 1.0 / 64.0
"""Greatest distance of two points at which a path is looked at, in characteristic lengths.

A piece of twice that is looked at in its middle only: what an S-shaped deviation adds to one that
grows with the square of the length is smaller by the length over the characteristic one.
"""

ACCEPTED, AIMED_AT = 0.9, 0.7
"""Shares of the tolerance: what is accepted at points that may miss the top; what cuts aim at."""

MOST_PARTS = 1024
"""Parts that one cut makes at most; they may be cut again."""

ALIKE = 0.05
"""Share of the tolerance by which what is known at both ends of a short move may differ.

In its middle it is then taken for the mean of both, which is off by less than half of that.
"""

UNKNOWN_PARTS = 8
"""Parts where the deviation is more than can be computed."""

KEPT = 1 << 17
"""Points of a batch whose known deviations are kept for the proof; all others are computed anew."""

TOO_SHORT, TOO_MANY = "too_short", "too_many"
"""Why a move cannot be corrected, beside the kernel's statuses: pieces too short, or too many."""

Interpolation = Literal["either", "pose"]


@dataclass(frozen=True, eq=False)
class Moves:
    """Some moves of a program, as the interpreter gives them: mm and degrees, machine coordinates.

    `line` (n,), from 1; `kind` (n,) 0 rapid, 1 line, 2 arc; `start`, `end` (n, 9); `length` (n,)
    of the path; `points(index (k,), share (k,))`: the points (k, 9) of moves at shares of theirs;
    `speed` (n,), of `length` a second, infinite for a rapid and NaN in G95; `stops` (n,): G61 or
    G61.1 holds.
    """

    line: NDArray[np.int64]
    kind: Codes
    start: Floats
    end: Floats
    length: Floats
    points: Callable[[NDArray[np.int64], Floats], Floats]
    speed: Floats
    stops: Flags


@dataclass(frozen=True)
class Limits:
    """What the division must hold: `chord` and `least` piece, m; what the controller may do."""

    chord: float
    least: float
    interpolation: Interpolation


class CannotCorrect(Exception):  # noqa: N818 - it is answered with a refusal, and no error itself
    """A move of the batch that cannot be corrected.

    `move` and `share` say where; `status` is the kernel's, `TOO_SHORT` or `TOO_MANY`; `pose`
    (n_commanded,), SI, the one that fails: of the program, or a command for it. `off`: by how
    much the tool would be off there, m.
    """

    def __init__(
        self,
        move: int,
        share: float,
        status: str,
        pose: Floats,
        *,
        of_program: bool,
        off: float = np.nan,
    ) -> None:
        super().__init__(move, share, status)
        self.move = move
        self.share = share
        self.status = status
        self.pose = pose
        self.of_program = of_program
        self.off = off


@dataclass(frozen=True, eq=False)
class MachineState:
    """Where the machine stands between two batches: the pose `asked`, and `joints` and `command`.

    The latter are the corrected ones; `corrected`: whether it was brought there by them. `moved`:
    what is known there.
    """

    joints: Floats
    command: Floats
    asked: Floats
    corrected: bool
    moved: ParameterDeviation


@dataclass(frozen=True, eq=False)
class PathPoints:
    """Points of a batch at which errors are told: on which piece, at which share of it.

    `piece` (k,) in the order of writing, `share` (k,), `weight` (k,) of each in a mean over the
    path, `poses` (k, n_commanded) programmed; `known` there, or None where it was not kept.
    `at_ends`: every share is 1.
    """

    piece: Indices
    share: Floats
    weight: Floats
    poses: Floats
    known: PoseDeviations | None
    at_ends: bool


@dataclass(frozen=True, eq=False)
class Divided:
    """A batch, ready to be written: `counts` (n,) of pieces, where and at which share they end.

    `points` (sum(counts), 9), `shares` (sum(counts),) of the moves' paths, `move` (sum(counts),) of
    each piece; `begins_corrected` (sum(counts),) whether the machine is where it should be when
    the piece begins; `looked_at` for the proof; `stand` at the end.
    """

    counts: NDArray[np.int64]
    points: Floats
    shares: Floats
    move: Indices
    begins_corrected: Flags
    looked_at: list[PathPoints]
    stand: MachineState


class Division:
    """Divides the moves of a program for one machine, one batch after the other."""

    def __init__(self, actual: ActualMachine, axes: Axes, limits: Limits) -> None:
        self.actual = actual
        self.axes = axes
        self.limits = limits
        self.measure = Measure(actual)

    def at_start(self, point: Floats) -> MachineState:
        """Where a program begins: at a point (9,) to which the controller went uncorrected.

        The first move is cut as if it began corrected; what it begins with besides is told apart.
        Raises `CannotCorrect` (of move 0) where the machine cannot be there.
        """
        asked = self.axes.poses(point[np.newaxis])
        known = self.actual.deviations_at(asked)
        status = known.status
        if known.block.indices.size:
            command = self.actual.command(known)
            status = command.status
        if status[0] != OK:
            raise CannotCorrect(0, 0.0, STATUS[status[0]], asked[0], of_program=True)
        return MachineState(
            command.joints[0], command.poses[0], asked[0], corrected=False, moved=known.moved
        )

    def divide(self, moves: Moves, stand: MachineState) -> Divided:
        """Cut a batch of moves, the first of which begins at `stand`.

        A move that does not begin where the one before it ends begins where the controller went
        by itself, uncorrected; a rapid may begin nobody knows where (NaN). Raises `CannotCorrect`
        for a move that has an unusable pose on it, or cannot be brought within the tolerance.
        """
        batch = _Batch(self, moves, stand)
        batch.cut()
        batch.require_ways()
        return batch.divided()


class _Batch:
    """The pieces of one batch of moves. Node i is the end of move i; those of starts come next."""

    def __init__(self, division: Division, moves: Moves, stand: MachineState) -> None:
        self.actual, self.axes = division.actual, division.axes
        self.limits, self.measure = division.limits, division.measure
        self.spacing = SPACING * division.actual.machine.characteristic_length
        self.moves = moves
        machine = division.actual.machine
        length = machine.characteristic_length
        self.unit = np.array([1.0 if unit == "m" else length for unit in machine.units])
        turn = self.axes.turn(moves.start, moves.end) * length
        # Of a rapid whose start nobody knows counts what is known, as in `length`.
        self.size = np.fmax(moves.length * MILLIMETRE, turn)
        self.kept = 0
        self.known: list[
            tuple[Indices, PoseDeviations | None]
        ] = []  # numbers of nodes, and what is known
        self.accepted: list[Pieces] = []
        self.looked: list[SamplePoints] = []

        count = len(moves.line)
        self.count = count
        numbers = np.arange(count)
        # What is known at the moves' ends and starts, if of the same parameters; at the last end.
        self.moved: ParameterDeviation | None = None
        self.at_end: ParameterDeviation = NO_DEVIATION
        self.nodes = self._corrected(numbers, np.ones(count), moves.end, first=0)
        ends = self.known[0][1]
        if len(self.known) == 1 and ends is not None and not ends.followed:
            self.moved = ends.moved
        starts = self.axes.poses(moves.start)
        before = np.concatenate([stand.asked[np.newaxis], self.nodes.asked[:-1]])
        jumps = np.flatnonzero((starts != before).any(axis=1))
        self.uncorrected = np.empty(0, np.intp)
        self.begin = numbers - 1
        self.begin[0] = self._add_stand(stand)
        for move in map(int, jumps):
            # A rapid whose start is not known is judged where it ends.
            known = np.isfinite(starts[move]).all()
            try:
                there = division.at_start((moves.start if known else moves.end)[move])
            except CannotCorrect as failure:
                failure.move = move
                raise
            self.begin[move] = self._add_stand(there)

    def _add_stand(self, stand: MachineState) -> int:
        """Make a node of where the machine stands, and return its number."""
        number = len(self.nodes.move)
        self.moved = _with_row(self.moved, stand.moved, number)
        if not stand.corrected:
            self.uncorrected = np.append(self.uncorrected, number)
        self.nodes = self.nodes.and_more(
            Nodes(
                np.array([-1]),
                np.ones(1),
                np.zeros((1, self.moves.end.shape[1])),
                stand.asked[np.newaxis],
                stand.joints[np.newaxis],
                stand.command[np.newaxis],
            )
        )
        return number

    def _corrected(self, move: Indices, share: Floats, points: Floats, first: int) -> Nodes:
        """Nodes, numbered from `first`, at shares (n,) of moves (n,), where `points` (n, 9) are.

        Raises `CannotCorrect` for the first of them without a command.
        """
        asked = self.axes.poses(points)
        joints = np.empty((len(asked), len(self.actual.machine.joints)))
        commands = np.empty_like(asked)
        for rows in blocks(len(asked)):
            known = self.actual.deviations_at(asked[rows])
            self._require(known, move[rows], share[rows], asked[rows])
            command = self.actual.command(known)
            failed = np.flatnonzero(command.status != OK)
            if failed.size:
                at = failed[0]
                raise CannotCorrect(
                    int(move[rows][at]),
                    float(share[rows][at]),
                    STATUS[command.status[at]],
                    command.poses[at] if np.isfinite(command.poses[at]).all() else asked[rows][at],
                    of_program=False,
                )
            joints[rows], commands[rows] = command.joints, command.poses
            if first == 0:
                self.at_end = known.moved[0], known.moved[1][-1:]
            self.known.append((first + np.arange(rows.start, rows.stop), self._keep(known)))
        return Nodes(move, share, points, asked, joints, commands)

    def _keep(self, known: PoseDeviations) -> PoseDeviations | None:
        """What is known, for the proof, unless there is much of it already."""
        self.kept += known.block.indices.size
        return known if self.kept <= KEPT else None

    def _require(self, known: PoseDeviations, move: Indices, share: Floats, poses: Floats) -> None:
        """Raise `CannotCorrect` for the first programmed pose that cannot be used."""
        if known.block.indices.size == len(poses):
            return
        lost = np.ones(len(poses), np.bool_)
        lost[known.block.indices] = False
        at = int(np.flatnonzero(lost)[0])
        raise CannotCorrect(
            int(move[at]), float(share[at]), STATUS[known.status[at]], poses[at], of_program=True
        )

    def cut(self) -> None:
        """Cut the moves into pieces until each holds the tolerance."""
        size, rapid = self.size, self.moves.kind == RAPID
        numbers = np.arange(self.count)
        whole = Pieces(self.begin, numbers, size, np.where(rapid, 0.0, size))
        still = rapid | (size == 0.0)
        self.accepted.append(whole.select(still))
        left = whole.select(~still)
        while left.end.size:
            off = np.concatenate([self._look_at(left.rows(rows)) for rows in self._in_blocks(left)])
            failed = ~self._holds(off)
            left = self._parts_of(left.select(failed), off[failed])

    def _points_in(self, size: Floats) -> Indices:
        """(n,) how many interior points pieces of a size (n,) are looked at: odd, so the middle."""
        halves = np.ceil(size / (2.0 * self.spacing)).astype(np.intp)
        counts: Indices = 2 * np.maximum(halves, 1) - 1
        return counts

    def _in_blocks(self, pieces: Pieces) -> list[slice]:
        """Pieces that are looked at together: so many that they have about a block of points."""
        block = (np.cumsum(self._points_in(pieces.size)) - 1) // BLOCK
        bounds = [0, *(np.flatnonzero(np.diff(block)) + 1).tolist(), len(block)]
        return [slice(*pair) for pair in itertools.pairwise(bounds)]

    def _holds(self, off: Floats) -> Flags:
        holds: Flags = off <= ACCEPTED * self.limits.chord
        return holds

    def _look_at(self, pieces: Pieces) -> Floats:
        """How far the tool is off within the pieces, (n,), m; those that hold are accepted.

        Raises `CannotCorrect`.
        """
        nodes = self.nodes
        inside = self._points_in(pieces.size)
        first = np.cumsum(inside) - inside
        number = np.repeat(np.arange(inside.size), inside)
        t = (np.arange(number.size) - first[number] + 1.0) / (inside[number] + 1.0)
        begin, end = pieces.begin[number], pieces.end[number]
        move = nodes.move[end]
        from_share = np.where(nodes.move[begin] == move, nodes.share[begin], 0.0)
        share = from_share + t * (nodes.share[end] - from_share)
        poses = self.axes.poses(self.moves.points(move, share))
        between = self._between(begin, end) if len(number) == len(inside) else None
        known = self.actual.deviations_at(poses, between)
        self._require(known, move, share, poses)

        step = t[:, np.newaxis]
        commands = nodes.commands[begin]
        commands = commands + (nodes.commands[end] - commands) * step
        off = self.measure.combined(self.measure.at_commands(known, commands))
        if self.limits.interpolation == "either":
            joints = nodes.joints[begin]
            joints = joints + (nodes.joints[end] - joints) * step
            off = np.maximum(off, self.measure.combined(self.measure.at_joints(known, joints)))
        worst = np.maximum.reduceat(off, first)

        held = self._holds(worst)
        good = Pieces(pieces.begin, pieces.end, pieces.size, pieces.size / (inside + 1.0))
        self.accepted.append(good.select(held))
        within = held[number]
        if within.any():
            known = known if within.all() else selected(known, within)
            weight = good.weight[number][within]
            self.looked.append(
                SamplePoints(end[within], t[within], weight, poses[within], self._keep(known))
            )
        return np.asarray(worst)

    def _between(self, begin: Indices, end: Indices) -> ParameterDeviation | None:
        """What is known in the middles of short moves, from their ends (n,); None: it differs."""
        if self.moved is None:
            return None
        columns, values = self.moved
        if len(values) == 1:
            return self.moved
        if max(begin.max(), end.max()) >= len(values):
            return None
        first, last = values[begin], values[end]
        if not (np.abs(last - first) * self.unit[columns]).max() <= ALIKE * self.limits.chord:
            return None
        return columns, 0.5 * (first + last)

    def _parts_of(self, pieces: Pieces, off: Floats) -> Pieces:
        """Cut pieces that are `off` (n,), m, into equal parts; new nodes are made between them."""
        if not pieces.end.size:
            return pieces
        nodes = self.nodes
        with np.errstate(invalid="ignore"):
            wanted = np.ceil(np.sqrt(off / (AIMED_AT * self.limits.chord)))
        wanted = np.where(np.isfinite(off), np.clip(wanted, 2, MOST_PARTS), UNKNOWN_PARTS)
        parts = np.minimum(wanted, np.floor(pieces.size / self.limits.least)).astype(np.intp)
        many = int(parts.sum()) > MOST_PIECES
        if many or (parts < 2).any():
            at = int(np.argmax(parts if many else parts < 2))
            self._cannot_cut(int(pieces.end[at]), float(off[at]), TOO_MANY if many else TOO_SHORT)
        begin, end = pieces.begin, pieces.end
        move = nodes.move[end]
        from_share = np.where(nodes.move[begin] == move, nodes.share[begin], 0.0)
        number = np.repeat(np.arange(parts.size), parts - 1)
        first = np.cumsum(parts - 1) - (parts - 1)
        part = np.arange(number.size) - first[number] + 1
        share = from_share[number] + (nodes.share[end] - from_share)[number] * (
            part / parts[number]
        )
        new = len(nodes.move)
        points = self.moves.points(move[number], share)
        self.nodes = nodes.and_more(self._corrected(move[number], share, points, new))

        # Part j of a piece begins at its cut j, the first at its begin, and so with the ends.
        of = np.repeat(np.arange(parts.size), parts)
        place = np.arange(of.size) - (np.cumsum(parts) - parts)[of]
        cut = new + first[of] + place
        size = (pieces.size / parts)[of]
        begins = np.where(place == 0, begin[of], cut - 1)
        ends = np.where(place == parts[of] - 1, end[of], cut)
        return Pieces(begins, ends, size, size)

    def _cannot_cut(self, end: int, off: float, why: str) -> NoReturn:
        """Raise `CannotCorrect` for the piece that ends at a node: by what its move passes."""
        nodes, move = self.nodes, int(self.nodes.move[end])
        share = np.linspace(0.0, 1.0, int(self._points_in(self.size[[move]])[0]) + 2)
        way = self.axes.poses(self.moves.points(np.full(share.size, move), share))
        crossing = singularity_crossings(self.actual, way[:-1], way[1:])
        raise CannotCorrect(
            move,
            float(nodes.share[end]),
            "singular" if crossing.size else why,
            nodes.asked[end],
            of_program=True,
            off=off,
        )

    def require_ways(self) -> None:
        """Raise `CannotCorrect` where the way leads through a singularity, or a rapid is off reach.

        What a rapid passes is asked of its straight line, coarsely, as its path is no promise.
        """
        moves, nodes = self.moves, self.nodes
        rapids = np.flatnonzero(moves.kind == RAPID)
        if rapids.size:
            self._require_rapids(rapids)
        # The way is gone from a node of every stretch of it to the next, and over every rapid.
        pieces = self.pieces
        ends, begins = pieces.end, pieces.begin
        crossing = first_crossing(
            self.actual,
            nodes.asked[begins],
            nodes.asked[ends],
            pieces.size,
            moves.kind[nodes.move[ends]] == RAPID,
        )
        if crossing is not None:
            at = ends[crossing]
            raise CannotCorrect(
                int(nodes.move[at]),
                float(nodes.share[at]),
                "singular",
                nodes.asked[at],
                of_program=True,
            )

    @cached_property
    def pieces(self) -> Pieces:
        """All pieces in the order of writing, when they are cut."""
        pieces = joined(self.accepted)
        if len(pieces.end) == self.count:  # no move is cut: its end node has its number
            order = np.empty(self.count, np.intp)
            order[pieces.end] = np.arange(self.count)
        else:
            order = np.lexsort((self.nodes.share[pieces.end], self.nodes.move[pieces.end]))
        return pieces.rows(order)

    def _require_rapids(self, rapids: Indices) -> None:
        nodes = self.nodes
        begin, end = nodes.commands[self.begin[rapids]], nodes.commands[rapids]
        far = np.abs((end - begin) / self.actual.unit).max(axis=1)
        inside = np.maximum(np.ceil(far / (4.0 * SPACING)) - 1.0, 0.0).astype(np.intp)
        number = np.repeat(np.arange(rapids.size), inside)
        part = np.arange(number.size) - (np.cumsum(inside) - inside)[number] + 1.0
        t = part / (inside[number] + 1.0)
        poses = begin[number] + (end - begin)[number] * t[:, np.newaxis]
        for rows in blocks(len(poses)):
            _, _, status = self.actual.machine.kernel.place(poses[rows])
            failed = np.flatnonzero(status != OK)
            if failed.size:
                at = rows.start + int(failed[0])
                raise CannotCorrect(
                    int(rapids[number[at]]),
                    float(t[at]),
                    STATUS[status[failed[0]]],
                    poses[at],
                    of_program=False,
                )

    def divided(self) -> Divided:
        """The batch in the order of writing."""
        nodes = self.nodes
        pieces = self.pieces
        ends, move = pieces.end, nodes.move[pieces.end]
        piece = np.full(len(nodes.move), -1)
        piece[ends] = np.arange(ends.size)
        weight = np.zeros(len(nodes.move))
        weight[ends] = pieces.weight
        looked_at = [
            PathPoints(
                piece[numbers],
                np.ones(numbers.size),
                weight[numbers],
                nodes.asked[numbers],
                known,
                at_ends=True,
            )
            for numbers, known in self.known
        ]
        looked_at += [
            PathPoints(
                piece[points.end],
                points.share,
                points.weight,
                points.poses,
                points.known,
                at_ends=False,
            )
            for points in self.looked
        ]
        last = ends[-1]
        return Divided(
            np.bincount(move, minlength=self.count),
            self.axes.with_poses(nodes.points[ends], nodes.commands[ends]),
            nodes.share[ends],
            move,
            ~np.isin(pieces.begin, self.uncorrected),
            looked_at,
            MachineState(
                nodes.joints[last],
                nodes.commands[last],
                nodes.asked[last],
                corrected=True,
                moved=self.at_end,
            ),
        )


def _with_row(
    table: ParameterDeviation | None, row: ParameterDeviation, number: int
) -> ParameterDeviation | None:
    """What is known at `number` nodes, and at one more; None where it is of other parameters."""
    if table is None or not np.array_equal(table[0], row[0]):
        return None
    columns, values = table
    if len(values) == 1 and np.array_equal(values, row[1]):
        return table
    every = np.broadcast_to(values, (number, columns.size))
    return columns, np.concatenate([every, row[1]])


__all__ = [
    "TOO_SHORT",
    "CannotCorrect",
    "Divided",
    "Division",
    "Interpolation",
    "Limits",
    "MachineState",
    "Moves",
    "PathPoints",
]
