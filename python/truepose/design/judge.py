"""The judge: where a design errs most, in one machine with its options set, in all conditions.

The largest error to first order is looked for at the lattice, at poses that fill the workspace and
where earlier designs erred most; from the worst of these, apart from each other, it climbs over
poses, the direction following the pose. There the machine at the worst corner is solved exactly.
What exceeds its limit, to first order or exactly, is a `WorstPlace`, and a cut of the programme.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.design.error_model import ErrorModel, LinearErrors
from truepose.design.judged_poses import Ascent, JudgedPoses
from truepose.error_budget.largest import Largest
from truepose.runs.poses import BLOCK

BY_ROUNDING = 1e-6
"""By which share an error may exceed its limit: what rounding and the solver's tolerance make."""

_TURNS = 6
"""Of a direction towards the farthest point in it: corners are few, and soon there."""

_APART = 0.04
"""Least distance of two witnesses, of the workspace."""


@dataclass(frozen=True)
class Effort:
    """How thoroughly it is looked, in each condition and at each quantity.

    `starts` of the climbs, and witnesses that are `kept`.
    """

    starts: int
    kept: int

    @property
    def quick(self) -> Effort:
        """For designs that only gather cuts."""
        return Effort(min(self.starts, QUICK.starts), min(self.kept, QUICK.kept))

    @property
    def still(self) -> Effort:
        """Without a climb, at the poses that are known."""
        return Effort(0, min(self.kept, QUICK.kept))


QUICK = Effort(starts=8, kept=12)
THOROUGH = Effort(starts=48, kept=24)


@dataclass(frozen=True, eq=False)
class WorstPlace:
    """Where a design errs much: the `case` and `quantity`, by number, a pose and a direction.

    `linear`: the largest error to first order; `exact`: that of the worst machine found, solved
    exactly, infinite where it cannot be assembled. `share`: the larger of them, of the limit.
    """

    case: int
    quantity: int
    pose: Floats
    direction: Floats
    linear: float
    exact: float
    share: float

    @property
    def exceeds(self) -> bool:
        """Whether it is beyond its limit."""
        return not self.share <= 1.0 + BY_ROUNDING

    @property
    def key(self) -> tuple[object, ...]:
        """What tells it from others."""
        return *self.place, self.direction.tobytes()

    @property
    def place(self) -> tuple[object, ...]:
        """The same whatever the direction."""
        return self.case, self.quantity, self.pose.tobytes()


@dataclass(frozen=True, eq=False)
class Findings:
    """The `witnesses` of a design, the worst first, and how many poses do not belong to the run.

    `lost`: (case, pose) at which the machine cannot be commanded, whatever its tolerances.
    """

    witnesses: tuple[WorstPlace, ...]
    left_out: int
    lost: tuple[tuple[int, Floats], ...]

    @property
    def exceeding(self) -> tuple[WorstPlace, ...]:
        """Those beyond their limits."""
        return tuple(witness for witness in self.witnesses if witness.exceeds)


