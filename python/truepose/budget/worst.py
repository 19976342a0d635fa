"""Worst: the most that the unknown part of a deviation can do, to first order.

    half[c] = sum over variables of | sum over the variable's columns of sensitivity[c, k] half[k] |

A variable is one column, or a correlation group whose members move together with their signs;
every variable lies in [-1, 1], so the sum of absolute values is reached at a corner of the box.
"""

from __future__ import annotations

import numpy as np

from truepose.machine import Machine
from truepose.sources import Block, Deviation
from truepose.sources._base import Floats


def variable_effects(
    machine: Machine, block: Block, deviation: Deviation
) -> tuple[Floats, Floats, np.ndarray]:
    """First-order error of each variable at +1, about the shift.

    Returns effects (n, n_component, n_variable) over the variables that have a band, m and rad,
    the half band of each in standard deviations (n_variable,), and a kernel status (n,). The
    sensitivities are those of the nominal machine at the commanded pose.
    """
    banded = deviation.banded
    sensitivity, status = machine.kernel.sensitivity_at(
        block.joints, block.placements, deviation.parameters[banded]
    )
    effects: Floats = sensitivity * deviation.signed_half[:, np.newaxis, banded]
    numbers, variable = np.unique(deviation.variables[banded], return_inverse=True)
    sigmas = np.empty(numbers.size)
    sigmas[variable] = [deviation.distribution[column].sigmas for column in banded]
    if numbers.size < banded.size:
        member = np.zeros((banded.size, numbers.size))
        member[np.arange(banded.size), variable] = 1.0
        effects = effects @ member
    return effects, sigmas, status


def linear_half(effects: Floats) -> Floats:
    """(n, n_component) half width of the first-order error: every variable at its worst."""
    width: Floats = np.abs(effects).sum(axis=-1)
    return width


def worst(error: Floats, half: Floats) -> Floats:
    """(n, n_component) the most a source alone can do: |error at its shift| + half width."""
    most: Floats = np.abs(error) + half
    return most
