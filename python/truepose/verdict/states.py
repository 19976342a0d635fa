"""The two states of a machine: as it is commanded, and as compensation commands it.

A state at some poses is a block, whose joints are what is commanded, and the variables of all
sources there. All that takes these two serves both states alike: before and after are the same set
of machines, asked by the same functions, at two commands.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Indices
from truepose.compensation.corrected import corrected
from truepose.machine import Condition, Machine
from truepose.runs.poses import (
    BLOCK,
    OK,
    Progress,
)
from truepose.runs.run import Run
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock

BEFORE, AFTER = "before compensation", "after compensation"
STATES = (BEFORE, AFTER)


@dataclass(frozen=True, eq=False)
class State:
    """One state at n poses.

    `block`: its `joints` are what is commanded, its `indices` the numbers of the poses in the run;
    `variables`: what all sources leave unknown at that command; `status` (n,): the kernel's, ok
    where the machine can be commanded so.
    """

    name: str
    machine: Machine
    block: PoseBlock
    variables: Variables
    status: np.ndarray

    def select(self, poses: Flags) -> State:
        """The same at the poses where `poses` (n,)."""
        return dataclasses.replace(
            self,
            block=self.block.select(poses),
            variables=self.variables if poses.all() else self.variables.select(poses),
            status=self.status[poses],
        )

    def at(self, pose: int) -> State:
        """The same at one of the poses."""
        chosen = np.zeros(self.block.indices.size, np.bool_)
        chosen[pose] = True
        return self.select(chosen)


class Population:
    """The poses that belong to a run (`budget.poses`), in either state; iterated as often as asked.

    Up to one block of poses is kept, more are walked over anew.
    """

    def __init__(
        self,
        machine: Machine,
        poses: ArrayLike | None = None,
        condition: Condition | None = None,
        progress: Progress | None = None,
        *,
        changed: Callable[[Variables], Variables] | None = None,
    ) -> None:
        """At `poses` (..., n_commanded), SI, default the file's; `condition`, default the file's.

        `changed`: other variables than those of the sources, in either state.

        Raises `RequestError`: bad-poses, no-workspace, no-source, unknown-part.
        """
        run = Run(machine, poses, condition)
        self.machine, self.table = machine, run.poses
        self.condition, self.sources = run.condition, run.sources
        self._poses, self._progress = poses, progress
        self._changed = changed
        self._kept: dict[str, list[State]] = {}
        self._used = 0

    @property
    def used(self) -> int:
        """How many of the poses of `table` belong to it: those that the machine can take."""
        if self._used == 0:
            self._used = sum(block.indices.size for block, _ in self._blocks())
        return self._used

    def states(self, name: str) -> Iterator[State]:
        """The population in one state, in blocks.

        Raises `RequestError` (no-pose-left) where it is empty.
        """
        if name in self._kept:
            yield from self._kept[name]
            return
        walked: list[State] = []
        for block, variables in self._blocks():
            state = self._state(name, block, variables)
            if len(self.table) <= BLOCK:
                walked.append(state)
            yield state
        if walked:
            self._kept[name] = walked

    def at(self, name: str, numbers: Indices) -> Iterator[State]:
        """The population at the poses numbered so in the run, those in one block together."""
        for state in self.states(name):
            chosen = np.isin(state.block.indices, numbers)
            if chosen.any():
                yield state.select(np.asarray(chosen, np.bool_))

    def _blocks(self) -> Iterator[tuple[PoseBlock, Variables]]:
        run = Run(self.machine, self._poses, self.condition, self._progress)
        used = 0
        for block, variables in run.with_variables():
            used += block.indices.size
            yield block, variables
        if used == 0:
            raise run.no_pose_left()
        self._used = used

    def _state(self, name: str, block: PoseBlock, variables: Variables) -> State:
        commanded, status = block, np.full(block.indices.size, OK, np.uint8)
        if name == AFTER:
            commanded, variables, status = corrected(self.machine, block, self.sources)
        if self._changed is not None:
            variables = self._changed(variables)
        return State(name, self.machine, commanded, variables, status)


@dataclass(frozen=True)
class Blocks:
    """The blocks of a population in one state with their variables; iterated as often as asked."""

    population: Population
    name: str

    def __iter__(self) -> Iterator[tuple[PoseBlock, Variables]]:
        """All of them."""
        for state in self.population.states(self.name):
            yield state.block, state.variables


__all__ = ["AFTER", "BEFORE", "STATES", "Blocks", "Population", "State"]
