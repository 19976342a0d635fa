"""Where a design is worst for a share of its machines, and how that number follows from its bands.

At a pose the number is the quantile q of the length |e| of the error. To first order the error is
m + sum over variables of b t, and as the covariance C = sum over variables of b b' var(t) changes,

    dq = 1/2 <G, dC>,    G = E[ C^-1 (e - m) u' | |e| = q ],    u = e / |e|

(the derivative of a quantile is the mean of what moves it, where it is: Hong, Operations Research
57 (2009) 118-130; that mean is linear in e where e is normal). The law

    q = q0 - v0 + sqrt(v0 v),    v = <G, C>,    v0 = v of the machines drawn

has that slope; it is exact for normal errors along one line about any mean, and for any errors
about zero whose bands all widen alike. Variances of grades add, so that v is linear in the columns.
Everything is of exact errors of machines drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.design.drawn_machines import DrawnMachines, rank_of
from truepose.design.judge import BY_ROUNDING, WorstPlace
from truepose.design.judged_poses import Ascent, JudgedPoses
from truepose.machine import Condition, Machine

STANDARD_ERRORS = 3.0
"""By how many of them an estimated share is above the share asked."""

LOOKED = 400
"""Machines drawn for the first order, divided by the share outside over `_TWENTIETH`."""

_TWENTIETH = 0.05
_MOST_LOOKED = 4000
_APART = 0.04
_NEAR = 0.02
"""Share of the machines on either side of the quantile that tell its slope."""


@dataclass(frozen=True)
class Sampling:
    """How it is looked: `starts` of climbs, poses `kept`, `draws` at each, and the `seed`."""

    starts: int
    kept: int
    draws: int
    seed: int


@dataclass(frozen=True, eq=False)
class QuantilePlace:
    """A quantity in a case at a pose: the quantile there, and what its law needs.

    `size`: number that is held against the limit, `estimate`: quantile at the level itself, both
    m or rad, infinite where too few machines can be assembled; `within`: share of the `draws`
    within the target. `mean` (k,), `covariance` and `weight` G (k, k) of the quantity's components.
    """

    case: int
    quantity: int
    pose: Floats
    size: float
    estimate: float
    limit: float
    within: float
    draws: int
    mean: Floats
    covariance: Floats
    weight: Floats
    direction: Floats

    @property
    def share(self) -> float:
        """Of the limit."""
        return self.size / self.limit

    @property
    def exceeds(self) -> bool:
        """Whether it is beyond the limit."""
        return not self.share <= 1.0 + BY_ROUNDING

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from others."""
        return self.case, self.quantity, self.pose.tobytes()

    @property
    def standard_error(self) -> float:
        """Of `within`; of a share of one that of a machine less."""
        return standard_error(self.within, self.draws)

    @property
    def witness(self) -> WorstPlace:
        """As a witness of a worst case is told."""
        return WorstPlace(
            self.case,
            self.quantity,
            self.pose,
            self.direction,
            self.estimate,
            self.estimate,
            self.estimate / self.limit,
        )


def standard_error(share: float, draws: int) -> float:
    """Of a share that was estimated from `draws`; of all or none as if one were different."""
    held = min(max(share, 1.0 / draws), 1.0 - 1.0 / draws)
    return float(np.sqrt(held * (1.0 - held) / draws))


