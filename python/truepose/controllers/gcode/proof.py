"""Proof: what was written, read back and driven through the actual machine, against the program.

At points of the programmed path, X, with the deviations that are known there:

    before    forward(inverse(X, nominal), nominal + shifts(X)) - X
    after     forward(q, nominal + shifts(X)) - X,  q of the written pieces at the same share

q is what the controller makes of the two poses between which the point lies: the nominal inverse
of the pose between them, or the joints between theirs, whichever is worse of those it may do.
The shifts are taken at X, not where the tool then is: second order, as in `truepose.budget`. The
points are the ends of all written blocks, and inside every piece those at which it was judged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from truepose.arrays import Floats
from truepose.controllers.gcode._measure import Measure
from truepose.controllers.gcode.division import Divided, Division, Moves, PathPoints
from truepose.controllers.gcode.exact_stops import ExactStops
from truepose.controllers.gcode.tolerance import UNFELT, PathTolerance
from truepose.representation import Represented


@dataclass(frozen=True)
class Worst:
    """The largest error, m or rad, the line of the program it is on, and the programmed pose.

    `pose` (n_commanded,), m and rad, machine coordinates.
    """

    value: float
    line: int
    pose: tuple[float, ...]


@dataclass(frozen=True)
class Errors:
    """Errors along a path: the largest, and the root mean square over the length of its feeds.

    None where the program has no such freedom, or nothing moves.
    """

    position: Worst | None
    position_rms: float | None
    orientation: Worst | None
    orientation_rms: float | None


@dataclass(frozen=True, repr=False)
class Proof(Represented):
    """What a corrected program is worth.

    `before`, `after`: errors of the program as it was, and as it was written, in the actual
    machine; `improves`: whether it became better. `moves` of the program, `blocks` written for
    them, `points` compared. `tolerance`, m, where that is from, and `interpolation` for which it
    holds. `approach`: the line of the first block, or None; it begins where the machine is not
    corrected, and its path counts from its end on. `warnings`, each a code and a sentence: why
    there was nothing to correct, and what exact stops take. `path_mode`: how the
    pieces of a block are joined, which is on top of `after`. `coordinates`: which the program was
    taken to be in, in words.
    """

    machine: str
    source: str
    target: str
    commanded: tuple[str, ...]
    tolerance: float
    tolerance_from: PathTolerance
    interpolation: str
    start: dict[str, float]
    approach: int | None
    moves: int
    blocks: int
    points: int
    before: Errors
    after: Errors
    improves: bool
    exact_stops: ExactStops
    path_mode: str | None = None
    warnings: tuple[dict[str, str], ...] = ()
    coordinates: str = ""


def sizes(errors: Errors, length: float) -> tuple[float | None, float | None]:
    """The largest position error and the largest angle times `length`, both m."""
    position, turned = errors.position, errors.orientation
    return (
        None if position is None else position.value,
        None if turned is None else turned.value * length,
    )


def improves(before: Errors, after: Errors, length: float, least: float) -> bool:
    """Whether a program is better than it was, an angle counting times `length`, m.

    The larger of both kinds of error must become smaller, and neither may grow beyond `UNFELT` of
    the larger one before, or beyond `least`, m, which the written digits make by themselves. A
    program that moves nothing is as good as it can be.
    """
    pairs = [
        (old, new)
        for old, new in zip(sizes(before, length), sizes(after, length), strict=True)
        if old is not None and new is not None
    ]
    if not pairs:
        return True
    largest = max(old for old, _ in pairs)
    unfelt = max(UNFELT * largest, least)
    if any(new >= old and new > unfelt for old, new in pairs):
        return False
    return max(new for _, new in pairs) < largest


@dataclass
class _Sum:
    """Running largest value and mean square of one kind of error."""

    worst: float = -1.0
    line: int = 0
    pose: tuple[float, ...] = ()
    squares: float = 0.0
    weight: float = 0.0

    def add(self, values: Floats, weights: Floats, lines: np.ndarray, poses: Floats) -> None:
        at = int(np.argmax(values))
        if values[at] > self.worst:
            self.worst = float(values[at])
            self.line = int(lines[at])
            self.pose = tuple(poses[at].tolist())
        self.squares += float(np.dot(np.square(values), weights))
        self.weight += float(weights.sum())

    @property
    def found(self) -> Worst | None:
        return Worst(self.worst, self.line, self.pose) if self.worst >= 0.0 else None

    @property
    def rms(self) -> float | None:
        return math.sqrt(self.squares / self.weight) if self.weight > 0.0 else None


@dataclass
class _Both:
    """The sums of position and orientation."""

    position: _Sum = field(default_factory=_Sum)
    orientation: _Sum = field(default_factory=_Sum)

    def errors(self, measure: Measure) -> Errors:
        none = _Sum()
        position = self.position if measure.has_position else none
        orientation = self.orientation if measure.has_orientation else none
        return Errors(position.found, position.rms, orientation.found, orientation.rms)


class Proving:
    """Gathers the errors of batches, as they are written and read back."""

    def __init__(self, division: Division) -> None:
        self._division = division
        self._measure = division.measure
        self._before = _Both()
        self._after = _Both()
        self.points = 0
        self.blocks = 0

    def add(self, moves: Moves, divided: Divided, starts: Floats, ends: Floats) -> None:
        """One batch: what was read back begins and ends at `starts` and `ends` (n_piece, 9)."""
        axes, kernel = self._division.axes, self._division.actual.machine.kernel
        begin, end = axes.poses(starts), axes.poses(ends)
        first, _ = kernel.inverse(begin[:1], status=True)
        joints, _ = kernel.inverse(end, status=True)
        from_joints = np.concatenate([first, joints[:-1]])
        lines = moves.line[divided.move]
        for points in divided.looked_at:
            self._compare(points, divided, (begin, end), (from_joints, joints), lines)
        self.blocks += len(ends)

    def _compare(
        self,
        points: PathPoints,
        divided: Divided,
        commands: tuple[Floats, Floats],
        joints: tuple[Floats, Floats],
        lines: np.ndarray,
    ) -> None:
        measure, division = self._measure, self._division
        known = (
            division.actual.deviations_at(points.poses) if points.known is None else points.known
        )
        piece = points.piece
        before = measure.at_joints(known, known.block.joints)
        if points.at_ends:
            after = measure.at_joints(known, joints[1][piece])
        else:
            share = points.share[:, np.newaxis]
            between = commands[0][piece]
            between = between + (commands[1][piece] - between) * share
            after = measure.at_commands(known, between)
            if division.limits.interpolation == "either":
                by_joints = joints[0][piece]
                by_joints = by_joints + (joints[1][piece] - by_joints) * share
                other = measure.at_joints(known, by_joints)
                after = np.maximum(after[0], other[0]), np.maximum(after[1], other[1])
        weight, on = points.weight, lines[piece]
        counted = divided.begins_corrected[piece]
        if not (points.at_ends or counted.all()):
            weight, on, poses = weight[counted], on[counted], points.poses[counted]
            before = before[0][counted], before[1][counted]
            after = after[0][counted], after[1][counted]
        else:
            poses = points.poses
        if not on.size:
            return
        self.points += on.size
        for sums, values in ((self._before, before), (self._after, after)):
            sums.position.add(values[0], weight, on, poses)
            sums.orientation.add(values[1], weight, on, poses)

    def errors(self) -> tuple[Errors, Errors]:
        """Before and after."""
        return self._before.errors(self._measure), self._after.errors(self._measure)


__all__ = ["Errors", "Proof", "Proving", "Worst", "improves", "sizes"]
