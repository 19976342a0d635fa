"""The budget: every source alone and all together, at every pose, and how they compare."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from truepose.cluster.evaluator import evaluator_of
from truepose.cluster.options import refuse_workers, requested_cluster
from truepose.error_budget.at_poses import SCHEMA, evaluate_block
from truepose.error_budget.tally import Tally
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.dataset import label, quantity_coords
from truepose.runs.poses import Progress
from truepose.runs.run import Run

if TYPE_CHECKING:
    import xarray as xr


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

        with evaluator_of(cluster) as evaluator:
            return summary_of(machine, poses, condition, progress, evaluator)
    if cluster is not None:
        raise refuse_workers(
            cluster,
            "workers are for a summary: rows of single poses take about as long to fetch as to "
            "compute",
            "without a summary",
            "--summary, summary=True",
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


__all__ = ["Evaluation", "budget", "evaluate"]
