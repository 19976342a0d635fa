"""Strain: which errors the clearances absorb, and which force the structure (Nakamura & Murai).

A machine with more closures than freedoms closes no more once its parameters deviate. Clearances of
its joints take up what they can; what they cannot the parts take by giving way, with

    energy = 1/2 sum over closures ij of (g - s)_i K_ij (g - s)_j - wrench . twist   least,
    |s_i| <= half the clearance of closure i

g the closures' residuals at the platform's pose, K their stiffness, s what each clearance takes. A
closure inside its clearance floats and carries nothing. Here the clearances are dead zones, pose by
pose and exact; the budget has none (docs/over_constrained.md).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Flags, Floats
from truepose.error_budget import worst
from truepose.error_budget.comparison import Highest
from truepose.errors import Problem, RequestError
from truepose.machine import Condition, Machine
from truepose.runs.arguments import checked
from truepose.runs.dataset import Schema, Variable, label
from truepose.runs.displacement import ParameterDeviation, sum_deviations
from truepose.runs.poses import (
    Progress,
)
from truepose.runs.run import Run
from truepose.sources import Clearance, Deviation, Elastic, Loads, PoseBlock, Source
from truepose.sources.clearance import half_clearances

if TYPE_CHECKING:
    import xarray as xr

FITS = 1e-9
"""Force, in that of a misfit as large as the deviation, at or below which it is rounding."""

ABSORBED = 1e-6
"""Part of the rigid force at or below which clearances have taken all: rounding, far above it."""

STRAINS = 0.99
"""Part of the rigid force above which clearances take nothing to speak of."""

VERDICTS = ("fits", "absorbed", "partly", "strains")

_EACH = ("pose", "source", "closure")
_ALL = ("pose", "closure")
_OVER = ("source",)

SCHEMA: Schema = {
    "force": Variable(
        _EACH, "N", "internal force, clearances open, where the source loads the closure most"
    ),
    "force_rigid": Variable(_EACH, "N", "the same to first order, had the joints no clearance"),
    "absorbed": Variable(_EACH, "m", "misfit of the closure that its clearance takes there"),
    "strain": Variable(_EACH, "m", "misfit of the closure that its parts take by giving way there"),
    "overall_force": Variable(_ALL, "N", "force from all sources at their shifts and all loads"),
    "overall_absorbed": Variable(_ALL, "m", "what the closure's clearance takes of these"),
    "overall_strain": Variable(_ALL, "m", "what the closure's parts take of these"),
    "highest_force": Variable(_OVER, "N", "highest |force| over poses and closures"),
    "highest_force_rigid": Variable(_OVER, "N", "highest |force_rigid| over poses and closures"),
    "remaining": Variable(_OVER, "1", "highest_force over highest_force_rigid"),
    "verdict": Variable(_OVER, "1", "fits, absorbed, partly or strains", str),
}

_OF_LOADS = (Elastic, Loads)
"""Deflections under load. They always fit, to first order; here the loads act themselves."""


@checked
def strain(
    machine: Machine,
    poses: ArrayLike | None = None,
    condition: Condition | None = None,
    *,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Internal forces of an over-constrained machine, from each source and from all together.

    `poses` (..., n_commanded), SI, default the file's workspace; `condition`, default the file's;
    `progress` is called with (poses done, poses in all). Each source alone and without load, at the
    corner of its deviation that loads each closure most to first order; all together at their
    shifts under the wrench on the tool, weight and inertia. Exact, with the joints' clearances as
    dead zones. The Dataset, SI, is described in docs/results.md.

    Raises `RequestError`: nothing-strains where there are as many closures as freedoms; bad-poses,
    no-workspace, no-source, no-pose-left; `TrueposeError` as the sources do.
    """
    if not machine.kernel.overconstrained:
        raise RequestError(_nothing_strains(machine))
    run = Run(machine, poses, condition, progress)
    sources, of_loads = _by_loads(run.sources)
    rows = run.begin(SCHEMA, source=len(sources))
    tally = _Tally(len(sources))
    for block in run:
        for source in of_loads:
            source.deviation(machine, run.condition, block)  # refuses what it cannot carry
        values, fit, statuses = _evaluate(block, sources)
        tally.add(values, fit, run.fill(block, values, *statuses))
    if rows.count == 0:
        raise run.no_pose_left()
    names = np.array([source.name for source in sources], np.str_)
    return run.dataset(
        over_all=tally.over_all(), coords={"source": label("source", names, "error source")}
    )


