"""What a machine costs against its position target: an allocation for each of some targets."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from truepose.design.allocate import allocate
from truepose.design.result import Allocation, money_unit
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.runs.dataset import Variable, data_variable, label, labelled_dataset, provenance
from truepose.runs.poses import Progress
from truepose.verdict.answer import BEFORE

if TYPE_CHECKING:
    import xarray as xr

MOST_TARGETS = 1000

OUT_OF_REACH = "target-out-of-reach"


@dataclass(frozen=True)
class CurvePoint:
    """A position `target`, m, its `cost` and `lower_bound`, infinite where no choice keeps it.

    `allocation`: the design; None where there is none.
    """

    target: float
    cost: float
    lower_bound: float
    allocation: Allocation | None


@dataclass(frozen=True, eq=False)
class CostCurve:
    """Costs against targets, the finest first; `interrupted`: not for all that were asked for."""

    machine: Machine
    state: str
    points: tuple[CurvePoint, ...]
    interrupted: bool

    @cached_property
    def dataset(self) -> xr.Dataset:
        """The curve as labelled data: `cost` and `lower_bound` along `target`, m."""
        costs = self.machine.costs
        assert costs is not None
        unit = money_unit(costs.unit)
        nothing: dict[str, Sequence[str]] = {}
        data = {
            "cost": data_variable(
                Variable(("target",), unit, "cost of the design"),
                [point.cost for point in self.points],
                nothing,
            ),
            "lower_bound": data_variable(
                Variable(("target",), unit, "bound of the cost to first order"),
                [point.lower_bound for point in self.points],
                nothing,
            ),
        }
        labels = {
            "target": label(
                "target", [point.target for point in self.points], "position error allowed", "m"
            ),
            "options": label(
                "target", [options_text(point) for point in self.points], "options chosen"
            ),
        }
        attrs = provenance(self.machine, self.machine.condition)
        attrs |= {
            "state": self.state,
            "cost_unit": costs.unit,
            "interrupted": int(self.interrupted),
        }
        return labelled_dataset(data, labels, attrs)


def cost_curve(
    machine: Machine,
    targets: Sequence[float],
    *,
    state: str = BEFORE,
    worst: bool = False,
    statistical: float | None = None,
    all_poses: bool = False,
    reserve: float = 0.01,
    gap: float = 0.01,
    progress: Progress | None = None,
) -> CostCurve:
    """What `truepose.allocate` finds for position targets, m, all else as the machine has it.

    `progress` is called with (targets done, targets in all). Ctrl-C gives the points of then.
    Raises as `allocate`, but not where a target is out of reach; bad-allocation for no target.
    """
    asked = sorted({float(target) for target in targets})
    if not asked or len(asked) > MOST_TARGETS or not all(0.0 < one < math.inf for one in asked):
        raise RequestError(
            Problem(
                "bad-allocation",
                "a curve of costs is over position targets",
                found=f"{len(asked)} targets" + (f" from {asked[0]:g} m" if asked else ""),
                expected=f"from 1 to {MOST_TARGETS} lengths above zero",
            )
        )
    points: list[CurvePoint] = []
    interrupted = False
    # The widest first: once one is out of reach, so are all that are finer.
    for target in reversed(asked):
        if progress is not None:
            progress(len(points), len(asked))
        accuracy = dataclasses.replace(machine.accuracy, target=target, target_text="")
        own = dataclasses.replace(machine, accuracy=accuracy)
        if points and math.isinf(points[-1].cost):
            points.append(CurvePoint(target, math.inf, math.inf, None))
            continue
        try:
            design = allocate(
                own,
                state=state,
                worst=worst,
                statistical=statistical,
                all_poses=all_poses,
                reserve=reserve,
                gap=gap,
            )
        except KeyboardInterrupt:
            if not points:
                raise
            interrupted = True
            break
        except RequestError as refusal:
            if refusal.problems[0].code != OUT_OF_REACH:
                raise
            points.append(CurvePoint(target, math.inf, math.inf, None))
            continue
        points.append(CurvePoint(target, design.cost, design.lower_bound, design))
        if design.interrupted:
            interrupted = True
            break
    return CostCurve(machine, state, tuple(reversed(points)), interrupted)


def options_text(point: CurvePoint) -> str:
    """The options of a design: "rods: steel"."""
    if point.allocation is None:
        return ""
    return ", ".join(f"{one.choice}: {one.option}" for one in point.allocation.options)


__all__ = ["CostCurve", "CurvePoint", "cost_curve", "options_text"]
