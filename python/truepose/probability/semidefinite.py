"""Whether correlations can all hold at once, and if not, which variables clash.

A matrix of correlations is positive semidefinite: else some sum of the variables would have a
negative variance. The eigenvector of the negative eigenvalue is such a sum.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Problem

ROUNDING = 1e-12
"""Of the number of variables: an eigenvalue so little below zero is zero."""

_CLASHING = 0.3
"""Of the largest entry of the eigenvector: from here on a variable takes part."""

_NAMED = 6
"""Variables that a message names; more are counted."""


def clash(names: Sequence[str], correlation: Floats) -> Problem | None:
    """Problem `correlation-not-semidefinite` of a symmetric (n, n) matrix; None where it is one."""
    if not names:
        return None
    values, vectors = np.linalg.eigh(correlation)
    least = float(values[0])
    if least >= -ROUNDING * len(names):
        return None
    size = np.abs(vectors[:, 0])
    part = [int(at) for at in np.flatnonzero(size > _CLASHING * size.max())]
    named = ", ".join(names[at] for at in part[:_NAMED])
    if len(part) > _NAMED:
        named += f" and {len(part) - _NAMED} more"
    pairs = sorted(combinations(part, 2), key=lambda pair: -abs(correlation[pair]))
    stated = ", ".join(
        f"{names[i]} with {names[j]} {correlation[i, j]:g}" for i, j in pairs[: _NAMED // 2]
    )
    return Problem(
        "correlation-not-semidefinite",
        f"the correlations of {named} cannot all hold at once",
        found=f"{stated}: the smallest eigenvalue of the matrix is {least:.3g}",
        expected="correlations whose matrix is positive semidefinite",
        hint=f"all of them times {_just_holds(least):.3g} would hold; or leave one out",
    )


def _just_holds(least: float) -> float:
    """By which all coefficients must be multiplied for a smallest eigenvalue of zero, rounded down.

    The matrix is 1 + C, and C has the eigenvalue `least` - 1.
    """
    return float(np.floor(1000.0 / (1.0 - least)) / 1000.0)
