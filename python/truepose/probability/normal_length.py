"""The length of a normal vector about zero: what it keeps with a given probability."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.probability.quantiles import normal_quantile

_DEPTH = 8.0
"""Standard deviations of the shortest axis beyond which nothing is counted: 1e-15."""

_STEPS = 60
"""Of Newton's search at most; it takes about five."""

_SETTLED = 1e-12
"""Of the quantile: a step that ends the search."""


def length_quantile(covariance: ArrayLike, probability: float) -> Floats:
    """(n,) what |N(0, C)| keeps with `probability`, for covariances C (n, m, m), m from 0 to 3.

    Along the shortest axis by Gauss-Legendre quadrature, across it by the mean of Rayleigh's
    distribution function over directions, which is exact for a normal vector in a plane. Infinite
    where a variance is.
    """
    whole = np.asarray(covariance, np.float64)
    count, size = whole.shape[:2]
    if size > 3:
        raise ValueError(f"covariances of {size} components, expected 3 at most")
    quantile = np.full(count, np.inf)
    finite = np.isfinite(whole).all(axis=(1, 2))
    variances = np.zeros((int(finite.sum()), 3))
    variances[:, 3 - size :] = np.maximum(np.linalg.eigvalsh(whole[finite]), 0.0)
    quantile[finite] = _quantile(variances, probability)
    return quantile


def _quantile(variances: Floats, probability: float) -> Floats:
    """Of independent variances (n, 3), ascending."""
    scale = np.sqrt(variances[:, 2])
    unit = np.divide(variances, variances[:, 2:], out=np.zeros_like(variances), where=variances > 0)
    length = np.full(len(unit), float(normal_quantile(0.5 * (1.0 + probability))))
    of_plane = unit[:, 1] > 0.0
    if of_plane.any():
        length[of_plane] = _search(unit[of_plane], probability, float(length[0]))
    of_length: Floats = scale * length
    return of_length


def _search(variances: Floats, probability: float, along_line: float) -> Floats:
    """Of variances (n, 3) up to 1, upward from that `along_line`: the density falls from there."""
    length = np.full(len(variances), along_line)
    for _ in range(_STEPS):
        below, density = _distribution(variances, length)
        step = (probability - below) / density
        length = np.maximum(length + step, along_line)
        if np.abs(step).max() <= _SETTLED * along_line:
            break
    return length


def _distribution(variances: Floats, length: Floats) -> tuple[Floats, Floats]:
    """Distribution function and density (n,) at `length` (n,), of variances (n, 3) up to 1."""
    angles = (np.arange(_AROUND) + 0.5) * (0.5 * np.pi / _AROUND)
    across = (
        variances[:, 2:] * np.cos(angles) ** 2 + variances[:, 1:2] * np.sin(angles) ** 2
    )  # (n, a)
    shortest = np.sqrt(variances[:, :1])
    reach = np.minimum(_DEPTH, length[:, np.newaxis] / np.maximum(shortest, 1e-300))
    at = 0.5 * reach * (_NODES + 1.0)  # (n, k), of the positive half
    weight = reach * _WEIGHTS * np.exp(-0.5 * at**2) / np.sqrt(2.0 * np.pi)
    left = length[:, np.newaxis] ** 2 - (shortest * at) ** 2
    beyond = np.exp(-0.5 * left[:, :, np.newaxis] / across[:, np.newaxis, :])
    below = (weight * (1.0 - beyond.mean(axis=2))).sum(axis=1)
    density = length * (weight * (beyond / across[:, np.newaxis, :]).mean(axis=2)).sum(axis=1)
    return below, density


_AROUND = 48
"""Directions of a quarter of the plane; the mean over them converges faster than any power."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(48)

__all__ = ["length_quantile"]
