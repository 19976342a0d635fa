"""`truepose.allocate`: the cheapest tolerances, materials and stiffnesses that keep a target."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.design.judge import QUICK, THOROUGH, Judge, WorstPlace
from truepose.design.judged_poses import JudgedPoses
from truepose.design.option_combination import GradedDesign, OptionCombination
from truepose.design.options import machine_of, require_options
from truepose.design.programme import require_solver
from truepose.design.result import (
    NOT_PROVEN,
    THESE_POSES,
    Allocation,
    ChosenGrade,
    ChosenOption,
    Contribution,
    WorstPose,
)
from truepose.design.search import DesignSearch, SearchOutcome, Task, at_worst
from truepose.design.space import DesignSpace
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.runs.arguments import checked
from truepose.runs.poses import Progress
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.verdict.accuracy import accuracy, required_states
from truepose.verdict.answer import AFTER, BEFORE, MET, NOT_MET

CONDITION = "condition"
"""What the file's own condition is called beside its cases."""

PROVEN = 24
"""Of the worst poses, at how many the verdict is asked, in each case."""

SHOWN = 12
"""Worst poses that a result tells of."""

KNOWN, OTHERS = "known deviations", "other bands"


@checked
def allocate(
    machine: Machine,
    *,
    state: str = BEFORE,
    worst: bool = False,
    reserve: float = 0.01,
    gap: float = 0.01,
    progress: Progress | None = None,
) -> Allocation:
    """Choose a grade for every tie and an option for every choice of `[cost]`, at least cost.

    So that the largest error at the tool, of every machine inside the bands, stays within the
    targets of `[accuracy]` less the share `reserve`, over the whole workspace, in the file's
    condition and in every `[case.NAME]`. `state`: "before compensation" or "after compensation".
    `gap`: by which share of the cost a cheaper design may be left undiscovered. `worst`: also where
    the file asks the accuracy of a share of all machines. `progress` is called with (programmes
    solved, 0). Ctrl-C gives the best design and the bound of then.

    Raises `RequestError`: no-cost, bad-allocation, option-not-set, bad-gap, no-accuracy,
    unknown-choice, no-workspace, no-pose-left, extra-missing; target-out-of-reach where no choice
    keeps the targets, with the pose and what is left.
    """
    (asked,) = _state(state)
    space = DesignSpace(machine)
    judged, targets = _targets(machine, worst=worst)
    limits = _limits(targets, reserve)
    require_solver()
    require_options(judged, space)
    task = Task(
        judged,
        {CONDITION: judged.condition, **judged.cases},
        limits,
        asked == AFTER,
        _gap(gap),
        THOROUGH,
    )
    return OneAllocation(judged, space, task, asked, targets, reserve, progress).result()


