"""What may be chosen: a grade for every tie, an option for every slot.

A slot is a choice of the file whose parts are tied, or one part of a choice whose parts are not.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.machine.costs import Costs, DesignChoice, DesignOption, ToleranceCost

Combination = tuple[int, ...]
"""Number of an option of each slot."""

MOST_COMBINATIONS = 512
"""Combinations of options that are gone through one by one."""


@dataclass(frozen=True)
class Slot:
    """One thing to be chosen: the options are of `parts`, all of which have the same."""

    choice: DesignChoice
    parts: tuple[str, ...]

    @property
    def name(self) -> str:
        """Of the choice, and of the part where each has its own."""
        return self.choice.name if self.choice.tied else f"{self.choice.name}: {self.parts[0]}"

    def settings(self, option: int) -> list[str]:
        """What an option sets, as `--set` takes it."""
        return [
            f"{part}.{key}={value}"
            for part in self.parts
            for key, value in self.choice.options[option].settings
        ]


@dataclass(frozen=True)
class Tie:
    """Features, by number, that have one grade together, and the row that they stand in."""

    name: str
    row: int
    features: tuple[int, ...]


class DesignSpace:
    """All that may be chosen for a machine.

    `features` (f,): names of the parameters that get a band, `units` of their deviations. Columns
    x are (tie, grade): `tie_of` (x,), `grade_of` (x,), `cost` (x,) and `halves` (x, f), the half
    widths that the features of the tie then have, else 0.

    Raises `RequestError` (no-cost, bad-allocation).
    """

    def __init__(self, machine: Machine) -> None:
        self.costs = required_costs(machine)
        self.rows: tuple[ToleranceCost, ...] = self.costs.tolerances
        self.features: tuple[str, ...] = tuple(name for row in self.rows for name in row.features)
        self.units: tuple[str, ...] = tuple(row.unit for row in self.rows for _ in row.features)
        self.slots = _slots(self.costs)
        first = np.cumsum([0, *(len(row.features) for row in self.rows)]).tolist()
        self.ties: tuple[Tie, ...] = tuple(
            Tie(name, number, tuple(first[number] + member for member in members))
            for number, row in enumerate(self.rows)
            for name, members in zip(row.tie_names, row.ties, strict=True)
        )
        count = math.prod(len(slot.choice.options) for slot in self.slots)
        if count > MOST_COMBINATIONS:
            raise RequestError(
                Problem(
                    "bad-allocation",
                    "the choices have more combinations than are gone through",
                    machine.file,
                    self.slots[0].choice.line,
                    "cost.choice",
                    found=f"{count} combinations of {len(self.slots)} choices",
                    expected=f"at most {MOST_COMBINATIONS}",
                    hint="tie = true gives all parts of a choice the same option",
                )
            )
        numbers = [(tie, grade) for tie in range(len(self.ties)) for grade in range(self._n(tie))]
        self.tie_of: Indices = np.array([tie for tie, _ in numbers], np.intp)
        self.grade_of: Indices = np.array([grade for _, grade in numbers], np.intp)
        self.cost: Floats = np.array([self._cost(*one) for one in numbers], np.float64)
        self.halves: Floats = np.zeros((len(numbers), len(self.features)))
        for column, (tie, grade) in enumerate(numbers):
            members = list(self.ties[tie].features)
            self.halves[column, members] = self.grade_halves(self.ties[tie].row, grade, members)

    def _n(self, tie: int) -> int:
        return len(self.rows[self.ties[tie].row].grades)

    def _cost(self, tie: int, grade: int) -> float:
        row = self.rows[self.ties[tie].row]
        return row.costs[grade][row.tie_names.index(self.ties[tie].name)]

    def grade_halves(self, row: int, grade: int, members: Sequence[int]) -> list[float]:
        """Half widths of features, by number, of a row at one of its grades."""
        before = sum(len(one.features) for one in self.rows[:row])
        return [self.rows[row].halves[grade][member - before] for member in members]

    @cached_property
    def combinations(self) -> tuple[Combination, ...]:
        """Every combination of options, the cheapest first; one without any where none is asked."""
        every = product(*(range(len(slot.choice.options)) for slot in self.slots))
        return tuple(sorted(every, key=lambda one: (self.option_cost(one), one)))

    def options(self, combination: Combination) -> list[DesignOption]:
        """The option of each slot."""
        return [slot.choice.options[at] for slot, at in zip(self.slots, combination, strict=True)]

    def option_cost(self, combination: Combination) -> float:
        """What the options of a combination cost together."""
        return math.fsum(option.cost for option in self.options(combination))

    def option_settings(self, combination: Combination) -> list[str]:
        """What the options of a combination set."""
        return [
            setting
            for slot, at in zip(self.slots, combination, strict=True)
            for setting in slot.settings(at)
        ]

    def columns(self, grades: Sequence[int]) -> Indices:
        """(n_tie,) the columns of a grade for each tie."""
        first = np.searchsorted(self.tie_of, np.arange(len(self.ties)))
        return np.asarray(first + np.asarray(grades, np.intp), np.intp)

    def chosen(self, grades: Sequence[int]) -> Floats:
        """(x,) 1 for the columns of a grade for each tie, else 0."""
        x = np.zeros(self.cost.size)
        x[self.columns(grades)] = 1.0
        return x

    def finest(self) -> Floats:
        """(x,) with everything at its finest."""
        return self.chosen([0] * len(self.ties))

    @cached_property
    def kind_of(self) -> Indices:
        """(x,) number of the grade of each column among all grades of all rows of the file."""
        first = np.cumsum([0, *(len(row.grades) for row in self.rows)])
        row_of = np.array([tie.row for tie in self.ties], np.intp)
        return np.asarray(first[row_of[self.tie_of]] + self.grade_of, np.intp)

    @cached_property
    def columns_of_coarsest(self) -> Indices:
        """(n_tie,) the columns with everything at its coarsest, which cost least."""
        return self.columns([self._n(tie) - 1 for tie in range(len(self.ties))])

    def grades(self, x: Floats) -> tuple[int, ...]:
        """The grade of each tie, of whole columns x (x,)."""
        return tuple(
            int(self.grade_of[self.tie_of == tie][np.argmax(x[self.tie_of == tie])])
            for tie in range(len(self.ties))
        )

    def between(self, place: float) -> tuple[Floats, float]:
        """Half widths (f,) and cost of all ties at one `place` of their lists, from 0 the finest.

        Between grades as `ToleranceCost.between` says; a shorter list ends at its coarsest.
        """
        every = [row.between(place) for row in self.rows]
        halves = np.array([half for halves, _ in every for half in halves], np.float64)
        return halves, math.fsum(cost for _, costs in every for cost in costs)

    @property
    def most_grades(self) -> int:
        """Of the longest list; 0 where no tolerance is to be chosen."""
        return max((len(row.grades) for row in self.rows), default=0)


def required_costs(machine: Machine) -> Costs:
    """`[cost]` of the machine with something to choose. Raises `RequestError` (no-cost)."""
    costs = machine.costs
    if costs is not None and (costs.tolerances or costs.choices):
        return costs
    raise RequestError(
        Problem(
            "no-cost",
            "nothing says what may be chosen, and what it costs",
            machine.file,
            path="cost",
            found="no [cost]" if costs is None else "a [cost] without a row",
            expected="[[cost.tolerance]] or [[cost.choice]]",
            hint="docs/allocation.md says how to begin without costs of one's own",
        )
    )


def _slots(costs: Costs) -> tuple[Slot, ...]:
    slots: list[Slot] = []
    for choice in costs.choices:
        if choice.tied:
            slots.append(Slot(choice, choice.parts))
        else:
            slots += [Slot(choice, (part,)) for part in choice.parts]
    return tuple(slots)


__all__ = ["Combination", "DesignSpace", "Slot", "Tie", "required_costs"]
