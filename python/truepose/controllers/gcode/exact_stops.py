"""Exact stops: how often a program stands still in G61 and G61.1, and what that takes.

A block of length l at the speed v, from standstill to standstill with the acceleration a, takes

    l / v + v / a     where it reaches its speed, l >= v^2 / a,
    2 sqrt(l / a)     elsewhere;

in G64, and where the program says nothing, l / v. What a controller really does at the end of a
block in G61 depends on the corner; here it stops, as it does in G61.1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.controllers.gcode._axes import AXES, DEGREE, LINEAR, MILLIMETRE
from truepose.controllers.gcode.division import LINE, RAPID, Divided, Moves

CODE = "exact-stops"

ACCELERATION = 1.0
"""m/s^2 that is taken where nobody says it."""


@dataclass(frozen=True)
class ExactStops:
    """Blocks at feed that end in an exact stop, and the time of all feeds, s.

    `before` and `after`: of the program as it was and as it was written; `acceleration`, m/s^2,
    with which the times are estimated. Moves in G95 are in no time.
    """

    before: int
    after: int
    seconds_before: float
    seconds_after: float
    acceleration: float

    def warning(self) -> dict[str, str]:
        """Code and sentence, where the written program stops more often."""
        sentence = (
            f"in G61 and G61.1 the tool stops at the end of every block, and of the {self.before:,}"
            f" blocks at feed there are {self.after:,} now: with {1e3 * self.acceleration:g} "
            f"mm/s^2 of acceleration the feeds take about {_time(self.seconds_after)}, and "
            f"{_time(self.seconds_before)} before; a path mode such as G64 P0.002 for the pieces "
            "of a divided block keeps the stops where the program has them"
        )
        return {"code": CODE, "sentence": sentence}


class CountedStops:
    """Adds up batches of a program, `blended` where the pieces of a block are not stopped at."""

    def __init__(self, acceleration: float, turning: float, *, blended: bool) -> None:
        """`acceleration`, m/s^2; `turning`, rad/s^2, of moves that only turn."""
        self._acceleration = acceleration
        self._turning = turning
        self._blended = blended
        self._found = np.zeros((2, 2))

    def add(self, moves: Moves, divided: Divided) -> None:
        """The next moves, as they were divided."""
        feeds = moves.kind != RAPID
        stops = feeds & moves.stops
        acceleration = self._acceleration_of(moves)
        whole = _seconds(moves.length, moves.speed, acceleration, stops)
        before = np.array([np.count_nonzero(stops), np.nansum(whole[feeds])])
        after = before
        if not self._blended:
            of = divided.move
            share = np.diff(divided.shares, prepend=0.0)
            share[_firsts(divided)] = divided.shares[_firsts(divided)]
            parts = _seconds(moves.length[of] * share, moves.speed[of], acceleration[of], stops[of])
            after = np.array([divided.counts[stops].sum(), np.nansum(parts[feeds[of]])])
        self._found += [before, after]

    def found(self) -> ExactStops:
        """Of all that was added."""
        (before, earlier), (after, later) = self._found.tolist()
        return ExactStops(int(before), int(after), earlier, later, self._acceleration)

    def _acceleration_of(self, moves: Moves) -> Floats:
        """In the unit of each move's length, mm or degrees, a second squared, (n,)."""
        linear = [AXES.index(letter) for letter in LINEAR]
        # What is not known, NaN, does not move.
        moved = np.nan_to_num(moves.end - moves.start)[:, linear].any(axis=1)
        turns = ~moved & (moves.kind == LINE)
        return np.where(turns, self._turning / DEGREE, self._acceleration / MILLIMETRE)


def _firsts(divided: Divided) -> Indices:
    """The first piece of each move."""
    return np.cumsum(divided.counts) - divided.counts


def is_blending(block: str) -> bool:
    """Whether it is G64 with a P above zero, without which it keeps to no path, and at most a Q."""
    words = block.split()
    numbers = {}
    for word in words[1:]:
        try:
            numbers[word[0]] = float(word[1:])
        except ValueError:
            return False
    positive = all(0.0 < number < 1e9 for number in numbers.values())
    named = len(numbers) == len(words) - 1 and "P" in numbers and numbers.keys() <= {"P", "Q"}
    return words[:1] == ["G64"] and named and positive


def _seconds(length: Floats, speed: Floats, acceleration: Floats, stops: Flags) -> Floats:
    """Of moves; NaN where the speed is not known."""
    with np.errstate(divide="ignore", invalid="ignore"):
        travelling = np.where(length > 0.0, length / speed, 0.0)
        reaches = length >= speed * speed / acceleration
        stopping = np.where(
            reaches, travelling + speed / acceleration, 2.0 * np.sqrt(length / acceleration)
        )
    return np.where(stops & ~np.isnan(travelling), stopping, travelling)


def _time(seconds: float) -> str:
    """For people."""
    if seconds < 99.5:
        return f"{seconds:.2g} s"
    return f"{seconds / 60.0:.1f} min" if seconds < 5970.0 else f"{seconds / 3600.0:.1f} h"
