"""What laws of the largest error ask of a machine: what is known of it, and machines inside it."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truepose.machine import Machine
from truepose.runs.first_order import ExactError
from truepose.runs.poses import OK
from truepose.runs.quantities import quantities
from truepose.uncertainty_analysis.sampler import Random
from truepose.verdict.answer import Answer
from truepose.verdict.states import STATES, Population, State
from truepose.verdict.survey import Survey, survey

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""Of a number: what a solved machine and an enclosure may differ by for rounding."""

FREEDOM = {"rx": "a", "ry": "b", "rz": "c"}
"""The freedom that commands a component of the error, where it has another name."""


def asking(machine: Machine, target: float | None = None, angle: float | None = None) -> Machine:
    """The machine with these accuracies asked of every machine inside its bands, m and rad."""
    asked = dataclasses.replace(
        machine.accuracy,
        target=target,
        angle_target=angle,
        target_text="" if target is None else f"{target!r} m",
        angle_target_text="" if angle is None else f"{angle!r} rad",
        at=None,
    )
    return dataclasses.replace(machine, accuracy=asked)


def asking_of(machine: Machine, kind: str, target: float) -> Machine:
    """The same of one quantity alone."""
    return asking(machine, **{"position": {"target": target}}.get(kind, {"angle": target}))


def settings_of(answer: Answer, target: float) -> str:
    """What `--set` is given to ask `target` of the quantity of an answer, m or rad."""
    if answer.quantity == "position":
        return f"accuracy.target={target!r} m"
    return f"accuracy.angle_target={target!r} rad"


class Known:
    """What is known of a machine at some poses, its file's by default."""

    def __init__(self, machine: Machine, poses: ArrayLike | None = None) -> None:
        self.machine = machine
        self.population = Population(machine, poses)
        self.kinds = quantities(machine.components)

    @cached_property
    def surveys(self) -> dict[str, Survey]:
        """By state."""
        columns = list(self.kinds.values())
        return {name: survey(self.population.states(name), columns) for name in STATES}

    def at(self, name: str, number: int) -> State:
        """One state at one pose of the run."""
        (state,) = self.population.at(name, np.array([number]))
        return state

    def worst(self, name: str) -> Iterator[tuple[str, int, State]]:
        """Of each quantity its name, the row in the survey of its worst pose, the state there."""
        found = self.surveys[name]
        for at, kind in enumerate(self.kinds):
            row = int(np.argmax(found.linear[:, at]))
            yield kind, row, self.at(name, int(found.numbers[row]))

    def all_commanded(self, kind: str) -> bool:
        """Whether every component of a quantity can be commanded."""
        names = np.array(self.machine.components)[self.kinds[kind]].tolist()
        return {FREEDOM.get(name, name) for name in names} <= set(self.machine.commanded)


def drawn_inside(state: State, columns: NDArray[np.intp], count: int, seed: int = 0) -> Array:
    """(count,) sizes of the errors of machines drawn at one pose, m or rad.

    From the distributions of all sources, those without ends cut at their stated sigmas: so each
    is inside the set. A machine that cannot be assembled is infinitely far off.
    """
    t = Random(state.variables, seed).rows(0, count)
    domain = state.variables.domain
    t = np.clip(t, domain.lower, domain.upper)
    mover = ExactError(state.machine, state.block, state.variables)
    error, status = mover(np.zeros(count, np.intp), t)
    size = np.linalg.norm(error[:, columns], axis=1)
    return np.where(status == OK, size, np.inf)


def has_ends(state: State) -> bool:
    """Whether every distribution has ends, so that no sample lies beyond the set."""
    return all(each.bounded for each in state.variables.distributions)


__all__ = [
    "ROUNDING",
    "Known",
    "asking",
    "asking_of",
    "drawn_inside",
    "has_ends",
    "settings_of",
]
