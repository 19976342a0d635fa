"""The budget: every source alone and all together, at every pose, and how they compare."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from truepose.error_budget import bands, comparison, in_kernel
from truepose.error_budget.guide_loads import GuideLoads
from truepose.machine import Condition, Machine
from truepose.runs import percent
from truepose.runs.arguments import checked
from truepose.runs.dataset import Schema, Variable, label, quantity_coords
from truepose.runs.poses import Progress, of_band
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.runs.variables import variables_of
from truepose.sources import Deviation, PoseBlock, Source

if TYPE_CHECKING:
    import xarray as xr

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

# What is highest over poses, and of which variable.
_HIGHEST = {
    "highest_lower": "error_lower",
    "highest_upper": "error_upper",
    "highest_percent_lower": "percent_lower",
    "highest_percent_upper": "percent_upper",
    "overall_highest_lower": "overall_error_lower",
    "overall_highest_upper": "overall_error_upper",
    "overall_highest_percent_lower": "overall_percent_lower",
    "overall_highest_percent_upper": "overall_percent_upper",
}


@checked
def budget(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The error over the workspace, or at `poses`, from each source alone and from all together.

    And how they compare. `poses` (..., n_commanded), SI, default the file's workspace; `condition`,
    default the file's; `progress` is called with (poses done, poses in all). Loads and temperatures
    are evaluated at nominal parameters and the commanded pose. The Dataset, SI, is described in
    docs/results.md; errors are actual minus commanded, base frame (Gojtan & Hess-Coelho 2005,
    equations 3-7; equation 8 for the percent of a source, 9 for that of all together).

    Raises `RequestError`: bad-poses, no-workspace, no-source, no-pose-left; `TrueposeError` where
    the condition asks for what the machine does not say (no-stiffness, no-expansion). What it warns
    of (guide-taken-rigid) is in the attribute `warnings`.
    """
    return evaluate(machine, poses, condition, progress).dataset()


@dataclass(frozen=True)
class Evaluation:
    """The budget over poses before it is a Dataset."""

    run: Run
    """The poses, their rows, and what was left out."""
    over_all: Mapping[str, Any]
    """The variables of `SCHEMA` that have no pose."""
    distributions: Sequence[str]
    """Of each source."""
    warnings: list[dict[str, str]]
    """What the result warns of: `code` and `sentence` of each."""

    def dataset(self) -> xr.Dataset:
        """The Dataset of `budget`."""
        names = [source.name for source in self.run.sources]
        coords = {
            "source": label("source", names, "error source"),
            "distribution": label(
                "source", list(self.distributions), "distribution inside the band"
            ),
            **quantity_coords(self.run.machine, "what is compared"),
        }
        dataset = self.run.dataset(over_all=self.over_all, coords=coords)
        return dataset.assign_attrs(warnings=json.dumps(self.warnings))


def evaluate(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    progress: Progress | None = None,
) -> Evaluation:
    """The work of `budget`, with its arguments and its errors."""
    run = Run(machine, poses, condition, progress)
    sources = run.sources
    kinds = quantities(machine.components)
    lengths = {"source": len(sources), "component": len(machine.components)}
    rows = run.begin(SCHEMA, source=len(sources))
    highest = {
        name: comparison.Highest(tuple(lengths[dim] for dim in SCHEMA[name].dims))
        for name in _HIGHEST
    }
    statistics = comparison.LengthStatistics(len(sources), len(kinds))
    guides = GuideLoads(machine)
    distributions: list[dict[str, None]] = [{} for _ in sources]

    for block in run:
        deviations = [source.deviation(machine, run.condition, block) for source in sources]
        for names, deviation in zip(distributions, deviations, strict=True):
            names.update((str(deviation.distribution[k]), None) for k in deviation.banded)
        values = rows.room(block.indices.size)
        filled, statuses = _evaluate(machine, block, sources, deviations, values)
        usable = run.fill(block, values, *statuses)
        if usable.any():
            every = bool(usable.all())
            for name, running in highest.items():
                if every:
                    running.raise_to(filled.highest[_HIGHEST[name]])
                else:
                    running.add(values[_HIGHEST[name]][usable])
            statistics.add(values["largest"] if every else values["largest"][usable])
            guides.add(block, usable)
    if rows.count == 0:
        raise run.no_pose_left()

    shares = comparison.share(statistics.highest[:, 0])
    over_all: dict[str, Any] = {name: running.value for name, running in highest.items()}
    over_all |= {
        "highest": statistics.highest,
        "rms": statistics.rms,
        "share": shares,
        "rank": comparison.rank(shares),
        "verdict": comparison.verdict(statistics.highest, kinds, machine.accuracy),
    }
    return Evaluation(
        run, over_all, [" / ".join(names) or "none" for names in distributions], guides.warnings()
    )


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


__all__ = ["SCHEMA", "Evaluation", "budget", "evaluate"]
