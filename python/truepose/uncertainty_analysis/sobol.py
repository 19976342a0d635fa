"""Sobol indices of variables and of groups of them, with exact evaluations of the model.

From two independent points A and B of the variables, for a set u of them:

    first(u) V = E[f(B) (f(A with u of B) - f(A))]             (Saltelli et al. 2010, table 2b)
    total(u) V = E[(f(A) - f(A with u of B))^2] / 2            (Jansen 1999)

first is the part of the variance V that knowing u would take away, `Var E[f | u]`; total the part
that stays when all but u are known, `E Var[f | others]`. Where u is correlated with others, they
are these same conditional variances (Kucherenko, Tarantola & Annoni 2012): "A with u of B" is then
a point whose u is B's, the others following by what they are correlated with (first), or one whose
others are A's and whose u is drawn anew given those (total). In the coordinates of a `Drawing` both
are linear maps of B - A.

From every estimate the same estimate of a linear function of the coordinates is taken off, over the
same points, and the exact value put in its place (control variate): a model that is nearly linear
has its indices to several digits from a thousand points, and a linear one exactly.

Half widths come from the Poisson bootstrap over base samples: every sample is counted a random
number of times, of mean one, a hundred times over. It needs sums only, so that memory does not
grow with the number of samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import NormalDist

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.uncertainty_analysis.random_points import Drawing, generator

Evaluate = Callable[[Floats], tuple[Floats, Flags]]
"""Values (s, m) of the model's outputs at variables t (s, n_variable), and which are good (s,)."""

REPLICATES = 100
"""Times that the bootstrap counts the samples anew."""

STACK = 1 << 16
"""Most points that are evaluated, and kept, at a time."""

LEAST = 8
"""Base samples below which nothing is said."""

RANK = 1e-9
"""Relative eigenvalue below which a correlation matrix is singular."""

BASE, OTHER, WALK_BASE, WALK_OTHER, ORDER, COUNTS = range(6)
"""What random numbers are for."""


@dataclass(frozen=True)
class Estimate:
    """Parts of the variance (k, m), and half widths of their confidence intervals (k, m)."""

    share: Floats
    half_width: Floats

    def of(self, rows: Sequence[int]) -> Estimate:
        """Some of the k, in this order."""
        return Estimate(self.share[rows], self.half_width[rows])


@dataclass(frozen=True)
class SobolIndices:
    """Indices of k sets of variables in m outputs.

    `variance` (m,); shares of an output whose variance is zero are NaN. `failed`: base samples left
    out, since the model could not be evaluated at one of their points; `points`: evaluations made.
    `slopes` (n_variable, m): of the linear function taken off.
    """

    first: Estimate
    total: Estimate
    variance: Floats
    slopes: Floats
    failed: int
    points: int


def indices(
    evaluate: Evaluate,
    drawing: Drawing,
    sets: Sequence[Indices],
    effects: Floats,
    *,
    samples: int,
    seed: int,
    confidence: float,
    floor: Floats,
) -> SobolIndices:
    """Sobol indices of each of `sets`, arrays of variable numbers, from `samples` base samples.

    `effects` (n_variable, m): first-order change of the outputs with each coordinate; how good they
    are decides on the width of the confidence intervals alone. `floor` (m,): standard deviation
    that is no more than rounding. Evaluates samples * (2 + number of sets) points, more where
    variables are correlated.
    """
    design = SobolDesign(drawing, sets, samples, seed)
    return design.indices(evaluate, effects, confidence=confidence, floor=floor)


