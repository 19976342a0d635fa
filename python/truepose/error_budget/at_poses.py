"""The budget of a block of poses: every source alone and all together, at each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Flags
from truepose.error_budget import bands, in_kernel
from truepose.error_budget.tally import Tally
from truepose.machine import Machine
from truepose.runs import percent
from truepose.runs.dataset import Schema, Variable
from truepose.runs.poses import PoseRun, of_band
from truepose.runs.quantities import quantities
from truepose.runs.variables import variables_of
from truepose.sources import Deviation, PoseBlock, Source

_EACH = ("pose", "source", "component")
_ALL = ("pose", "component")
_OVER = ("source", "component")

SCHEMA: Schema = {
    "error": Variable(_EACH, "component", "known error of the source alone, at its shift"),
    "error_lower": Variable(
        _EACH, "component", "error of the source alone, all lengths at their bands' lower ends"
    ),
    "error_upper": Variable(
        _EACH, "component", "error of the source alone, all lengths at their bands' upper ends"
    ),
    "worst": Variable(_EACH, "component", "worst case of the source alone, of each component"),
    "reach": Variable(
        _EACH, "component", "how far the source's tolerance band reaches, the farther way"
    ),
    "largest": Variable(
        ("pose", "source", "quantity"), "quantity", "linear maximum of the source alone"
    ),
    "uncertainty": Variable(
        _EACH, "component", "standard uncertainty from the source's tolerance band"
    ),
    "percent_lower": Variable(_EACH, "%", "error_lower in % of the coordinate"),
    "percent_upper": Variable(_EACH, "%", "error_upper in % of the coordinate"),
    "overall_error": Variable(_ALL, "component", "known error of all sources, at their shifts"),
    "overall_error_lower": Variable(
        _ALL, "component", "error of all sources, toleranced lengths all at their lower ends"
    ),
    "overall_error_upper": Variable(
        _ALL, "component", "error of all sources, toleranced lengths all at their upper ends"
    ),
    "overall_percent_lower": Variable(
        _ALL, "%", "overall_error_lower in percent of the coordinate"
    ),
    "overall_percent_upper": Variable(
        _ALL, "%", "overall_error_upper in percent of the coordinate"
    ),
    "percent_defined": Variable(
        _ALL, "1", "whether the coordinate is large enough for a percent of it", np.bool_
    ),
    "linear_maximum": Variable(
        ("pose", "quantity"), "quantity", "linear maximum: largest error of all sources together"
    ),
    "joint_nominal": Variable(("pose", "joint"), "joint", "joint coordinate, nominal command"),
    "force": Variable(
        ("pose", "closure"), "N", "closure force under all that acts, a strut's tension positive"
    ),
    "highest_lower": Variable(_OVER, "component", "highest |error_lower| over poses"),
    "highest_upper": Variable(_OVER, "component", "highest |error_upper| over poses"),
    "highest_percent_lower": Variable(_OVER, "%", "highest percent_lower over poses"),
    "highest_percent_upper": Variable(_OVER, "%", "highest percent_upper over poses"),
    "overall_highest_lower": Variable(
        ("component",), "component", "highest |overall_error_lower| over poses"
    ),
    "overall_highest_upper": Variable(
        ("component",), "component", "highest |overall_error_upper| over poses"
    ),
    "overall_highest_percent_lower": Variable(
        ("component",), "%", "highest overall_percent_lower over poses"
    ),
    "overall_highest_percent_upper": Variable(
        ("component",), "%", "highest overall_percent_upper over poses"
    ),
    "highest": Variable(
        ("source", "quantity"), "quantity", "highest linear maximum of the source over poses"
    ),
    "rms": Variable(
        ("source", "quantity"), "quantity", "root mean square of the source's linear maximum"
    ),
    "share": Variable(("source",), "1", "highest position error over the sum of all sources'"),
    "rank": Variable(("source",), "1", "place of the source by its share, 1 the largest", np.intp),
    "verdict": Variable(("source",), "1", "negligible, relevant or dominant", str),
}


def evaluate_block(
    run: PoseRun,
    sources: Sequence[Source],
    block: PoseBlock,
    values: dict[str, np.ndarray],
    tally: Tally,
) -> Flags:
    """Fill `values`, every variable over poses, for one block; which of them can be used, (n,)."""
    deviations = [source.deviation(run.machine, run.condition, block) for source in sources]
    tally.note(deviations)
    filled, statuses = _evaluate(run.machine, block, sources, deviations, values)
    usable = run.keep(block.indices, *statuses)
    tally.add(block, values, filled.highest, usable)
    return usable


def _evaluate(
    machine: Machine,
    block: PoseBlock,
    sources: Sequence[Source],
    deviations: Sequence[Deviation],
    values: dict[str, np.ndarray],
) -> tuple[in_kernel.Filled, list[np.ndarray]]:
    """Fill `values`, every variable over poses, for one block.

    Returns what the kernel says of it, and all statuses (n,) met on the way, in the order of
    `displacement.at_shifts`: at shifts, of the bands about them, at edges of the bands.
    """
    kinds = list(quantities(machine.components).values())
    filled = in_kernel.fill(machine, block, sources, deviations, kinds, values)
    statuses = [filled.shifts, filled.bands]
    for at, deviation in enumerate(deviations):
        if deviation.banded.size and not in_kernel.is_plain(deviation):
            error = np.ascontiguousarray(values["error"][:, at])
            effects, status = bands.of_source(machine, block, deviation, error, kinds)
            for name, effect in effects.items():
                values[name][:, at] = effect
            statuses.append(status)
    if not in_kernel.in_boxes(deviations):
        variables = variables_of(machine, sources, deviations)
        values["linear_maximum"][:], status = bands.of_all(
            machine, block, variables, values["overall_error"], kinds
        )
        statuses.append(status)
    values["percent_defined"][:] = percent.defined(machine, block.placements)
    values["joint_nominal"][:] = block.joints
    values["force"][:] = block.forces
    return filled, [*statuses, of_band(filled.edges)]


__all__ = ["SCHEMA", "evaluate_block"]
