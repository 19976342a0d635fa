"""Correct the command for what is known, and drive it through the machine for what is not."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.compensation.corrected import corrected_deviations
from truepose.compensation.parasitic import parasitic_remains
from truepose.compensation.remainder import Remainder
from truepose.error_budget.largest import largest
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.controller_geometry import (
    ROUNDING,
    nothing_to_correct,
    require_known_controller,
)
from truepose.runs.dataset import Schema, Variable, quantity_coords
from truepose.runs.displacement import at_shifts, displacement, sum_deviations
from truepose.runs.first_order import first_order
from truepose.runs.poses import (
    Progress,
    of_band,
    of_correction,
)
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.runs.variables import variables_of
from truepose.sources import Deviation, PoseBlock, Source

if TYPE_CHECKING:
    import xarray as xr

_ALL = ("pose", "component")

SCHEMA: Schema = {
    "joint_corrected": Variable(("pose", "joint"), "joint", "joint coordinate, corrected command"),
    "joint_nominal": Variable(("pose", "joint"), "joint", "joint coordinate, nominal command"),
    "residual_lower": Variable(
        _ALL, "component", "error of the corrected command, all lengths at their lower ends"
    ),
    "residual_upper": Variable(
        _ALL, "component", "error of the corrected command, all lengths at their upper ends"
    ),
    "residual_middle": Variable(
        _ALL, "component", "known error of the corrected command, every source at its shift"
    ),
    "bound": Variable(
        _ALL, "component", "linear reach of all tolerance bands, at the corrected command"
    ),
    "linear_maximum": Variable(
        ("pose", "quantity"), "quantity", "linear maximum: largest error that remains"
    ),
    "remainder": Variable(
        ("pose", "quantity"), "quantity", "what an error may exceed linear_maximum by, proven"
    ),
    "second_order": Variable(
        _ALL,
        "component",
        "what the residual may exceed the bound by, proven; missing where it is not",
    ),
    "proven": Variable(("pose",), "1", "whether second_order is proven", np.bool_),
}


@checked
def compensate(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The corrected command at every pose, and what remains, by re-simulation.

    The corrected joints are `inverse(X, nominal + sum of the sources' shifts)`, the shifts taken at
    these very joints where they follow them; they are driven through the machine with the
    deviations at their shifts (middle) and with the lengths and offsets of every source at both
    edges of their bands. On the commanded freedoms

        |residual| <= bound + second_order

    for every deviation inside the bands, where `proven`; elsewhere `second_order` is missing. A
    pose is left out where a machine at an edge cannot be assembled (`band`) or the corrected
    command not be followed (`correction_` and the kernel's status). `poses` (..., n_commanded), SI,
    default the file's workspace. The Dataset, SI, and both terms are described in docs/results.md.

    Where there is nothing to correct, or something that no command can, the attribute `warnings`
    has the reason. Raises as
    `truepose.budget`; `RequestError` (controller-unsaid, controller-contradicted) for a calibrated
    file of which it is not known with which geometry its controller works.
    """
    require_known_controller(machine)
    return against_nominal(machine, poses, condition, progress=progress)


def against_nominal(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The same of any file: of a controller that works with the nominal geometry, be it so or not.

    For what shows a machine and commands none.
    """
    run = Run(machine, poses, condition, progress)
    run.begin(SCHEMA)
    remainder = Remainder(machine)
    for block in run:
        deviations = [source.deviation(machine, run.condition, block) for source in run.sources]
        alone = [(d.parameters, d.shift) for d in deviations]
        shifted = at_shifts(machine, block, alone, sum_deviations(alone))
        values, followed, edges = _correct(machine, block, run.sources, deviations, remainder)
        run.fill(block, values, shifted, *map(of_correction, followed), *map(of_band, edges))
    dataset = run.dataset(coords=quantity_coords(machine))
    moved = np.abs(dataset["joint_corrected"] - dataset["joint_nominal"]).max()
    if max(moved, np.abs(dataset["residual_middle"]).max()) < ROUNDING:
        warnings = [nothing_to_correct(machine)]
    else:
        warnings = parasitic_remains(machine, dataset["residual_middle"])
    if warnings:
        dataset.attrs["warnings"] = json.dumps(warnings)
    return dataset


def _correct(
    machine: Machine,
    block: PoseBlock,
    sources: Sequence[Source],
    nominal: list[Deviation],
    remainder: Remainder,
) -> tuple[dict[str, np.ndarray], list[np.ndarray], list[np.ndarray]]:
    """Every variable over poses for one block, and all statuses (n,) met on the way.

    From the deviations at the `nominal` command. First the statuses of the corrected command at
    the shifts, then those at edges of the bands.
    """
    after, deviations, corrected = corrected_deviations(block, sources, nominal)
    variables = variables_of(machine, sources, deviations)
    middle, effects, at_middle = first_order(machine, after, variables)
    kinds = list(quantities(machine.components).values())
    bounds = remainder.bound(after, variables, middle, effects)
    values = {
        "joint_corrected": after.joints,
        "joint_nominal": block.joints,
        "residual_middle": middle,
        "bound": np.maximum(*variables.domain.reach(effects)),
        "linear_maximum": largest(middle, effects, variables.domain, kinds).length,
        "remainder": bounds.norms,
        "second_order": bounds.components,
        "proven": bounds.proven,
    }
    edges = []
    for name, side in (("residual_lower", -1.0), ("residual_upper", +1.0)):
        moved = sum_deviations(
            [(deviation.parameters, deviation.at_edge(side)) for deviation in deviations]
        )
        values[name], status = displacement(machine, after.joints, after.placements, moved)
        edges.append(status)
    return values, [corrected, at_middle], edges
