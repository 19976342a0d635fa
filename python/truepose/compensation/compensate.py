"""Correct the command for what is known, and drive it through the machine for what is not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from truepose.budget import worst
from truepose.budget.dataset import Rows, Schema, Variable, assemble, sizes
from truepose.budget.evaluate import required_sources
from truepose.budget.exact import Moved, at_shifts, displacement, together
from truepose.budget.poses import (
    NO_BOUND,
    Progress,
    Walk,
    is_path,
    no_pose_left,
    of_band,
    of_correction,
    reason_unless,
    requested_poses,
)
from truepose.compensation.second_order import SecondOrder, Step
from truepose.machine import Condition, Machine
from truepose.sources import Block, Deviation
from truepose.sources._base import Floats

_ALL = ("pose", "component")

SCHEMA: Schema = {
    "joint": Variable(("pose", "joint"), "joint", "joint coordinate, corrected command"),
    "joint_nominal": Variable(("pose", "joint"), "joint", "joint coordinate, nominal command"),
    "residual_lower": Variable(
        _ALL, "component", "error of the corrected command, lengths and offsets at the lower edges"
    ),
    "residual_upper": Variable(
        _ALL, "component", "error of the corrected command, lengths and offsets at the upper edges"
    ),
    "residual_middle": Variable(
        _ALL, "component", "error of the corrected command, every source at its shift"
    ),
    "bound": Variable(_ALL, "component", "linear, group-aware reach of the bands of all sources"),
    "second_order": Variable(
        _ALL, "component", "what the residual may exceed the bound by, of second order"
    ),
}


def compensate(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The corrected command at every pose, and what remains, by re-simulation.

    The corrected joints are `inverse(X, nominal + sum of the sources' shifts)`; they are driven
    through the machine with the deviations at their shifts (middle) and with the lengths and
    offsets of every source at both edges of their bands. On the commanded freedoms

        |residual| <= bound + second_order

    for every deviation inside the bands. Where they are too wide for that the pose is left out
    (`no_bound`), as it is where a machine at an edge cannot be assembled (`band`) or the corrected
    command not be followed (`correction_` and the kernel's status). `poses` (..., n_commanded), SI,
    default the file's workspace. The Dataset, SI, and both terms are described in docs/results.md.

    Raises as `truepose.budget`.
    """
    given = machine.condition if condition is None else condition
    table = requested_poses(machine, poses)
    sources = required_sources(machine, given)
    rows = Rows(machine, SCHEMA, sizes(machine, len(table)))
    second_order = SecondOrder(machine)
    walk = Walk(machine, table, given, progress, path=poses is None and is_path(machine))
    for block in walk:
        deviations = [source.deviation(machine, given, block) for source in sources]
        values, corrected, edges = _correct(machine, block, deviations, second_order)
        alone = [(d.parameters, d.shift) for d in deviations]
        shifted = at_shifts(machine, block, alone, together(alone))
        bounded = np.isfinite(values["bound"] + values["second_order"]).all(axis=1)
        usable = walk.keep(
            block.indices,
            shifted,
            *map(of_correction, corrected),
            *map(of_band, edges),
            reason_unless(bounded, NO_BOUND),
        )
        rows.append(block, values, usable)
    if rows.count == 0:
        raise no_pose_left(machine, table, walk.left_out, of_file=poses is None)
    return assemble(machine, given, SCHEMA, rows, table, walk.left_out)


def _correct(
    machine: Machine,
    block: Block,
    deviations: Sequence[Deviation],
    second_order: SecondOrder,
) -> tuple[dict[str, np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Every variable over poses for one block, and all statuses (n,) met on the way.

    First those of the corrected command at the shifts, then those at edges of the bands.
    """
    shift = together([(d.parameters, d.shift) for d in deviations])
    lower = together([(d.parameters, d.at_edge(-1.0)) for d in deviations])
    upper = together([(d.parameters, d.at_edge(+1.0)) for d in deviations])
    joints, _, corrected = machine.kernel.corrected(block.requested[block.indices], *shift)

    def residual(moved: Moved) -> tuple[Floats, np.ndarray]:
        return displacement(machine, joints, block.placements, moved)

    middle, at_middle = residual(shift)
    low, at_low = residual(lower)
    high, at_high = residual(upper)
    statuses = [corrected, at_middle]

    # Rounding of the inverse is no deviation: where nothing is known, nothing is corrected.
    centre = Step(*shift, joints - block.joints, middle)
    down, up = np.zeros_like(middle), np.zeros_like(middle)
    band: list[Step] = []
    for deviation in deviations:
        if not deviation.banded.size:
            continue
        effects, _, status = worst.variable_effects(machine, block, deviation)
        for reach, of_source in zip((down, up), deviation.domain.reach(effects), strict=True):
            reach += of_source
        band += second_order.steps(deviation, effects)
        statuses.append(status)
    values = {
        "joint": joints,
        "joint_nominal": block.joints,
        "residual_lower": low,
        "residual_upper": high,
        "residual_middle": middle,
        "bound": np.maximum(down, up),
        "second_order": second_order.bound(block, centre, band),
    }
    return values, statuses, [at_low, at_high]
