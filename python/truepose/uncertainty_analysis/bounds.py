"""Bounds: what the error is proven not to exceed, at poses or over a region.

The variables of all sources are taken anywhere in their bands, in any combination. Interval Newton
on the closures proves that every such machine has exactly one pose near the commanded one and
encloses it, rounding included (`crates/kernel/src/proof`). What is reached stands beside it: the
exact error at the worst vertices that were found. A force of unknown direction is taken on its
sphere: along an error the most that it can do is the length of its three effects.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats
from truepose.cluster.evaluator import TaskEvaluator, evaluator_of
from truepose.cluster.options import refuse_workers, requested_cluster
from truepose.error_budget.worst import worst
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.dataset import Schema, Variable, quantity_coords
from truepose.runs.first_order import ExactError, first_order
from truepose.runs.poses import (
    OK,
    Progress,
    of_band,
)
from truepose.runs.quantities import quantities
from truepose.runs.run import Run
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.bounds_over_region import (
    bounds_over_region,
    require_root,
    required_gap,
)
from truepose.uncertainty_analysis.corners import worst_corners
from truepose.uncertainty_analysis.region_search import bad_resume
from truepose.uncertainty_analysis.truncation import Ends

if TYPE_CHECKING:
    import xarray as xr

_EACH = ("pose", "component")
_SIZE = ("pose", "quantity")

SCHEMA: Schema = {
    "lower": Variable(_EACH, "component", "proven bound: the error is never below"),
    "upper": Variable(_EACH, "component", "proven bound: the error is never above"),
    "reached_lower": Variable(_EACH, "component", "lowest exact error found at a vertex"),
    "reached_upper": Variable(_EACH, "component", "highest exact error found at a vertex"),
    "linear": Variable(_EACH, "component", "worst case to first order"),
    "magnitude": Variable(_SIZE, "quantity", "proven bound of the size of the error"),
    "reached_magnitude": Variable(_SIZE, "quantity", "largest exact error found at a vertex"),
    "status": Variable(("pose",), "1", "proven, or why there is no proof", object),
}

POSES = 16
"""Poses between two looks at Ctrl-C and progress."""

PROVEN = "proven"

MOST_BOXES = 100
"""Parts that the bands are divided into where they cannot be proven as a whole,"""

CLOSE = 1.01
"""and until the sizes lie at most this above what is reached."""


@checked
def bounds(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    region: Mapping[str, Sequence[float]] | None = None,
    gap: float = 0.05,
    truncate: float | None = None,
    resume: xr.Dataset | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    tls: str | Path | None = None,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Proven bounds of the error over every combination of deviations in their bands.

    At `poses` (..., n_commanded), SI, default the file's workspace; or over a `region`, freedom ->
    (from, to) in m and rad, a freedom not named staying at home: then the bounds hold at every pose
    of it, and lie at most the share `gap` above what is reached somewhere in it, unless the parts
    that the region may be divided into run out: `gap_reached` says how far they lie. A distribution
    without ends (normal, Student's) is taken at its band of k standard deviations, or at `truncate`
    standard deviations; the attributes `truncate` and `unbounded` say so. `progress` is called with
    (poses or boxes done, all or 0 where that is not known; of boxes it is an estimate).

    Ctrl-C gives what is proven so far, with the attribute `interrupted` at 1: the poses done, of a
    block of poses the worst to first order first; of a region bounds that hold in all of it and lie
    farther above what is reached, or none while a part is without any. `resume` goes on from such a
    result over the same region, also from one whose parts ran out.

    `status` is "proven", or says why nothing is: "near_singular", "box_too_wide" (the bands are too
    wide for the method, at a pose divided into many parts, or a part of the region could not be
    divided further). Bounds without a proof are missing. A pose at which a machine inside the bands
    was met that cannot be assembled is left out as `band`. The Dataset, SI, is described in
    docs/results.md.

    `workers`: so many processes of this computer prove the bounds at poses, or those of the
    dask.distributed `scheduler` at "tcp://HOST:PORT", or "tls://HOST:PORT" and `tls`, a folder with
    ca.pem, cert.pem and key.pem; the numbers are the same (docs/scale.md).

    Raises `RequestError`: bad-truncation, bad-gap, bad-region, bad-resume, region-out-of-reach,
    no-proof (a machine or a source that cannot be enclosed), bad-poses, no-workspace, no-source,
    no-pose-left, bad-workers, no-scheduler, no-worker, worker-lost, extra-missing.
    """
    cluster = requested_cluster(workers, scheduler, tls)
    given = machine.condition if condition is None else condition
    ends = Ends.of(truncate)
    require_root(machine)
    if region is None:
        if resume is not None:
            raise bad_resume("bounds are asked for at poses", "no region", "the same region")
        with evaluator_of(cluster) as evaluator:
            return _at_poses(machine, poses, given, ends, evaluator, progress)
    if cluster is not None:
        raise refuse_workers(
            cluster,
            "workers share poses, and a region is one search",
            "over a region",
            "bounds at poses, or no workers",
        )
    if poses is not None:
        raise RequestError(
            Problem(
                "bad-region",
                "bounds are asked for at poses and over a region at once",
                found="both",
                expected="poses or a region",
            )
        )
    return bounds_over_region(machine, given, region, required_gap(gap), ends, resume, progress)


