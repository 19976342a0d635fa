"""The budget: every source alone and all together, at every pose, and how they compare."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags
from truepose.cluster.options import requested_cluster
from truepose.error_budget import bands, in_kernel
from truepose.error_budget.tally import Tally
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs import percent
from truepose.runs.arguments import checked
from truepose.runs.dataset import Schema, Variable, label, quantity_coords
from truepose.runs.poses import PoseRun, Progress, of_band
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


@checked
def budget(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    summary: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """The error over the workspace, or at `poses`, from each source alone and from all together.

    And how they compare. `poses` (..., n_commanded), SI, default the file's workspace; `condition`,
    default the file's; `progress` is called with (poses done, poses in all). Loads and temperatures
    are evaluated at nominal parameters and the commanded pose. The Dataset, SI, is described in
    docs/results.md; errors are actual minus commanded, base frame (Gojtan & Hess-Coelho 2005,
    equations 3-7; equation 8 for the percent of a source, 9 for that of all together).

    `summary`: what is highest over all poses, where, and how the sources compare, without any
    variable over poses: of a grid in the file there may be 1e10 then. `workers`: so many processes
    of this computer evaluate it, or those of the dask.distributed `scheduler` at "tcp://HOST:PORT",
    or "tls://HOST:PORT" and `tls`, a folder with ca.pem, cert.pem and key.pem; the numbers are the
    same (docs/scale.md).

    Raises `RequestError`: bad-poses, no-workspace, grid-too-large, no-source, no-pose-left,
    bad-workers, no-scheduler, no-worker, worker-lost, extra-missing; `TrueposeError` where the
    condition asks for what the machine does not say (no-stiffness, no-expansion). What it warns
    of (guide-taken-rigid) is in the attribute `warnings`.
    """
    cluster = requested_cluster(workers, scheduler, tls)
    if summary:
        from truepose.error_budget.summary import summary as summary_of

        return summary_of(machine, poses, condition, progress, cluster)
    if cluster is not None:
        raise RequestError(
            Problem(
                "bad-workers",
                "workers are for a summary: rows of single poses take longer to send than to "
                "compute",
                found=f"{cluster.workers or cluster.scheduler} without a summary",
                expected="--summary, summary=True",
            )
        )
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
    rows = run.begin(SCHEMA, source=len(run.sources))
    tally = Tally(machine, len(run.sources))
    for block in run:
        values = rows.room(block.indices.size)
        rows.append(block, values, evaluate_block(run, run.sources, block, values, tally))
    if rows.count == 0:
        raise run.no_pose_left()
    return Evaluation(run, tally.over_all(), tally.distributions(), tally.warnings())


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


__all__ = ["SCHEMA", "Evaluation", "budget", "evaluate", "evaluate_block"]
