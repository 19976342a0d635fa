"""Shapley shares: the variance divided among variables that may be correlated.

The Shapley share of a variable is what it takes away from the variance that is left, as the
variables become known one after the other, averaged over all orders in which they can (Owen 2014;
Song, Nelson & Staum 2016). The shares are not negative and add up to one, correlated or not, where
Sobol indices of correlated variables do neither.

Sampled, by Goda's walk (2021, "A simple algorithm for global sensitivity analysis with Shapley
effects"): in a random order, one variable after another of a point is drawn anew,

    share V = E[(f_before - f_after) (f_start - (f_before + f_after) / 2)]

which needs n_variable + 1 evaluations a walk for all shares. Goda has independent variables;
for correlated ones those that are still to change must keep their values and those that were
changed be drawn given them. With the correlated coordinates z = L e, L a Cholesky factor in the
reverse of the walk's order, that is drawing anew the last components of e.

A linear function of the coordinates has its shares in closed form (Owen & Prieur 2017, "On Shapley
value for measuring importance of dependent inputs", theorem 2 in sums over subsets), and stands in
as a control variate as for Sobol indices.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.uncertainty_analysis.random_points import Drawing, generator
from truepose.uncertainty_analysis.sobol import (
    LEAST,
    ORDER,
    RANK,
    WALK_BASE,
    WALK_OTHER,
    Estimate,
    Evaluate,
    Sums,
    estimate,
    parts,
    regression,
)

SUBSETS = 12
"""Correlated variables up to which all subsets of them are summed over, not orders drawn."""

ORDERS = 1 << 12
"""Orders drawn for a linear function of more correlated variables than `SUBSETS`."""


KEPT = 6 << 20
"""Numbers that the factors of orders take at most, where they are kept."""


@dataclass(frozen=True)
class ShapleyShares:
    """Shares (n_cause, m) of the outputs' variance, in the order of `Drawing.by_itself`.

    `failed`: walks left out, since the model could not be evaluated somewhere on them; `points`:
    evaluations made.
    """

    shares: Estimate
    failed: int
    points: int


def shares(
    evaluate: Evaluate,
    drawing: Drawing,
    slopes: Floats,
    *,
    samples: int,
    seed: int,
    confidence: float,
    floor: Floats,
) -> ShapleyShares:
    """Shapley shares of every cause, from `samples` walks.

    `slopes` (n_variable, m): a linear function of the coordinates close to the outputs. `floor`
    (m,): standard deviation that is no more than rounding; the shares of an output below are NaN.
    """
    return Walks(drawing, samples, seed).shares(
        evaluate, slopes, confidence=confidence, floor=floor
    )


@dataclass(frozen=True)
class _Part:
    """Some walks: orders (n, d); on the way `coordinates` and `variables` (n (d + 1), n_variable).

    Of d causes, which become known one after the other; all walks' starts stand first.
    """

    order: Indices
    coordinates: Floats
    variables: Floats


class Walks:
    """The walks of `shares`: the same for every model of the variables.

    Where their points are few enough to be evaluated together, they are made once.
    """

    def __init__(self, drawing: Drawing, samples: int, seed: int) -> None:
        """As for `shares`."""
        self._drawing, self._samples, self._seed = drawing, samples, seed
        self._causes = drawing.by_itself

    def shares(
        self, evaluate: Evaluate, slopes: Floats, *, confidence: float, floor: Floats
    ) -> ShapleyShares:
        """Shapley shares of every cause; see the function of this name."""
        sums = Sums()
        failed = points = 0
        for part in self._parts():
            values, flags = evaluate(part.variables)
            values = np.where(flags[:, np.newaxis], values, 0.0)
            count = len(part.order)
            shape = (len(self._causes) + 1, count, slopes.shape[1])
            good = np.asarray(flags.reshape(-1, count).all(axis=0))
            points += flags.size
            failed += int(good.size - good.sum())
            on_the_way = values.reshape(shape).swapaxes(0, 1)
            linear = (part.coordinates @ slopes).reshape(shape).swapaxes(0, 1)
            taken = _taken(on_the_way) - _taken(linear)
            by_cause = np.empty_like(taken)
            np.put_along_axis(by_cause, part.order[:, :, np.newaxis], taken, axis=1)
            rows = by_cause[good]
            sums.add(rows.swapaxes(1, 2), rows.sum(axis=1, keepdims=True))
        linear_parts = self._linear.parts(slopes)
        # The components of a direction are not correlated, so that their linear parts add up.
        exact = np.stack([linear_parts[members].sum(axis=0) for members in self._causes])
        # Of its own sum, so that the shares add up to one.
        variance = (sums.means + exact).sum(axis=0)
        defined = (np.sqrt(np.maximum(variance, 0.0)) > floor) & (sums.count >= LEAST)
        of_variance = np.ones((1, variance.size))
        of_all = estimate(sums, exact, variance, of_variance, defined, confidence)
        return ShapleyShares(of_all, failed, points)

    @cached_property
    def _linear(self) -> LinearShares:
        return LinearShares(self._drawing, self._seed)

    def _parts(self) -> Iterable[_Part]:
        return self._walked() if self._only is None else [self._only]

    @cached_property
    def _only(self) -> _Part | None:
        """All walks, where they are evaluated together."""
        if len(list(parts(self._samples, len(self._causes) + 1))) != 1:
            return None
        only, *_ = self._walked()
        return only

    def _walked(self) -> Iterator[_Part]:
        drawing, n_cause = self._drawing, len(self._causes)
        bases, others = drawing.points(WALK_BASE), drawing.points(WALK_OTHER)
        numbers = generator(self._seed, 0, ORDER)
        for count in parts(self._samples, n_cause + 1):
            order = _orders(numbers, count, n_cause)
            base, other = bases.independent(count), others.independent(count)
            flat = _coordinates(drawing, order, base, other).reshape(-1, base.shape[1])
            variables = drawing.variables(flat)
            variables.flags.writeable = False
            yield _Part(order, flat, variables)


def linear_shares(drawing: Drawing, slopes: Floats, seed: int) -> Floats:
    """(n_variable, m) Shapley parts of the variance of a linear function of the coordinates.

    Exact for up to `SUBSETS` correlated variables, else over random orders of them.
    """
    return LinearShares(drawing, seed).parts(slopes)


class LinearShares:
    """The same for any linear function: what does not depend on it is worked out once."""

    def __init__(self, drawing: Drawing, seed: int) -> None:
        """As for `linear_shares`."""
        self._linked = drawing.linked
        latent = drawing.copula.latent
        self._of: list[tuple[Indices, _Subsets | _Orders]] = []
        for block in _blocks(latent):
            inside = latent[np.ix_(block, block)]
            few = block.size <= SUBSETS
            numbers = generator(seed, 1, ORDER)
            self._of.append((block, _Subsets(inside) if few else _Orders(inside, numbers)))

    def parts(self, slopes: Floats) -> Floats:
        """(n_variable, m) of the function with these slopes (n_variable, m)."""
        squares: Floats = slopes**2
        for block, of_block in self._of:
            squares[self._linked[block]] = of_block.parts(slopes[self._linked[block]])
        return squares


class _Subsets:
    """Shapley parts of b' z over every subset of the k coordinates."""

    def __init__(self, latent: Floats) -> None:
        count = len(latent)
        # Variance of the mean given a subset is b' L R b, R its regression: a matrix a subset.
        self._explained = np.zeros((1 << count, count, count))
        for subset in range(1, 1 << count):
            given = np.array([bool(subset >> index & 1) for index in range(count)])
            self._explained[subset] = latent @ regression(latent, given).T

    def parts(self, slopes: Floats) -> Floats:
        """(k, m) of slopes (k, m)."""
        count = len(slopes)
        known = ((self._explained @ slopes) * slopes).sum(axis=1)
        parts = np.zeros_like(slopes)
        subsets = np.arange(1 << count)
        sizes = np.array([int(subset).bit_count() for subset in subsets])
        weights = np.array([1.0 / (count * math.comb(count - 1, size)) for size in range(count)])
        for index in range(count):
            without = subsets[(subsets >> index & 1) == 0]
            added = known[without | (1 << index)] - known[without]
            parts[index] = weights[sizes[without]] @ added
        return parts


