"""The smallest largest residual of linear equations, exactly: the exchange of E. Stiefel.

    minimise over x   max over i |values_i - sum over k columns_ki x_k|

k + 1 equations, the reference, have residuals of one size and of the signs that make it the
smallest that these alone allow (Chebyshev's alternation, of any columns). It is below that of all
equations; the equation that is worst takes the place of one of them, by the ratio test of the dual
simplex method, so that the level never falls, until nothing is worse. E. Stiefel, Note on Jordan
elimination, linear programming and Tchebycheff approximation, Numerische Mathematik 2 (1960) 1-17.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices

_PATIENT = 40
"""Exchanges after which the first that is too far comes in, not the worst: R. G. Bland's rule,
which cannot come round in a circle where several points of a reference lie on one line."""

_MOST = 2000
"""Exchanges; a set of 360 takes some ten."""

_FLAT = 1e-9
"""Components of a direction of the ratio test below this part of the largest are rounding."""

_SLACK = 1e-10
"""What a weight, of weights whose sum is 1, may be below zero: so much lower may the level be, of
the largest residual. It leaves a choice among ratios that are nearly the least, of which the one of
the largest component is taken (P. M. J. Harris, Pivot selection methods of the Devex LP code,
Mathematical Programming 5 (1973) 1-28): of points at one place, the one that they stand for."""


@dataclass(frozen=True, eq=False)
class Reference:
    """The k + 1 equations that hold the level, of each sample: `index` and `sign` (s, k + 1)."""

    index: Indices
    sign: Floats

    def of(self, samples: Indices | slice) -> Reference:
        """That of some samples."""
        return Reference(self.index[samples], self.sign[samples])


def first_reference(columns: Floats) -> Reference:
    """A reference of equations that are independent as far as may be; `columns` (k, n).

    k of them by elimination with the largest pivot, and the one that all of these take part in.
    """
    rest, chosen = columns.T.copy(), []
    for _ in range(len(columns)):
        pivot = int(np.argmax(np.einsum("nk,nk->n", rest, rest)))
        chosen.append(pivot)
        direction = rest[pivot] / np.linalg.norm(rest[pivot])
        rest -= np.outer(rest @ direction, direction)
    combination = np.linalg.solve(columns[:, chosen], columns)
    combination[:, chosen] = 0.0
    last = int(np.argmax(np.abs(combination).min(axis=0) + 1e-6 * np.abs(combination).sum(axis=0)))
    sign = np.where(combination[:, last] > 0.0, -1.0, 1.0)
    return Reference(np.array([[*chosen, last]]), np.array([[*sign, 1.0]]))


def chebyshev(
    columns: Floats, values: Floats, reference: Reference, tolerance: float
) -> tuple[Floats, Reference]:
    """x (s, k) of each sample, and the reference at the end; `columns` (k, s, n), `values` (s, n).

    Ends where no residual is above the level by more than `tolerance`, m.
    """
    samples = np.arange(len(values))
    solution = np.empty((len(values), len(columns)))
    index, sign = reference.index.copy(), reference.sign.copy()
    # Signs of a reference that was one of other columns: weights below zero turn round.
    combination = np.linalg.inv(_basis(columns, index, sign))[:, -1, :]
    sign[combination < 0.0] *= -1.0
    left, last_index, last_sign = samples, index.copy(), sign.copy()
    for step in range(_MOST):
        rows = np.arange(len(left))[:, np.newaxis]
        basis = _basis(columns, index, sign)
        inverse: Floats = np.asarray(np.linalg.inv(basis), np.float64)
        right = sign * values[rows, index]
        x = np.einsum("sij,sj->si", inverse, right)
        x += np.einsum("sij,sj->si", inverse, right - np.einsum("sij,sj->si", basis, x))
        fallen = x[:, -1] < 0.0
        sign[fallen] *= -1.0
        inverse[fallen, :-1] *= -1.0
        level = np.abs(x[:, -1])
        residual = values.copy()
        for k, column in enumerate(columns):
            residual -= column * x[:, k, np.newaxis]
        size = np.abs(residual)
        size[rows, index] = 0.0  # at the level, but for rounding
        if step < _PATIENT:
            worst = np.argmax(size, axis=1)
        else:
            worst = np.argmax(size > (level + tolerance)[:, np.newaxis], axis=1)
        above = size[rows[:, 0], worst] > level + tolerance
        solution[left] = x[:, :-1]
        last_index[left], last_sign[left] = index, sign
        if not above.any():
            return solution, Reference(last_index, last_sign)
        if not above.all():
            left, index, sign, inverse = left[above], index[above], sign[above], inverse[above]
            columns, values, worst = columns[:, above], values[above], worst[above]
            residual = residual[above]
        _exchange(index, sign, inverse, columns, residual, worst, patient=step < _PATIENT)
    raise RuntimeError("no minimum zone was found")


def _basis(columns: Floats, index: Indices, sign: Floats) -> Floats:
    """(s, k + 1, k + 1) rows of the reference's equations, for x and the level."""
    rows = np.arange(len(index))[:, np.newaxis]
    basis = np.ones((len(index), index.shape[1], index.shape[1]))
    for k, column in enumerate(columns):
        basis[:, :, k] = sign * column[rows, index]
    return basis


def _exchange(
    index: Indices,
    sign: Floats,
    inverse: Floats,
    columns: Floats,
    residual: Floats,
    worst: Indices,
    *,
    patient: bool,
) -> None:
    """Put the equation `worst` (s,) in the place of the one that the ratio test names."""
    rows = np.arange(len(worst))
    entering = np.where(residual[rows, worst] < 0.0, -1.0, 1.0)
    row = np.ones((len(worst), len(columns) + 1))
    for k, column in enumerate(columns):
        row[:, k] = entering * column[rows, worst]
    direction = np.einsum("si,sij->sj", row, inverse)
    usable = direction > _FLAT * np.abs(direction).max(axis=1, keepdims=True)
    weight = np.maximum(inverse[:, -1, :], 0.0)
    divisor = np.where(usable, direction, 1.0)
    ratio = np.where(usable, weight / divisor, np.inf)
    if patient:
        most = np.where(usable, (weight + _SLACK) / divisor, np.inf).min(axis=1, keepdims=True)
        place = np.argmax(np.where(ratio <= most, direction, 0.0), axis=1)
    else:  # of those that are as good, the first of all equations: the other half of Bland's rule
        least = ratio.min(axis=1, keepdims=True)
        place = np.argmin(np.where(ratio <= least, index, np.iinfo(np.intp).max), axis=1)
    index[rows, place] = worst
    sign[rows, place] = entering
