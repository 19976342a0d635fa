"""Bounds: what the error is proven not to exceed, at poses or over a region.

The variables of all sources are taken anywhere in their bands, in any combination. Interval Newton
on the closures proves that every such machine has exactly one pose near the commanded one and
encloses it, rounding included (`crates/kernel/src/proof`). What is reached stands beside it: the
exact error at the worst vertices that were found. A force of unknown direction is taken on its
sphere: along an error the most that it can do is the length of its three effects.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from truepose.arrays import Floats
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
from truepose.runs.run import Run, in_parts
from truepose.runs.variables import Variables
from truepose.sources import PoseBlock
from truepose.uncertainty_analysis.bounds_over_region import (
    bounds_over_region,
    no_proof,
    required_gap,
)
from truepose.uncertainty_analysis.corners import worst_corners
from truepose.uncertainty_analysis.truncation import Ends

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
    progress: Progress | None = None,
) -> xr.Dataset:
    """Proven bounds of the error over every combination of deviations in their bands.

    At `poses` (..., n_commanded), SI, default the file's workspace; or over a `region`, freedom ->
    (from, to) in m and rad, a freedom not named staying at home: then the bounds hold at every pose
    of it, and lie at most the share `gap` above what is reached somewhere in it, unless the parts
    that the region may be divided into run out: `gap_reached` says how far they lie. A distribution
    without ends (normal, Student's) is taken at its band of k standard deviations, or at `truncate`
    standard deviations; the attributes `truncate` and `unbounded` say so. `progress` is called with
    (poses or boxes done, all or 0).

    `status` is "proven", or says why nothing is: "near_singular", "box_too_wide" (the bands are too
    wide for the method, at a pose divided into many parts, or a part of the region could not be
    divided further). Bounds without a proof are missing. A pose at which a machine inside the bands
    was met that cannot be assembled is left out as `band`. The Dataset, SI, is described in
    docs/results.md.

    Raises `RequestError`: bad-truncation, bad-gap, bad-region, region-out-of-reach, no-proof (a
    machine or a source that cannot be enclosed), bad-poses, no-workspace, no-source, no-pose-left.
    """
    given = machine.condition if condition is None else condition
    ends = Ends.of(truncate)
    if machine.kernel.overconstrained:
        raise no_proof(
            machine,
            "more closures than freedoms",
            "as many closures as freedoms: there the pose is a root, which can be enclosed",
        )
    if region is None:
        return _at_poses(machine, poses, given, ends, progress)
    if poses is not None:
        raise RequestError(
            Problem(
                "bad-region",
                "bounds are asked for at poses and over a region at once",
                found="both",
                expected="poses or a region",
            )
        )
    return bounds_over_region(machine, given, region, required_gap(gap), ends, progress)


def _at_poses(
    machine: Machine,
    poses: ArrayLike | None,
    condition: Condition,
    ends: Ends,
    progress: Progress | None,
) -> xr.Dataset:
    run = Run(machine, poses, condition)
    run.begin(SCHEMA)
    for block, every in run.with_variables():
        every = ends.truncated(every)
        for part, variables in in_parts(block, every, POSES):
            value, effects, status = first_order(machine, part, variables)
            usable = run.keep(part.indices, of_band(status))
            if usable.any():
                order = (value[usable], effects[usable])
                some = part.select(usable)
                run.fill(some, *_bounded(machine, some, variables.select(usable), order))
            if progress is not None:
                progress(int(part.indices[-1]) + 1, len(run.poses))
    dataset = run.dataset(coords=quantity_coords(machine))
    dataset["status"] = dataset["status"].astype(str)
    return dataset.assign_attrs(ends.attrs)


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
    machine: Machine,
    block: PoseBlock,
    variables: Variables,
    order: tuple[Floats, Floats],
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Every variable over the poses of a block, and a reason (n,) of each where it is unusable."""
    value, effects = order
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
