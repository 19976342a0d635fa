"""The proof engine, asked where linear maximum and remainder do not decide."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.language import say
from truepose.runs.quantities import quantities
from truepose.uncertainty_analysis.bounds import PROVEN, proven_bounds
from truepose.verdict.states import State

EFFORT = 1024
"""Boxes in all, for one state."""

EACH = 512
"""Boxes at one pose."""

AT_ONCE = 8
"""Poses that share what is left of the effort."""


def bounds(state: State, targets: Sequence[float | None], boxes: int) -> tuple[Floats, int]:
    """Proven bounds (n, q) of all quantities at the poses of a state, and the boxes that it took.

    inf where nothing is proven. `targets` (q,): no more is proven than that they are kept; `boxes`
    at each pose at most.
    """
    machine, block = state.machine, state.block
    kinds = quantities(machine.components)
    nothing = np.full((block.indices.size, len(kinds)), np.inf)
    if machine.kernel.overconstrained or not len(state.variables.names):
        return nothing, 0
    limits = np.array([[np.inf if target is None else target for target in targets]])
    bounds = proven_bounds(machine, block, state.variables.centred(), boxes, limits)
    proven = bounds["status"] == PROVEN
    bound = np.where(proven[:, np.newaxis], bounds["magnitude"], nothing)
    return bound, int(bounds["boxes"].sum())


def refused(state: State) -> str:
    """Why the engine has nothing to say of a machine; empty where it has."""
    return say("more closures than freedoms") if state.machine.kernel.overconstrained else ""
