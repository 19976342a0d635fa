"""What every allocation tells of a design, whatever it was judged by."""

from __future__ import annotations

import math
from collections.abc import Sequence

from truepose.design.judge import WorstPlace
from truepose.design.option_combination import GradedDesign
from truepose.design.result import Alternative, ChosenGrade, ChosenOption, WorstPose
from truepose.design.space import Combination, DesignSpace
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.runs.quantities import quantities
from truepose.runs.run import Run


class Telling:
    """The machine and space of an allocation, its `cases` by name and `limits` (q,)."""

    def __init__(
        self,
        machine: Machine,
        space: DesignSpace,
        cases: Sequence[str],
        limits: Sequence[float | None],
    ) -> None:
        self.machine, self.space = machine, space
        self.cases, self.limits = list(cases), tuple(limits)
        self.kinds = list(quantities(machine.components))
        self.of_whom = ""

    def options(self, design: GradedDesign) -> tuple[ChosenOption, ...]:
        """The options of a design."""
        return tuple(
            ChosenOption(slot.choice.name, slot.parts, option.name, option.cost)
            for slot, option in zip(
                self.space.slots, self.space.options(design.combination), strict=True
            )
        )

    def grades(self, design: GradedDesign) -> tuple[ChosenGrade, ...]:
        """The grades of a design."""
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

    def alternative(self, other: GradedDesign, design: GradedDesign) -> Alternative:
        """Another design, beside the one that was chosen."""
        options, grades = self.options(other), self.grades(other)
        differs = [
            f"{_of(one)}: {one.option}, not {own.option}"
            for one, own in zip(options, self.options(design), strict=True)
            if one.option != own.option
        ]
        differs += [
            f"{one.name}: {one.grade}, not {own.grade}"
            for one, own in zip(grades, self.grades(design), strict=True)
            if one.grade != own.grade
        ]
        return Alternative(other.cost, options, grades, tuple(differs))

    def pose_of(self, witness: WorstPlace, price: float) -> WorstPose:
        """A witness by the names of its case and quantity."""
        limit = self.limits[witness.quantity]
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

    def out_of_reach(self, combination: Combination, witness: WorstPlace | None) -> RequestError:
        """Why there is no design."""
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
        kind, limit = self.kinds[witness.quantity], self.limits[witness.quantity]
        assert limit is not None
        worst = max(witness.exact, witness.linear)
        return RequestError(
            Problem(
                "target-out-of-reach",
                f"no choice keeps the {kind} within its target: at {self._pose(witness)} "
                f"({self.cases[witness.case]}) {self._said(kind, worst)} is left{self.of_whom} "
                f"with everything at its finest{of_options}",
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


def _of(option: ChosenOption) -> str:
    """What an option is of: its choice, and the part where each has its own."""
    return option.choice if len(option.parts) != 1 else f"{option.choice} {option.parts[0]}"


__all__ = ["Telling"]
