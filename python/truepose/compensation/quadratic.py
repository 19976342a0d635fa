"""What closures do to the tool in second order: a quadratic form, bounded.

In z, the v variables of a pose and the m components of e, which the platform moves beyond the
linear model:

    second order of a component = z . H z,    |z . H z| <= sum of |H[j, k]| |z[j]| |z[k]|

H is formed of all closures together, symmetric, before it is bounded, so that they may cancel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.compensation.motion import Motion
from truepose.compensation.remainder_closures import Closures

AT_ONCE = 1 << 18
"""Numbers of the forms' matrices that are worked on at once: they stay in the cache."""


@dataclass(frozen=True, eq=False)
class Quadratic:
    """Bounds of the second order, m and rad: `of_set` + `mixed` s + s . `of_more` s, |e| <= s.

    `of_set` (n, m) of the variables alone, `mixed` (n, m, m) of each of them with e, `of_more`
    (n, m, m, m) of e alone; no number of them is negative.
    """

    of_set: Floats
    mixed: Floats
    of_more: Floats

    def at(self, more: Floats) -> Floats:
        """(n, m) where e is at most `more` (n, m)."""
        twice = self.mixed + np.einsum("ncjk,nk->ncj", self.of_more, more)
        return np.asarray(self.of_set + np.einsum("ncj,nj->nc", twice, more))


def quadratic(motion: Motion, closures: Sequence[Closures]) -> Quadratic:
    """Of all closures of a machine."""
    n, m, size = motion.effects.shape
    v = size - m
    most = np.maximum(np.abs(motion.domain.lower), np.abs(motion.domain.upper))
    quadratic = Quadratic(np.zeros((n, m)), np.zeros((n, m, m)), np.zeros((n, m, m, m)))
    weights, one, other = _products(motion, closures)
    lever, carried = _turned(motion, closures)
    turns = motion.turns[:, np.newaxis]
    few = max(1, AT_ONCE // (m * size * size))
    for start in range(0, n, few):
        at = slice(start, start + few)
        left = [weights[at, :, :, np.newaxis] * one[at, np.newaxis], lever[at]]
        turning = np.broadcast_to(turns[at], lever[at].shape)
        right = [np.broadcast_to(other[at, np.newaxis], left[0].shape), turning]
        if carried is not None:
            left.append(turning)
            right.append(carried[at])
        rows, columns = (
            np.swapaxes(np.concatenate(left, axis=2), 2, 3),
            np.concatenate(right, axis=2),
        )
        quadratic.of_more[at] = np.abs(rows[..., v:, :] @ columns[..., v:])
        form = rows[..., :v, :] @ columns
        np.abs(form, out=form)
        by_set = most @ form
        quadratic.of_set[at] = by_set[..., :v] @ most
        quadratic.mixed[at] = 2.0 * by_set[..., v:]
    return quadratic


def _turned(motion: Motion, closures: Sequence[Closures]) -> tuple[Floats, Floats | None]:
    """Forms (n, m, 3, v + m) that the turn is multiplied by, and half of those it carries."""
    n, m, size = motion.effects.shape
    turned, carried = np.zeros((n, m, 9)), None
    for closure in closures:
        turned += closure.influence @ closure.turned.reshape(n, -1, 9)
        if closure.carried is not None:
            more = 0.5 * (closure.influence @ closure.carried.reshape(n, -1, 3 * size))
            carried = more if carried is None else carried + more
    lever: Floats = turned.reshape(n, m, 3, 3) @ motion.turns[:, np.newaxis]
    if carried is None:
        return lever, None
    carried = carried.reshape(n, m, 3, size)
    return np.asarray(lever + carried), carried


def _products(motion: Motion, closures: Sequence[Closures]) -> tuple[Floats, Floats, Floats]:
    """Weights (n, m, k) in the components, and the forms (n, k, v + m) that are multiplied.

    A product of two forms that are not one is taken in both orders, half each.
    """
    n, m, size = motion.effects.shape
    weights, one, other = [np.zeros((n, m, 0))], [np.zeros((n, 0, size))], [np.zeros((n, 0, size))]

    def add(weight: Floats, first: Floats, second: Floats) -> None:
        weights.append(weight)
        one.append(first)
        other.append(second)

    for closure in closures:
        for product in closure.products:
            weight = closure.influence[:, :, :, np.newaxis] * product.coefficient[:, np.newaxis]
            weight = weight.reshape(n, m, -1)
            first, second = (way.reshape(n, -1, size) for way in (product.one, product.other))
            if product.one is product.other:
                add(weight, first, first)
            else:
                add(0.5 * weight, first, second)
                add(0.5 * weight, second, first)
    return np.concatenate(weights, 2), np.concatenate(one, 1), np.concatenate(other, 1)


__all__ = ["Quadratic", "quadratic"]