def _at_poses(
    machine: Machine,
    poses: ArrayLike | None,
    condition: Condition,
    ends: Ends,
    evaluator: TaskEvaluator,
    progress: Progress | None,
) -> xr.Dataset:
    run = Run(machine, poses, condition)
    run.begin(SCHEMA)
    done, interrupted = 0, False
    for block, every in run.with_variables():
        every = ends.truncated(every)
        done_parts: list[_Found] = []
        try:
            value, effects, status = first_order(machine, block, every)
            usable = run.keep(block.indices, of_band(status))
            block, every, value = block.select(usable), every.select(usable), value[usable]
            effects = effects[usable]
            parts = list(_worst_first(machine, value, effects))
            tasks = (
                (
                    number,
                    (block.select(part).alone(), every.select(part), value[part], effects[part]),
                )
                for number, part in enumerate(parts)
            )
            for number, bounded in evaluator.results(_bounded, machine, tasks):
                done_parts.append((parts[number], *bounded))
                done += int(parts[number].sum())
                if progress is not None:
                    progress(done, len(run.poses))
        except KeyboardInterrupt:
            interrupted = True
        _fill(run, block, done_parts)
        if interrupted:
            break
    if interrupted and run.rows.count == 0:
        raise KeyboardInterrupt
    dataset = run.dataset(coords=quantity_coords(machine))
    dataset["status"] = dataset["status"].astype(str)
    # Poses that were not come to are neither used nor left out.
    return dataset.assign_attrs(
        ends.attrs, interrupted=int(interrupted), poses_left_out=dataset.sizes["left_out"]
    )


_Found = tuple[Flags, dict[str, np.ndarray], np.ndarray]
"""Which poses of a block, their values, and the status of each."""


def _worst_first(machine: Machine, value: Floats, effects: Floats) -> Iterator[Flags]:
    """Which poses (n,) come next, some at a time: the largest worst case to first order first.

    That of the tool's position, or of its rotation where it only turns.
    """
    chosen = next(iter(quantities(machine.components).values()))
    most = np.abs(value[:, chosen]) + np.abs(effects[:, chosen]).sum(axis=2)
    rank = np.argsort(np.argsort(-np.linalg.norm(most, axis=1), kind="stable"))
    for first in range(0, rank.size, POSES):
        yield (rank >= first) & (rank < first + POSES)


def _fill(run: Run, block: PoseBlock, found: Sequence[_Found]) -> None:
    """Write what was found at some poses of a block, in the order of the block."""
    if not found:
        return
    parts, values, statuses = zip(*found, strict=True)
    order = np.argsort(np.concatenate([np.flatnonzero(part) for part in parts]))
    together = {name: np.concatenate([one[name] for one in values])[order] for name in values[0]}
    chosen: Flags = np.logical_or.reduce(parts)
    run.fill(block.select(chosen), together, np.concatenate(statuses)[order])


def proven_bounds(
    machine: Machine,
    block: PoseBlock,
    variables: Variables,
    most_boxes: int = 1,
    targets: ArrayLike | None = None,
) -> dict[str, np.ndarray]:
    """`lower`, `upper`, `magnitude`, `status` (`SCHEMA`) and `boxes` at the n poses of a block.

    `variables` has every single variable in [-1, 1]. The box of variables is divided, into at most
    `most_boxes` parts, where it cannot be proven as a whole, and where a magnitude lies above its
    `targets` (n or 1, n_quantity), m and rad; `boxes` (n,) says how many were looked at.
    """
    shifted, shift = variables.shift
    lower, upper, magnitude, status, boxes = machine.kernel.bounds_at(
        block.joints,
        block.placements,
        shifted,
        np.ascontiguousarray(shift),
        variables.columns,
        variables.variable_of.tolist(),
        np.ascontiguousarray(variables.half_width),
        [members.tolist() for members in variables.directions],
        most_boxes,
        targets,
    )
    return {
        "lower": np.asarray(lower),
        "upper": np.asarray(upper),
        "magnitude": np.asarray(magnitude),
        "status": np.asarray(status, object),
        "boxes": np.asarray(boxes, np.intp),
    }


def _bounded(
    machine: Machine, at: tuple[PoseBlock, Variables, Floats, Floats]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Every variable over the poses of a block, and a reason (n,) of each where it is unusable.

    `at`: the block, what varies there, and the error and effects to first order.
    """
    block, variables, value, effects = at
    kinds = list(quantities(machine.components).values())
    corners = worst_corners(
        ExactError(machine, block, variables), value, effects, variables.domain, kinds
    )
    m = len(machine.components)
    proven = proven_bounds(machine, block, variables)
    hard = np.asarray((proven["status"] != PROVEN) & (corners.status == OK), np.bool_)
    if hard.any():
        asked = CLOSE * corners.most[hard, 2 * m :]
        divided = proven_bounds(
            machine, block.select(hard), variables.select(hard), MOST_BOXES, asked
        )
        for name, found_in_parts in divided.items():
            proven[name][hard] = found_in_parts
    values = {
        **{name: values for name, values in proven.items() if name in SCHEMA},
        "reached_lower": -corners.most[:, m : 2 * m],
        "reached_upper": corners.most[:, :m],
        "reached_magnitude": corners.most[:, 2 * m :],
        "linear": worst(value, variables.domain.reach(effects)),
    }
    return values, of_band(corners.status)
