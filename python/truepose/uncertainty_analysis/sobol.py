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
    swaps, first_at, total_at = _swaps(drawing, sets)
    sums: Sums | None = None
    slopes = effects
    failed = points = 0
    for part in _evaluated(evaluate, drawing, swaps, samples):
        good = part.good
        points += good.size * (2 + len(swaps))
        failed += int(good.size - good.sum())
        if sums is None:
            # Any centre and any slopes, fixed once, leave the estimates unbiased.
            centre, fit = _pilot(
                np.concatenate([part.base[good], part.other[good]]),
                np.concatenate([part.start[good], part.end[good]]) @ effects,
            )
            slopes = effects * fit
            sums = Sums(seed, slopes.shape[1])
        sums.add(_rows(part, centre, slopes, swaps)[good])
    assert sums is not None
    means = sums.means()
    covariance = drawing.covariance
    linear_variance = np.einsum("vm,vw,wm->m", slopes, covariance, slopes)
    # Weighted means of the rows, with what is exact of the linear function put back.
    variance = means[:, 0] - means[:, 1] ** 2 - (means[:, 2] - means[:, 3] ** 2) + linear_variance
    exact_first = np.array([swap.first(slopes, covariance) for swap in swaps])
    exact_total = np.array([swap.total(slopes, covariance) for swap in swaps])
    count = len(swaps)
    firsts = means[:, 4 : 4 + count] + exact_first
    totals = means[:, 4 + count :] + exact_total
    some = sums.count >= LEAST
    spread = np.sqrt(np.maximum(variance[0], 0.0))
    defined = (spread > floor) & some
    return SobolIndices(
        estimate(firsts[:, first_at], variance, defined, confidence),
        estimate(totals[:, total_at], variance, defined, confidence),
        np.where(some, np.where(spread > floor, variance[0], 0.0), np.nan),
        slopes,
        failed,
        points,
    )


def estimate(parts: Floats, variance: Floats, defined: Flags, confidence: float) -> Estimate:
    """Shares from `parts` (1 + REPLICATES, k, m) of `variance` (1 + REPLICATES, m).

    The first row is the estimate, the others are those of the bootstrap. NaN where not `defined`
    (m,).
    """
    usable = defined & (variance > 0.0)
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
    return Estimate(share, NormalDist().inv_cdf(0.5 + 0.5 * confidence) * spread)


def _deviation(values: Floats) -> Floats:
    """(k, m) standard deviation of `values` (r, k, m) that are not NaN."""
    good = ~np.isnan(values)
    count = np.maximum(good.sum(axis=0), 1)
    filled = np.where(good, values, 0.0)
    mean = filled.sum(axis=0) / count
    squares = np.where(good, filled - mean, 0.0) ** 2
    deviation: Floats = np.sqrt(squares.sum(axis=0) / np.maximum(count - 1, 1))
    return deviation


class Sums:
    """Means over rows, as they are and as the bootstrap counts them.

    Rows are (n, k, m): k statistics of m outputs.
    """

    def __init__(self, seed: int, n_output: int) -> None:
        self._counts = generator(seed, 0, COUNTS)
        self._total: Floats | None = None
        self._weight = np.zeros(1 + REPLICATES)
        self._n_output = n_output

    def add(self, rows: Floats) -> None:
        """More rows (n, k, m)."""
        times = np.empty((1 + REPLICATES, len(rows)))
        times[0] = 1.0
        times[1:] = self._counts.poisson(1.0, (len(rows), REPLICATES)).T
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
    """Some base samples: f(A), f(B) (n, m) and f of each swap (n, k, m), and which are good (n,).

    `start`, `end` (n, n_variable): coordinates of A and B.
    """

    base: Floats
    other: Floats
    swapped: Floats
    good: Flags
    start: Floats
    end: Floats


def _evaluated(
    evaluate: Evaluate, drawing: Drawing, swaps: Sequence[Swap], samples: int
) -> Iterator[_Part]:
    starts, ends = drawing.points(BASE), drawing.points(OTHER)
    for count in parts(samples, 2 + len(swaps)):
        start, end = starts.next(count), ends.next(count)
        base, other = drawing.variables(start), drawing.variables(end)
        stack = np.empty((2 + len(swaps), *base.shape))
        stack[0], stack[1] = base, other
        for at, swap in enumerate(swaps, start=2):
            stack[at] = swap.variables(base, other, start, end)
        values, good = evaluate(stack.reshape(-1, stack.shape[2]))
        # What cannot be evaluated may be NaN, which no weight of zero takes out of a sum.
        values = np.where(good[:, np.newaxis], values, 0.0).reshape(len(stack), count, -1)
        every: Flags = np.all(good.reshape(len(stack), count), axis=0)
        yield _Part(values[0], values[1], values[2:].swapaxes(0, 1), every, start, end)


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


def _rows(part: _Part, centre: Floats, slopes: Floats, swaps: Sequence[Swap]) -> Floats:
    """(n, 4 + 2 k, m): moments of f and of the linear g, then first and total of k swaps, f - g.

    f is taken less `centre` (m,), which does not change what is estimated.
    """
    base, other = part.base - centre, part.other - centre
    at_base, at_other = part.start @ slopes, part.end @ slopes
    step = part.swapped - part.base[:, np.newaxis]
    of_linear = np.empty_like(step)
    for number, swap in enumerate(swaps):
        of_linear[:, number] = (part.end - part.start) @ swap.moved(slopes)
    rows = np.empty((len(base), 4 + 2 * len(swaps), base.shape[1]))
    rows[:, 0] = 0.5 * (base**2 + other**2)
    rows[:, 1] = 0.5 * (base + other)
    rows[:, 2] = 0.5 * (at_base**2 + at_other**2)
    rows[:, 3] = 0.5 * (at_base + at_other)
    count = len(swaps)
    rows[:, 4 : 4 + count] = other[:, np.newaxis] * step - at_other[:, np.newaxis] * of_linear
    rows[:, 4 + count :] = 0.5 * (step**2 - of_linear**2)
    return rows
