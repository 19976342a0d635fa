"""One combination of options: the machine that it makes, its cuts, its bound, its cheapest grades.

A cut is what a witness says of the columns x: along its direction, at its pose, in its case

    known + sum over ties of |slope half widths| <= limit - excess

`excess`: by how much the exact error was beyond the linear one there, if it was. Without it the
cuts are those of the linear model, of which alone a lower bound is claimed. Where the worst machine
cannot be assembled, there is no such number: then the design, and all that are as coarse, are out.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.design.judge import Effort, Findings, Judge, WorstPlace
from truepose.design.programme import Programme, ProgrammeSolution
from truepose.design.space import Combination, DesignSpace
from truepose.machine import Machine

FIRST_GAP = 0.05
"""Of the integer programme until its designs are clean."""

_ALIKE = 1e-4
"""By which share a design with one grade for all, told for comparison, may be beyond a limit."""

_HALVINGS = 20

_NONE: Indices = np.empty(0, np.intp)

_MOST_PLAINER = 20
"""Rounds of cuts for a design of fewer distinct grades."""

_MOST_ROUNDS = 400
"""Rounds of cuts: far more than any design needed, which ended after some tens."""


@dataclass(frozen=True, eq=False)
class GradedDesign:
    """One grade for every tie of a combination of options, and what it costs."""

    combination: Combination
    grades: tuple[int, ...]
    cost: float
    judgement: Findings


@dataclass(frozen=True, eq=False)
class Cut:
    """A witness's row: `coefficients` (x,) and `known`, m or rad, and the `excess` there.

    `signed` (f,): what a unit of each feature's half width adds along its direction.
    """

    witness: WorstPlace
    signed: Floats
    coefficients: Floats
    known: float
    limit: float
    excess: float


class OptionCombination:
    """A combination with its `machine`, judged by `judge`."""

    def __init__(
        self,
        space: DesignSpace,
        combination: Combination,
        machine: Machine,
        judge: Judge,
        tick: Callable[[], None],
    ) -> None:
        self.space, self.combination, self.machine, self.judge = space, combination, machine, judge
        self.option_cost = space.option_cost(combination)
        self.cuts: dict[tuple[object, ...], Cut] = {}
        self.bound = self.option_cost
        self.duals: dict[tuple[object, ...], float] = {}
        self._too_coarse: list[Floats] = []
        self._forbidden = _NONE
        self._programme = Programme(space.cost, space.tie_of)
        self._tick = tick

    def add_cuts(self, witnesses: Sequence[WorstPlace]) -> None:
        """Cuts of witnesses, also of those that another combination had."""
        new = [witness for witness in witnesses if witness.key not in self.cuts]
        if not new:
            return
        known, signed, usable = self.judge.rows(new)
        for number, witness in enumerate(new):
            if not usable[number]:  # of another machine, which reaches farther
                continue
            limit = self.judge.limits[witness.quantity]
            assert limit is not None
            self.cuts[witness.key] = Cut(
                witness,
                signed[number],
                self.rows(witness.case, signed[number]),
                float(known[number]),
                limit,
                0.0,
            )

    def rows(self, case: int, signed: Floats) -> Floats:
        """(x,) what every column adds along a direction, of what each feature does, signed (f,)."""
        member = self.judge.models[case].bands.member
        return np.asarray(np.abs((self.space.halves * signed) @ member).sum(axis=1))

    def finest(self) -> GradedDesign:
        """Everything at its finest, judged quickly."""
        x = self.space.finest()
        return self._design(x, self.judge.assess(self._halves(x), self.judge.effort.quick))

    def relax(self) -> None:
        """Raise the bound to that of the relaxation, cut until nothing exceeds to first order."""
        for _ in range(_MOST_ROUNDS):
            self._tick()
            solution = self._programme.relaxed(*self._rows(exact=False))
            if solution is None:
                self.bound = math.inf
                return
            self._keep(solution)
            judgement = self._judged(solution.x, self.judge.effort.quick)
            limits = self.judge.limits
            beyond = [
                witness
                for witness in judgement.exceeding
                if witness.linear > (limits[witness.quantity] or math.inf)
            ]
            if not self._cut(beyond, exact=False):
                return

    def cheapest(self, gap: float, known: GradedDesign | None) -> GradedDesign | None:
        """The design within `gap` of the cheapest, judged clean; None where cuts leave none.

        Goes first to a wide gap, as the first designs only gather cuts.
        """
        best: GradedDesign | None = None
        for wide in dict.fromkeys((max(FIRST_GAP, gap), gap)):
            best = self._clean(wide, known) or best
        return best

    def _clean(self, gap: float, known: GradedDesign | None) -> GradedDesign | None:
        start = None if known is None else self.space.chosen(known.grades)
        for _ in range(_MOST_ROUNDS):
            self._tick()
            coefficients, most = self._rows(exact=True)
            allowed = start is not None and bool((coefficients @ start <= most + 1e-9).all())
            solution = self._programme.whole(coefficients, most, gap, start if allowed else None)
            if solution is None:
                return None
            if design := self._kept(solution.x):
                return design
        return None

    def _kept(self, x: Floats) -> GradedDesign | None:
        """The design of a solution if it is judged clean; it is cut off if not."""
        design = self._design(x, self._judged(x, self.judge.effort))
        if not design.judgement.exceeding:
            return design
        self.cut(design.judgement.exceeding, design)
        return None

    def cut(self, witnesses: Sequence[WorstPlace], design: GradedDesign) -> None:
        """Cut off a design of which `witnesses` were found beyond their limits."""
        self._cut(witnesses, exact=True)
        if any(math.isinf(witness.exact) for witness in witnesses):
            self._too_coarse.append(self.space.chosen(design.grades))

    def without(self, columns: Indices, gap: float) -> GradedDesign | None:
        """The design within `gap` of the cheapest that has none of some columns."""
        self._forbidden = columns
        try:
            return self.cheapest(gap, None)
        finally:
            self._forbidden = _NONE

    def estimate_without(self, columns: Indices) -> float:
        """What the relaxation of the cuts costs that has none of some columns."""
        self._forbidden = columns
        try:
            solution = self._programme.relaxed(*self._rows(exact=True))
        finally:
            self._forbidden = _NONE
        return math.inf if solution is None else self.option_cost + solution.cost

    def plainest(self, known: GradedDesign, budget: float) -> GradedDesign | None:
        """A clean design of fewer distinct grades than `known` has, within the budget, if found.

        Two ties have the same grade where it is the same one of the same row of the file.
        """
        kinds = self.space.kind_of
        fewest = len(np.unique(kinds[self.space.columns(known.grades)]))
        start = self.space.chosen(known.grades)
        for _ in range(_MOST_PLAINER):
            self._tick()
            coefficients, most = self._rows(exact=True)
            paid = budget - self.option_cost
            solution = self._programme.plainest(coefficients, most, kinds, paid, start)
            if solution is None or len(np.unique(kinds[solution.x > 0.5])) >= fewest:
                return None
            if design := self._kept(solution.x):
                return design
        return None

    def bound_of_linear_model(self, gap: float) -> float:
        """The bound of whole grades under the cuts of the linear model alone."""
        self._tick()
        solution = self._programme.whole(*self._rows(exact=False), gap)
        if solution is None:
            return math.inf
        self.bound = max(self.bound, self.option_cost + solution.bound)
        return self.bound

    def halves(self, grades: Sequence[int]) -> Floats:
        """(f,) half widths of a grade for every tie, SI."""
        return self._halves(self.space.chosen(grades))

    def alike(self, *, between: bool) -> float:
        """What it costs with all ties at one place of their lists; infinite where nothing keeps.

        `between`: also between two grades, as `DesignSpace.between` says.
        """
        last = self.space.most_grades - 1
        for _ in range(_MOST_ROUNDS):
            place = self._coarsest_place(last, between=between)
            if place is None:
                return math.inf
            halves, cost = self.space.between(place)
            beyond = [
                witness
                for witness in self._assessed(halves, self.judge.effort.quick).exceeding
                if witness.share > 1.0 + _ALIKE
            ]
            if not beyond:
                return self.option_cost + cost
            if any(math.isinf(witness.exact) for witness in beyond):
                last = math.ceil(place) - 1
            if last < 0:
                return math.inf
            self._cut(beyond, exact=True)
        return math.inf

    # --- inside

    def _coarsest_place(self, last: int, *, between: bool) -> float | None:
        """The coarsest place from 0 to `last` that the cuts allow; None where not even 0 is."""
        lower = next((place for place in range(last, -1, -1) if self._keeps(place)), None)
        if lower is None or not between or lower == last:
            return lower
        upper = lower + 1.0
        within = float(lower)
        for _ in range(_HALVINGS):
            middle = 0.5 * (within + upper)
            within, upper = (middle, upper) if self._keeps(middle) else (within, middle)
        return within

    def _keeps(self, place: float) -> bool:
        """Whether all ties at one place are within the cuts."""
        halves, _ = self.space.between(place)
        for cut in self.cuts.values():
            member = self.judge.models[cut.witness.case].bands.member
            own = float(np.abs((cut.signed * halves) @ member).sum())
            if cut.known + cut.excess + own > cut.limit:
                return False
        return True

    def _halves(self, x: Floats) -> Floats:
        return np.asarray(x @ self.space.halves)

    def _judged(self, x: Floats, effort: Effort) -> Findings:
        """Judged without a climb first, which is only for what is clean without."""
        return self._assessed(self._halves(x), effort)

    def _assessed(self, halves: Floats, effort: Effort) -> Findings:
        judgement = self.judge.assess(halves, effort.still)
        return judgement if judgement.exceeding else self.judge.assess(halves, effort)

    def _design(self, x: Floats, judgement: Findings) -> GradedDesign:
        cost = math.fsum([self.option_cost, *self.space.cost[x > 0.5].tolist()])
        return GradedDesign(self.combination, self.space.grades(x), cost, judgement)

    def _keep(self, solution: ProgrammeSolution) -> None:
        self.bound = max(self.bound, self.option_cost + solution.bound)
        self.duals = {
            key: float(dual)
            for (key, _), dual in zip(self.cuts.items(), solution.dual, strict=True)
            if dual > 0.0
        }

    def _cut(self, witnesses: Sequence[WorstPlace], *, exact: bool) -> bool:
        """Cuts of witnesses; whether there was one that was not there as it is."""
        before = len(self.cuts)
        self.add_cuts(witnesses)
        changed = len(self.cuts) > before
        if not exact:
            return changed
        for witness in witnesses:
            cut = self.cuts[witness.key]
            excess = max(witness.exact - witness.linear, cut.excess)
            if math.isinf(excess) or excess == cut.excess == 0.0:
                continue
            if excess == cut.excess:  # by the solver's tolerance
                excess += (witness.share - 1.0) * cut.limit
            self.cuts[witness.key] = dataclasses.replace(cut, excess=excess)
            changed = True
        return changed

    def _rows(self, *, exact: bool) -> tuple[Floats, Floats]:
        """Coefficients (n, x) and right sides (n,) of the cuts, of their limits."""
        cuts = list(self.cuts.values())
        limits = np.array([cut.limit for cut in cuts])
        rows = np.array([cut.coefficients for cut in cuts]).reshape(len(cuts), self.space.cost.size)
        known = np.array([cut.known + (cut.excess if exact else 0.0) for cut in cuts])
        coefficients = rows / limits[:, np.newaxis]
        most = 1.0 - known / limits
        if exact and self._too_coarse:
            # At least one tie has to be finer than in a design that cannot be assembled.
            finer = np.array([self._as_coarse(x) for x in self._too_coarse])
            coefficients = np.concatenate([coefficients, finer])
            most = np.concatenate([most, np.full(len(finer), len(self.space.ties) - 1.0)])
        if self._forbidden.size:
            row = np.zeros((1, self.space.cost.size))
            row[0, self._forbidden] = 1.0
            coefficients = np.concatenate([coefficients, row])
            most = np.append(most, 0.0)
        return coefficients, most

    def _as_coarse(self, x: Floats) -> Floats:
        """(x,) 1 for the columns that are as coarse as the design's, or coarser."""
        grades = np.array(self.space.grades(x))
        return np.asarray(self.space.grade_of >= grades[self.space.tie_of], np.float64)


__all__ = ["Cut", "GradedDesign", "OptionCombination"]
