"""The worst case of a feature: from above by a proof, from below by one machine that does it.

From above, to first order a form of the points' errors is largest at the support function of what
the variables lie in (`probability.domain`), and beyond first order it is off by no more than

    sum over points of |weight| times the remainder of the point  +  curvature rho^2

with the proven remainders of `compensation.remainder` and the largest error rho of a point. What
varies along the path may be anywhere in its band at every point, which is more than it can be.

From below, machines are solved exactly: those at which the linear forms are largest, others drawn
at random, and where the value grows from there (climbing, with a counted effort).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.compensation.remainder import Remainder
from truepose.error_budget.largest import largest
from truepose.part.alignment import Alignment
from truepose.part.features import Feature, Forms
from truepose.part.states import PartState, every_point, position_columns
from truepose.part.varying import Varying
from truepose.probability.domain import Domain

PAIRS = 8
"""Of the linear forms, from how many of the farthest the search starts on either side."""

DRAWN = 256
"""Machines that are drawn besides, and tried to first order."""

STEPS = 12
"""Steps of a climb: corners are few."""

STEP = 1e-3
"""Of a variable's band, in the differences by which a climb finds its way."""


@dataclass(frozen=True)
class Interval:
    """The value lies between `lower` and `upper`; `proven`, or else `why` not."""

    lower: float
    upper: float
    proven: bool
    why: str = ""


@dataclass(frozen=True, eq=False)
class ReachedValue:
    """A value that one machine makes, exactly: its variables `t`, (v,) or of each point (n, v)."""

    value: float
    t: Floats


@dataclass
class Search:
    """The smallest and the largest value that were found, and of how many machines."""

    lower: ReachedValue
    upper: ReachedValue
    effort: int = field(default=0)


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
        proven, why = False, "what its alignment moves is not proven beyond first order"
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
        weights, points, aligned = _of_part(alignment, forms, members)
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


def _of_part(alignment: Alignment, forms: Forms, members: Indices) -> tuple[Floats, Indices, bool]:
    """Weights over points of the part, which points these are, and whether alignment counts."""
    weights = _centred(forms)
    if not alignment.moves:
        return weights, members, False
    every = _in_part(alignment, weights, members)
    if alignment.invariant(every):
        return weights, members, False
    return alignment.linear(every), np.arange(len(alignment.nominal)), True


def _in_part(alignment: Alignment, weights: Floats, members: Indices) -> Floats:
    """(k, n, 3) weights (k, m, 3) of `members` as weights of all points of the part."""
    every = np.zeros((len(weights), len(alignment.nominal), 3))
    for column, point in enumerate(members):
        every[:, point] += weights[:, column]
    return every


