"""Terms of next order in the law of propagation, for plain functions (GUM, JCGM 100:2008, 5.1.2).

    u^2 = sum over i of f_i^2 u_i^2 + sum over i, j of (1/2 f_ij^2 + f_i f_ijj) u_i^2 u_j^2

the second sum being the note's, for independent inputs of normal distribution. Inputs that are
correlated are first written as independent ones: s = L z with L L^T their correlation.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from truepose.arrays import Floats
from truepose.uncertainty_analysis.model import FunctionModel, LinearModel

Function = Callable[[Floats], Floats]
"""Outputs (s, m) of independent variables (s, n) in standard uncertainties."""

STEP = 0.125
"""Longer step of the differences, in standard uncertainties: well inside every band."""

NOISE = 64.0
"""Rounding of a difference, in units of the last place of what is subtracted."""


def second_order_uncertainty(model: FunctionModel, law: LinearModel) -> Floats:
    """(m,) standard uncertainty with the terms of next order; NaN where they are not finite."""
    sigmas = np.array([distribution.sigmas for distribution in model.distributions])
    mix = np.eye(sigmas.size)
    if model.correlation is not None:
        values, vectors = np.linalg.eigh(model.correlation)
        mix = vectors * np.sqrt(np.maximum(values, 0.0))

    def at(z: Floats) -> Floats:
        outputs, fine = model.evaluate((z @ mix.T) / sigmas)
        return np.where(fine[:, np.newaxis], outputs, np.nan)

    slopes = (law.effects / sigmas) @ mix
    with np.errstate(invalid="ignore", over="ignore"):
        second, third = _derivatives(at, sigmas.size)
        terms = 0.5 * np.square(second).sum(axis=(0, 1))
        terms += np.einsum("mi,ijm->m", slopes, third)
        return np.asarray(np.sqrt(np.maximum(np.square(slopes).sum(axis=1) + terms, 0.0)))


def _derivatives(at: Function, n: int) -> tuple[Floats, Floats]:
    """f_ij and f_ijj, both (n, n, m), at 0: central differences of two steps, extrapolated."""
    coarse, fine = (_differences(at, n, step) for step in (STEP, 0.5 * STEP))
    size = fine[2] * NOISE * np.finfo(np.float64).eps
    terms = []
    for order, (longer, shorter) in enumerate(zip(coarse[:2], fine[:2], strict=True), start=2):
        value = (4.0 * shorter - longer) / 3.0
        terms.append(np.where(np.abs(value) <= size / (0.5 * STEP) ** order, 0.0, value))
    return terms[0], terms[1]


def _differences(at: Function, n: int, step: float) -> tuple[Floats, Floats, Floats]:
    """f_ij, f_ijj (n, n, m) by central differences of one step, and the largest |f| met (m,)."""
    unit = step * np.eye(n)
    centre = at(np.zeros((1, n)))[0]
    up, down = at(unit), at(-unit)
    twice = at(2.0 * unit) - at(-2.0 * unit)
    second = np.empty((n, n, centre.size))
    third = np.empty_like(second)
    largest = np.abs(np.concatenate([up, down, centre[np.newaxis]])).max(axis=0, initial=0.0)
    for i in range(n):
        # (n, m) each: the corners of the squares of i with every j; j = i is put right below.
        pp, pm = at(unit[i] + unit), at(unit[i] - unit)
        mp, mm = at(-unit[i] + unit), at(-unit[i] - unit)
        second[i] = (pp - pm - mp + mm) / (4.0 * step**2)
        third[i] = ((pp - 2.0 * up[i] + pm) - (mp - 2.0 * down[i] + mm)) / (2.0 * step**3)
        second[i, i] = (up[i] - 2.0 * centre + down[i]) / step**2
        third[i, i] = (twice[i] - 2.0 * (up[i] - down[i])) / (2.0 * step**3)
    return second, third, largest
