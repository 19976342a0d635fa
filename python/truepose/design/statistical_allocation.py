"""One allocation for a share of all machines, from the search to its result."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.design.option_combination import GradedDesign
from truepose.design.result import KNOWN, NOT_PROVEN, OTHERS, Allocation, Contribution, WorstPose
from truepose.design.space import DesignSpace
from truepose.design.statistical_judge import QuantilePlace
from truepose.design.statistical_search import (
    GATHER,
    StatisticalCombination,
    StatisticalSearch,
    StatisticalTask,
)
from truepose.design.telling import Telling
from truepose.runs.poses import Progress


class StatisticalAllocation(Telling):
    """An allocation of a `task`, whose limits (q,) are its targets less the reserve."""

    def __init__(
        self,
        space: DesignSpace,
        task: StatisticalTask,
        limits: Sequence[float | None],
        progress: Progress | None,
    ) -> None:
        super().__init__(task.machine, space, list(task.conditions), limits)
        self.of_whom = f" of {100.0 * task.share:g} % of the machines"
        self.task = task
        self.search = StatisticalSearch(space, task, progress)

    def result(self) -> Allocation:
        """Search, and say what came of it."""
        outcome, task = self.search.run(), self.task
        if outcome.best is None or outcome.candidate is None:
            assert outcome.shortfall is not None
            combination, place = outcome.shortfall
            raise self.out_of_reach(combination, None if place is None else place.witness)
        design, candidate = outcome.best, outcome.candidate
        return Allocation(
            machine=task.machine,
            designed=candidate.bands.designed(candidate.halves(design.grades)),
            state=task.state,
            cases=tuple(self.cases),
            unit=self.space.costs.unit,
            cost=design.cost,
            lower_bound=math.nan,
            targets={
                kind: target
                for kind, target in zip(self.kinds, task.targets, strict=True)
                if target is not None
            },
            reserve=task.reserve,
            options=self.options(design),
            grades=self.grades(design),
            worst_poses=self._worst(design),
            contributions=self._contributions(candidate, design, outcome.places),
            proven=NOT_PROVEN,
            poses_proven=0,
            combinations=len(self.space.combinations),
            impossible=outcome.impossible,
            one_grade=math.inf,
            one_width=math.inf,
            rounds=outcome.rounds,
            left_out=design.judgement.left_out,
            interrupted=outcome.interrupted,
            gap_asked=task.gap,
            share=task.share,
            all_poses=task.all_poses,
            kept=outcome.kept,
            changes=tuple(self.space.option_settings(design.combination)),
        )

    def _worst(self, design: GradedDesign) -> tuple[WorstPose, ...]:
        return tuple(self.pose_of(witness, 0.0) for witness in design.judgement.witnesses)

    def _contributions(
        self,
        candidate: StatisticalCombination,
        design: GradedDesign,
        places: Sequence[QuantilePlace],
    ) -> tuple[Contribution, ...]:
        """What adds to the largest quantile of each quantity, as filed and designed."""
        filed = self.search.candidate_as_filed()
        before = filed.judge.assess(self.machine, self.task.share, GATHER)
        contributions = []
        for quantity, kind in enumerate(self.kinds):
            if self.limits[quantity] is None:
                continue
            one = self._parts(filed, before, quantity, filed.bands.filed)
            other = self._parts(candidate, places, quantity, candidate.halves(design.grades))
            contributions += [Contribution(kind, name, one[name], other[name]) for name in other]
        return tuple(contributions)

    def _parts(
        self,
        candidate: StatisticalCombination,
        places: Sequence[QuantilePlace],
        quantity: int,
        halves: Floats,
    ) -> dict[str, float]:
        """What the mean does along the errors of that size, and the rest in parts of variances."""
        rows = dict.fromkeys((KNOWN, OTHERS, *(row.of for row in self.space.rows)), math.nan)
        place = next((one for one in places if one.quantity == quantity), None)
        if place is None or not math.isfinite(place.estimate):
            return rows
        rows[KNOWN] = known = float(place.direction @ place.mean)
        whole = float((place.weight * place.covariance).sum())
        rest = place.estimate - known
        own = candidate.variances_of(place, halves)
        row_of = np.array([n for n, row in enumerate(self.space.rows) for _ in row.features])
        for number, row in enumerate(self.space.rows):
            share = float(own[row_of == number].sum()) / whole if whole > 0.0 else 0.0
            before = 0.0 if math.isnan(rows[row.of]) else rows[row.of]
            rows[row.of] = before + rest * share
        chosen = sum(rows[name] for name in {row.of for row in self.space.rows})
        rows[OTHERS] = rest - chosen
        return rows


__all__ = ["StatisticalAllocation"]
