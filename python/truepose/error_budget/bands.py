"""Bands that the kernel's budget leaves to the effects of each variable.

Where all variables are independent and lie in [-1, 1] the kernel needs no sensitivities in between
(`in_kernel`). What is correlated, a direction that is not known and listed values that are not
symmetric are worked out here, from what each variable does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.error_budget import propagation, worst
from truepose.error_budget.largest import largest
from truepose.machine import Machine
from truepose.runs.first_order import effects_at, rows_of
from truepose.runs.variables import Variables
from truepose.sources import Deviation, PoseBlock

FEW = 1024
"""Poses whose sensitivities to every parameter stay in the cache together."""


def of_source(
    machine: Machine,
    block: PoseBlock,
    deviation: Deviation,
    error: Floats,
    kinds: Sequence[Indices],
) -> tuple[dict[str, Floats], np.ndarray]:
    """What the band of one source does about its `error` (n, n_component), and a status (n,).

    Of the budget `worst`, `reach` and `uncertainty` (n, n_component), m and rad, and `largest`
    (n, n_quantity).
    """
    n_pose = block.indices.size
    down = np.zeros((n_pose, len(machine.components)))
    up, uncertain = np.zeros_like(down), np.zeros_like(down)
    far, status = np.empty((n_pose, len(kinds))), np.empty(n_pose, np.uint8)
    correlation = deviation.banded_correlation
    for start in range(0, n_pose, FEW):
        poses = slice(start, start + FEW)
        effects, sigmas, status[poses] = worst.variable_effects(machine, block, deviation, poses)
        far[poses] = largest(error[poses], effects, deviation.domain, kinds).length
        # Sizes first, then their squares, in the one place; what is correlated keeps its signs.
        scratch = effects if correlation is None else None
        down[poses], up[poses] = deviation.domain.reach(effects, scratch)
        uncertain[poses] = propagation.standard_uncertainty(
            effects, sigmas, scratch=effects, correlation=correlation
        )
    return {
        "worst": worst.worst(error, (down, up)),
        "reach": np.maximum(down, up),
        "uncertainty": uncertain,
        "largest": far,
    }, status


def of_all(
    machine: Machine,
    block: PoseBlock,
    variables: Variables,
    error: Floats,
    kinds: Sequence[Indices],
) -> tuple[Floats, np.ndarray]:
    """The largest lengths (n, n_quantity) with all `variables`, and the kernel's status (n,).

    From the `error` (n, n_component) where all of them are 0.
    """
    n_pose = block.indices.size
    far, status = np.empty((n_pose, len(kinds))), np.empty(n_pose, np.uint8)
    parameters, shift = variables.shift
    for start in range(0, n_pose, FEW):
        poses = slice(start, start + FEW)
        moved = (parameters, np.ascontiguousarray(rows_of(shift, poses)))
        effects, status[poses] = effects_at(machine, block, variables, moved, poses)
        far[poses] = largest(error[poses], effects, variables.domain, kinds).length
    return far, status


__all__ = ["of_all", "of_source"]
