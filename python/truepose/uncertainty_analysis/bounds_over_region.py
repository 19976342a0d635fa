"""Bounds over a continuous region of the workspace, by branch and bound.

What the sources know must be known at every pose in between too, not at some poses only. So a
source's deviation is the same at every pose, or the source says by `over_region` how it follows
from the pose, and that is enclosed with everything else (`crates/kernel/src/proof`):

* "lengths": the deviation of a strut's length is a constant and a multiple of the strut's length;
* "wrench": the deviation is compliance times load under the wrench on the tool.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from truepose._kernel import STATUS
from truepose.arrays import Floats, Indices
from truepose.errors import Problem, RequestError
from truepose.files.wording import did_you_mean, one_of
from truepose.machine import Condition, Machine
from truepose.runs.dataset import Schema, Variable, overall_dataset, provenance
from truepose.runs.poses import PoseRun, Progress, faults_text, pose_in_words, required_sources
from truepose.runs.variables import Variables, variables_at
from truepose.sources import PoseBlock, Source
from truepose.uncertainty_analysis.length_law import law_of_length
from truepose.uncertainty_analysis.region_search import (
    UNFINISHED,
    by_name,
    earlier,
    unfinished,
)
from truepose.uncertainty_analysis.truncation import Ends

if TYPE_CHECKING:
    import xarray as xr

MOST_BOXES = 200_000
"""Parts of a region that are looked at before giving up."""

KNOWN = 0.05
"""Share of a region that must be finished to tell how many parts it may take in all."""

_ALL = ("component",)
_SIZE = ("quantity",)

SCHEMA: Schema = {
    "lower": Variable(_ALL, "component", "proven bound: the error is nowhere below"),
    "upper": Variable(_ALL, "component", "proven bound: the error is nowhere above"),
    "reached_lower": Variable(_ALL, "component", "lowest exact error found in the region"),
    "reached_upper": Variable(_ALL, "component", "highest exact error found in the region"),
    "where_lower": Variable((*_ALL, "commanded"), "commanded", "pose of the lowest error found"),
    "where": Variable((*_ALL, "commanded"), "commanded", "pose of the highest error found"),
    "magnitude": Variable(_SIZE, "quantity", "proven bound of the size of the error"),
    "reached_magnitude": Variable(_SIZE, "quantity", "largest exact error found in the region"),
    "where_magnitude": Variable(
        (*_SIZE, "commanded"), "commanded", "pose of the largest error found"
    ),
    "where_unproven": Variable(
        ("commanded",), "commanded", "a pose near which nothing is proven, missing where all is"
    ),
    "boxes": Variable((), "1", "parts of the region that were looked at", np.int64),
    "status": Variable((), "1", "proven, or why nothing is", str),
}

Affine = tuple[int, tuple[float, float], float, int]
"""Parameter, constant (low, high), per length of a strut, and which strut."""


def required_gap(gap: float) -> float:
    """The gap asked for. Raises `RequestError` (bad-gap)."""
    if isinstance(gap, float | int | np.number) and 1e-3 <= gap < 1.0:
        return float(gap)
    raise RequestError(
        Problem(
            "bad-gap",
            "the bounds cannot be closed to this gap",
            found=f"{gap!r}",
            expected="a share from 0.001 to below 1, such as 0.05",
        )
    )


def no_proof(machine: Machine, found: str, expected: str, hint: str | None = None) -> RequestError:
    """The refusal where the method has no proof to give."""
    return RequestError(
        Problem(
            "no-proof",
            "nothing can be proven here",
            file=machine.file,
            found=found,
            expected=expected,
            hint=hint,
        )
    )


def require_root(machine: Machine) -> None:
    """Raises `RequestError` (no-proof) where the pose of a machine is no root of its closures."""
    if machine.kernel.overconstrained:
        raise no_proof(
            machine,
            "more closures than freedoms",
            "as many closures as freedoms: there the pose is a root, which can be enclosed",
        )


def bounds_over_region(
    machine: Machine,
    condition: Condition,
    region: Mapping[str, Sequence[float]],
    gap: float,
    ends: Ends,
    resume: xr.Dataset | None,
    progress: Progress | None,
    targets: Mapping[str, float] | None = None,
) -> xr.Dataset:
    """Proven bounds over every commanded pose of a region; see `uncertainty_analysis.bounds`.

    With `targets`, sizes in m and rad by quantity, the search is for whether nothing is above them:
    it ends where that is proven, or where a machine and a pose are met that are.

    Raises `RequestError`: bad-region, region-out-of-reach, no-proof, no-source, bad-resume.
    """
    require_root(machine)
    if not machine.kernel.can_be_enclosed:
        raise no_proof(
            machine,
            f"a machine commanded in {', '.join(machine.commanded)} of {', '.join(machine.dof)}",
            "parasitic rotations c alone, or a, b and c, over a region",
            "bounds at poses have no such limit",
        )
    sides = _sides(machine, region)
    block = _corners(machine, condition, sides)
    sources = required_sources(machine, condition)
    shifts: list[Affine] = []
    yielding: list[Affine] = []
    for source in sources:
        of = _known(machine, condition, source, block)
        (yielding if getattr(source, "over_region", None) == "wrench" else shifts).extend(of)
    every = variables_at(machine, block, sources)
    variables = ends.truncated(every)
    shifts.extend(_middles(every))
    asked = {name: list(side) for name, side in zip(machine.commanded, sides, strict=True)}
    question = ends.attrs | {"gap": gap, "region": str(asked)}
    goes_on = None
    if resume is not None:
        goes_on = earlier(machine, resume, provenance(machine, condition) | question)
    proof = machine.kernel.bounds_over(
        sides,
        shifts,
        yielding,
        tuple(float(value) for value in condition.wrench),
        list(
            zip(
                variables.columns.tolist(),
                variables.variable_of.tolist(),
                variables.half_width[0].tolist(),
                strict=True,
            )
        ),
        (gap, None if targets is None else _sizes(targets)),
        MOST_BOXES,
        goes_on,
        _told(progress),
    )
    status = str(proof["status"])
    if status in STATUS:
        raise _out_of_reach(machine, np.array(proof["where"]), status)
    proven = status == "proven"
    bound, reached = (np.asarray(proof[name], np.float64) for name in ("bound", "reached"))
    missing = np.full(len(machine.commanded), np.nan)
    found = by_name(machine, np.where(proven, bound, np.nan))
    found |= by_name(machine, np.where(np.isfinite(reached), reached, np.nan), "reached_")
    where = by_name(machine, np.asarray(proof["at"], np.float64).T)
    rest = unfinished(machine, proof)
    values = {
        **found,
        **rest,
        "where_lower": where["lower"].T,
        "where": where["upper"].T,
        "where_magnitude": where["magnitude"].T,
        "where_unproven": missing if proven else proof["where"],
        "boxes": proof["boxes"],
        "status": status,
    }
    schema = {**SCHEMA, **UNFINISHED} if rest else SCHEMA
    result = overall_dataset(machine, condition, schema, values)
    return result.assign_attrs(
        question | {"gap_reached": float(proof["gap"]), "interrupted": int(proof["interrupted"])}
    )


def _sizes(targets: Mapping[str, float]) -> tuple[float, float]:
    """Of position and orientation; infinite without one."""
    position, orientation = (targets.get(name, math.inf) for name in ("position", "orientation"))
    return position, orientation


def _middles(variables: Variables) -> list[Affine]:
    """By how much the middles of bands lie off their shifts, of listed values of no symmetry."""
    offsets = variables.half_width[0] * variables.domain.middle[variables.variable_of]
    columns = zip(variables.columns.tolist(), offsets.tolist(), strict=True)
    return [(column, (value, value), 0.0, 0) for column, value in columns if value != 0.0]


def _sides(machine: Machine, region: Mapping[str, Sequence[float]]) -> list[tuple[float, float]]:
    """Ends of every commanded freedom, m and rad. Raises `RequestError` (bad-region)."""
    problems: list[Problem] = []
    expected = 'ends by freedom, such as {"x": (0.2, 0.4)}, in m and rad'
    if not isinstance(region, Mapping) or not region:
        raise RequestError(
            Problem("bad-region", "this is no region", found=f"{region!r}", expected=expected)
        )
    for name in region:
        if name not in machine.commanded:
            problems.append(
                Problem(
                    "bad-region",
                    f"{name!r} is no freedom that the machine is commanded in",
                    found=f"{name}",
                    expected=one_of(machine.commanded),
                    hint=did_you_mean(str(name), machine.commanded),
                )
            )
    home = dict(zip(machine.dof, np.asarray(machine.kernel.home).tolist(), strict=True))
    sides: list[tuple[float, float]] = []
    for name in machine.commanded:
        given = region.get(name, (home[name], home[name]))
        try:
            low, high = (float(end) for end in given)
        except (TypeError, ValueError):
            low, high = math.nan, math.nan
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            reversed_ends = math.isfinite(low) and math.isfinite(high)
            problems.append(
                Problem(
                    "bad-region",
                    f"the ends of {name} are reversed" if reversed_ends else f"{name} has no ends",
                    found=f"{given!r}",
                    expected="the lower end, then the upper one, in m or rad",
                )
            )
        sides.append((low, high))
    if problems:
        raise RequestError(*problems)
    return sides


def _corners(machine: Machine, condition: Condition, sides: list[tuple[float, float]]) -> PoseBlock:
    """The corners and the middle of a region. Raises `RequestError` (region-out-of-reach)."""
    varying = [side if side[1] > side[0] else side[:1] for side in sides]
    poses = [*itertools.product(*varying), tuple(0.5 * (low + high) for low, high in sides)]
    table = np.array(poses, np.float64)
    walk = PoseRun(machine, table, condition)
    blocks = list(walk)
    outside, status = walk.left_out.sorted()
    if outside.size:
        raise _out_of_reach(machine, table[outside[0]], str(status[0]))
    return blocks[0]


def _out_of_reach(machine: Machine, pose: np.ndarray, status: str) -> RequestError:
    because = faults_text(machine, machine.kernel.explain(pose))
    return RequestError(
        Problem(
            "region-out-of-reach",
            "the region leaves the workspace: the machine cannot be commanded everywhere in it",
            file=machine.file,
            found=f"{status.replace('_', ' ')} at {pose_in_words(machine, pose)}"
            + (f": {because}" if because else ""),
            expected="a region within reach and travel, off singularities",
        )
    )


def _known(
    machine: Machine, condition: Condition, source: Source, block: PoseBlock
) -> list[Affine]:
    """What a source knows over the region: shifts, or compliances of one that yields.

    Raises `RequestError` (no-proof) for a source that does not say how it follows from the pose.
    """
    deviation = source.deviation(machine, condition, block)
    how = getattr(source, "over_region", None)
    if deviation.domain.directions:
        raise _unknown(machine, source, "what a force of unknown direction does is not enclosed")
    if _varies(deviation.half) or _varies(deviation.signed_half):
        raise _unknown(machine, source, "its band differs from pose to pose")
    if how == "wrench":
        if machine.kernel.limb_pairs:
            raise _unknown(machine, source, "how its limbs bend is not enclosed over a region")
        columns, table = block.compliances.columns, block.compliances.own
        if not np.any(condition.wrench != 0.0):
            return []
    else:
        columns, table = deviation.parameters, deviation.shift
        if how != "lengths" and _varies(table):
            raise _unknown(machine, source, "it differs from pose to pose")
    affine = _affine(machine, columns, table, block)
    if affine is None:
        raise _unknown(machine, source, "it does not follow from the struts' lengths")
    return affine


def _varies(table: Floats) -> bool:
    return bool(np.ptp(table, axis=0).any())


def _affine(
    machine: Machine, columns: Indices, table: Floats, block: PoseBlock
) -> list[Affine] | None:
    """Each column as a constant and a multiple of its strut's length; None where one is not so."""
    of_strut = {int(column): k for k, column in enumerate(machine.kernel.length_parameters)}
    result: list[Affine] = []
    for at, column in enumerate(columns.tolist()):
        values = table[:, at]
        strut = of_strut.get(column)
        lengths = np.zeros(len(values)) if strut is None else block.lengths[:, strut]
        law = law_of_length(values, lengths)
        if law is None:
            return None
        constant, slope, slack = law
        result.append((column, (constant - slack, constant + slack), slope, strut or 0))
    return result


def _unknown(machine: Machine, source: Source, why: str) -> RequestError:
    return no_proof(
        machine,
        f"{source.name}: {why}",
        "sources that are the same at every pose of the region, or are enclosed over it",
        "bounds at poses take every source; or leave the source out of the machine file",
    )


def _told(progress: Progress | None) -> Callable[[int, float], bool]:
    """What the kernel calls between parts of its work: tells progress, and goes on.

    The number of boxes in all is that at which the whole region is finished, at the rate so far.
    """

    def told(boxes: int, share: float) -> bool:
        if progress is not None:
            progress(boxes, round(boxes / share) if share >= KNOWN else 0)
        return True

    return told


__all__ = ["SCHEMA", "bounds_over_region", "require_root", "required_gap"]