def _nothing_strains(machine: Machine) -> Problem:
    count = len(machine.closures)
    return Problem(
        code="nothing-strains",
        message="nothing strains: the machine has as many closures as freedoms",
        file=machine.file,
        found=f"{count} closures for {len(machine.dof)} freedoms",
        expected="a machine with more closures than freedoms",
        hint="here every error moves the platform, and none forces the structure: `truepose "
        "budget` says how much",
    )


def _by_loads(sources: Sequence[Source]) -> tuple[list[Source], list[Source]]:
    """The sources that may not fit, and those that deflect under load; the former may be none.

    Clearance is neither: it is the dead zone.
    """
    of_loads: list[Source] = [source for source in sources if isinstance(source, _OF_LOADS)]
    neither = (Clearance, *_OF_LOADS)
    return [source for source in sources if not isinstance(source, neither)], of_loads


@dataclass(frozen=True)
class _Rest:
    """A machine at rest: (n, n_closure) in N, m and m, and a status (n,)."""

    force: Floats
    absorbed: Floats
    strain: Floats
    status: np.ndarray


@dataclass(frozen=True)
class _Fit:
    """By pose and source (n, n_source), N: its own rigid force, and that of the largest misfit."""

    force: Floats
    misfit: Floats


@dataclass(frozen=True)
class _Corners:
    """Where a source loads each closure most, to first order.

    `values`: deviations (n or 1, k), one of them for each closure, or one for all.
    `force_rigid` (n, n_closure): N, first-order force there without clearances, and `own` what of
    it is the source's; the rest is there in a machine that does not fit as it is drawn.
    """

    values: list[Floats]
    force_rigid: Floats
    own: Floats
    status: np.ndarray


def _evaluate(
    block: PoseBlock, sources: Sequence[Source]
) -> tuple[dict[str, np.ndarray], _Fit, list[np.ndarray]]:
    """Every variable over poses for one block, what decides on a fit, and all statuses (n,)."""
    machine, n_pose = block.machine, block.indices.size
    n_closure = len(machine.closures)
    gaps = np.zeros((n_pose, n_closure))
    gaps[:, : len(machine.struts)] = half_clearances(block)  # a guide has none
    values: dict[str, np.ndarray] = {
        name: np.empty((n_pose, len(sources), n_closure))
        for name, variable in SCHEMA.items()
        if variable.dims == _EACH
    }
    deviations = [source.deviation(machine, block.condition, block) for source in sources]
    unloaded = np.zeros((1, 6))
    drawn = _settle(block, sum_deviations([]), np.zeros((1, n_closure)), unloaded)
    fit = _Fit(np.empty((n_pose, len(sources))), np.empty((n_pose, len(sources))))
    stiffest = _stiffest(block)
    statuses: list[np.ndarray] = [drawn.status]
    for at, deviation in enumerate(deviations):
        corners = _corners(block, deviation, drawn.force)
        statuses.append(corners.status)
        fit.force[:, at] = np.abs(corners.own).max(axis=1)
        fit.misfit[:, at] = stiffest * _misfit(machine, deviation)
        values["force_rigid"][:, at] = corners.force_rigid
        for number, corner in enumerate(corners.values):
            closures = slice(None) if len(corners.values) == 1 else number
            moved = sum_deviations([(deviation.parameters, corner)])
            rest = _settle(block, moved, gaps, unloaded)
            statuses.append(rest.status)
            values["force"][:, at, closures] = rest.force[:, closures]
            values["absorbed"][:, at, closures] = rest.absorbed[:, closures]
            values["strain"][:, at, closures] = rest.strain[:, closures]
    shifts = [(deviation.parameters, deviation.shift) for deviation in deviations]
    wrench = block.tool_wrench + block.own_wrench
    rest = _settle(block, sum_deviations([*shifts, *_own_weight(block)]), gaps, wrench)
    values["overall_force"] = rest.force
    values["overall_absorbed"] = rest.absorbed
    values["overall_strain"] = rest.strain
    return values, fit, [*statuses, rest.status]