class StatisticalJudge:
    """Judges designs of a combination of options; `conditions` as the task has them.

    `targets` (q,) of the file, None where nothing is asked, of which the share `reserve` is left.
    """

    def __init__(
        self,
        conditions: Sequence[Condition],
        state: str,
        places: JudgedPoses,
        targets: Sequence[float | None],
        reserve: float,
    ) -> None:
        self.conditions, self.state, self.places = tuple(conditions), state, places
        self.targets, self.reserve = tuple(targets), reserve
        self._poses = places.first()
        self._further: list[Floats] = []
        self._seen: set[bytes] = set()
        self.left_out = 0

    def look_at(self, poses: Sequence[Floats]) -> None:
        """Judge at these poses (d,) as well from now on."""
        new = [pose for pose in poses if pose.tobytes() not in self._seen]
        self._seen.update(pose.tobytes() for pose in new)
        self._further += new

    def assess(
        self, machine: Machine, level: float, sampling: Sampling, fresh: Floats | None = None
    ) -> list[QuantilePlace]:
        """The worst places of a design's machine at a `level`, the worst first.

        `fresh` (n, d): poses to look at besides, this once.
        """
        worst_places: list[QuantilePlace] = []
        every = [self._poses, np.array(self._further).reshape(-1, self._poses.shape[1])]
        poses = np.concatenate([*every, *([] if fresh is None else [fresh])])
        self.left_out = 0
        for case, condition in enumerate(self.conditions):
            machines = DrawnMachines(machine, condition, self.state)
            worst_places += self._in_case(machines, case, poses, level, sampling)
        worst_places.sort(key=lambda place: -place.share)
        self.look_at([place.pose for place in worst_places])
        return worst_places

    def at_poses(
        self, machine: Machine, level: float, wanted: Sequence[tuple[int, Floats]], draws: int
    ) -> list[QuantilePlace]:
        """The places of all quantities at (case, pose), each once."""
        worst_places: list[QuantilePlace] = []
        for case, condition in enumerate(self.conditions):
            poses = [pose for number, pose in wanted if number == case]
            machines = DrawnMachines(machine, condition, self.state)
            worst_places += self._sampled(machines, case, np.array(poses), level, draws, 0)
        return sorted(worst_places, key=lambda place: -place.share)

    # --- inside

    def _in_case(
        self,
        machines: DrawnMachines,
        case: int,
        poses: Floats,
        level: float,
        sampling: Sampling,
    ) -> list[QuantilePlace]:
        count = int(min(LOOKED * max(1.0, _TWENTIETH / (1.0 - level)), _MOST_LOOKED))
        values, belongs = machines.quantiles(poses, level, count, sampling.seed)
        self.left_out += int((~belongs).sum())
        chosen: list[Floats] = []
        for quantity, target in enumerate(self.targets):
            if target is None:
                continue
            own = values[:, quantity] / target
            # What cannot be commanded is worse than all numbers.
            ranked = np.where(np.isposinf(own), 1e300, own)
            starts = poses[self.places.separated(poses, ranked, sampling.starts, 0.1)]
            climbed = self._climbed(machines, quantity, target, starts, level, count, sampling.seed)
            worst = poses[self.places.separated(poses, ranked, sampling.kept, _APART)]
            if len(climbed):
                again, _ = machines.quantiles(climbed, level, count, sampling.seed)
                own = np.concatenate(
                    [again[:, quantity], ranked_of(worst, poses, values, quantity)]
                )
                both = np.concatenate([climbed, worst])
                own = np.where(np.isposinf(own), 1e300, own)
                worst = both[self.places.separated(both, own, sampling.kept, _APART)]
            chosen += list(worst)
        distinct = {pose.tobytes(): pose for pose in chosen}
        at = np.array(list(distinct.values())).reshape(-1, poses.shape[1])
        return self._sampled(machines, case, at, level, sampling.draws, sampling.seed)

    def _climbed(
        self,
        machines: DrawnMachines,
        quantity: int,
        target: float,
        starts: Floats,
        level: float,
        count: int,
        seed: int,
    ) -> Floats:
        """Where the climbs from `starts` (s, d) end, by the first-order quantile."""
        if self.places.listed is not None or not len(starts):
            return starts[:0]
        ascent = Ascent(self.places, starts)

        def share(poses: Floats) -> Floats:
            values, _ = machines.quantiles(poses, level, count, seed)
            return np.asarray(values[:, quantity] / target)

        here = share(starts)
        while (going := ascent.goes_on(here)).size:
            tried = ascent.tried(going)
            values = share(tried.reshape(-1, tried.shape[2])).reshape(tried.shape[:2])
            here[going] = ascent.go(going, tried, values, here[going])
        return ascent.poses

    def _sampled(
        self,
        machines: DrawnMachines,
        case: int,
        poses: Floats,
        level: float,
        draws: int,
        seed: int,
    ) -> list[QuantilePlace]:
        worst_places: list[QuantilePlace] = []
        if not len(poses):
            return worst_places
        for number, errors in machines.exact(poses, draws, seed):
            for quantity, (columns, target) in enumerate(
                zip(machines.kinds, self.targets, strict=True)
            ):
                if target is not None:
                    worst_places.append(
                        self._place(
                            case, quantity, poses[number], errors[:, columns], target, level
                        )
                    )
        return worst_places

    def _place(
        self, case: int, quantity: int, pose: Floats, errors: Floats, target: float, level: float
    ) -> QuantilePlace:
        """A place from the exact errors (s, k) of a quantity; NaN of what is not assembled."""
        draws, k = errors.shape
        sizes = np.sqrt(np.square(errors).sum(axis=1))
        sizes = np.where(np.isnan(sizes), np.inf, sizes)
        ordered = np.sort(sizes)
        limit = target * (1.0 - self.reserve)
        estimate = float(ordered[rank_of(level, draws)])
        # Fresh machines have to show the share with standard errors to spare, at the whole target.
        surer = min(level + STANDARD_ERRORS * standard_error(level, draws), 1.0)
        size = max(estimate, float(ordered[rank_of(surer, draws)]) * (1.0 - self.reserve))
        within = float(np.searchsorted(ordered, target, side="right")) / draws
        nothing = np.zeros((k, k))
        if not np.isfinite(size):
            size = np.inf
            mean, covariance, weight, u = np.zeros(k), nothing, nothing, np.eye(k)[0]
        else:
            there = errors[np.isfinite(sizes)]
            mean = there.mean(axis=0)
            covariance = np.cov(there, rowvar=False, bias=True).reshape(k, k)
            middle = rank_of(level, draws)
            reach = max(int(_NEAR * draws), 10)
            order = np.argsort(sizes, kind="stable")
            near = order[max(middle - reach, 0) : middle + reach + 1]
            near = near[np.isfinite(sizes[near])]
            along = errors[near] / np.maximum(sizes[near], 1e-300)[:, np.newaxis]
            apart = (errors[near] - mean) @ np.linalg.pinv(covariance, rcond=1e-12, hermitian=True)
            weight = apart.T @ along / len(near)
            weight = 0.5 * (weight + weight.T)
            u = along.mean(axis=0)
        length = float(np.sqrt(np.square(u).sum()))
        direction = u / length if length > 0.0 else np.eye(k)[0]
        return QuantilePlace(
            case,
            quantity,
            pose,
            size,
            estimate,
            limit,
            within,
            draws,
            mean,
            covariance,
            weight,
            direction,
        )


def ranked_of(wanted: Floats, poses: Floats, values: Floats, quantity: int) -> Floats:
    """The values of a quantity at some of the poses."""
    place = {pose.tobytes(): at for at, pose in enumerate(poses)}
    numbers: Indices = np.array([place[pose.tobytes()] for pose in wanted], np.intp)
    return np.asarray(values[numbers, quantity])


__all__ = [
    "STANDARD_ERRORS",
    "QuantilePlace",
    "Sampling",
    "StatisticalJudge",
    "standard_error",
]
