"""The machine inside the set that is farthest off, at one pose: what a "no" rests on.

A witness needs no proof but itself: it is solved exactly. So it may be looked for by any means, and
is: at the maximiser of the linear model and opposite to it, from there on climbing (to the end of
every variable by the slopes where one stands, again and again), and at samples, corners and others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.error_budget.largest import largest
from truepose.probability.domain import Domain, unit
from truepose.runs.first_order import ExactError, effects_at, first_order
from truepose.runs.poses import OK
from truepose.verdict.states import State

SAMPLES = 1024
"""Machines that are tried besides, half of them corners of the set."""

CLIMBED = 8
"""Of what was tried, from how many of the farthest the search climbs."""

STEPS = 24
"""Steps of a climb, beyond what it takes: corners are few."""

GAIN = 1e-13
"""What is gained at least by a step, of the size: less is rounding."""


@dataclass(frozen=True)
class Reached:
    """Variables t (v,), the error there (m,), its size in the quantity, and the kernel's status.

    Of a machine that cannot be assembled the size is inf.
    """

    t: Floats
    error: Floats
    size: float
    status: int


def farthest(state: State, columns: Indices) -> Reached:
    """The machine farthest off in the components `columns`, of a state at one pose.

    One that cannot be assembled, or that leaves its branch, is farther than all others.
    """
    machine, block, variables = state.machine, state.block, state.variables
    domain = variables.domain
    value, effects, _ = first_order(machine, block, variables)
    far = largest(value, effects, domain, [columns])
    u = far.direction[0, 0, : columns.size]
    slopes = effects[0][columns]
    starts = [
        np.zeros(len(variables.names)),
        domain.most_along(u @ slopes),
        domain.most_along(-u @ slopes),
    ]
    tried = np.concatenate([np.stack(starts), _samples(domain)])
    tried_best = _tried(state, columns, tried)
    order = np.argsort(-tried_best.size, kind="stable")[:CLIMBED]
    best = tried_best.best()
    for row in order:
        if np.isinf(best.size):
            break
        reached = _climbed(state, columns, tried[row])
        if reached.size > best.size * (1.0 + GAIN):
            best = reached
    return best


@dataclass(frozen=True)
class _Tried:
    t: Floats
    error: Floats
    size: Floats
    status: np.ndarray

    def best(self) -> Reached:
        row = int(np.argmax(self.size))
        return Reached(self.t[row], self.error[row], float(self.size[row]), int(self.status[row]))


def _tried(state: State, columns: Indices, t: Floats) -> _Tried:
    exact_error = ExactError(state.machine, state.block, state.variables)
    error, status = exact_error(np.zeros(len(t), np.intp), t.copy())
    size = np.sqrt(np.square(error[:, columns]).sum(axis=1))
    return _Tried(t, error, np.where(status == OK, size, np.inf), status)


def _climbed(state: State, columns: Indices, start: Floats) -> Reached:
    """From one machine on: to where the error by its slopes there grows most, while it does."""
    best = _tried(state, columns, start[np.newaxis]).best()
    for _ in range(STEPS):
        size = best.size
        if not 0.0 < size < np.inf:
            break
        u = best.error[columns] / size
        effects, status = effects_at(
            state.machine,
            state.block,
            state.variables,
            state.variables.parameters_moved(best.t[None]),
        )
        if status[0] != OK:
            break
        further = state.variables.domain.most_along(u @ effects[0][columns])
        reached = _tried(state, columns, further[np.newaxis]).best()
        if not reached.size > size * (1.0 + GAIN):
            break
        best = reached
    return best


def _samples(domain: Domain) -> Floats:
    """(s, v) machines inside the set, the same ones every time."""
    count = domain.lower.size
    random = np.random.default_rng(count)
    ends = random.integers(0, 2, (SAMPLES // 2, count))
    corners = np.where(ends == 1, domain.upper, domain.lower)
    share = random.random((SAMPLES - SAMPLES // 2, count))
    inside = domain.lower + share * (domain.upper - domain.lower)
    starts = np.concatenate([corners, inside])
    for members in domain.directions:
        starts[:, members] = unit(random.standard_normal((SAMPLES, members.size)))
    return starts


__all__ = ["Reached", "farthest"]