class Judge:
    """Judges designs of one machine: `models`, one a case, and the `limits` of the quantities.

    A limit of None is of a quantity that nothing is asked of. `effort` of a judgement that is to
    hold.
    """

    def __init__(
        self,
        models: Sequence[ErrorModel],
        places: JudgedPoses,
        limits: Sequence[float | None],
        effort: Effort = THOROUGH,
    ) -> None:
        self.models, self.places, self.limits = tuple(models), places, tuple(limits)
        self.effort = effort
        self._poses = places.first()
        self._known: list[list[tuple[Floats, LinearErrors]]] = [[] for _ in self.models]
        self._seen: set[bytes] = set()
        self._further: list[Floats] = []

    def look_at(self, poses: Floats) -> None:
        """Judge at these poses (n, d) as well from now on."""
        new = [pose for pose in poses if pose.tobytes() not in self._seen]
        self._seen.update(pose.tobytes() for pose in new)
        self._further += new

    def forget(self) -> None:
        """Free what is kept of the poses; it is worked out anew."""
        self._known = [[] for _ in self.models]

    def assess(self, halves: Floats, effort: Effort | None = None) -> Findings:
        """Of half widths (f,) of the features, SI."""
        effort = self.effort if effort is None else effort
        witnesses: list[WorstPlace] = []
        lost: list[tuple[int, Floats]] = []
        left_out = 0
        for case, model in enumerate(self.models):
            parts = self._errors(case)  # looked up, but where there are new poses
            poses = np.concatenate([poses for poses, _ in parts])
            belongs = np.concatenate([errors.belongs for _, errors in parts])
            gone = np.concatenate([errors.lost for _, errors in parts])
            left_out += int((~belongs).sum())
            lost += [(case, pose) for pose in poses[gone]]
            every = [self._at(model, errors, halves) for _, errors in parts]
            lengths = np.concatenate([length for length, _ in every])
            for quantity, limit in enumerate(self.limits):
                if limit is None:
                    continue
                values = lengths[:, quantity] / limit
                starts = poses[self.places.separated(poses, values, effort.starts, 0.1)]
                climbed = self._climbed(model, quantity, limit, starts, halves, effort)
                worst = poses[self.places.separated(poses, values, effort.kept, _APART)]
                witnesses += self._witnesses(
                    case, quantity, limit, np.concatenate([climbed, worst]), halves, effort
                )
        witnesses.sort(key=lambda witness: -witness.share)
        # Where it erred most the next design is looked at too.
        self.look_at(np.array([witness.pose for witness in witnesses]))
        return Findings(tuple(witnesses), left_out, tuple(lost))

    def rows(self, witnesses: Sequence[WorstPlace]) -> tuple[Floats, Floats, Flags]:
        """What is known and fixed along each witness's direction (n,), and of each feature (n, f).

        And whether the machine can be commanded to the pose (n,); the rest means nothing where not.
        """
        known = np.zeros(len(witnesses))
        signed = np.zeros((len(witnesses), len(self.models[0].bands.features)))
        usable = np.zeros(len(witnesses), np.bool_)
        alike: dict[tuple[int, int], list[int]] = {}
        for number, witness in enumerate(witnesses):
            alike.setdefault((witness.case, witness.quantity), []).append(number)
        for (case, quantity), numbers in alike.items():
            model = self.models[case]
            for start in range(0, len(numbers), BLOCK):
                some = numbers[start : start + BLOCK]
                errors = model.at(np.array([witnesses[number].pose for number in some]))
                directions = np.array([witnesses[number].direction for number in some])
                known[some], signed[some] = model.support(errors, model.kinds[quantity], directions)
                usable[some] = errors.usable
        return known, signed, usable

    def at_pose(self, case: int, pose: Floats, halves: Floats) -> list[WorstPlace]:
        """The design's witnesses at one pose, one of each quantity that is asked."""
        return [
            witness
            for quantity, limit in enumerate(self.limits)
            if limit is not None
            for witness in self._witnesses(case, quantity, limit, pose[np.newaxis], halves, QUICK)
        ]

    # --- inside

    def _errors(self, case: int) -> list[tuple[Floats, LinearErrors]]:
        """The errors at all poses known by now, those of before kept."""
        known = self._known[case]
        done = sum(len(poses) for poses, _ in known)
        further = np.array(self._further).reshape(-1, self._poses.shape[1])
        left = np.concatenate([self._poses, further])[done:]
        for start in range(0, len(left), BLOCK):
            poses = left[start : start + BLOCK]
            known.append((poses, self.models[case].at(poses)))
        return known

    def _at(
        self, model: ErrorModel, errors: LinearErrors, halves: Floats
    ) -> tuple[Floats, Largest]:
        """Largest lengths (n, q), minus infinity where there is no error, and their directions."""
        largest = model.largest(errors, halves)
        usable: Flags = errors.usable
        return np.where(usable[:, np.newaxis], largest.reached, -np.inf), largest

    def _climbed(
        self,
        model: ErrorModel,
        quantity: int,
        limit: float,
        starts: Floats,
        halves: Floats,
        effort: Effort,
    ) -> Floats:
        """Where the climbs from `starts` (s, d) end."""
        if self.places.listed is not None or not len(starts):
            return starts
        ascent = Ascent(self.places, starts)
        here = self._at(model, model.at(starts), halves)[0][:, quantity] / limit
        while (going := ascent.goes_on(here)).size:
            tried = ascent.tried(going)
            flat = tried.reshape(-1, tried.shape[2])
            values = np.concatenate(
                [
                    self._at(model, model.at(flat[at : at + BLOCK]), halves)[0][:, quantity]
                    for at in range(0, len(flat), BLOCK)
                ]
            )
            here[going] = ascent.go(
                going, tried, values.reshape(tried.shape[:2]) / limit, here[going]
            )
        return ascent.poses

    def _witnesses(
        self,
        case: int,
        quantity: int,
        limit: float,
        poses: Floats,
        halves: Floats,
        effort: Effort,
    ) -> list[WorstPlace]:
        """What is found at poses (n, d): the linear corner solved exactly, and one step further."""
        if not len(poses):
            return []
        model = self.models[case]
        errors = model.at(poses)
        usable = errors.usable
        if not usable.any():
            return []
        _, largest = self._at(model, errors, halves)
        effects, domain = model.effects(errors, halves)
        columns = model.kinds[quantity]
        value, effects = errors.value[usable][:, columns], effects[usable][:, columns]
        directions = largest.direction[usable, quantity, : columns.size]
        # The farthest point of a direction lies along another, in which the set reaches farther.
        for _ in range(_TURNS):
            slopes = np.einsum("nc,ncv->nv", directions, effects)
            point = value + np.einsum("ncv,nv->nc", effects, domain.most_along(slopes))
            size = np.sqrt(np.square(point).sum(axis=1, keepdims=True))
            directions = np.divide(point, size, out=directions.copy(), where=size > 0.0)
        slopes = np.einsum("nc,ncv->nv", directions, effects)
        linear = np.einsum("nc,nc->n", directions, value) + domain.support(slopes)
        exact = np.zeros(len(value))
        along = directions
        for _ in range(2):
            slopes = np.einsum("nc,ncv->nv", along, effects)
            error, there = model.exact(errors, halves, domain.most_along(slopes))
            of_kind = error[:, columns]
            size = np.where(there, np.sqrt(np.square(of_kind).sum(axis=1)), np.inf)
            exact = np.maximum(exact, size)
            scale = np.where(there & (size > 0.0), size, 1.0)[:, np.newaxis]
            along = np.where(there[:, np.newaxis], of_kind / scale, along)
        share = np.maximum(linear, exact) / limit
        poses = poses[usable]
        chosen = self.places.separated(poses, np.minimum(share, 1e300), effort.kept, _APART)
        return [
            WorstPlace(
                case,
                quantity,
                poses[at],
                directions[at],
                float(linear[at]),
                float(exact[at]),
                float(share[at]),
            )
            for at in chosen.tolist()
        ]


__all__ = ["QUICK", "THOROUGH", "Effort", "Findings", "Judge", "WorstPlace"]