class SobolDesign:
    """The points at which `indices` evaluates a model: the same for every model of the variables.

    Where they are few enough to be evaluated together, they are made once, as are the numbers by
    which the bootstrap counts them.
    """

    def __init__(self, drawing: Drawing, sets: Sequence[Indices], samples: int, seed: int) -> None:
        """As for `indices`."""
        self._drawing, self._samples, self._seed = drawing, samples, seed
        self._swaps, self._first_at, self._total_at = _swaps(drawing, sets)
        self._arrays: tuple[Floats, Floats, Floats, Floats] | None = None
        alone = [
            at
            for at, swap in enumerate(self._swaps)
            if swap.linked is None and swap.single.size == 1
        ]
        self._alone: Indices = np.array(alone, np.intp)
        self._variable: Indices = np.array([self._swaps[at].single[0] for at in alone], np.intp)
        others = set(range(len(self._swaps))).difference(alone)
        self._others = [(at, self._swaps[at]) for at in sorted(others)]

    def indices(
        self, evaluate: Evaluate, effects: Floats, *, confidence: float, floor: Floats
    ) -> SobolIndices:
        """Sobol indices of each of the sets; see the function of this name."""
        sums: Sums | None = None
        slopes = effects
        failed = points = 0
        for part in self._parts():
            values, good = evaluate(part.variables)
            every: Flags = np.all(good.reshape(len(part.start), -1), axis=1)
            whole = bool(every.all())
            if not whole:
                # What cannot be evaluated may be NaN, which no weight of zero takes out of a sum.
                values = np.where(good[:, np.newaxis], values, 0.0)
            values = values.reshape(len(part.start), -1, values.shape[1])
            points += good.size
            failed += int(every.size - every.sum())
            if sums is None:
                # Any centre and any slopes, fixed once, leave the estimates unbiased.
                centre, fit = _pilot(
                    np.concatenate([values[every, 0], values[every, 1]]),
                    np.concatenate([part.start[every], part.end[every]]) @ effects,
                )
                slopes = effects * fit
                sums = Sums(self._seed, slopes.shape[1], self._counts)
            rows = self._rows(part, values, centre, slopes)
            sums.add(rows if whole else rows[every])
        assert sums is not None
        return self._estimates(sums, slopes, failed, points, confidence, floor)

    def _estimates(
        self,
        sums: Sums,
        slopes: Floats,
        failed: int,
        points: int,
        confidence: float,
        floor: Floats,
    ) -> SobolIndices:
        means = sums.means()
        covariance = self._drawing.covariance
        linear_variance = ((covariance @ slopes) * slopes).sum(axis=0)
        # Weighted means of the rows, with what is exact of the linear function put back.
        variance = (
            means[:, 0] - means[:, 1] ** 2 - (means[:, 2] - means[:, 3] ** 2) + linear_variance
        )
        count = len(self._swaps)
        exact = np.empty((2, count, slopes.shape[1]))
        exact[:, self._alone] = slopes[self._variable] ** 2
        for at, swap in self._others:
            exact[0, at] = swap.first(slopes, covariance)
            exact[1, at] = swap.total(slopes, covariance)
        firsts = means[:, 4 : 4 + count] + exact[0]
        totals = means[:, 4 + count :] + exact[1]
        some = sums.count >= LEAST
        spread = np.sqrt(np.maximum(variance[0], 0.0))
        defined = (spread > floor) & some
        return SobolIndices(
            estimate(firsts, variance, defined, confidence).of(self._first_at),
            estimate(totals, variance, defined, confidence).of(self._total_at),
            np.where(some, np.where(spread > floor, variance[0], 0.0), np.nan),
            slopes,
            failed,
            points,
        )

    def _parts(self) -> Iterable[_Part]:
        return self._evaluated() if self._only is None else [self._only]

    @cached_property
    def _only(self) -> _Part | None:
        """All points, where they are evaluated together."""
        if self._samples * (2 + len(self._swaps)) > STACK:
            return None
        only, *_ = self._evaluated()
        return only

    @cached_property
    def _counts(self) -> Floats | None:
        return None if self._only is None else counts(self._seed, self._samples)

    def _evaluated(self) -> Iterator[_Part]:
        drawing, swaps = self._drawing, self._swaps
        starts, ends = drawing.points(BASE), drawing.points(OTHER)
        for count in parts(self._samples, 2 + len(swaps)):
            start, end = starts.next(count), ends.next(count)
            base, other = drawing.variables(start), drawing.variables(end)
            stack = np.empty((count, 2 + len(swaps), base.shape[1]))
            stack[:, 0], stack[:, 1] = base, other
            for at, swap in enumerate(swaps, start=2):
                stack[:, at] = swap.variables(base, other, start, end)
            variables = stack.reshape(-1, stack.shape[2])
            variables.flags.writeable = False
            yield _Part(variables, start, end)

    def _rows(self, part: _Part, values: Floats, centre: Floats, slopes: Floats) -> Floats:
        """(n, 4 + 2 k, m): moments of f and the linear g, then first and total of k swaps, f - g.

        From f (n, 2 + k, m), less `centre` (m,), which does not change what is estimated.
        """
        base, other = values[:, 0] - centre, values[:, 1] - centre
        at_base, at_other = part.start @ slopes, part.end @ slopes
        between = part.end - part.start
        step, of_linear, product, rows = self._room(len(base), base.shape[1])
        np.subtract(values[:, 2:], values[:, :1], out=step)
        if not self._others:
            np.multiply(between[:, self._variable, np.newaxis], slopes[self._variable], of_linear)
        else:
            of_linear[:, self._alone] = (
                between[:, self._variable, np.newaxis] * slopes[self._variable]
            )
        for at, swap in self._others:
            of_linear[:, at] = between @ swap.moved(slopes)
        count = len(self._swaps)
        rows[:, 0] = 0.5 * (base**2 + other**2)
        rows[:, 1] = 0.5 * (base + other)
        rows[:, 2] = 0.5 * (at_base**2 + at_other**2)
        rows[:, 3] = 0.5 * (at_base + at_other)
        first, total = rows[:, 4 : 4 + count], rows[:, 4 + count :]
        np.multiply(other[:, np.newaxis], step, out=first)
        np.multiply(at_other[:, np.newaxis], of_linear, out=product)
        first -= product
        # step^2 - of_linear^2, halved
        np.subtract(step, of_linear, out=product)
        step += of_linear
        step *= 0.5
        np.multiply(product, step, out=total)
        return rows

    def _room(self, count: int, n_output: int) -> tuple[Floats, Floats, Floats, Floats]:
        """Three arrays (n, k, m) and the rows (n, 4 + 2 k, m), the same from model to model."""
        swaps = len(self._swaps)
        if self._arrays is None or self._arrays[0].shape != (count, swaps, n_output):
            step, of_linear, product = np.empty((3, count, swaps, n_output))
            rows = np.empty((count, 4 + 2 * swaps, n_output))
            self._arrays = step, of_linear, product, rows
        return self._arrays


