"""One allocation for the worst case, from the search to its result."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.design.judge import QUICK, Judge, WorstPlace
from truepose.design.judged_poses import JudgedPoses
from truepose.design.option_combination import GradedDesign, OptionCombination
from truepose.design.options import machine_of
from truepose.design.region_proof import prove_region
from truepose.design.result import (
    KNOWN,
    NOT_PROVEN,
    OTHERS,
    REGION,
    THESE_POSES,
    Allocation,
    Contribution,
    WorstPose,
)
from truepose.design.search import DesignSearch, Task, at_worst
from truepose.design.space import DesignSpace
from truepose.design.telling import Telling
from truepose.machine import Machine
from truepose.runs.poses import Progress
from truepose.verdict.accuracy import accuracy
from truepose.verdict.answer import MET, NOT_MET

PROVEN = 24
"""Of the worst poses, at how many the verdict is asked, in each case."""

SHOWN = 12
"""Worst poses that a result tells of."""


class OneAllocation(Telling):
    """One allocation, from the search to its result."""

    def __init__(
        self,
        machine: Machine,
        space: DesignSpace,
        task: Task,
        state: str,
        targets: tuple[float | None, ...],
        reserve: float,
        progress: Progress | None,
        *,
        region: bool = False,
    ) -> None:
        super().__init__(machine, space, list(task.conditions), task.limits)
        self.task, self.state = task, state
        self.targets, self.reserve = targets, reserve
        self._region, self._progress = region, progress
        self.search = DesignSearch(space, task, self.beyond, progress)
        self._proven: dict[tuple[object, ...], tuple[str, int]] = {}

    def result(self) -> Allocation:
        """Search, and say what came of it."""
        outcome = self.search.run()
        if outcome.best is None or outcome.candidate is None:
            assert outcome.shortfall is not None
            raise self.out_of_reach(*outcome.shortfall)
        design, candidate = outcome.best, outcome.candidate
        if not outcome.interrupted and self._key(design) not in self._proven:
            self.beyond(candidate, design)
        proven, poses = self._proven.get(self._key(design), (NOT_PROVEN, 0))
        chosen = machine_of(self.machine, self.space, design.combination)
        designed = self.search.bands(chosen).designed(candidate.halves(design.grades))
        targets = {
            kind: target
            for kind, target in zip(self.kinds, self.targets, strict=True)
            if target is not None
        }
        worst_poses = self._worst(candidate, design)
        region = None
        if self._region and not outcome.interrupted:
            largest = {
                kind: max((one.error for one in worst_poses if one.quantity == kind), default=0.0)
                for kind in targets
            }
            region = prove_region(designed, self.task.conditions, targets, largest, self._progress)
            if region.kept or region.witness is not None:
                proven = REGION if region.kept else NOT_PROVEN
        return Allocation(
            machine=self.machine,
            designed=designed,
            state=self.state,
            cases=tuple(self.cases),
            unit=self.space.costs.unit,
            cost=design.cost,
            lower_bound=outcome.bound,
            targets=targets,
            reserve=self.reserve,
            options=self.options(design),
            grades=self.grades(design),
            worst_poses=worst_poses,
            contributions=self._contributions(candidate, design),
            proven=proven,
            poses_proven=poses,
            combinations=len(self.space.combinations),
            impossible=outcome.impossible,
            one_grade=outcome.alike[0],
            one_width=outcome.alike[1],
            rounds=outcome.rounds,
            left_out=design.judgement.left_out,
            interrupted=outcome.interrupted,
            gap_asked=self.task.gap,
            alternatives=tuple(self.alternative(other, design) for other in outcome.alternatives),
            region_proof=region,
            changes=tuple(self.space.option_settings(design.combination)),
        )

    # --- the proof

    def beyond(self, candidate: OptionCombination, design: GradedDesign) -> list[WorstPlace]:
        """Ask the verdict at the worst poses; what it finds beyond the targets, as witnesses."""
        halves = candidate.halves(design.grades)
        machine = candidate.judge.models[0].bands.designed(halves)
        worst = at_worst(design.judgement.witnesses, PROVEN * len(self.cases))
        beyond: list[WorstPlace] = []
        every, count = True, 0
        for number, condition in enumerate(self.task.conditions.values()):
            poses = np.array([pose for case, pose in worst if case == number])
            if not len(poses):
                continue
            count += len(poses)
            answers = accuracy(machine, poses, condition, states=(self.state,))
            for answer in answers:
                if answer.asked is None:
                    continue
                every = every and answer.answer == MET
                if answer.answer == NOT_MET:
                    at = candidate.judge.at_pose(number, answer.witness.pose, halves)
                    beyond += [
                        dataclasses.replace(
                            one,
                            exact=answer.witness.value,
                            share=answer.witness.value
                            / (self.task.limits[one.quantity] or math.inf),
                        )
                        for one in at
                        if self.kinds[one.quantity] == answer.quantity
                    ]
        proven = THESE_POSES if every and count else NOT_PROVEN
        self._proven[self._key(design)] = proven, count
        return beyond

    def _key(self, design: GradedDesign) -> tuple[object, ...]:
        return design.combination, design.grades

    # --- what the result says

    def _worst(self, candidate: OptionCombination, design: GradedDesign) -> tuple[WorstPose, ...]:
        """The worst poses of the design, and those that decide what the relaxation costs."""
        halves = candidate.halves(design.grades)
        every = design.judgement.witnesses
        # The worst of each quantity in each condition, however little, and the worst of all.
        of_each = {(one.case, one.quantity): one for one in reversed(every)}
        kept = [*every[:SHOWN], *of_each.values()]
        keyed = {witness.place: (witness, 0.0) for witness in kept}
        for key, price in candidate.duals.items():
            of_cut = candidate.cuts[key].witness
            for witness in candidate.judge.at_pose(of_cut.case, of_cut.pose, halves):
                if witness.quantity == of_cut.quantity:
                    known, before = keyed.get(witness.place, (witness, 0.0))
                    keyed[witness.place] = known, before + price
        ordered = sorted(keyed.values(), key=lambda one: -one[0].share)
        return tuple(self.pose_of(witness, price) for witness, price in ordered)

    def _contributions(
        self, candidate: OptionCombination, design: GradedDesign
    ) -> tuple[Contribution, ...]:
        """What adds to the worst error of each quantity, as filed and designed."""
        before_judge = Judge(
            self.search.models(self.search.bands(self.machine)),
            JudgedPoses.of(self.machine),
            self.task.limits,
            QUICK,
        )
        filed = before_judge.models[0].bands.filed
        before = before_judge.assess(filed).witnesses
        after = design.judgement.witnesses
        halves = candidate.halves(design.grades)
        contributions = []
        for quantity, kind in enumerate(self.kinds):
            if self.task.limits[quantity] is None:
                continue
            one = self._parts(before_judge, before, quantity, filed)
            other = self._parts(candidate.judge, after, quantity, halves)
            contributions += [Contribution(kind, name, one[name], other[name]) for name in other]
        return tuple(contributions)

    def _parts(
        self, judge: Judge, witnesses: Sequence[WorstPlace], quantity: int, halves: Floats
    ) -> dict[str, float]:
        """What adds up to the linear error of the worst witness of a quantity; NaN of none."""
        rows = dict.fromkeys((KNOWN, OTHERS, *(row.of for row in self.space.rows)), math.nan)
        worst = next((one for one in witnesses if one.quantity == quantity), None)
        if worst is None:
            return rows
        model = judge.models[worst.case]
        errors = model.at(worst.pose[np.newaxis])
        along = worst.direction[np.newaxis]
        columns = model.kinds[quantity]
        both, signed = model.support(errors, columns, along)
        known = float(along[0, : columns.size] @ errors.value[0, columns])
        rows[KNOWN], rows[OTHERS] = known, max(float(both[0]) - known, 0.0)
        moved = (signed[0] * halves)[:, np.newaxis] * model.bands.member
        row_of = np.array(
            [number for number, row in enumerate(self.space.rows) for _ in row.features]
        )
        for number, row in enumerate(self.space.rows):
            own = moved[row_of == number].sum(axis=0)
            before = 0.0 if math.isnan(rows[row.of]) else rows[row.of]
            rows[row.of] = before + float(np.abs(own).sum())
        return rows


__all__ = ["OneAllocation"]
