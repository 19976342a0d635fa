"""The law of propagation of uncertainty (GUM, JCGM 100:2008, 5.1.2, 5.2.2, annex G).

    u[c]^2 = sum over variables of (effect[c] / sigmas)^2

where the effect is the first-order error of the variable at the end of its band, and `sigmas` that
band in standard deviations: sqrt(3) for a uniform distribution (GUM 4.3.7), k for a normal one.
Within a correlation group the members add with their signs before the square is taken; variables
i and j that a coefficient r correlates add 2 r (effect / sigmas)_i (effect / sigmas)_j (5.2.2).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.probability.quantiles import normal_quantile, student_quantile


def standard_uncertainty(
    effects: Floats,
    sigmas: Floats,
    scratch: Floats | None = None,
    *,
    correlation: Floats | None = None,
) -> Floats:
    """(n, n_component) from effects (n, n_component, n_variable) and sigmas (n_variable,).

    `correlation` (n_variable, n_variable) of the variables, None where they are independent.
    `scratch`: where what is on the way may go, such as `effects` itself.
    """
    if correlation is None:
        combined: Floats = np.sqrt(np.square(effects, out=scratch) @ sigmas**-2.0)
        return combined
    standard: Floats = np.divide(effects, sigmas, out=scratch)
    squares = np.einsum("ncv,ncv->nc", standard @ correlation, standard)
    # What cancels leaves rounding, of either sign.
    return np.asarray(np.sqrt(np.maximum(squares, 0.0)))


MANY = 1e9
"""Degrees of freedom from which on Student's quantiles are the normal ones to 1e-9: no end."""


@dataclass(frozen=True)
class Combined:
    """The law of propagation, per output.

    `standard_uncertainty` (n, m), `covariance` (n, m, m); `dof` (n, m): effective degrees of
    freedom, NaN where there is no such number. `scale` and `scale_dof` (n, m): the interval is
    Student's quantile for `scale_dof` times `scale`. That is the standard uncertainty where the
    degrees of freedom are of its estimate; where they are of Student variables, the scale of the
    Student distribution that has it for its standard deviation.
    """

    standard_uncertainty: Floats
    covariance: Floats
    dof: Floats
    scale: Floats
    scale_dof: Floats


def combine(
    effects: Floats,
    sigmas: Floats,
    correlation: Floats | None = None,
    dofs: Floats | None = None,
    scales: Floats | None = None,
) -> Combined:
    """The law of propagation for effects (n, m, v), of variables with `dofs` (v,), default inf.

    u[c, d] = sum over i, j of a[c, i] r[i, j] a[d, j] with a = effect / sigmas (GUM 5.2.2, H.2.3),
    and s[c]^4 / dof[c] = sum of s_i[c]^4 / dof_i (G.2b), with s_i = `scales` (v,) u_i: the formula
    is for what a readings' standard deviation estimates, which is the scale of a Student variable
    and not its standard deviation (G.3.2). It is for independent variables (G.4.1). Where some of
    finite degrees are correlated there are no effective ones, and the interval takes them as one
    variable with the fewest degrees among them, which it is where they are wholly correlated.
    """
    standard = effects / sigmas
    weighed = standard if correlation is None else standard @ correlation
    covariance = weighed @ standard.transpose(0, 2, 1)
    covariance = 0.5 * (covariance + covariance.transpose(0, 2, 1))
    variance = np.maximum(np.einsum("ncc->nc", covariance), 0.0)
    size = np.sqrt(variance)
    dof = np.full(variance.shape, math.inf)
    if dofs is None or not np.isfinite(dofs).any():
        return Combined(size, covariance, dof, size, dof)
    if scales is not None:
        standard = standard * scales
        weighed = standard if correlation is None else standard @ correlation
    square = np.maximum((weighed * standard).sum(axis=2), 0.0)
    sets = _correlated_sets(len(dofs), correlation)
    member = (sets[:, np.newaxis] == np.unique(sets)).astype(np.float64)
    fewest = np.array([dofs[column > 0.0].min() for column in member.T])
    parts = np.square((weighed * standard) @ member) / fewest
    fourth, whole = parts.sum(axis=2), np.square(square)
    scale_dof = dof.copy()
    # Compared by a product: where parts of finite degrees are next to nothing, so is their sum.
    np.divide(whole, fourth, out=scale_dof, where=fourth * MANY > whole)
    correlated = (member.sum(axis=0) > 1.0) & np.isfinite(fewest)
    undefined = parts[..., correlated].sum(axis=2) * MANY > whole
    # Of one Student variable sqrt((dof - 2) / dof), of many next to one: a sum of them is normal.
    student = np.zeros(len(dofs)) if scales is None else (scales < 1.0).astype(np.float64)
    of_students = parts[..., student @ member > 0.0].sum(axis=2)
    share = np.divide(of_students, whole, out=np.zeros_like(whole), where=whole > 0.0)
    scale = size * np.sqrt(1.0 - 2.0 * share)
    return Combined(size, covariance, np.where(undefined, np.nan, scale_dof), scale, scale_dof)


def _correlated_sets(count: int, correlation: Floats | None) -> Indices:
    """(v,) the first variable of each one's set: those that coefficients link, however far."""
    if correlation is None:
        return np.arange(count)
    linked = (correlation != 0.0) | np.eye(count, dtype=np.bool_)
    first = np.arange(count)
    while True:
        nearest = np.where(linked, first, count).min(axis=1)
        if np.array_equal(nearest, first):
            return first
        first = nearest


def coverage_factor(dof: Floats, probability: float) -> Floats:
    """k of Student's distribution for `dof`, any shape; inf: of the normal one (GUM G.3.2)."""
    # One number of degrees of freedom at a time: there are few.
    factor = np.full(dof.shape, float(normal_quantile(0.5 + 0.5 * probability)))
    for degrees in np.unique(dof[np.isfinite(dof)]):
        factor[dof == degrees] = student_quantile(0.5 + 0.5 * probability, float(degrees))
    return factor
