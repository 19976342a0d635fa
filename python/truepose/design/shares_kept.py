"""Which share of a design's machines keeps the targets at all poses at once.

Every machine goes to every pose by first order; where it then errs most it is solved exactly, at
the `_WORST` poses of the largest errors. A machine is the same at all poses: its variables are
drawn once. Conditions are counted apart, and the least share is told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.design.drawn_machines import DrawnMachines
from truepose.design.statistical_judge import standard_error
from truepose.machine import Condition, Machine

_WORST = 3
"""Poses at which a machine is solved exactly."""

_CLEAR = 0.8
"""Share of the target by first order below which no machine is solved."""


@dataclass(frozen=True)
class SharesKept:
    """Estimated shares of all machines within the targets, and their standard errors.

    `each_pose`: at the pose where it is least; `all_poses`: at all that were looked at, `poses`.
    """

    each_pose: float
    each_pose_error: float
    all_poses: float
    all_poses_error: float
    poses: int


def shares_kept(
    machine: Machine,
    conditions: Sequence[Condition],
    state: str,
    targets: Sequence[float | None],
    poses: Floats,
    draws: int,
    seed: int,
) -> SharesKept:
    """At `poses` (n, d); the share at each pose is left at that of all."""
    least, used = 1.0, 0
    for condition in conditions:
        machines = DrawnMachines(machine, condition, state)
        beyond, used = _beyond(machines, targets, poses, draws, seed)
        least = min(least, 1.0 - beyond / draws)
    error = standard_error(least, draws)
    return SharesKept(least, error, least, error, used)


def _beyond(
    machines: DrawnMachines,
    targets: Sequence[float | None],
    poses: Floats,
    draws: int,
    seed: int,
) -> tuple[int, int]:
    """How many machines are beyond a target somewhere, and the poses that belong to the run."""
    limits = np.array([np.inf if target is None else target for target in targets])
    worst = np.full((_WORST, draws), -np.inf, np.float32)
    where: Indices = np.zeros((_WORST, draws), np.intp)
    used = 0
    for part in machines.linear(poses, draws, seed):
        shares = (part.sizes / limits[np.newaxis, :, np.newaxis]).max(axis=1)
        used += len(shares)
        for number, share in zip(part.numbers.tolist(), shares, strict=True):
            if share.max() >= _CLEAR:
                _keep(worst, where, share, number)
    beyond = np.zeros(draws, np.bool_)
    for rank in range(_WORST):
        numbers: Indices = np.flatnonzero((worst[rank] >= _CLEAR) & ~beyond)
        errors = machines.exact_of(poses, where[rank][numbers], numbers, draws, seed)
        for columns, limit in zip(machines.kinds, limits, strict=True):
            size = np.sqrt(np.square(errors[:, columns]).sum(axis=1))
            beyond[numbers[~(size <= limit)]] = True
    return int(beyond.sum()), used


def _keep(worst: np.ndarray, where: Indices, share: np.ndarray, number: int) -> None:
    """Put a pose among the worst of each machine, the worst of all first."""
    numbers: Indices = np.full(share.size, number, np.intp)
    for rank in range(_WORST):
        higher = share > worst[rank]
        if not higher.any():
            return
        kept, at = worst[rank].copy(), where[rank].copy()
        worst[rank], where[rank] = np.where(higher, share, kept), np.where(higher, numbers, at)
        share, numbers = np.where(higher, kept, share), np.where(higher, at, numbers)


__all__ = ["SharesKept", "shares_kept"]
