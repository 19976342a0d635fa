"""Worst: the most that the unknown part of a deviation can do, to first order.

    half[c] = sum over variables of | sum over the variable's columns of sensitivity[c, k] half[k] |

A variable is one column, or a correlation group whose members move together with their signs;
every variable lies in [-1, 1], so the sum of absolute values is reached at a corner of the box.
"""

from __future__ import annotations

import numpy as np

from truepose.machine import Machine
from truepose.sources import Block, Deviation
from truepose.sources._base import Floats, Indices

EVERY = slice(None)
"""All poses of a block."""


def variable_effects(
    machine: Machine, block: Block, deviation: Deviation, poses: slice = EVERY
) -> tuple[Floats, Floats, np.ndarray]:
    """First-order error of each variable at +1, about the shift, at some poses of the block.

    Returns effects (n, n_component, n_variable) over the variables that have a band, m and rad,
    the half band of each in standard deviations (n_variable,), and a kernel status (n,). The
    sensitivities are those of the nominal machine at the commanded pose.
    """
    banded = deviation.banded
    sensitivity, status = machine.kernel.sensitivity_at(
        block.joints[poses], block.placements[poses], deviation.parameters[banded]
    )
    effects, variable = by_variable(deviation, sensitivity, poses)
    sigmas = np.empty(effects.shape[2])
    sigmas[variable] = [deviation.distribution[column].sigmas for column in banded]
    return effects, sigmas, status


def by_variable(
    deviation: Deviation, slopes: Floats, poses: slice = EVERY
) -> tuple[Floats, Indices]:
    """What each variable does at +1, from `slopes` (n, m, n_banded) per unit of a banded column.

    `poses` are those of the deviation that the slopes belong to. `slopes` are written over: there
    is seldom room for two of them in the cache.

    Returns effects (n, m, n_variable), and the variable of each banded column (n_banded,).
    """
    banded = deviation.banded
    half = deviation.signed_half
    if len(half) > 1:
        half = half[poses]
    if banded.size < half.shape[1]:
        half = half[:, banded]
    effects: Floats = np.multiply(slopes, half[:, np.newaxis], out=slopes)
    numbers, variable = np.unique(deviation.variables[banded], return_inverse=True)
    if numbers.size < banded.size:
        member = np.zeros((banded.size, numbers.size))
        member[np.arange(banded.size), variable] = 1.0
        effects = effects @ member
    return effects, np.asarray(variable, np.intp)


def linear_half(effects: Floats, scratch: Floats | None = None) -> Floats:
    """(n, n_component) half width of the first-order error: every variable at its worst.

    `scratch`: where what is on the way may go, such as `effects` itself.
    """
    # A product with ones, which is several times as quick as a sum along a short axis.
    width: Floats = np.abs(effects, out=scratch) @ np.ones(effects.shape[-1])
    return width


def worst(error: Floats, half: Floats) -> Floats:
    """(n, n_component) the most a source alone can do: |error at its shift| + half width."""
    most: Floats = np.abs(error) + half
    return most
