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

Half widths come from the infinitesimal jackknife over base samples (Efron 1982, chapter 6): the
variance of an index is that of what each sample moves it by, to first order. It is what a bootstrap
has in the mean, without the noise of one, and needs sums only, so that memory does not grow with
the number of samples.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.probability.quantiles import student_quantile
from truepose.uncertainty_analysis.random_points import Drawing

Evaluate = Callable[[Floats], tuple[Floats, Flags]]
"""Values (s, m) of the model's outputs at variables t (s, n_variable), and which are good (s,)."""

STACK = 1 << 16
"""Most points that are evaluated, and kept, at a time."""

LEAST = 8
"""Base samples below which nothing is said."""

RANK = 1e-9
"""Relative eigenvalue below which a correlation matrix is singular."""

BASE, OTHER, WALK_BASE, WALK_OTHER, ORDER = range(5)
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

    Where they are few enough to be evaluated together, they are made once.
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
            moments, rows = self._rows(part, values, centre, slopes)
            if not whole:
                moments, rows = moments[every], rows[every]
            sums = Sums() if sums is None else sums
            sums.add(rows, moments)
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
        covariance = self._drawing.covariance
        linear_variance = ((covariance @ slopes) * slopes).sum(axis=0)
        # What is exact of the linear function is put back.
        moments = sums.moments
        variance = moments[0] - moments[1] ** 2 - (moments[2] - moments[3] ** 2) + linear_variance
        one = np.ones_like(variance)
        of_variance = np.stack([one, -2.0 * moments[1], -one, 2.0 * moments[3]])
        count = len(self._swaps)
        exact = np.empty((2, count, slopes.shape[1]))
        exact[:, self._alone] = slopes[self._variable] ** 2
        for at, swap in self._others:
            exact[0, at] = swap.first(slopes, covariance)
            exact[1, at] = swap.total(slopes, covariance)
        some = sums.count >= LEAST
        spread = np.sqrt(np.maximum(variance, 0.0))
        defined = (spread > floor) & some
        both = estimate(
            sums, exact.reshape(2 * count, -1), variance, of_variance, defined, confidence
        )
        return SobolIndices(
            both.of(self._first_at),
            both.of([count + at for at in self._total_at]),
            np.where(some, np.where(spread > floor, variance, 0.0), np.nan),
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

    def _rows(
        self, part: _Part, values: Floats, centre: Floats, slopes: Floats
    ) -> tuple[Floats, Floats]:
        """Moments (n, 4, m) of f and the linear g, and first and total (n, m, 2 k) of f less g.

        From f (n, 2 + k, m), less `centre` (m,), which does not change what is estimated.
        """
        base, other = values[:, 0] - centre, values[:, 1] - centre
        at_base, at_other = part.start @ slopes, part.end @ slopes
        step, of_linear, product, rows = self._room(len(base), base.shape[1])
        np.subtract(values[:, 2:].swapaxes(1, 2), values[:, 0, :, np.newaxis], out=step)
        between, alone = part.between[:, np.newaxis], slopes.T[:, self._variable]
        if not self._others:
            np.multiply(between[:, :, self._variable], alone, out=of_linear)
        else:
            of_linear[:, :, self._alone] = between[:, :, self._variable] * alone
        for at, swap in self._others:
            of_linear[:, :, at] = part.between @ swap.moved(slopes)
        count = len(self._swaps)
        moments = np.stack(
            [
                0.5 * (base**2 + other**2),
                0.5 * (base + other),
                0.5 * (at_base**2 + at_other**2),
                0.5 * (at_base + at_other),
            ],
            axis=1,
        )
        first, total = rows[:, :, :count], rows[:, :, count:]
        np.multiply(other[:, :, np.newaxis], step, out=first)
        np.multiply(at_other[:, :, np.newaxis], of_linear, out=product)
        first -= product
        # step^2 - of_linear^2, halved
        np.subtract(step, of_linear, out=product)
        step += of_linear
        step *= 0.5
        np.multiply(product, step, out=total)
        return moments, rows

    def _room(self, count: int, n_output: int) -> tuple[Floats, Floats, Floats, Floats]:
        """Three arrays (n, m, k) and the rows (n, m, 2 k), the same from model to model."""
        swaps = len(self._swaps)
        if self._arrays is None or self._arrays[0].shape != (count, n_output, swaps):
            step, of_linear, product = np.empty((3, count, n_output, swaps))
            rows = np.empty((count, n_output, 2 * swaps))
            self._arrays = step, of_linear, product, rows
        return self._arrays


class Sums:
    """Means of rows (n, m, k), k statistics of m outputs, and how sure these are.

    Beside them go some moments (n, j, m) of the same samples, on which their whole depends.
    """

    def __init__(self) -> None:
        # Of 1 and the moments (m, 1 + j): products with each other, and with the rows; the rows'
        # squares (m, k).
        self._sums: tuple[Floats, Floats, Floats] | None = None

    def add(self, rows: Floats, moments: Floats) -> None:
        """More rows (n, m, k), and moments (n, j, m) of the same samples."""
        n, m, k = rows.shape
        beside = np.ones((m, 1 + moments.shape[1], n))
        beside[:, 1:] = moments.transpose(2, 1, 0)
        flat = rows.reshape(n, m * k)
        sums = (
            beside @ beside.swapaxes(1, 2),
            beside @ rows.swapaxes(0, 1),
            np.einsum("ij,ij->j", flat, flat).reshape(m, k),
        )
        if self._sums is not None:
            own, products, squares = self._sums
            sums = (own + sums[0], products + sums[1], squares + sums[2])
        self._sums = sums

    @property
    def count(self) -> int:
        """Rows added."""
        return int(self._of_all[0][0, 0, 0])

    @property
    def moments(self) -> Floats:
        """(j, m) means."""
        means: Floats = self._of_all[0][:, 0, 1:].T / max(self.count, 1)
        return means

    @property
    def means(self) -> Floats:
        """(k, m) of the rows."""
        means: Floats = self._of_all[1][:, 0].T / max(self.count, 1)
        return means

    def deviation(self, share: Floats, slopes: Floats) -> Floats:
        """(k, m) standard uncertainty of the means less `share` (k, m) of a whole.

        `slopes` (j, m): how the whole changes with the mean of each moment.
        """
        own, products, squares = self._of_all
        count = max(self.count, 2)
        mean, between = products[:, 0] / count, own[:, 0, 1:] / count
        among = own[:, 1:, 1:] / count - between[:, :, np.newaxis] * between[:, np.newaxis]
        with_rows = products[:, 1:] / count - between[:, :, np.newaxis] * mean[:, np.newaxis]
        along = slopes.T[:, np.newaxis]
        of_whole = (along @ among @ along.swapaxes(1, 2))[:, :, 0]
        with_whole = (along @ with_rows)[:, 0]
        of_each = squares / count - mean**2
        squared = of_each + share.T * (share.T * of_whole - 2.0 * with_whole)
        deviation: Floats = np.sqrt(np.maximum(squared, 0.0) / (count - 1)).T
        return deviation

    @property
    def _of_all(self) -> tuple[Floats, Floats, Floats]:
        assert self._sums is not None
        return self._sums


def estimate(
    sums: Sums,
    exact: Floats,
    variance: Floats,
    of_variance: Floats,
    defined: Flags,
    confidence: float,
) -> Estimate:
    """Shares of `variance` (m,): the means of the sums and what is `exact` (k, m) beside them.

    `of_variance` (j, m): how it changes with each of the moments. NaN where not `defined` (m,).
    """
    whole = np.where(defined, variance, np.nan)
    share = (sums.means + exact) / whole
    return Estimate(
        share, _width(confidence, sums.count) * sums.deviation(share, of_variance) / whole
    )


@cache
def _width(confidence: float, samples: int) -> float:
    """Half of an interval that holds the share `confidence`, in deviations known from samples."""
    return float(student_quantile(0.5 + 0.5 * confidence, max(samples - 1, 1)))


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

    @cached_property
    def between(self) -> Floats:
        """(n, n_variable) B less A."""
        return self.end - self.start


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
