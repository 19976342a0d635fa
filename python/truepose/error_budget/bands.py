"""Bands: what the variables of a source, or of all, can do to the error at a pose, to first order.

Where all of them are independent and lie in [-1, 1] the kernel answers in one call, without the
sensitivities in between (`crates/kernel/src/batch/band.rs`). What is correlated, a direction that
is not known and listed values that are not symmetric go by the effects of each variable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.error_budget import propagation, worst
from truepose.error_budget.largest import largest, lengths
from truepose.machine import Machine
from truepose.probability.distributions import Distribution
from truepose.probability.domain import Domain
from truepose.runs.displacement import ParameterDeviation, sum_deviations
from truepose.runs.first_order import effects_at, rows_of
from truepose.runs.poses import OK
from truepose.runs.variables import Variables
from truepose.sources import Deviation, PoseBlock

FEW = 1024
"""Poses whose sensitivities to every parameter stay in the cache together."""


@dataclass(frozen=True)
class BandEffect:
    """What a band does at n poses: m and rad.

    `reach`: down and up, (n, n_component); `uncertainty` (n, n_component), standard; `largest`
    (n, n_quantity); `status` (n,), the kernel's.
    """

    reach: tuple[Floats, Floats]
    uncertainty: Floats
    largest: Floats
    status: np.ndarray


def of_source(
    machine: Machine,
    block: PoseBlock,
    deviation: Deviation,
    error: Floats,
    kinds: Sequence[Indices],
) -> BandEffect:
    """Of one source, whose `error` (n, n_component) at its shift is known."""
    n_pose = block.indices.size
    if not deviation.banded.size:
        nothing = np.zeros((n_pose, len(machine.components)))
        status = np.full(n_pose, OK, np.uint8)
        return BandEffect((nothing, nothing), nothing, lengths(error, kinds), status)
    if is_plain(deviation.domain, deviation.banded_correlation):
        place = deviation.banded_variables[1]
        first = deviation.banded[np.unique(place, return_index=True)[1]]
        return _in_kernel(
            machine,
            block,
            error,
            sum_deviations([(deviation.parameters, deviation.shift)]),
            (deviation.parameters[deviation.banded], place),
            deviation.signed_half[:, deviation.banded],
            [deviation.distribution[column] for column in first],
            kinds,
        )
    return _by_effects(machine, block, deviation, error, kinds)


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
    if not variables.names:
        return lengths(error, kinds), np.full(n_pose, OK, np.uint8)
    # How they are correlated does not change how far they can go.
    if is_plain(variables.domain):
        band = _in_kernel(
            machine,
            block,
            error,
            variables.shift,
            (variables.columns, variables.variable_of),
            variables.half_width,
            variables.distributions,
            kinds,
        )
        return band.largest, band.status
    far, status = np.empty((n_pose, len(kinds))), np.empty(n_pose, np.uint8)
    parameters, shift = variables.shift
    for start in range(0, n_pose, FEW):
        poses = slice(start, start + FEW)
        moved = (parameters, np.ascontiguousarray(rows_of(shift, poses)))
        effects, status[poses] = effects_at(machine, block, variables, moved, poses)
        far[poses] = largest(error[poses], effects, variables.domain, kinds).length
    return far, status


def is_plain(domain: Domain, correlation: Floats | None = None) -> bool:
    """Whether all variables lie in [-1, 1], each by itself and independent."""
    return domain.symmetric and not domain.directions and correlation is None


def _in_kernel(
    machine: Machine,
    block: PoseBlock,
    error: Floats,
    moved: ParameterDeviation,
    columns: tuple[Indices, Indices],
    half: Floats,
    distributions: Sequence[Distribution],
    kinds: Sequence[Indices],
) -> BandEffect:
    """Of `columns`, their parameters (k,) and variables (k,), by `half` (n or 1, k) at +1."""
    parameters, shift = moved
    if not shift.any():
        parameters, shift = parameters[:0], shift[:, :0]
    numbers, status = machine.kernel.band_at(
        block.joints,
        block.placements,
        error,
        parameters,
        np.ascontiguousarray(shift),
        columns[0],
        columns[1].tolist(),
        np.ascontiguousarray(half),
        [distribution.sigmas for distribution in distributions],
        [kind.tolist() for kind in kinds],
    )
    count = error.shape[1]
    reach, uncertainty = numbers[:, :count], numbers[:, count : 2 * count]
    return BandEffect((reach, reach), uncertainty, numbers[:, 2 * count :], status)


def _by_effects(
    machine: Machine,
    block: PoseBlock,
    deviation: Deviation,
    error: Floats,
    kinds: Sequence[Indices],
) -> BandEffect:
    """The same as `of_source` from the effects of each variable."""
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
    return BandEffect((down, up), uncertain, far, status)


__all__ = ["BandEffect", "is_plain", "of_all", "of_source"]
