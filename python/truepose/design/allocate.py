"""`truepose.allocate`: the cheapest tolerances, materials and stiffnesses that keep a target."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from truepose.design.judge import THOROUGH
from truepose.design.one_allocation import OneAllocation
from truepose.design.options import require_options
from truepose.design.programme import require_solver
from truepose.design.result import Allocation
from truepose.design.search import Task
from truepose.design.space import DesignSpace
from truepose.errors import Problem, RequestError
from truepose.machine import Machine
from truepose.runs.arguments import checked
from truepose.runs.poses import Progress
from truepose.runs.quantities import quantities
from truepose.verdict.accuracy import required_states
from truepose.verdict.answer import AFTER, BEFORE

CONDITION = "condition"
"""What the file's own condition is called beside its cases."""

MOST_ALTERNATIVES = 20

LEAST_SHARE, MOST_SHARE = 0.5, 0.999
"""Shares of all machines that a design is chosen for: beyond, a few thousand draws say little."""


@checked
def allocate(
    machine: Machine,
    *,
    state: str = BEFORE,
    worst: bool = False,
    statistical: float | None = None,
    all_poses: bool = False,
    reserve: float = 0.01,
    gap: float = 0.01,
    alternatives: int = 0,
    region: bool = False,
    progress: Progress | None = None,
) -> Allocation:
    """Choose a grade for every tie and an option for every choice of `[cost]`, at least cost.

    So that the largest error at the tool, of every machine inside the bands, stays within the
    targets of `[accuracy]` less the share `reserve`, over the whole workspace, in the file's
    condition and in every `[case.NAME]`. `state`: "before compensation" or "after compensation".
    `gap`: by which share of the cost a cheaper design may be left undiscovered. `worst`: also where
    the file asks the accuracy of a share of all machines. `statistical`: such a share, 0.95, by
    default that of the file: so many machines are within the targets, at each pose by itself or,
    with `all_poses`, at all of them. `alternatives`: so many other designs with what they cost,
    of other options, or without one of the grades of what is tied, for the worst case.
    `region`: prove the design all over the box too, before compensation, if that can be.
    `progress` is called with (programmes solved, 0). Ctrl-C gives the best design and the bound of
    then.

    Raises `RequestError`: no-cost, bad-allocation, option-not-set, bad-gap, no-accuracy,
    unknown-choice, no-workspace, no-pose-left, extra-missing; target-out-of-reach where no choice
    keeps the targets, with the pose and what is left.
    """
    (asked,) = _state(state)
    space = DesignSpace(machine)
    share = _asked_share(machine, worst=worst, statistical=statistical, all_poses=all_poses)
    judged, targets = _targets(machine)
    limits = _limits(targets, reserve)
    if region and (share is not None or asked == AFTER):
        raise RequestError(
            Problem(
                "bad-allocation",
                "a design is proven all over the box for the worst case before compensation",
                found=asked if share is None else "a share of all machines",
                expected="--worst and --before, or no --region",
            )
        )
    others = _alternatives(alternatives, share)
    require_solver()
    require_options(judged, space)
    conditions = {CONDITION: judged.condition, **judged.cases}
    if share is not None:
        from truepose.design.statistical_allocation import StatisticalAllocation
        from truepose.design.statistical_search import StatisticalTask

        sampled = StatisticalTask(
            judged,
            conditions,
            targets,
            reserve,
            asked,
            asked == AFTER,
            _gap(gap),
            share,
            all_poses,
        )
        return StatisticalAllocation(space, sampled, limits, progress).result()
    task = Task(judged, conditions, limits, asked == AFTER, _gap(gap), THOROUGH, others)
    return OneAllocation(
        judged, space, task, asked, targets, reserve, progress, region=region
    ).result()


def _alternatives(alternatives: int, share: float | None) -> int:
    """How many other designs are asked for. Raises `RequestError` (bad-allocation)."""
    whole = isinstance(alternatives, int) and not isinstance(alternatives, bool)
    if whole and 0 <= alternatives <= MOST_ALTERNATIVES and (share is None or not alternatives):
        return alternatives
    raise RequestError(
        Problem(
            "bad-allocation",
            "so many other designs are not looked for",
            found=str(alternatives) if share is None else "a share of all machines",
            expected=f"a whole number up to {MOST_ALTERNATIVES}, for the worst case",
        )
    )


def _asked_share(
    machine: Machine, *, worst: bool, statistical: float | None, all_poses: bool
) -> float | None:
    """The share of all machines that is to keep the targets; None: every one inside the bands."""
    if statistical is not None and worst:
        raise RequestError(
            Problem(
                "bad-allocation",
                "a design is chosen for the worst case, or for a share of all machines",
                found="both",
                expected="--worst or --statistical",
            )
        )
    share = statistical if statistical is not None else machine.accuracy.at
    share = None if worst else share
    if share is None:
        if all_poses:
            raise RequestError(
                Problem(
                    "bad-allocation",
                    "at all poses at once is asked of a share of all machines",
                    found="the worst case, which is at all poses",
                    expected="--statistical 95 --all-poses",
                )
            )
        return None
    return required_share(share)


def required_share(share: float) -> float:
    """A share of all machines. Raises `RequestError` (bad-allocation)."""
    fine = isinstance(share, float | int) and not isinstance(share, bool)
    if fine and LEAST_SHARE <= share <= MOST_SHARE:
        return float(share)
    raise RequestError(
        Problem(
            "bad-allocation",
            "no design is chosen for this share of all machines",
            found=str(share),
            expected=f"a share from {LEAST_SHARE:.0%} to {MOST_SHARE:.1%}, such as 0.95",
            hint=f"{share:g} % is {share / 100.0:g}" if fine and 1.0 < share <= 100.0 else None,
        )
    )


def _state(state: str) -> tuple[str, ...]:
    return required_states((state,))


def _targets(machine: Machine) -> tuple[Machine, tuple[float | None, ...]]:
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
