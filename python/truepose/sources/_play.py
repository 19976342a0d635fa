"""Play: to which of its two sides a joint is pressed by what acts, where that is certain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats, Indices
from truepose.sources.pose_block import PoseBlock

NO_LOAD = 1e-9
"""Load, in all that acts on the machine, at or below which a part carries nothing but rounding."""


@dataclass(frozen=True)
class DeadZone:
    """A play that stays open while little presses on it: what `pressed` is asked of a source.

    `parameter`: the kernel's that it leaves open, m or rad; it is pressed by the load on that.
    `threshold`, N, or N m of an angle, whose `lever` is the machine's size, m; 1 otherwise.
    `end`: number of a strut and its end (0 base, 1 platform), where the force differs from that
    load, a strut's mean, by what `PoseBlock.over_tension` says; else None.
    """

    parameter: int
    threshold: float
    lever: float = 1.0
    end: tuple[int, int] | None = None


def pressed(
    block: PoseBlock, columns: Indices, loads: Floats, threshold: ArrayLike, lever: ArrayLike = 1.0
) -> tuple[Floats, Flags]:
    """To which side the known `loads` (n, k) on parameters `columns` (k,) press each, -1 or +1.

    0 where they are at or below the `threshold` (k,), or where a force of unknown direction could
    bring them there. And where no direction of that force could take them above it: (n, k) both.
    Loads and threshold in N, or N m of a parameter that is an angle, whose `lever` (k,) is the
    machine's size, m; 1 otherwise.
    """
    least = np.maximum(threshold, NO_LOAD * all_that_acts(block) * np.asarray(lever, np.float64))
    unknown = _of_any_direction(block, columns)
    side = np.where(np.abs(loads) - unknown > least, np.sign(loads), 0.0)
    return side, np.abs(loads) + unknown <= least


def all_that_acts(block: PoseBlock) -> Floats:
    """(n or 1, 1) N: the size of all that acts, moments by the machine's size."""
    wrench = np.abs(block.tool_wrench) + np.abs(block.own_wrench)
    size = block.machine.characteristic_length
    acting = wrench @ np.repeat([1.0, 1.0 / size], 3)
    if block.base_forces is not None:
        acting = acting + np.abs(block.base_forces).sum(axis=(1, 2))
    if block.condition.envelope is not None:
        acting = acting + block.condition.envelope.force
    return np.asarray(acting[:, np.newaxis])


def _of_any_direction(block: PoseBlock, columns: Indices) -> Floats | float:
    """(n, k) the most that a force of unknown direction can load parameters: Cauchy-Schwarz."""
    envelope = block.condition.envelope
    if envelope is None:
        return 0.0
    loads = [block.loads_of(wrench[np.newaxis], columns) for wrench in envelope.wrenches]
    squares = sum(np.square(load) for load in loads)
    return np.asarray(np.sqrt(squares))
