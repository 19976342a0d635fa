"""Correlated variables of any distribution, drawn through normal ones (a Gaussian copula).

    t_i = Q_i(Phi(z_i)),  z normal, of unit variance and correlation `latent`

Q_i is the quantile function of the variable's distribution, Phi the normal distribution function.
The correlation stated is that of the variables themselves (Pearson's); `latent` is what z must have
so that the variables come to it (`joint_normal`). For normal variables the two are one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.probability.distributions import Distribution
from truepose.probability.joint_normal import normal_correlation
from truepose.probability.quantiles import normal_cdf

NORMAL = "normal"

ROUNDING = 1e-5
"""An eigenvalue of the latent correlation so little below zero is zero: integrals are that good."""

CLASHING = 0.3
"""Of the largest entry of its eigenvector: from here on a variable takes part."""

_U_LEAST = 2.0**-53
"""Nearest that a probability comes to 0 and 1, where a quantile may be infinite."""


@dataclass(frozen=True)
class Copula:
    """The k variables of a set that are correlated with another one of it.

    `linked` (k,): their numbers in the set. `latent` (k, k): correlation of the normal z.
    """

    linked: Indices
    distributions: tuple[Distribution, ...]
    latent: Floats

    @classmethod
    def of(
        cls,
        distributions: Sequence[Distribution],
        correlation: Floats | None,
        names: Sequence[str] | None = None,
    ) -> Copula:
        """From `correlation` (n_variable, n_variable), positive semidefinite; None: independent.

        Raises `RequestError` (correlation-out-of-reach) where two distributions cannot have the
        coefficient stated, whatever joins them, or some of them not all of theirs at once.
        """
        if correlation is None:
            return cls(np.empty(0, np.intp), (), np.empty((0, 0)))
        off = correlation - np.diag(np.diag(correlation))
        linked = np.flatnonzero((off != 0.0).any(axis=0))
        chosen = tuple(distributions[index] for index in linked.tolist())
        labels = [names[index] if names else str(index) for index in linked.tolist()]
        stated = correlation[np.ix_(linked, linked)]
        return cls(linked, chosen, _latent(chosen, stated, labels))

    @cached_property
    def factor(self) -> Floats:
        """(k, k) F with F F' = latent, so that z = F e of independent e; symmetric."""
        values, vectors = np.linalg.eigh(self.latent)
        root: Floats = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        return root

    def variables(self, normals: Floats) -> Floats:
        """(s, k) variables t from z (s, k)."""
        variables = np.empty_like(normals)
        for column, distribution in enumerate(self.distributions):
            variables[:, column] = shaped(distribution, normals[:, column])
        return variables


def shaped(distribution: Distribution, normals: Floats) -> Floats:
    """Values of the variable t, of `distribution`, from unit normal ones of the same rank."""
    if distribution.name == NORMAL:
        scaled: Floats = normals / distribution.sigmas
        return scaled
    below = np.clip(normal_cdf(normals), _U_LEAST, 1.0 - _U_LEAST)
    return distribution.quantile(below)


def _latent(distributions: Sequence[Distribution], stated: Floats, names: Sequence[str]) -> Floats:
    """(k, k) correlation of z that gives the variables the correlation `stated` (k, k)."""
    if all(distribution.name == NORMAL for distribution in distributions):
        return stated
    latent = np.eye(len(stated))
    for i in range(len(stated)):
        for j in range(i):
            latent[i, j] = latent[j, i] = normal_correlation(
                distributions[j], distributions[i], float(stated[j, i]), (names[j], names[i])
            )
    return _semidefinite(latent, stated, names)


def _semidefinite(matrix: Floats, stated: Floats, names: Sequence[str]) -> Floats:
    """The matrix, or where rounding left it indefinite, the next one that is not.

    Raises `RequestError` (correlation-out-of-reach) where it is more than rounding: another matrix
    would give the variables other correlations than those stated.
    """
    values, vectors = np.linalg.eigh(matrix)
    least = values.min(initial=0.0)
    if least >= 0.0:
        return matrix
    if least < -ROUNDING:
        size = np.abs(vectors[:, 0])
        part = np.flatnonzero(size > CLASHING * size.max()).tolist()
        raise RequestError(
            Problem(
                "correlation-out-of-reach",
                "variables of these distributions cannot have all these correlations at once",
                found=", ".join(
                    f"{names[i]} with {names[j]} {stated[i, j]:g}" for i, j in combinations(part, 2)
                ),
                expected="correlations that functions of correlated normal variables can have",
                hint="give them one distribution, or smaller coefficients",
            )
        )
    lifted = (vectors * np.maximum(values, 0.0)) @ vectors.T
    size = np.sqrt(np.diag(lifted))
    correlation: Floats = lifted / np.outer(size, size)
    return correlation
