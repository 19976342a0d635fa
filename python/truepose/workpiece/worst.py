"""The worst case of a feature from above: what no machine inside the bands is beyond.

To first order a form of the points' errors is largest at the support function of what the variables
lie in (`probability.domain`), and beyond first order it is off by no more than

    sum over points of |weight| times the remainder of the point  +  curvature rho^2

with the proven remainders of `compensation.remainder` and the largest error rho of a point. What
varies along the path may be anywhere in its band at every point, which is more than it can be.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.compensation.remainder import Remainder
from truepose.error_budget.largest import largest
from truepose.probability.domain import Domain
from truepose.workpiece.alignment import Alignment
from truepose.workpiece.features import Forms
from truepose.workpiece.states import PartState, position_columns


@dataclass(frozen=True)
class Interval:
    """The value lies between `lower` and `upper`; `proven`, or else `why` not."""

    lower: float
    upper: float
    proven: bool
    why: str = ""


class PointBounds:
    """How far points may be off in one state: beyond first order, and at all."""

    def __init__(self, state: PartState) -> None:
        self._state = state
        self._columns = position_columns(state.machine)
        self._reaches: dict[bytes, float] = {}
        value, effects = state.first_order
        bounds = Remainder(state.machine).bound(state.block, state.variables, value, effects)
        self.remainder: Floats = bounds.norms[:, 0] if self._columns.size else np.zeros(len(value))
        """(n,) m; NaN where it is not proven."""

    def reach(self, points: Indices, scale: Floats) -> float:
        """M: how far `points` (m,) are off beside the error of the one in their middle, at most.

        For all machines of the state. `scale` (v,): of the bands, 1 as they are. What all have in
        common adds nothing of second order, see `Forms`.
        """
        key = points.tobytes() + scale.tobytes()
        if key not in self._reaches:
            self._reaches[key] = self._reach(points, scale)
        return self._reaches[key]

    def _reach(self, points: Indices, scale: Floats) -> float:
        state = self._state
        value, effects = (of[points] for of in state.first_order)
        effects = effects * scale
        remainder = np.nan_to_num(self.remainder[points])
        varies, domain = state.variables.varies_along, state.variables.domain
        ends = np.maximum(np.abs(domain.lower), np.abs(domain.upper))[varies]
        along = effects[:, self._columns][:, :, varies]
        # What varies along the path may be at any end, here and in the middle.
        loose = remainder + np.linalg.norm(np.abs(along) @ ends, axis=1)
        effects = np.where(varies, 0.0, effects)
        away = state.points[points] - state.points[points].mean(axis=0)
        middle = int(np.argmin(np.einsum("na,na->n", away, away)))
        value, effects = value - value[middle], effects - effects[middle]
        loose = loose + loose[middle]
        if not effects.shape[2]:
            sizes = np.linalg.norm(value[:, self._columns], axis=1)
        else:
            sizes = largest(value, effects, domain, [self._columns]).length[:, 0]
        return float((sizes + loose).max(initial=0.0))


def from_above(
    state: PartState,
    bounds: PointBounds,
    alignment: Alignment,
    forms: Forms,
    members: Indices,
    scale: Floats | None = None,
) -> Interval:
    """Between what a value of these forms lies, for all machines of the state.

    `members` (m,): points of the part that the forms are over; `scale` (v,): of the bands, 1 as
    they are. Remainders are those of the bands as they are, which of narrower ones is enough.
    """
    scale = np.ones(len(state.variables.names)) if scale is None else scale
    over = _Over.of(state, bounds, alignment, forms, members, scale)
    beside = sum(
        _spread(_Over.of(state, bounds, alignment, one, members, scale), one.factor)
        for one in forms.plus
    )
    if over.aligned:
        weights = _in_part(alignment, _centred(forms), members)
        beside += sum(
            _spread(_Over.of(state, bounds, alignment, one, alignment.members, scale), one.factor)
            for one in alignment.besides(weights)
        ) * _share_of_one(forms, len(weights))
    far = bounds.reach(members, scale)
    proven, why = bool(np.isfinite(over.remainder).all()), ""
    if not proven:
        why = "the remainder beyond first order is not proven for this machine"
    elif over.aligned:
        proven = False
        why = (
            "what the alignment moves is not proven beyond first order; it is with datums of its "
            "own"
        )
    elif far > forms.reach:
        proven, why = False, "points may be off further than the geometry's second order is known"
    room = forms.curvature * far**2 + beside
    if forms.rule == "between":
        low, high = over.ends()
        pick = np.max if forms.side > 0 else np.min
        return Interval(float(pick(low)) - room, float(pick(high)) + room, proven, why)
    most = _spread(over, forms.factor) if forms.rule == "spread" else _length(over, forms.factor)
    return Interval(0.0, most + room, proven, why)


def _share_of_one(forms: Forms, count: int) -> float:
    """By how much a value may change, where each of its `count` forms may by 1."""
    if forms.rule == "length":
        return forms.factor * math.sqrt(count)
    return 2.0 * forms.factor if forms.rule == "spread" else 1.0


@dataclass(frozen=True, eq=False)
class _Over:
    """Forms over the variables of a state: base (K,) + slopes (K, v) t, and `loose` (K,) beside.

    `remainder`: of the points, m, NaN where not proven; `aligned`: the alignment changes the forms.
    """

    base: Floats
    slopes: Floats
    loose: Floats
    remainder: Floats
    aligned: bool
    domain: Domain

    @classmethod
    def of(
        cls,
        state: PartState,
        bounds: PointBounds,
        alignment: Alignment,
        forms: Forms,
        members: Indices,
        scale: Floats,
    ) -> _Over:
        weights, points, aligned = in_part(alignment, forms, members)
        domain, effects = state.variables.domain, state.effects[points] * scale
        varies = state.variables.varies_along
        base = forms.base + np.tensordot(weights, state.known_error[points], axes=([1, 2], [0, 1]))
        slopes = np.tensordot(weights, effects, axes=([1, 2], [0, 1]))
        loose = np.linalg.norm(weights, axis=2) @ np.nan_to_num(bounds.remainder[points])
        if varies.any():
            slopes[:, varies] = 0.0
            ends = np.maximum(np.abs(domain.lower), np.abs(domain.upper))[varies]
            moving = effects[:, :, varies]
            for k, row in enumerate(weights):
                loose[k] += (np.abs(np.einsum("na,nav->nv", row, moving)) @ ends).sum()
        return cls(base, slopes, loose, bounds.remainder[points], aligned, domain)

    def ends(self) -> tuple[Floats, Floats]:
        """(K,) the least and the most of each form."""
        high = self.domain.support(self.slopes.copy())
        low = self.domain.support(-self.slopes)
        return self.base - low - self.loose, self.base + high + self.loose


def _spread(over: _Over, factor: float) -> float:
    """The most that the largest form is more than the smallest, for one machine."""
    most = 0.0
    for k in range(len(over.base)):
        pairs = over.domain.support(over.slopes[k] - over.slopes)
        pairs += over.base[k] - over.base + over.loose[k] + over.loose
        pairs[k] = 0.0
        most = max(most, float(pairs.max()))
    return factor * most


def _length(over: _Over, factor: float) -> float:
    """The most of the Euclidean length of forms."""
    beyond = float(np.linalg.norm(over.loose))
    if not over.slopes.shape[1]:
        return factor * (float(np.linalg.norm(over.base)) + beyond)
    columns = np.arange(len(over.base))
    far = largest(over.base[np.newaxis], over.slopes[np.newaxis], over.domain, [columns])
    return factor * (float(far.length[0, 0]) + beyond)


def _centred(forms: Forms) -> Floats:
    """The weights; of a spread, which only differences of forms count for, about their mean."""
    weights = forms.weights
    return weights - weights.mean(axis=0) if forms.rule == "spread" else weights


def in_part(alignment: Alignment, forms: Forms, members: Indices) -> tuple[Floats, Indices, bool]:
    """Weights over points of the part, which points these are, and whether alignment counts."""
    weights = _centred(forms)
    if not alignment.moves or alignment.invariant(weights, members):
        return weights, members, False
    every = _in_part(alignment, weights, members)
    return alignment.linear(every), np.arange(len(alignment.nominal)), True


def _in_part(alignment: Alignment, weights: Floats, members: Indices) -> Floats:
    """(k, n, 3) weights (k, m, 3) of `members` as weights of all points of the part."""
    every = np.zeros((len(weights), len(alignment.nominal), 3))
    for column, point in enumerate(members):
        every[:, point] += weights[:, column]
    return every