class _Orders:
    """As `_Subsets`, the mean over `ORDERS` random orders."""

    def __init__(self, latent: Floats, numbers: np.random.Generator) -> None:
        count = len(latent)
        self._latent = latent
        self._some = max(1, (1 << 20) // count**2)
        self._orders = _orders(numbers, ORDERS, count)
        self._kept: dict[int, Floats] = {}

    def parts(self, slopes: Floats) -> Floats:
        """(k, m) of slopes (k, m)."""
        parts = np.zeros_like(slopes)
        for start in range(0, ORDERS, self._some):
            orders = self._orders[start : start + self._some]
            # What the j-th of an order adds, given those before it: the square of b' L in it.
            added = np.matmul(self._factors(start).swapaxes(1, 2), slopes[orders]) ** 2
            for place in range(orders.shape[1]):
                np.add.at(parts, orders[:, place], added[:, place])
        return parts / ORDERS

    def _factors(self, start: int) -> Floats:
        """Those of the orders from `start` on; kept where they take some 50 MB at most."""
        if start in self._kept:
            return self._kept[start]
        made = factors(self._latent, self._orders[start : start + self._some])
        if (start + self._some) * len(self._latent) ** 2 <= KEPT:
            self._kept[start] = made
        return made


def _blocks(latent: Floats) -> Iterator[Indices]:
    """Sets of coordinates that are correlated among each other and with none besides."""
    left = set(range(len(latent)))
    while left:
        reached, front = set(), {min(left)}
        while front:
            reached |= front
            nearby = np.flatnonzero((latent[sorted(front)] != 0.0).any(axis=0))
            front = set(nearby.tolist()) - reached
        left -= reached
        yield np.array(sorted(reached), np.intp)


def _orders(numbers: np.random.Generator, count: int, size: int) -> Indices:
    """(count, size) random orders of `size` things."""
    orders: Indices = np.argsort(numbers.random((count, size)), axis=1)
    return orders


def factors(latent: Floats, orders: Indices) -> Floats:
    """(n, k, k) Cholesky factors of `latent` (k, k), rows and columns in each order (n, k).

    Of a singular one: a coordinate that follows from those before it has a column of zeros.
    """
    ordered = latent[orders[:, :, np.newaxis], orders[:, np.newaxis, :]]
    parts = np.zeros_like(ordered)
    # Column by column from those before it: what is left of the matrix is never written back.
    for at in range(orders.shape[1]):
        before = np.matmul(parts[:, at:, :at], parts[:, at, :at, np.newaxis])[..., 0]
        line = ordered[:, at:, at] - before
        pivot = line[:, 0]
        root = np.sqrt(np.where(pivot > RANK, pivot, np.inf))
        parts[:, at:, at] = line / root[:, np.newaxis]
    return parts


def _taken(values: Floats) -> Floats:
    """(n, d, m) Goda's product of each step, from f (n, d + 1, m) along the walks."""
    before, after = values[:, :-1], values[:, 1:]
    taken: Floats = (before - after) * (values[:, :1] - 0.5 * (before + after))
    return taken


def _coordinates(drawing: Drawing, order: Indices, base: Floats, other: Floats) -> Floats:
    """(d + 1, n, v) coordinates along the walks of `order` (n, d), all of `base` at their start.

    `base`, `other` (n, v): independent ones; those of linked variables become the components of e.
    """
    n_cause = order.shape[1]
    linked = drawing.linked
    cause_of = np.empty(base.shape[1], np.intp)
    for cause, members in enumerate(drawing.by_itself):
        cause_of[members] = cause
    steps = np.empty((n_cause + 1, *base.shape))
    steps[0] = base
    for step in range(n_cause):
        steps[step + 1] = np.where(cause_of == order[:, [step]], other, steps[step])
    if linked.size:
        # Place of each linked variable among them, the last of the walk first: what changes first
        # is drawn given all others, so its component of e comes last.
        place = np.argsort(order, axis=1)[:, cause_of[linked]]
        reverse = np.argsort(-place, axis=1)
        lower = factors(drawing.copula.latent, reverse)
        moved = np.take_along_axis(steps[:, :, linked], reverse[np.newaxis], axis=2)
        together = np.matmul(lower[np.newaxis], moved[..., np.newaxis])[..., 0]
        back = np.argsort(reverse, axis=1)
        steps[:, :, linked] = np.take_along_axis(together, back[np.newaxis], axis=2)
    return steps
