"""The worst case of a feature from below: machines that do it, each solved exactly.

Tried to first order are the machines at which the linear forms of its quantities are largest,
others drawn at random, and those of all samples that are farthest off; from the best of them on the
search climbs to where a quantity by its slopes is largest, while it grows. The ends are solved
exactly. How many machines were tried is counted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.workpiece.alignment import Alignment
from truepose.workpiece.features import Feature, Forms
from truepose.workpiece.part_values import FeatureValues
from truepose.workpiece.states import PartState, every_point
from truepose.workpiece.varying import Varying
from truepose.workpiece.worst import in_part

PAIRS = 6
"""Of the linear forms, from how many of the farthest the search starts on either side."""

DRAWN = 128
"""Machines that are drawn besides."""

EXACT = 3
"""Of those on either side, how many of the farthest are solved exactly."""

STEPS = 12
"""Steps of a climb: corners are few."""

STEP = 1e-3
"""Of a variable's band, in the differences by which a climb finds its way."""

GAIN = 1e-12
"""What is gained at least by a step, of the value: less is rounding."""


@dataclass(frozen=True, eq=False)
class ReachedValue:
    """A value that one machine makes, exactly: its variables `t`, (v,) or of each point (n, v)."""

    value: float
    t: Floats


@dataclass(frozen=True)
class Search:
    """The smallest and the largest value that machines were found for, of how many tried."""

    lower: ReachedValue
    upper: ReachedValue
    effort: int


