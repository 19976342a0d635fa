"""The search: the cheapest combination of options with its cheapest grades.

Every combination gets a bound from its relaxation. In the order of these bounds the integer
programmes are solved, until what is left costs at least what was found, but for the gap. A design
counts once the judge and the verdict's own search for a worse machine found nothing beyond the
limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.design.allocated_bands import AllocatedBands, allocated_bands
from truepose.design.error_model import ErrorModel
from truepose.design.judge import THOROUGH, Effort, Judge, WorstPlace
from truepose.design.judged_poses import JudgedPoses
from truepose.design.option_combination import GradedDesign, OptionCombination
from truepose.design.options import machine_of
from truepose.design.space import Combination, DesignSpace
from truepose.machine import Condition, Machine

Confirm = Callable[[OptionCombination, GradedDesign], Sequence[WorstPlace]]
"""What is found beyond the limits of a design that the judge takes for clean."""


@dataclass(frozen=True, eq=False)
class Task:
    """What is asked: the machine, its conditions by name, the limits (q,) and the effort.

    `alternatives`: how many designs besides the best are looked for.
    """

    machine: Machine
    conditions: dict[str, Condition]
    limits: tuple[float | None, ...]
    after: bool
    gap: float
    effort: Effort = THOROUGH
    alternatives: int = 0


@dataclass(eq=False)
class SearchOutcome:
    """What a search comes to. `bound` of the linear model; `shortfall`: the least that is left.

    Of combinations that cannot be (`shortfall`) the one whose worst error, with everything at its
    finest, is least. `rounds`: programmes solved. `interrupted`: by Ctrl-C. `alike`: what it costs
    with all ties at one place of their lists, at a grade and between two. `alternatives`: other
    designs, the cheapest first.
    """

    best: GradedDesign | None = None
    candidate: OptionCombination | None = None
    bound: float = 0.0
    shortfall: tuple[Combination, WorstPlace | None] | None = None
    impossible: int = 0
    rounds: int = 0
    interrupted: bool = False
    alike: tuple[float, float] = (math.inf, math.inf)
    alternatives: tuple[GradedDesign, ...] = ()
    bounds: dict[Combination, float] = field(default_factory=dict)


class DesignSearch:
    """Looks for the cheapest design of a task; `progress` is told of (rounds, nothing)."""

    def __init__(
        self,
        space: DesignSpace,
        task: Task,
        confirm: Confirm,
        progress: Callable[[int, int], None] | None = None,
    ) -> None:
        self.space, self.task = space, task
        self.outcome = SearchOutcome()
        self._confirm, self._progress = confirm, progress
        self._places = JudgedPoses.of(task.machine)
        self._shared: dict[tuple[object, ...], WorstPlace] = {}
        tie_of = np.zeros(len(space.features), np.intp)
        for number, tie in enumerate(space.ties):
            tie_of[list(tie.features)] = number
        self._tie_of: Indices = tie_of

    def run(self) -> SearchOutcome:
        """The best design and the bound; on Ctrl-C those of then.

        Raises `KeyboardInterrupt` where there is no design yet.
        """
        outcome = self.outcome
        trivial = float(self.space.cost[self.space.columns_of_coarsest].sum())
        for combination in self.space.combinations:
            outcome.bounds[combination] = self.space.option_cost(combination) + trivial
        try:
            possible = sorted(self._possible(), key=lambda one: one.bound)
            for candidate in possible:
                self._integer(candidate)
            self._plainer()
            self._alternatives(possible)
            outcome.alike = (
                self._alike(possible, between=False),
                self._alike(possible, between=True),
            )
        except KeyboardInterrupt:
            if outcome.best is None:
                raise
            outcome.interrupted = True
        if outcome.best is not None:
            outcome.bound = min(min(outcome.bounds.values()), outcome.best.cost)
        return outcome

    def candidate(self, combination: Combination) -> OptionCombination:
        """A combination of options, ready to be judged. Raises `RequestError` (option-not-set)."""
        machine = machine_of(self.task.machine, self.space, combination)
        judge = Judge(
            self.models(self.bands(machine)), self._places, self.task.limits, self.task.effort
        )
        return OptionCombination(self.space, combination, machine, judge, self._tick)

    def bands(self, machine: Machine) -> AllocatedBands:
        """The bands to be chosen, of a machine with its options set."""
        return allocated_bands(machine, self.space.features, self._tie_of.tolist())

    def models(self, bands: AllocatedBands) -> list[ErrorModel]:
        """The machine in all its conditions."""
        conditions = self.task.conditions.values()
        return [ErrorModel(bands, condition, after=self.task.after) for condition in conditions]

    # --- inside

    def _tick(self) -> None:
        self.outcome.rounds += 1
        if self._progress is not None:
            self._progress(self.outcome.rounds, 0)

    def _possible(self) -> list[OptionCombination]:
        """The combinations that keep the limits at their finest, with the bounds of relaxations."""
        possible: list[OptionCombination] = []
        for combination in self.space.combinations:
            if self._too_dear(self.outcome.bounds[combination]):
                continue
            candidate = self.candidate(combination)
            self._tick()
            finest = candidate.finest()
            if not self._at_finest(candidate, finest):
                self.outcome.bounds[combination] = math.inf
                self.outcome.impossible += 1
                continue
            self._better(candidate, finest)
            candidate.add_cuts(tuple(self._shared.values()))
            candidate.relax()
            self._share(candidate)
            candidate.judge.forget()
            self.outcome.bounds[combination] = candidate.bound
            possible.append(candidate)
        return possible

    def _at_finest(self, candidate: OptionCombination, finest: GradedDesign) -> bool:
        """Whether a combination can keep the limits; if not, how far it is off is remembered."""
        judgement = finest.judgement
        worst = judgement.witnesses[0] if judgement.witnesses else None
        if worst is not None and not judgement.exceeding and not judgement.lost:
            return True
        share = math.inf if worst is None or judgement.lost else worst.share
        before = self.outcome.shortfall
        if before is None or before[1] is None or share < before[1].share:
            kept = None if worst is None or judgement.lost else worst
            if before is None or kept is not None:
                self.outcome.shortfall = candidate.combination, kept
        return False

    def _too_dear(self, bound: float) -> bool:
        best = self.outcome.best
        return best is not None and bound >= best.cost * (1.0 - self.task.gap)

    def _better(self, candidate: OptionCombination, design: GradedDesign) -> None:
        if self.outcome.best is None or design.cost < self.outcome.best.cost:
            self.outcome.best, self.outcome.candidate = design, candidate

    def _integer(self, candidate: OptionCombination) -> None:
        """Solve a combination's integer programme, unless its bound says that it is too dear."""
        outcome, gap = self.outcome, self.task.gap
        if self._too_dear(candidate.bound):
            return
        candidate.add_cuts(tuple(self._shared.values()))
        own = outcome.best if outcome.candidate is candidate else None
        design = self._confirmed(candidate, lambda: candidate.cheapest(gap, own))
        if design is not None:
            self._better(candidate, design)
        self._share(candidate)
        outcome.bounds[candidate.combination] = candidate.bound_of_linear_model(0.5 * gap)
        candidate.judge.forget()

    def _confirmed(
        self, candidate: OptionCombination, next_design: Callable[[], GradedDesign | None]
    ) -> GradedDesign | None:
        """The first `next_design` that is found to keep its limits; the others are cut off."""
        while (design := next_design()) is not None:
            beyond = [witness for witness in self._confirm(candidate, design) if witness.exceeds]
            if not beyond:
                return design
            candidate.cut(beyond, design)
        return None

    def _plainer(self) -> None:
        """Of the designs within the gap take one with fewer distinct grades, if one is found."""
        outcome, best, candidate = self.outcome, self.outcome.best, self.outcome.candidate
        if best is None or candidate is None or len(self.space.ties) < 2:
            return
        bound = min(outcome.bounds.values())
        budget = max(best.cost, bound / (1.0 - self.task.gap) * (1.0 - 1e-9))
        plainer = self._confirmed(candidate, lambda: candidate.plainest(best, budget))
        if plainer is not None:
            outcome.best = plainer
        candidate.judge.forget()

    def _alternatives(self, possible: Sequence[OptionCombination]) -> None:
        """The cheapest designs with other options, or without one of the grades of what is tied."""
        outcome, best, own = self.outcome, self.outcome.best, self.outcome.candidate
        if not self.task.alternatives or best is None or own is None:
            return
        asked: list[tuple[float, OptionCombination, Indices | None]] = [
            (candidate.bound, candidate, None) for candidate in possible if candidate is not own
        ]
        # Without a grade for any tie of its row: to exchange two joints' grades is no other design.
        tied = {tie.row for tie in self.space.ties if len(tie.features) > 1}
        used = self.space.kind_of[self.space.columns(best.grades)]
        for row, kind in sorted({*zip((tie.row for tie in self.space.ties), used, strict=True)}):
            if row in tied:
                columns = np.flatnonzero(self.space.kind_of == kind)
                asked.append((own.estimate_without(columns), own, columns))
        others: list[GradedDesign] = []
        for estimate, candidate, barred in sorted(asked, key=lambda one: one[0]):
            if len(others) == self.task.alternatives and estimate >= others[-1].cost:
                break
            if math.isinf(estimate):
                break
            design = self._confirmed(candidate, self._other(candidate, barred))
            candidate.judge.forget()
            known = {(one.combination, one.grades) for one in (best, *others)}
            if design is not None and (design.combination, design.grades) not in known:
                others = sorted([*others, design], key=lambda one: one.cost)
                others = others[: self.task.alternatives]
        outcome.alternatives = tuple(others)

    def _other(
        self, candidate: OptionCombination, barred: Indices | None
    ) -> Callable[[], GradedDesign | None]:
        """How a design is found of other options, or without some columns."""
        gap = self.task.gap
        if barred is None:
            return lambda: candidate.cheapest(gap, None)
        return lambda: candidate.without(barred, gap)

    def _alike(self, possible: Sequence[OptionCombination], *, between: bool) -> float:
        """What one grade for all costs, with the options for which that is least."""
        least = math.inf
        if len(self.space.ties) < 2:
            return least
        for candidate in possible:
            if candidate.bound < least:
                self._tick()
                least = min(least, candidate.alike(between=between))
                candidate.judge.forget()
        return least

    def _share(self, candidate: OptionCombination) -> None:
        """Let other combinations begin with the cuts of this one."""
        for key, cut in candidate.cuts.items():
            self._shared.setdefault(key, cut.witness)


def at_worst(witnesses: Sequence[WorstPlace], count: int) -> list[tuple[int, Floats]]:
    """(case, pose) of the worst witnesses, each once."""
    poses = {(one.case, one.pose.tobytes()): (one.case, one.pose) for one in witnesses}
    return list(poses.values())[:count]


__all__ = ["Confirm", "DesignSearch", "SearchOutcome", "Task", "at_worst"]