def estimate(parts: Floats, variance: Floats, defined: Flags, confidence: float) -> Estimate:
    """Shares from `parts` (1 + REPLICATES, k, m) of `variance` (1 + REPLICATES, m).

    The first row is the estimate, the others are those of the bootstrap. NaN where not `defined`
    (m,).
    """
    usable = defined & (variance > 0.0)
    if usable.all():
        shares = parts / variance[:, np.newaxis]
        spread = shares[1:].std(axis=0, ddof=1)
        return Estimate(shares[0], _width(confidence) * spread)
    shares = np.divide(
        parts,
        variance[:, np.newaxis],
        out=np.full_like(parts, np.nan),
        where=usable[:, np.newaxis],
    )
    share = np.where(defined, shares[0], np.nan)
    spread = np.full_like(share, np.nan)
    if defined.any():
        known = shares[1:][:, :, defined]
        # A replicate without variance, from a handful of samples, says nothing.
        spread[:, defined] = _deviation(known)
    return Estimate(share, _width(confidence) * spread)


def _width(confidence: float) -> float:
    """Half of an interval that holds the share `confidence`, in standard deviations."""
    return NormalDist().inv_cdf(0.5 + 0.5 * confidence)


def _deviation(values: Floats) -> Floats:
    """(k, m) standard deviation of `values` (r, k, m) that are not NaN."""
    good = ~np.isnan(values)
    count = np.maximum(good.sum(axis=0), 1)
    filled = np.where(good, values, 0.0)
    mean = filled.sum(axis=0) / count
    squares = np.where(good, filled - mean, 0.0) ** 2
    deviation: Floats = np.sqrt(squares.sum(axis=0) / np.maximum(count - 1, 1))
    return deviation


def counts(seed: int, samples: int, numbers: np.random.Generator | None = None) -> Floats:
    """(1 + REPLICATES, samples) how often each row counts: once, and in each of the bootstrap's."""
    drawn = generator(seed, 0, COUNTS) if numbers is None else numbers
    times = np.empty((1 + REPLICATES, samples))
    times[0] = 1.0
    times[1:] = drawn.poisson(1.0, (samples, REPLICATES)).T
    return times


class Sums:
    """Means over rows, as they are and as the bootstrap counts them.

    Rows are (n, k, m): k statistics of m outputs. `known`: the counts of as many rows as are added
    at most, all at once, where these are known.
    """

    def __init__(self, seed: int, n_output: int, known: Floats | None = None) -> None:
        self._seed, self._known = seed, known
        self._counts = generator(seed, 0, COUNTS)
        self._total: Floats | None = None
        self._weight = np.zeros(1 + REPLICATES)
        self._n_output = n_output

    def add(self, rows: Floats) -> None:
        """More rows (n, k, m)."""
        if self._known is None:
            times = counts(self._seed, len(rows), self._counts)
        else:
            times = self._known[:, : len(rows)]
        sums = times @ rows.reshape(len(rows), rows.shape[1] * rows.shape[2])
        self._total = sums if self._total is None else self._total + sums
        self._weight += times.sum(axis=1)

    @property
    def count(self) -> int:
        """Rows added."""
        return int(self._weight[0])

    def means(self) -> Floats:
        """(1 + REPLICATES, k, m): of all rows, then of each counting."""
        assert self._total is not None
        mean = self._total / np.maximum(self._weight, 1.0)[:, np.newaxis]
        return mean.reshape(len(mean), -1, self._n_output)