class OneAllocation:
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
    ) -> None:
        self.machine, self.space, self.task, self.state = machine, space, task, state
        self.targets, self.reserve = targets, reserve
        self.kinds = list(quantities(machine.components))
        self.cases = list(task.conditions)
        self.search = DesignSearch(space, task, self.beyond, progress)
        self._proven: dict[tuple[object, ...], tuple[str, int]] = {}

    def result(self) -> Allocation:
        """Search, and say what came of it."""
        outcome = self.search.run()
        if outcome.best is None or outcome.candidate is None:
            raise self._out_of_reach(outcome)
        design, candidate = outcome.best, outcome.candidate
        if not outcome.interrupted and self._key(design) not in self._proven:
            self.beyond(candidate, design)
        proven, poses = self._proven.get(self._key(design), (NOT_PROVEN, 0))
        chosen = machine_of(self.machine, self.space, design.combination)
        bands = self.search.bands(chosen)
        return Allocation(
            machine=self.machine,
            designed=bands.designed(candidate.halves(design.grades)),
            state=self.state,
            cases=tuple(self.cases),
            unit=self.space.costs.unit,
            cost=design.cost,
            lower_bound=outcome.bound,
            targets={
                kind: target
                for kind, target in zip(self.kinds, self.targets, strict=True)
                if target is not None
            },
            reserve=self.reserve,
            options=self._options(design),
            grades=self._grades(design),
            worst_poses=self._worst(candidate, design),
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

    def _options(self, design: GradedDesign) -> tuple[ChosenOption, ...]:
        return tuple(
            ChosenOption(slot.choice.name, slot.parts, option.name, option.cost)
            for slot, option in zip(
                self.space.slots, self.space.options(design.combination), strict=True
            )
        )

    def _grades(self, design: GradedDesign) -> tuple[ChosenGrade, ...]:
        columns = self.space.columns(design.grades).tolist()
        chosen = []
        for tie, grade, column in zip(self.space.ties, design.grades, columns, strict=True):
            row = self.space.rows[tie.row]
            chosen.append(
                ChosenGrade(
                    tie.name,
                    row.of,
                    row.grades[grade],
                    float(self.space.cost[column]),
                    tuple(self.space.features[at] for at in tie.features),
                    tuple(self.space.halves[column, list(tie.features)].tolist()),
                    row.unit,
                )
            )
        return tuple(chosen)

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
        return tuple(self._pose_of(witness, price) for witness, price in ordered)

    def _pose_of(self, witness: WorstPlace, price: float) -> WorstPose:
        limit = self.task.limits[witness.quantity]
        assert limit is not None
        return WorstPose(
            self.cases[witness.case],
            self.kinds[witness.quantity],
            witness.pose,
            witness.direction,
            witness.exact,
            witness.linear,
            limit,
            price,
        )

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

    def _out_of_reach(self, outcome: SearchOutcome) -> RequestError:
        """Why there is no design."""
        assert outcome.shortfall is not None
        combination, witness = outcome.shortfall
        options = ", ".join(option.name for option in self.space.options(combination))
        of_options = f", with {options}" if options else ""
        if witness is None:
            run = Run(self.machine)
            if not any(True for _ in run.with_variables()):
                return run.no_pose_left()
            return RequestError(
                Problem(
                    "target-out-of-reach",
                    "the machine cannot be commanded to a pose of its workspace, "
                    f"whatever is chosen{of_options}",
                    self.machine.file,
                    path="workspace",
                    found="a pose that its known deviations put out of reach",
                    expected="a workspace that the machine reaches",
                    hint="`truepose check` says which pose, and why",
                )
            )
        kind, limit = self.kinds[witness.quantity], self.task.limits[witness.quantity]
        assert limit is not None
        worst = max(witness.exact, witness.linear)
        return RequestError(
            Problem(
                "target-out-of-reach",
                f"no choice keeps the {kind} within its target: at {self._pose(witness)} "
                f"({self.cases[witness.case]}) {self._said(kind, worst)} is left with everything "
                f"at its finest{of_options}",
                self.machine.file,
                path="accuracy",
                found=f"{self._said(kind, worst)}",
                expected=f"at most {self._said(kind, limit)}, the target less the reserve",
                hint="finer bands, other options, a wider target, or --after compensation",
            )
        )

    def _pose(self, witness: WorstPlace) -> str:
        units = self.machine.shown
        parts = []
        for name, value in zip(self.machine.commanded, witness.pose.tolist(), strict=True):
            unit = units.pose(name)
            parts.append(f"{name} {value * unit.per_si:.6g} {unit.label}")
        return ", ".join(parts)

    def _said(self, kind: str, value: float) -> str:
        if math.isinf(value):
            return "a machine that cannot be assembled"
        unit = self.machine.shown.error(kind)
        return f"{value * unit.per_si:.4g} {unit.label}"


def _state(state: str) -> tuple[str, ...]:
    return required_states((state,))


def _targets(machine: Machine, *, worst: bool) -> tuple[Machine, tuple[float | None, ...]]:
    """The machine, of whose every member the accuracy is asked, and the target of each quantity."""
    asked = machine.accuracy
    if not asked.asks:
        raise RequestError(
            Problem(
                "no-accuracy",
                "an allocation needs an accuracy to be kept",
                machine.file,
                path="accuracy",
                found="nothing",
                expected='[accuracy] with target = "0.5 mm", or angle_target',
            )
        )
    if asked.at is not None and not worst:
        raise RequestError(
            Problem(
                "bad-allocation",
                "the file asks its accuracy of a share of all machines, and designs are chosen for "
                "every machine inside the bands",
                machine.file,
                path="accuracy.at",
                found=asked.at_text,
                expected='at = "worst"',
                hint="--worst (worst=True) chooses for the worst case, which is dearer",
            )
        )
    machine = dataclasses.replace(machine, accuracy=dataclasses.replace(asked, at=None))
    by_kind = {"position": asked.target, "orientation": asked.angle_target}
    targets = tuple(by_kind[kind] for kind in quantities(machine.components))
    if all(target is None for target in targets):
        raise RequestError(
            Problem(
                "no-accuracy",
                "nothing is asked of what this machine does",
                machine.file,
                path="accuracy",
                found="an angle_target alone",
                expected='a target, such as "0.5 mm"',
            )
        )
    for kind, target in zip(quantities(machine.components), targets, strict=True):
        if target is not None and target <= 0.0:
            raise RequestError(
                Problem(
                    "target-out-of-reach",
                    f"the {kind} is to have no error at all",
                    machine.file,
                    path="accuracy",
                    found="a target of zero",
                    expected="a target above zero",
                )
            )
    return machine, targets


def _limits(targets: Sequence[float | None], reserve: float) -> tuple[float | None, ...]:
    if not 0.0 <= reserve < 1.0:
        raise RequestError(
            Problem(
                "bad-allocation",
                "the reserve is a share of the target",
                found=str(reserve),
                expected="a number from 0 to below 1, such as 0.01",
            )
        )
    return tuple(None if target is None else target * (1.0 - reserve) for target in targets)


def _gap(gap: float) -> float:
    try:
        share = float(gap)
    except (TypeError, ValueError, OverflowError):
        share = math.nan
    if isinstance(gap, bool) or not 0.0 <= share < 1.0:
        raise RequestError(
            Problem(
                "bad-gap",
                "by which share of the cost the design may be dearer than the cheapest",
                found=str(gap),
                expected="a number from 0 to below 1, such as 0.01",
            )
        )
    return share


__all__ = ["allocate"]