class Climb:
    """The search for the smallest and the largest value of one quantity in one state.

    `number` of the quantity in its `feature`, whose points of the part are `parts`.
    """

    def __init__(
        self,
        state: PartState,
        alignment: Alignment,
        feature: Feature,
        number: int,
        parts: Sequence[Indices],
        varying: Varying,
    ) -> None:
        self._state, self._varying, self._number = state, varying, number
        self._domain, self._forms = state.variables.domain, feature.forms()[number]
        members = np.concatenate(list(parts))
        weights, points, _ = _of_part(alignment, self._forms, members)
        if alignment.moves:
            # Where the part is moved, all of its points say how.
            points = np.arange(len(alignment.nominal))
            self._values = values_of(feature, parts, alignment)
        else:
            ends = np.cumsum([0, *(part.size for part in parts)])
            own = [np.arange(low, high) for low, high in itertools.pairwise(ends.tolist())]
            self._values = values_of(feature, own, alignment)
        self._points = points
        self._effects, self._start = state.effects[points], state.points[points]
        self._known = self._start + state.known_error[points]
        over = points if len(points) == weights.shape[1] else members
        self._slopes = np.tensordot(weights, state.effects[over], axes=([1, 2], [0, 1]))
        self._slopes[:, state.variables.varies_along] = 0.0
        self._base = self._forms.base + np.tensordot(
            weights, state.known_error[over], axes=([1, 2], [0, 1])
        )
        self.effort = 0

    def _value(self, points: Floats) -> Floats:
        column: Floats = self._values(points)[:, self._number]
        return column

    def search(self) -> Search:
        """Tried to first order, climbed from there, and the ends solved exactly."""
        if not self._slopes.shape[1]:
            only = ReachedValue(float(self._value(self._known[np.newaxis])[0]), np.empty(0))
            return Search(only, only, 1)
        starts = self._starts()
        values = self._linear(starts)
        ends = []
        for sign in (-1.0, 1.0):
            order = np.argsort(-sign * values, kind="stable")[:3]
            ends += [starts[..., row, :] for row in order]
            ends += [self._climbed(starts[..., row, :], sign) for row in order[:2]]
        tried = np.stack(ends, axis=-2)
        exact, good = self._state.exact(tried, self._points)
        self.effort += tried.shape[-2]
        values = np.full(len(good), np.nan)
        if good.any():
            values[good] = self._value(self._start + exact[good])
        if not good.any():
            none = ReachedValue(math.nan, tried[..., 0, :])
            return Search(none, none, self.effort)
        low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
        return Search(
            ReachedValue(float(values[low]), tried[..., low, :]),
            ReachedValue(float(values[high]), tried[..., high, :]),
            self.effort,
        )

    def _starts(self) -> Floats:
        """Machines (s, v), or of each point their own (n, s, v)."""
        corners = np.concatenate([np.zeros((1, self._slopes.shape[1])), *self._corners()])
        drawn = self._varying.rows(0, DRAWN)
        if self._varying.constant:
            return np.concatenate([corners, self._inside(drawn)])
        values = every_point(self._varying, drawn, 0)
        steady = ~self._state.variables.varies_along
        starts = np.concatenate([values[:, : len(corners)], values], axis=1)
        starts[:, : len(corners), steady] = corners[:, steady]
        return self._inside(starts)

    def _corners(self) -> list[Floats]:
        forms, domain = self._forms, self._domain
        if forms.rule == "length":
            far = np.eye(len(self._slopes)) @ self._slopes
            joint = self._base @ self._slopes
            return [domain.most_along(np.concatenate([far, -far, joint[np.newaxis]]))]
        reach = domain.support(self._slopes.copy())
        high = np.argsort(-(self._base + reach), kind="stable")[:PAIRS]
        low = np.argsort(self._base - reach, kind="stable")[:PAIRS]
        if forms.rule == "between":
            rows = self._slopes[np.concatenate([high, low])]
            return [domain.most_along(rows), domain.most_along(-rows)]
        pairs = self._slopes[high][:, np.newaxis] - self._slopes[low]
        rows = pairs.reshape(-1, pairs.shape[-1])
        return [domain.most_along(rows), domain.most_along(-rows)]

    def _inside(self, t: Floats) -> Floats:
        """Within the ends of the bands: a distribution without ends draws beyond them."""
        return np.clip(t, self._domain.lower, self._domain.upper)

    def _linear(self, t: Floats) -> Floats:
        """(s,) values to first order where the variables are t (s, v) or (n, s, v)."""
        self.effort += t.shape[-2]
        if t.ndim == 2:
            n = len(self._effects)
            moved = (t @ self._effects.reshape(3 * n, -1).T).reshape(len(t), n, 3)
        else:
            moved = np.einsum("nsv,nav->sna", t[self._points], self._effects)
        return self._value(self._known + moved)

    def _climbed(self, start: Floats, sign: float) -> Floats:
        """From one machine on to where the value by its slopes there is largest, while it grows."""
        best, reached = start, float(self._linear(start[..., np.newaxis, :])[0])
        steady = np.flatnonzero(~self._state.variables.varies_along)
        for _ in range(STEPS):
            around = np.repeat(best[..., np.newaxis, :], 2 * steady.size, axis=-2)
            for row, variable in enumerate(steady):
                around[..., 2 * row, variable] += STEP
                around[..., 2 * row + 1, variable] -= STEP
            values = self._linear(around)
            slopes = np.zeros(best.shape[-1])
            slopes[steady] = sign * (values[0::2] - values[1::2])
            further = best.copy()
            further[..., steady] = self._domain.most_along(slopes)[steady]
            value = float(self._linear(further[..., np.newaxis, :])[0])
            if not sign * (value - reached) > 1e-12 * abs(reached):
                break
            best, reached = further, value
        return best


def values_of(
    feature: Feature, parts: Sequence[Indices], alignment: Alignment
) -> Callable[[Floats], Floats]:
    """(s, n_quantity) of parts whose points are (s, n, 3): aligned, and the feature's own taken."""

    def values(points: Floats) -> Floats:
        aligned = alignment.apply(points)
        quantities: Floats = feature.values([aligned[:, place] for place in parts])
        return quantities

    return values