@dataclass(frozen=True)
class Swap:
    """How a set of the coordinates of A becomes B's: single ones outright, linked by a map.

    `single`: numbers of the variables exchanged. `linked`: map (k, k) of the linked coordinates'
    difference B - A, or None where they stay.
    """

    drawing: Drawing
    single: Indices
    linked: Floats | None

    def variables(self, base: Floats, other: Floats, start: Floats, end: Floats) -> Floats:
        """(s, n_variable) variables t there, from those and the coordinates of A and B."""
        swapped = base.copy()
        swapped[:, self.single] = other[:, self.single]
        if self.linked is not None:
            at = self.drawing.linked
            moved = start[:, at] + (end[:, at] - start[:, at]) @ self.linked.T
            swapped[:, at] = self.drawing.copula.variables(moved)
        return swapped

    def first(self, slopes: Floats, covariance: Floats) -> Floats:
        """The V of u alone (m,) of linear functions: b' G M' b, G the covariance (first-order)."""
        moved = self.moved(slopes)
        return np.asarray(((covariance @ moved) * slopes).sum(axis=0))

    def total(self, slopes: Floats, covariance: Floats) -> Floats:
        """The V of u in total (m,) of linear functions: b' M G M' b."""
        moved = self.moved(slopes)
        return np.asarray(((covariance @ moved) * moved).sum(axis=0))

    def moved(self, slopes: Floats) -> Floats:
        """(n_variable, m) slopes b in what is exchanged: the change is (B - A) of these."""
        moved = np.zeros_like(slopes)
        moved[self.single] = slopes[self.single]
        if self.linked is not None:
            at = self.drawing.linked
            moved[at] = self.linked.T @ slopes[at]
        return moved


def regression(latent: Floats, given: Flags) -> Floats:
    """(k, k) map to the mean of all coordinates from those `given` (k,), the others' columns 0."""
    matrix = np.zeros_like(latent)
    if given.any():
        known = latent[np.ix_(given, given)]
        matrix[:, given] = latent[:, given] @ np.linalg.pinv(known, rcond=RANK, hermitian=True)
    return matrix


def _swaps(drawing: Drawing, sets: Sequence[Indices]) -> tuple[list[Swap], list[int], list[int]]:
    """The swaps to evaluate, and which of them gives each set's first and total index.

    One for both, but for sets that are correlated with variables outside of them.
    """
    latent, linked = drawing.copula.latent, drawing.linked
    swaps: list[Swap] = []
    first_at, total_at = [], []
    known: dict[bytes, tuple[int, int]] = {}
    for variables in sets:
        if variables.tobytes() in known:
            again = known[variables.tobytes()]
            first_at.append(again[0])
            total_at.append(again[1])
            continue
        single = variables[drawing.single[variables]]
        inside = np.isin(linked, variables)
        if not inside.any():
            maps: list[Floats | None] = [None]
        else:
            alone = regression(latent, inside)
            anew = np.eye(linked.size) - regression(latent, ~inside)
            maps = [alone] if np.allclose(alone, anew, atol=RANK) else [alone, anew]
        first_at.append(len(swaps))
        swaps += [Swap(drawing, single, linear_map) for linear_map in maps]
        total_at.append(len(swaps) - 1)
        known[variables.tobytes()] = first_at[-1], total_at[-1]
    return swaps, first_at, total_at


@dataclass(frozen=True)
class _Part:
    """Some base samples: `variables` (n (2 + k), n_variable) at A, B and every swap of each.

    `start`, `end` (n, n_variable): coordinates of A and B.
    """

    variables: Floats
    start: Floats
    end: Floats


def parts(samples: int, points: int) -> Iterable[int]:
    """Lengths of the parts in which `samples` of so many points each are evaluated."""
    most = max(1, STACK // points)
    for start in range(0, samples, most):
        yield min(most, samples - start)


def _pilot(values: Floats, linear: Floats) -> tuple[Floats, Floats]:
    """Straight line of the outputs over the linear function, both (n, m): offset, slope (m,)."""
    if len(values) < LEAST:
        return np.zeros(values.shape[1]), np.ones(values.shape[1])
    mean, of_linear = values.mean(axis=0), linear.mean(axis=0)
    about = linear - of_linear
    squares = (about**2).sum(axis=0)
    common = ((values - mean) * about).sum(axis=0)
    slope = np.divide(common, squares, out=np.ones_like(common), where=squares > 0.0)
    return mean - slope * of_linear, slope
