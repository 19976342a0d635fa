"""By how much the machine may be off beyond the linear model: a bound that is proven.

With all variables at 0 the machine stands at X0, where its shifts and its command take it. There
it is linearised, so that what is known makes no cross terms; x is the platform's displacement from
X0. Each closure is

    F(x, t) = W x + G t + R(x, t) = 0

so that x = x1(t) + e, the linear model and e = -W^-1 R(x1 + e, t). What of that is of second order
in t and e is formed with the signs of all closures in one matrix for each component
(`quadratic.py`). What else R has is bounded by a majorant, a power series without negative
coefficients in the sizes of the movements (`majorants.py`). Together, with one number s for each
component of e,

    |e| <= f(|e|),   f(s) = a + B s + s . C s + |W^-1| (majorant of R at |x1| + s from third order)

and f is such a power series in s; a is what is left where bands are narrow.

*It holds.* Let s > 0 with f(s) < s, strictly. Then f has a least fixed point s0 <= f(s), and as f
is convex, f'(s0) (s - s0) <= f(s) - f(s0) < s - s0 with s - s0 > 0: the matrix f'(s0), which is not
negative, has a spectral radius below 1 (Perron and Frobenius; Collatz and Wielandt). It bounds how
W^-1 times the closures' derivative differs from 1 wherever |e| <= s0, t in the set, so that there
this derivative is regular. Now let t grow from 0 as a t, 0 <= a <= 1: all of that way lies in the
set, as it is convex and has 0 in it. Where the machine starts e is 0. As long as |e| <= s0 the
implicit function theorem continues its pose; and it does not leave that tube: it would have to pass
the edge of a tube s0 < s' < s, f(s') < s' (on the straight line from s0 to s, by convexity), where
|e| <= f(|e|) <= f(s') < s' says that it is not at the edge. So the pose that the machine comes to
by its own continuous motion differs from the linear model by no more than f(s), for every t of the
set, and is regular all the way.

Where no such s is found, or the machine has parts whose majorant is not known here (more closures
than freedoms), nothing is proven and no number is given.

The rotation vector of an error is not the turn: with the known part v and the turn r it is
log(exp(r) exp(v)), whose derivative at r = 0 the linear model has; beyond that it differs by at
most 0.3 (|v| + |r|) |r|^2 where |v| + |r| <= 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.compensation.motion import Motion
from truepose.compensation.quadratic import quadratic
from truepose.compensation.remainder_closures import Closures
from truepose.compensation.remainder_guides import Guides
from truepose.compensation.remainder_rings import Rings
from truepose.compensation.remainder_struts import Struts
from truepose.machine import Machine
from truepose.runs.first_order import rows_of
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.spatial import norm

FEW = 512
"""Poses at once: what is worked on stays in the cache."""

ROUNDS = 3
"""Rounds in which the further motion grows from 0 before a tube about it is tried."""

TRIALS = 8
"""Tubes that are tried, each from further rounds: near a singularity they settle slowly."""

WIDER = 1.02
"""By how much a tube is wider than the motion it is made for."""

LEAST = 1e-18
"""m and rad by which it is wider at least."""

ROUNDING = 1e-12
"""Share by which the result is larger, for rounding on the way."""

TURNED = 0.3
"""Of the rotation vector beyond its derivative: see above."""


@dataclass(frozen=True, eq=False)
class Bounds:
    """Most that the error differs from the linear model, m and rad; NaN where it is not proven.

    `components` (n, m) of each component, `norms` (n, q) of the length of the displacement and of
    that of the rotation vector, whichever there are; `proven` (n,).
    """

    components: Floats
    norms: Floats
    proven: Flags


class Remainder:
    """The remainder at poses of one machine."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        rings = [at for at, strut in enumerate(machine.struts) if strut.ring_axis is not None]
        plain = [at for at in range(len(machine.struts)) if at not in rings]
        parts: list[Struts | Rings | Guides] = [
            *([Struts(machine, plain)] if plain else []),
            *([Rings(machine, rings)] if rings else []),
            *([Guides(machine)] if machine.guides else []),
        ]
        self._parts = parts
        self._parameters = np.concatenate([part.parameters for part in parts])
        self._known = not machine.kernel.overconstrained and all(part.is_proven for part in parts)

    def bound(
        self, block: PoseBlock, variables: Variables, value: Floats, effects: Floats
    ) -> Bounds:
        """At the poses of a block, with its value (n, m) and effects (n, m, v) of the variables.

        Those that `truepose.runs.first_order` has of the same block and variables.
        """
        n, m = value.shape
        quantities = len({name.startswith("r") for name in self._machine.components})
        components, norms = np.full((n, m), np.nan), np.full((n, quantities), np.nan)
        if not effects.shape[2]:
            # Nothing is unknown: the value is the error.
            components[:], norms[:] = 0.0, 0.0
        elif self._known:
            for start in range(0, n, FEW):
                poses = slice(start, start + FEW)
                bounds = self._some(block, variables, (value, effects), poses)
                components[poses], norms[poses] = bounds
        proven = np.isfinite(components).all(axis=1) & np.isfinite(norms).all(axis=1)
        components[~proven], norms[~proven] = np.nan, np.nan
        return Bounds(components, norms, np.asarray(proven, np.bool_))

    def _some(
        self, block: PoseBlock, variables: Variables, first: tuple[Floats, Floats], poses: slice
    ) -> tuple[Floats, Floats]:
        """Components (n, m) and norms (n, q) at some poses; not finite where not proven."""
        motion = Motion.at(self._machine, block, variables, first, poses)
        parameters, shift = variables.shift
        sensitivity, _ = self._machine.kernel.sensitivity_moved(
            block.joints[poses],
            block.placements[poses],
            self._parameters,
            parameters,
            np.ascontiguousarray(rows_of(shift, poses)),
        )
        closures: list[Closures] = []
        at = 0
        for part in self._parts:
            next_ = at + part.parameters.size
            closures += part.closures(motion, sensitivity[:, :, at:next_])
            at = next_
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            return _Tube(motion, closures).bounds()