class FeatureSearch:
    """The search for the extremes of all quantities of one feature, whose points are `parts`.

    `drawn`: numbers of machines of `varying` that are known to make them far off.
    """

    def __init__(
        self,
        state: PartState,
        alignment: Alignment,
        feature: Feature,
        parts: Sequence[Indices],
        varying: Varying,
        drawn: Sequence[int] = (),
    ) -> None:
        self._state, self._varying = state, varying
        self._drawn = sorted({number for number in drawn if number >= DRAWN})
        self._domain = state.variables.domain
        self._steady = np.flatnonzero(~state.variables.varies_along)
        members = np.concatenate(list(parts))
        self._forms = feature.forms()
        self._values = FeatureValues(feature, parts, alignment, self._forms)
        points = self._values.points
        self._points = points
        self._effects, self._start = state.effects[points], state.points[points]
        self._known = self._start + state.known_error[points]
        self._slopes = [self._slopes_of(forms, alignment, members) for forms in self._forms]
        self._effort = 0

    def search(self) -> tuple[Search, ...]:
        """Of each quantity."""
        count = len(self._forms)
        if not self._state.variables.names:
            only = self._values(self._known[np.newaxis])[0].tolist()
            alone = [ReachedValue(value, np.empty(0)) for value in only]
            return tuple(Search(one, one, 1) for one in alone)
        starts = self._starts()
        values = self._linear(starts)
        ends: list[Floats] = []
        for number in range(count):
            for sign in (-1.0, 1.0):
                order = np.argsort(-sign * values[:, number], kind="stable")[:EXACT]
                ends += [starts[..., row, :] for row in order]
                ends.append(self._climbed(starts[..., order[0], :], number, sign))
        tried = np.stack(ends, axis=-2)
        errors, good = self._state.exact(tried, self._points)
        self._effort += tried.shape[-2]
        exact = np.full((len(good), count), np.nan)
        if good.any():
            exact[good] = self._values(self._start + errors[good])
        return tuple(self._extremes(exact[:, number], tried) for number in range(count))

    def _extremes(self, values: Floats, tried: Floats) -> Search:
        if not np.isfinite(values).any():
            none = ReachedValue(math.nan, tried[..., 0, :])
            return Search(none, none, self._effort)
        low, high = int(np.nanargmin(values)), int(np.nanargmax(values))
        return Search(
            ReachedValue(float(values[low]), tried[..., low, :]),
            ReachedValue(float(values[high]), tried[..., high, :]),
            self._effort,
        )

    def _slopes_of(
        self, forms: Forms, alignment: Alignment, members: Indices
    ) -> tuple[Floats, Floats]:
        """What each form is where all variables are 0 (k,), and its slopes (k, v) along them."""
        state = self._state
        weights, points, _ = in_part(alignment, forms, members)
        slopes = np.tensordot(weights, state.effects[points], axes=([1, 2], [0, 1]))
        slopes[:, state.variables.varies_along] = 0.0
        known = np.tensordot(weights, state.known_error[points], axes=([1, 2], [0, 1]))
        return forms.base + known, slopes

    def _starts(self) -> Floats:
        """Machines (s, v), or of each point their own (n, s, v)."""
        corners = [np.zeros((1, len(self._state.variables.names)))]
        for forms, (base, slopes) in zip(self._forms, self._slopes, strict=True):
            corners += self._corners(forms, base, slopes)
        listed = np.unique(np.concatenate(corners), axis=0)
        varying, numbers = self._varying, [(0, DRAWN), *((number, 1) for number in self._drawn)]
        drawn = [(varying.rows(first, count), first) for first, count in numbers]
        if varying.constant:
            return np.concatenate([listed, *(self._inside(rows) for rows, _ in drawn)])
        values = np.concatenate([every_point(varying, *some) for some in drawn], axis=1)
        # Corners go with what others have on the way, again and again.
        again = np.arange(len(listed)) % values.shape[1]
        starts = np.concatenate([values[:, again], values], axis=1)
        starts[:, : len(listed), self._steady] = listed[:, self._steady]
        return self._inside(starts)

    def _corners(self, forms: Forms, base: Floats, slopes: Floats) -> list[Floats]:
        domain = self._domain
        if forms.rule == "length":
            rows = np.concatenate([slopes, (base @ slopes)[np.newaxis]])
            return [domain.most_along(rows), domain.most_along(-rows)]
        reach = domain.support(slopes.copy())
        high = np.argsort(-(base + reach), kind="stable")[:PAIRS]
        low = np.argsort(base - reach, kind="stable")[:PAIRS]
        if forms.rule == "between":
            rows = slopes[np.concatenate([high, low])]
        else:
            pairs = slopes[high][:, np.newaxis] - slopes[low]
            rows = pairs.reshape(-1, pairs.shape[-1])
        return [domain.most_along(rows), domain.most_along(-rows)]

    def _inside(self, t: Floats) -> Floats:
        """Within the ends of the bands: a distribution without ends draws beyond them."""
        return np.clip(t, self._domain.lower, self._domain.upper)

    def _linear(self, t: Floats) -> Floats:
        """(s, n_quantity) to first order where the variables are t (s, v) or (n, s, v)."""
        self._effort += t.shape[-2]
        n = len(self._effects)
        if t.ndim == 2:
            moved = (t @ self._effects.reshape(3 * n, -1).T).reshape(len(t), n, 3)
        else:
            along = np.matmul(self._effects, np.swapaxes(t[self._points], 1, 2))
            moved = np.moveaxis(along, 2, 0)
        return self._values(self._known + moved)

    def _climbed(self, start: Floats, number: int, sign: float) -> Floats:
        """From one machine on to where the value by its slopes there is largest, while it grows."""
        best, reached = start, float(self._linear(start[..., np.newaxis, :])[0, number])
        steps = np.repeat(np.eye(best.shape[-1])[self._steady], 2, axis=0) * STEP
        steps[1::2] *= -1.0
        for _ in range(STEPS):
            values = self._linear(best[..., np.newaxis, :] + steps)[:, number]
            slopes = np.zeros(best.shape[-1])
            slopes[self._steady] = sign * (values[0::2] - values[1::2])
            further = best.copy()
            further[..., self._steady] = self._domain.most_along(slopes)[self._steady]
            value = float(self._linear(further[..., np.newaxis, :])[0, number])
            if not sign * (value - reached) > GAIN * abs(reached):
                break
            best, reached = further, value
        return best
