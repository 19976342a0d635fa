"""Where a design is judged: the box that the workspace's axes span, or the poses that it lists.

A box has a lattice of its corners, the middles of its edges and faces and its centre, and points
that fill it evenly: x_n = frac(n a), a = (g^-1, g^-2, ...) with g^(d+1) = g + 1, an additive
recurrence (Kronecker; Niederreiter, Random Number Generation and Quasi-Monte Carlo Methods, 1992,
section 3.1). Of listed poses there are no others.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.machine import Machine

EVEN = 512
"""Points that fill the box."""

MOST_OF_FILE = 4096
"""Poses of the file's own grid that are judged at; of more, evenly spaced ones."""

STEPS = 0.25, 1.0 / 1024.0
"""First and last step of an ascent, of the box."""

GIVEN_UP = 1.0 / 16.0, 0.8
"""At which step, and below which share of the limit, a start that does not rise is given up."""

_MOST_MOVES = 60


@dataclass(frozen=True, eq=False)
class JudgedPoses:
    """`lower`, `upper` (d,): ends of the box, SI; `listed` (n, d): the poses, where it is none."""

    lower: Floats
    upper: Floats
    listed: Floats | None
    of_file: Floats

    @classmethod
    def of(cls, machine: Machine) -> JudgedPoses:
        """Of the machine's workspace, or of its home pose where the file has none.

        Raises `RequestError` (no-workspace).
        """
        every = machine.poses()
        axes = machine.workspace.axes if machine.workspace is not None else ()
        if not axes:
            return cls(every.min(axis=0), every.max(axis=0), every, every)
        thinned = every[np.unique(np.linspace(0, len(every) - 1, MOST_OF_FILE).astype(np.intp))]
        ends = np.array([(axis.start, axis.stop) for axis in axes])
        return cls(ends.min(axis=1), ends.max(axis=1), None, thinned)

    @property
    def wide(self) -> Indices:
        """Freedoms along which the box has a width."""
        return np.flatnonzero(self.upper > self.lower)

    def first(self) -> Floats:
        """(n, d) poses that are judged first: of the lattice, of the box and of the file."""
        if self.listed is not None:
            return self.listed
        wide, span = self.wide, self.upper - self.lower
        shares = np.full((3**wide.size, span.size), 0.5)
        shares[:, wide] = list(product((0.0, 0.5, 1.0), repeat=wide.size))
        return np.concatenate([self.lower + shares * span, self.even(EVEN), self.of_file])

    def even(self, count: int, first: int = 1) -> Floats:
        """(count, d) poses that fill the box evenly, from the `first` of the sequence on."""
        d = self.lower.size
        root = 1.0
        for _ in range(64):  # a contraction: converged to rounding long before
            root = (1.0 + root) ** (1.0 / (d + 1.0))
        a = root ** -np.arange(1.0, d + 1.0)
        shares = np.mod(np.arange(first, first + count)[:, np.newaxis] * a + 0.5, 1.0)
        return np.asarray(self.lower + shares * (self.upper - self.lower))

    def separated(self, poses: Floats, values: Floats, count: int, least: float) -> Indices:
        """Numbers of at most `count` poses (n, d) of the largest `values`, `least` apart or more.

        Distances in the box, as the largest share of its widths. What is not finite is no start.
        """
        shares = self._shares(poses)
        chosen: list[int] = []
        for at in np.argsort(-values, kind="stable").tolist():
            if len(chosen) == count or not np.isfinite(values[at]):
                break
            if chosen and np.abs(shares[chosen] - shares[at]).max(axis=1).min() < least:
                continue
            chosen.append(at)
        return np.array(chosen, np.intp)

    def _shares(self, poses: Floats) -> Floats:
        span = np.where(self.upper > self.lower, self.upper - self.lower, 1.0)
        return np.asarray((poses - self.lower) / span)


class Ascent:
    """Climbs from several starts at once, by steps along the axes and along drawn directions.

    The directions matter where two corners of the bands are equally far and neither axis rises.
    """

    def __init__(self, places: JudgedPoses, starts: Floats) -> None:
        self._places = places
        self._at = starts.copy()
        self._step = np.full(len(starts), STEPS[0])
        wide = places.wide
        axes = np.zeros((wide.size, starts.shape[1]))
        axes[np.arange(wide.size), wide] = 1.0
        drawn = np.zeros_like(axes)
        drawn[:, wide] = np.random.default_rng(0).standard_normal((wide.size, wide.size))
        drawn /= np.maximum(np.abs(drawn).max(axis=1, keepdims=True), 1e-300)
        both = np.concatenate([axes, drawn])
        self._moves = np.concatenate([both, -both]) * (places.upper - places.lower)
        self._left = _MOST_MOVES

    @property
    def poses(self) -> Floats:
        """(s, d) where it stands."""
        return self._at

    def goes_on(self, shares: Floats) -> Indices:
        """Which starts have a step left to try; `shares` (s,) of the limit where they stand.

        One that no longer rises by wide steps, far below the limit, is given up.
        """
        if self._left <= 0 or not len(self._moves):
            return np.empty(0, np.intp)
        hopeless = (self._step <= GIVEN_UP[0]) & (shares < GIVEN_UP[1])
        return np.flatnonzero((self._step >= STEPS[1]) & ~hopeless)

    def tried(self, starts: Indices) -> Floats:
        """(s, r, d) the next poses of some starts."""
        self._left -= 1
        moves = self._step[starts, np.newaxis, np.newaxis] * self._moves
        there = self._at[starts, np.newaxis] + moves
        return np.clip(there, self._places.lower, self._places.upper)

    def go(self, starts: Indices, tried: Floats, values: Floats, here: Floats) -> Floats:
        """Go where the value is largest, (s, r) against (s,) `here`; returns the values then."""
        best = values.argmax(axis=1)
        every = np.arange(len(here))
        higher = values[every, best]
        better = higher > here + 1e-12 * np.abs(here)
        self._at[starts[better]] = tried[every[better], best[better]]
        self._step[starts[~better]] *= 0.5
        return np.where(better, higher, here)


__all__ = ["Ascent", "JudgedPoses"]