class _Tube:
    """How far the platform may move beyond the linear model, at n poses."""

    def __init__(self, motion: Motion, closures: list[Closures]) -> None:
        self._motion, self._closures = motion, closures
        self._second = quadratic(motion, closures)
        self._sizes = [np.abs(closure.influence) for closure in closures]
        self._ones = np.zeros((len(motion.components), 2))
        self._ones[motion.linear, 0] = self._ones[motion.angular, 1] = 1.0

    def bounds(self) -> tuple[Floats, Floats]:
        """Components (n, m) and norms (n, q); not finite where no tube was found."""
        motion, tube = self._motion, self._tube()
        second, rests = self._second.at(tube), self._rests(tube)
        total = self._sum(second, rests)
        for closure in self._closures:
            total[~closure.closed] = np.nan
        norms = []
        for part in filter(None, (motion.linear, motion.angular)):
            size = norm(second[:, part])
            for closure, rest in zip(self._closures, rests, strict=True):
                size = size + (norm(np.swapaxes(closure.influence[:, part], 1, 2)) * rest).sum(
                    axis=1
                )
            norms.append(size)
        if len(motion.angular) == 3:
            turn = norm(motion.turn_reach) + norms[-1]
            whole = norm(motion.turned) + turn
            bent = np.where(whole <= 1.0, TURNED * whole * turn * turn, np.inf)
            total[:, motion.angular] += bent[:, np.newaxis]
            norms[-1] = norms[-1] + bent
        more = 1.0 + ROUNDING
        return total * more, np.stack(norms, axis=1) * more

    def _tube(self) -> Floats:
        """(n, m) sizes of e that f maps into themselves, else infinite."""
        tube = np.full(self._second.of_set.shape, np.inf)
        sizes = np.zeros_like(tube)
        left = np.ones(len(tube), np.bool_)
        for trial in range(TRIALS):
            for _ in range(ROUNDS * (trial + 1)):
                sizes = self._after(sizes)
            wider = WIDER * sizes + LEAST
            inside = left & (self._after(wider) < wider).all(axis=1)
            tube[inside] = wider[inside]
            left &= ~inside & np.isfinite(sizes).all(axis=1)
            if not left.any():
                break
        return tube

    def _after(self, sizes: Floats) -> Floats:
        """(n, m) f of sizes (n, m)."""
        return self._sum(self._second.at(sizes), self._rests(sizes))

    def _rests(self, sizes: Floats) -> list[Floats]:
        """(n, c) of all closures, each. Sizes are summed, not squared: f stays a power series."""
        further = sizes @ self._ones
        return [closure.rest(further[:, :1], further[:, 1:]) for closure in self._closures]

    def _sum(self, second: Floats, rests: list[Floats]) -> Floats:
        """(n, m) the second order and what the rests of all closures allow."""
        total = second.copy()
        for size, rest in zip(self._sizes, rests, strict=True):
            total += (size @ rest[:, :, np.newaxis])[:, :, 0]
        return total


__all__ = ["Bounds", "Remainder"]
