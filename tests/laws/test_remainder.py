"""Laws of the remainder: what the error may differ by from its linear model, proven."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from drive_kinds import has_majorant
from machine_under_test import OK, MachineUnderTest
from made_source import MadeSource, sizes, with_sources
from random_machines import DrawnMachine
from sweeps import thinned
from truepose.compensation.corrected import corrected
from truepose.compensation.remainder import Bounds, Remainder
from truepose.machine import Machine
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import PoseRun
from truepose.runs.variables import Variables, variables_at
from truepose.sources import Deviation, PoseBlock, acting
from truepose.uncertainty_analysis.corners import worst_corners

Floats = NDArray[np.float64]
ROUNDING = 1e-13
POSES = 2


@cache
def loaded(machine: MachineUnderTest) -> Machine:
    return tp.load(machine.path)


class State:
    """A machine's sources at a few poses, with the nominal or with the corrected command."""

    def __init__(self, machine: Machine, poses: Floats, *, after: bool) -> None:
        sources = acting(machine, machine.condition)
        block = next(iter(PoseRun(machine, poses, machine.condition)))
        self.machine = machine
        self.block: PoseBlock = block
        self.variables: Variables
        if after:
            self.block, self.variables, status = corrected(machine, block, sources)
            assert (status == OK).all()
        else:
            self.variables = variables_at(machine, block, sources)
        self.value, self.effects, _ = first_order(machine, self.block, self.variables)
        self.bounds: Bounds = Remainder(machine).bound(
            self.block, self.variables, self.value, self.effects
        )
        self.exact_error = ExactError(machine, self.block, self.variables)
        turns = np.array([name.startswith("r") for name in machine.components])
        self.quantities = [np.flatnonzero(part) for part in (~turns, turns) if part.any()]

    def beyond(self, pose: int, t: Floats) -> Floats:
        """(s, m) exact error less its linear model at variables t (s, v)."""
        error, status = self.exact_error(np.full(len(t), pose), t)
        assert (status == OK).all()
        return np.asarray(error - self.value[pose] - t @ self.effects[pose].T)

    def norms(self, errors: Floats) -> Floats:
        """(s, q)."""
        return np.stack([np.linalg.norm(errors[:, q], axis=1) for q in self.quantities], axis=1)

    def most_beyond(self, pose: int, random: np.random.Generator) -> tuple[Floats, Floats]:
        """Components (m,) and norms (q,) that corners, insides and climbing from them find."""
        domain, count = self.variables.domain, self.effects.shape[2]

        def into(t: Floats) -> Floats:
            t = np.clip(t, domain.lower, domain.upper)
            for members in domain.directions:
                t[:, members] /= np.linalg.norm(t[:, members], axis=1, keepdims=True)
            return t

        t = into(random.choice([-1.0, 1.0], (200, count)) * np.abs(domain.upper))
        t = np.concatenate([t, into(random.uniform(-1.0, 1.0, (50, count)))])
        targets = self._targets(pose, t)
        most = targets.max(axis=0)
        for at in range(most.size):
            best = t[np.argmax(targets[:, at])]
            for _ in range(5):
                other = np.repeat(best[np.newaxis], count, axis=0)
                np.fill_diagonal(other, -other.diagonal())
                other = into(other)
                found = self._targets(pose, other)
                most = np.maximum(most, found.max(axis=0))
                best = other[np.argmax(found[:, at])]
        return most[: self.effects.shape[1]], most[self.effects.shape[1] :]

    def _targets(self, pose: int, t: Floats) -> Floats:
        beyond = self.beyond(pose, t)
        return np.concatenate([np.abs(beyond), self.norms(beyond)], axis=1)


def it_holds(machine: Machine, poses: Floats, *, after: bool, seed: int) -> float:
    """Against corners, insides and what climbs; returns the largest excess of a bound, a factor."""
    state = State(machine, poses, after=after)
    bounds, random = state.bounds, np.random.default_rng(seed)
    assert bounds.proven.all()
    worst = worst_corners(
        state.exact_error, state.value, state.effects, state.variables.domain, state.quantities
    )
    m = len(machine.components)
    down, up = state.variables.domain.reach(state.effects)
    limit = np.concatenate(
        [state.value + up + bounds.components, down - state.value + bounds.components], axis=1
    )
    assert (worst.most[:, : 2 * m] <= limit + ROUNDING).all()
    most, found = np.zeros(bounds.norms.shape), np.zeros(bounds.components.shape)
    for pose in range(len(state.value)):
        found[pose], most[pose] = state.most_beyond(pose, random)
    assert (found <= bounds.components + ROUNDING).all()
    assert (most <= bounds.norms + ROUNDING).all()
    assert (bounds.norms <= np.sqrt(m) * bounds.components.max(axis=1, keepdims=True)).all()
    return float((bounds.norms / most).max())


@pytest.mark.parametrize("after", thinned([True, False]), ids=["after", "before"])
def test_it_holds_and_is_no_wider_than_five_times_what_is_found(
    shipped: MachineUnderTest, after: bool
) -> None:
    machine = loaded(shipped)
    if not has_majorant(machine):
        state = State(machine, machine.poses()[:POSES], after=after)
        assert not state.bounds.proven.any()
        assert np.isnan(state.bounds.components).all()
        return
    random = np.random.default_rng(shipped.seed)
    poses = random.permutation(machine.poses())[:POSES]
    assert it_holds(machine, poses, after=after, seed=shipped.seed) <= 5.0


def test_it_holds_for_machines_drawn(drawn: DrawnMachine) -> None:
    machine = drawn.loaded
    if has_majorant(machine):
        it_holds(machine, drawn.poses[:POSES], after=True, seed=drawn.seed)


def test_of_one_variable_it_is_the_second_difference(machine: MachineUnderTest) -> None:
    """By central differences of the exact error: with one variable no sign is lost."""
    tool = loaded(machine)
    if not has_majorant(tool):
        return
    columns = np.arange(len(tool.parameters))
    random = np.random.default_rng(machine.seed + 3)
    for _ in range(4):
        swing = 0.1 * sizes(tool)[columns] * random.uniform(-1.0, 1.0, columns.size)
        source = MadeSource(
            "s", Deviation.of(columns, half=np.abs(swing), sign=np.sign(swing), groups=0)
        )
        state = State(with_sources(tool, source), machine.poses[:POSES], after=False)
        assert state.bounds.proven.all()
        for pose in range(POSES):
            ends, _ = state.exact_error(np.full(2, pose), np.array([[-1.0], [1.0]]))
            second = np.abs(0.5 * ends.sum(axis=0) - state.value[pose])
            bound = state.bounds.components[pose]
            assert (second <= bound + ROUNDING).all()
            assert (bound <= second + 0.02 * second.max() + 1e-12).all()
