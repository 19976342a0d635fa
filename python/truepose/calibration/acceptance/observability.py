"""What measurements see of a machine's unknowns: rank, indices, and covariance where there is one.

Rows are whitened: d(observed)/d(unknown) over the standard uncertainty of the observation, so that
one is a change as large as its noise. What belongs to instruments (frames, targets, biases) is
projected out first, so that all that is said here is of the machine's unknowns alone.
`docs/calibration_gate.md` has the formulas and references.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.calibration.least_squares import (
    column_basis,
    column_norms,
    singular_decomposition,
)
from truepose.representation import Represented

RANK_TOLERANCE = 1e-9
"""Of the largest singular value of the columns scaled to length one, or of one if that is larger:
below it nothing is seen."""
UNSEEN = 1e-6
"""An unknown of which one prior standard deviation moves no observation by so much of its noise is
not seen at all."""
ROUNDED = 1e-12
"""A column without a prior that is so much shorter than the longest is rounding."""
TOUCHED = 1e-6
"""A unit direction, in columns of length one, has a part in an unknown if it is larger."""

Scaling = Literal["prior", "column"]


@dataclass(frozen=True, eq=False)
class WhitenedRows:
    """Whitened rows of the machine's unknowns.

    `matrix` (k, n); `lengths` (n,) of its columns before anything was projected out of them, zero
    for an unknown that no row sees.
    """

    matrix: Floats
    lengths: Floats


@dataclass(frozen=True, eq=False)
class RowCovariance:
    """What rows determine: the covariance is `root @ root.T` off the `null` directions.

    `root` (n, r); `null` (k, n): directions that no row sees, in the unknowns' units, orthonormal
    where these are multiplied by `lengths` (n,).
    """

    root: Floats
    null: Floats
    lengths: Floats

    @property
    def rank(self) -> int:
        """How many directions are determined."""
        return int(self.root.shape[1])

    def standard(self) -> Floats:
        """Standard uncertainty (n,), inf where a null direction has a part in the unknown."""
        deviations: Floats = np.sqrt(np.einsum("ij,ij->i", self.root, self.root))
        touched = (np.abs(self.null * self.lengths) > TOUCHED).any(axis=0)
        return np.where(touched, np.inf, deviations)


@dataclass(frozen=True, repr=False)
class Observability(Represented):
    """Rank, singular values and the five indices over what is seen.

    `singular` (n,): of the Jacobian with its columns multiplied by the prior standard deviations
    (`scaling` "prior") or divided by their lengths ("column"), largest first, zero beyond `rank`.
    `directions` (n, n): their unknowns, one row each, in that scale. `unit` (n,): the scale.
    """

    scaling: Scaling
    rank: int
    singular: Floats
    directions: Floats
    unit: Floats
    o1: float
    o2: float
    o3: float
    o4: float
    o5: float

    @property
    def n_null(self) -> int:
        """How many directions no observation sees."""
        return self.singular.size - self.rank

    @property
    def condition(self) -> float:
        """Largest over smallest singular value; inf where a direction is not seen."""
        if self.n_null or self.rank == 0:
            return float("inf")
        return float(self.singular[0] / self.singular[-1])


def weighted(jacobian: ArrayLike, weights: ArrayLike | None = None) -> Floats:
    """Whitened rows (m, n) by the square roots of robust weights (m,), from 0 to 1."""
    rows = np.asarray(jacobian, np.float64)
    if weights is None:
        return rows
    return np.sqrt(np.asarray(weights, np.float64))[:, np.newaxis] * rows


def project_out_instruments(
    rows: ArrayLike, n_machine: int, unit: Floats | None = None
) -> WhitenedRows:
    """Rows (m, n) of all unknowns with those after the first `n_machine` projected out.

    What is left of the machine's columns is what no change of the instruments' unknowns can
    imitate: the Schur complement of the normal equations. `unit` (n_machine,): prior standard
    deviations, inf where there is none.
    """
    whole = np.asarray(rows, np.float64)
    machine, of_instruments = whole[:, :n_machine].copy(), whole[:, n_machine:]
    lengths = column_norms(machine)
    lengths[_unseen(lengths, unit)] = 0.0
    machine[:, lengths == 0.0] = 0.0
    if of_instruments.shape[1]:
        basis = column_basis(_of_length_one(of_instruments), RANK_TOLERANCE)
        for _ in range(2):  # the second takes away what rounding left of the first
            machine -= basis @ (basis.T @ machine)
    return WhitenedRows(machine, lengths)


def _unseen(lengths: Floats, unit: Floats | None) -> Flags:
    known = np.isfinite(unit) if unit is not None else np.zeros(lengths.size, np.bool_)
    effect = lengths * np.where(known, unit, 1.0) if unit is not None else lengths
    dead: Flags = np.where(known, effect < UNSEEN, lengths <= ROUNDED * lengths.max(initial=0.0))
    return dead


def prior_rows(covariance: ArrayLike) -> Floats:
    """Rows (k, n), whitened, that say what a prior covariance (n, n) says.

    A diagonal of inf is an unknown without a prior. What the prior takes for exactly known is
    known to 1e-6 of its own standard deviation.
    """
    whole = np.asarray(covariance, np.float64)
    known, sigma, values, vectors = _principal(whole)
    rows = np.zeros((known.size, len(whole)))
    rows[:, known] = (vectors / np.sqrt(np.maximum(values, 1e-12))).T / sigma
    return rows


def covariance_root(covariance: ArrayLike) -> Floats:
    """(n, k) with covariance = root root^T over the finite variances, 0 elsewhere."""
    whole = np.asarray(covariance, np.float64)
    known, sigma, values, vectors = _principal(whole)
    root = np.zeros((len(whole), known.size))
    root[known] = sigma[:, np.newaxis] * vectors * np.sqrt(np.maximum(values, 0.0))
    return root


def _principal(covariance: Floats) -> tuple[Indices, Floats, Floats, Floats]:
    """Which of n have a finite variance, their k deviations; eigenvalues and vectors.

    The eigenvalues (k,) and vectors (k, k) are those of the correlation matrix, so that no unit
    matters. What is exact has the deviation 1 and the eigenvalue 0.
    """
    known = np.flatnonzero(np.isfinite(np.diagonal(covariance)))
    part = covariance[np.ix_(known, known)]
    sigma = np.sqrt(np.diagonal(part))
    sigma = np.where(sigma > 0.0, sigma, 1.0)
    values, vectors = np.linalg.eigh(part / np.outer(sigma, sigma))
    return known, sigma, values, vectors


def stacked(*parts: WhitenedRows) -> WhitenedRows:
    """Rows of several sources of knowledge as one."""
    lengths: Floats = np.sqrt(np.sum([part.lengths**2 for part in parts], axis=0))
    return WhitenedRows(np.vstack([part.matrix for part in parts]), lengths)


def prior(covariance: ArrayLike) -> WhitenedRows:
    """A prior covariance (n, n) as rows."""
    matrix = prior_rows(covariance)
    return WhitenedRows(matrix, column_norms(matrix))


def row_covariance(rows: WhitenedRows) -> RowCovariance:
    """Covariance and null directions of whitened rows."""
    # An unknown that no row sees is weighed as the others are: whitened columns are far from one.
    of_seen = rows.lengths[rows.lengths > 0.0]
    usual = float(np.median(of_seen)) if of_seen.size else 1.0
    lengths = np.where(rows.lengths > 0.0, rows.lengths, usual)
    singular, right = singular_decomposition(rows.matrix / lengths)
    # Where instruments imitate everything, what is left is rounding of columns of length one.
    seen = singular > RANK_TOLERANCE * singular.max(initial=1.0)
    root: Floats = (right[seen] / singular[seen, np.newaxis] / lengths).T
    return RowCovariance(root, right[~seen] / lengths, lengths)


def observability(
    rows: WhitenedRows, n_observation: int, prior_standard: ArrayLike | None = None
) -> Observability:
    """Rank, singular values and indices O1-O5 of the machine's whitened rows.

    `n_observation`: m of O1, the rows that were measured. `prior_standard` (n,): the scale where
    all are finite and above zero; else columns are scaled to length one. The rank is always that of
    columns scaled by their lengths before instruments were projected out, relative to
    `RANK_TOLERANCE`, so that it does not depend on units or priors.

    O1 of Borm & Menq (1991), O2 of Driels & Pathre (1990), O3 of Nahvi, Hollerbach & Hayward
    (1994), O4 of Nahvi & Hollerbach (1996), O5 of Sun & Hollerbach (2008), each over the singular
    values that are seen.
    """
    n = rows.lengths.size
    standard = np.full(n, np.inf) if prior_standard is None else np.asarray(prior_standard, float)
    by_prior = n > 0 and bool((np.isfinite(standard) & (standard > 0.0)).all())
    inverse = 1.0 / np.where(rows.lengths > 0.0, rows.lengths, 1.0)
    rank = row_covariance(rows).rank
    unit = standard if by_prior else inverse
    singular, right = singular_decomposition(rows.matrix * unit)
    singular[rank:] = 0.0
    seen = singular[:rank]
    o1 = o2 = o3 = o4 = o5 = 0.0
    if rank and (seen > 0.0).all():
        largest, smallest = float(seen[0]), float(seen[-1])
        o1 = float(np.exp(np.log(seen).mean())) / float(np.sqrt(max(n_observation, 1)))
        o2, o3, o4 = smallest / largest, smallest, smallest**2 / largest
        o5 = 1.0 / float((1.0 / seen).sum())
    scaling: Scaling = "prior" if by_prior else "column"
    return Observability(scaling, rank, singular, right, unit, o1, o2, o3, o4, o5)


def share(after: ArrayLike, prior_standard: ArrayLike, *, use_prior: bool) -> Floats:
    """How much of each unknown came from the data (n,): 1 - variance after / prior variance.

    Without a prior, or where it was not used: 1 where the data determine the unknown, else 0.
    """
    posterior = np.asarray(after, np.float64)
    before = np.asarray(prior_standard, np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = 1.0 - (posterior / before) ** 2
    determined = np.isfinite(posterior).astype(np.float64)
    if not use_prior:
        return determined
    return np.where(np.isfinite(before), np.clip(shares, 0.0, 1.0), determined)


def fitted(rows: Floats, held: Floats) -> float:
    """How many degrees of freedom whitened `rows` (m, n) give up to the fit.

    `held` (k, n): rows of the prior. Without it the rank; with it the trace of the matrix that
    turns measurements into fitted ones.
    """
    basis = column_basis(_of_length_one(np.vstack([rows, held])), RANK_TOLERANCE)
    return float(np.sum(basis[: len(rows)] ** 2))


def _of_length_one(matrix: Floats) -> Floats:
    """The matrix with its columns divided by their lengths; a column of zeros stays."""
    lengths = column_norms(matrix)
    return np.asarray(matrix / np.where(lengths > 0.0, lengths, 1.0))


def normalised_rms(residual: Floats, weights: Floats, degrees: float) -> float:
    """Root mean square of weighted residuals over their degrees of freedom; NaN with none."""
    if degrees < 0.5:
        return float("nan")
    return float(np.sqrt(np.sum((weights * residual) ** 2) / degrees))
