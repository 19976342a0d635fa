"""How far off its path a corrected tool may be, where nobody says: less than it was off before.

The error that a program makes on the machine is looked up at some thousand points of its path,
before anything is divided. A tolerance above that error would make good programs worse, so that
it is a share of the error, between what the written digits can hold and what suffices anyhow.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from truepose.arrays import Floats
from truepose.controllers.gcode._axes import DEGREE, MILLIMETRE
from truepose.controllers.gcode._measure import Measure
from truepose.controllers.gcode.division import SPACING, Division, Moves

SHARE = 0.1
"""Of the error before: what may be left. The correction takes nine tenths or more away."""

MOST = 5e-6
"""m: the largest tolerance that is taken by itself."""

UNFELT = 0.01
"""Of the larger kind of error before: up to which the other kind may grow.

Of a machine that is off by nothing but an angle, or does not turn at all, not even this little can
be taken away: a corrected program has rounding and chords in both.
"""

ROUNDING = 0.1
"""Share of a tolerance that rounding may take: the rest is the division's."""

LOOKED_AT = 2048
"""Points at which the error before is looked up; at least half as many of a longer program."""

INCH_DIGIT = 2.54
"""mm: the last decimal of inches, which have one more, over that of millimetres."""

Reason = Literal["asked", "error", "most", "digits"]


@dataclass(frozen=True)
class PathTolerance:
    """A tolerance, m, and why it is that.

    "asked"; "error": a share of the error before, `SHARE` of the smaller of the largest position
    error and the largest angle times the characteristic length, as both are to become less, but at
    least `UNFELT` of the larger; "most": that, or what the written digits hold, is more than
    `MOST`; "digits": it would be less than what they hold. `before`, m: the larger of both errors,
    where looked up.
    """

    value: float
    reason: Reason
    before: float | None = None


def least_of(division: Division, digits: int) -> float:
    """The smallest tolerance, m, that rounding to `digits` decimals of mm and degrees leaves.

    The rounding is `ROUNDING` of it.
    """
    return rounding_of(division, digits) / ROUNDING


def rounding_of(division: Division, digits: int) -> float:
    """How far rounding to `digits` decimals of mm and degrees takes a pose, m.

    Half a last decimal on every axis, an angle times the characteristic length. Inches, with a
    decimal more, are the coarser ones.
    """
    names = division.actual.machine.commanded
    linear = sum(name in "xyz" for name in names)
    angular = len(names) - linear
    half = 0.5 * 10.0**-digits
    length = division.actual.machine.characteristic_length
    off = half * (MILLIMETRE * INCH_DIGIT * np.sqrt(linear) + DEGREE * length * np.sqrt(angular))
    return float(off)


def tolerance_for(division: Division, batches: Iterable[Moves], digits: int) -> PathTolerance:
    """The tolerance of a program, `batches` of its moves, that is to be written in `digits`."""
    least = least_of(division, digits)
    sizes = error_before(division, batches)
    if not sizes:
        return PathTolerance(MOST, "most") if least >= MOST else PathTolerance(least, "digits")
    before = max(sizes)
    share = max(SHARE * min(sizes), UNFELT * before)
    if max(share, least) >= MOST:
        return PathTolerance(MOST, "most", before)
    if share <= least:
        return PathTolerance(least, "digits", before)
    return PathTolerance(share, "error", before)


def error_before(division: Division, batches: Iterable[Moves]) -> tuple[float, ...]:
    """The largest position error and, where the machine turns, angle times length, m, if any.

    At ends of moves and at points between them on long ones; poses that the machine cannot be at
    are passed over, they are refused where the program is corrected.
    """
    poses = _some_poses(division, batches)
    if not len(poses):
        return ()
    known = division.actual.deviations_at(poses)
    if not known.block.indices.size:
        return ()
    measure: Measure = division.measure
    position, orientation = measure.at_joints(known, known.block.joints)
    length = division.actual.machine.characteristic_length
    tolerances = []
    for present, sizes in (
        (measure.has_position, position),
        (measure.has_orientation, orientation * length),
    ):
        finite = sizes[np.isfinite(sizes)]
        if present and finite.size:
            tolerances.append(float(finite.max()))
    return tuple(tolerances)


def _some_poses(division: Division, batches: Iterable[Moves]) -> Floats:
    """(n, n_commanded) at most `LOOKED_AT` poses of a program, evenly among those there are."""
    kept, stride, passed = np.empty((0, len(division.axes.columns))), 1, 0
    for moves in batches:
        move, share = _points_of(division, moves)
        # Of all points of the program so far those whose number is a multiple of the stride.
        chosen = np.arange(-passed % stride, len(move), stride)
        passed += len(move)
        points = moves.points(move[chosen], share[chosen])
        kept = np.concatenate([kept, division.axes.poses(points)])
        while len(kept) > LOOKED_AT:
            kept, stride = kept[::2], 2 * stride
    return np.ascontiguousarray(kept[np.isfinite(kept).all(axis=1)])


def _points_of(division: Division, moves: Moves) -> tuple[np.ndarray, Floats]:
    """Numbers of moves (k,) and shares (k,) of their paths: the ends, and points on long ones."""
    length = division.actual.machine.characteristic_length
    turn = division.axes.turn(moves.start, moves.end) * length
    size = np.fmax(np.fmax(moves.length * MILLIMETRE, turn), 0.0)
    count = np.clip(np.ceil(size / (4.0 * SPACING * length)), 1, LOOKED_AT).astype(np.int64)
    move = np.repeat(np.arange(len(count)), count)
    place = np.arange(move.size) - (np.cumsum(count) - count)[move] + 1.0
    return move, place / count[move]


__all__ = [
    "LOOKED_AT",
    "MOST",
    "SHARE",
    "UNFELT",
    "PathTolerance",
    "error_before",
    "least_of",
    "rounding_of",
    "tolerance_for",
]