def _corners(block: PoseBlock, deviation: Deviation, drawn: Floats) -> _Corners:
    """The corners of a source's deviation, from the forces of unit deviations.

    `drawn` (n, n_closure): N, the forces in the nominal machine.
    """
    kernel, columns = block.machine.kernel, deviation.parameters
    slopes, status = kernel.internal_forces_at(block.joints, block.placements, columns)
    own: Floats = (slopes * deviation.shift[:, np.newaxis]).sum(axis=2)
    force = drawn + own
    banded = deviation.banded
    if not banded.size:
        return _Corners([deviation.shift], force, own, status)
    effects, variable = worst.by_variable(deviation, slopes[:, :, banded])
    down, up = deviation.domain.reach(effects)
    # A band alone pulls and pushes alike: then the corner that pulls.
    side = np.where(force + 0.5 * (up - down) < -FITS * 0.5 * (up + down), -1.0, 1.0)
    width = np.where(side < 0.0, down, up)
    known = np.abs(effects) > FITS * width[:, :, np.newaxis]
    along = deviation.domain.most_along(side[:, :, np.newaxis] * effects)
    toward = np.where(known, along, 0.0)
    corners = []
    for closure in range(force.shape[1]):
        corner = np.repeat(deviation.shift, len(toward) // len(deviation.shift), axis=0)
        corner[:, banded] += deviation.signed_half[:, banded] * toward[:, closure][:, variable]
        corners.append(corner)
    return _Corners(
        corners, force + side * width, np.maximum(np.abs(own - down), np.abs(own + up)), status
    )


def _settle(block: PoseBlock, moved: ParameterDeviation, gaps: Floats, wrench: Floats) -> _Rest:
    """The machine with its parameters moved, at rest within `gaps` (n, n_closure), half, m."""
    columns, values = moved
    _, force, absorbed, strained, status = block.machine.kernel.settle_at(
        block.joints, block.placements, columns, np.ascontiguousarray(values), gaps, wrench
    )
    return _Rest(force, absorbed, strained, status)


def _own_weight(block: PoseBlock) -> list[ParameterDeviation]:
    """What gives way under weight that does not act on the platform: at the bases, along struts."""
    uneven = block.uneven_stretch
    lengths = block.machine.kernel.length_parameters
    moved: list[ParameterDeviation] = [] if uneven is None else [(lengths, uneven)]
    if block.base_forces is None:
        return moved
    yielding = block.compliances
    columns = yielding.columns
    forces = block.base_forces.reshape(len(block.base_forces), -1)
    kernel = block.machine.kernel
    loads = kernel.base_loads_at(block.joints, block.placements, forces, columns)
    return [*moved, (columns, yielding.deflection(loads))]


def _misfit(machine: Machine, deviation: Deviation) -> Floats:
    """(n or 1,) m: what the deviation could at most misfit by, angles by the machine's size."""
    size = machine.characteristic_length
    arms = [1.0 if machine.units[column] == "m" else size for column in deviation.parameters]
    misfit: Floats = (np.abs(deviation.shift) + deviation.half) @ np.array(arms)
    return misfit


def _stiffest(block: PoseBlock) -> Floats:
    """(n,) N/m: the largest force that one unit of misfit, along a strut, makes anywhere."""
    kernel = block.machine.kernel
    slopes, _ = kernel.internal_forces_at(block.joints, block.placements, kernel.length_parameters)
    return np.asarray(np.abs(slopes).max(axis=(1, 2)))


class _Tally:
    """What is highest over poses and closures, and the verdict."""

    def __init__(self, n_source: int) -> None:
        self._force = Highest((n_source,))
        self._rigid = Highest((n_source,))
        self._own = Highest((n_source,))
        self._misfit = Highest((n_source,))

    def add(self, values: dict[str, np.ndarray], fit: _Fit, usable: Flags) -> None:
        """The poses of a block where `usable` (n,)."""
        if usable.any():
            self._force.add(np.abs(values["force"][usable]).max(axis=2))
            self._rigid.add(np.abs(values["force_rigid"][usable]).max(axis=2))
            self._own.add(fit.force[usable])
            self._misfit.add(fit.misfit[usable])

    def over_all(self) -> dict[str, Any]:
        """Every variable that has no pose."""
        force, rigid = self._force.value, self._rigid.value
        fits = self._own.value <= FITS * self._misfit.value
        remaining = np.divide(force, rigid, out=np.zeros_like(force), where=~fits)
        chosen = np.select([fits, remaining <= ABSORBED, remaining <= STRAINS], [0, 1, 2], 3)
        return {
            "highest_force": force,
            "highest_force_rigid": rigid,
            "remaining": remaining,
            "verdict": np.array([VERDICTS[index] for index in chosen], np.str_),
        }


__all__ = ["SCHEMA", "VERDICTS", "strain"]
