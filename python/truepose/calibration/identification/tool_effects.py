"""What unknowns do at the tool over the workspace, and further measurements that could help."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike

from truepose._kernel import STATUS
from truepose.arrays import Flags, Floats
from truepose.calibration.acceptance import Candidate
from truepose.calibration.acceptance.observability import project_out_instruments, row_covariance
from truepose.calibration.acceptance.tool_uncertainty import (
    Tool,
    commanded_components,
    tool_components,
)
from truepose.calibration.identification.fit import Fit
from truepose.calibration.identification.problem import (
    IdentificationProblem,
    property_effects,
    row_shifts,
)
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.instruments._base import Frame, Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.errors import Problem as Refused
from truepose.errors import RequestError
from truepose.machine import Condition, Machine
from truepose.runs.poses import OK, requested_poses

MOST_POSES = 300
"""Poses of the workspace at which the tool's uncertainty is computed; more are thinned evenly."""

OUT_OF_TRAVEL = STATUS.index("out_of_travel")

FURTHER = (5, 20)
"""Numbers of further poses that are tried as a remedy."""


def workspace_poses(machine: Machine, poses: ArrayLike | None) -> Floats:
    """Poses (n, n_commanded) that the machine as filed can take, thinned evenly.

    Raises `RequestError` (no-workspace, no-pose-left).
    """
    table = machine.poses() if poses is None else requested_poses(machine, poses)
    if len(table) > MOST_POSES:
        table = table[np.linspace(0, len(table) - 1, MOST_POSES).round().astype(np.intp)]
    _, _, status = machine.kernel.place(table)
    usable = status == OK
    if not usable.any():
        raise RequestError(
            Refused(
                "no-pose-left",
                "the machine can reach none of the poses",
                machine.file,
                found=f"{len(table)} poses",
                expected="poses of the workspace that it reaches",
            )
        )
    reached: Floats = table[usable]
    return reached


@dataclasses.dataclass(frozen=True, eq=False)
class ToolEffects:
    """What unknowns do at the tool of the machine in use: commanded as it was found to be.

    `effects` (n_usable, n_component, n_machine): d(error of the tool)/d(unknown), base frame.
    `positions` (n_usable, 3), m. `usable` (n_pose,): whether the calibrated machine can be there.
    """

    effects: Floats
    positions: Floats
    usable: Flags


def tool_effects(
    machine: Machine, unknowns: Unknowns, values: Floats, poses: Floats
) -> ToolEffects:
    """At `poses` (n_pose, n_commanded), to which the joints take the machine with these values.

    They are those of its own inverse kinematics: what a controller commands that holds the
    calibrated machine, or whose commands are compensated. Properties act as the machine's own
    condition lets them.
    """
    change = unknowns.parameter_change(values)[np.newaxis, :]
    columns = unknowns.columns
    joints, placements, placed = machine.kernel.corrected(poses, columns, change)
    slopes, status = machine.kernel.sensitivity_moved(joints, placements, columns, columns, change)
    effects = slopes @ unknowns.effects[:, : unknowns.n_machine]
    if unknowns.properties:
        rows = _without_readings(joints, placements, (machine.condition,) * len(joints))
        base = row_shifts(machine, rows, unknowns)
        for number, (own, amounts) in property_effects(machine, rows, unknowns, base):
            sensitivity, _ = machine.kernel.sensitivity_moved(
                joints, placements, own, columns, change
            )
            effects[:, :, number] = np.einsum("pck,pk->pc", sensitivity, amounts)
    # Out of travel there is a pose as well, and an offset that is found moves the travel with it.
    usable = np.isin(placed, (OK, OUT_OF_TRAVEL)) & (status == OK)
    return ToolEffects(effects[usable], placements[usable, :3], usable)


def relative_tool(
    machine: Machine, effects: ToolEffects, rows: Floats, unknowns: Unknowns
) -> tuple[Tool, bool]:
    """The tool without what moves the machine as a whole in an instrument's frame; if that does.

    `rows` (m, n): weighted derivatives of the readings that leave it open.
    """
    components, commanded = tool_components(machine), commanded_components(machine)
    tool = Tool.of(effects.effects, components, effects.positions, commanded)
    n = unknowns.n_machine
    if unknowns.count == n:
        return tool, False
    sigma: Floats = np.sqrt(np.diagonal(unknowns.prior_covariance)[:n])
    seen = row_covariance(project_out_instruments(rows, n, sigma))
    gauge = tool.sort(seen, with_gauge=True).gauge
    return tool.relative(gauge), len(gauge) > 0


def _without_readings(
    joints: Floats, placements: Floats, conditions: tuple[Condition, ...]
) -> Measurements:
    """Rows without a reading."""
    count = len(joints)
    nothing = np.empty(0, np.intp)
    return Measurements(
        (),
        joints,
        placements,
        np.zeros(count, np.intp),
        conditions,
        np.zeros(count, np.bool_),
        nothing,
        nothing,
        nothing,
        np.empty(0),
        np.empty(0),
        np.zeros(count, np.intp),
    )


def candidates(machine: Machine, fit: Fit) -> list[Candidate]:
    """Measurements that could be added: more coordinates, more poses, all three coordinates.

    Their cost is the number of readings.
    """
    additions = []
    data = fit.measurements
    for number, instrument in enumerate(data.instruments):
        read = data.observables(number)
        missing = [axis for axis in "xyz" if axis not in read and axis in machine.components]
        if instrument.kind == "coordinate" and missing:
            what = " and ".join(missing)
            rows = _more_coordinates(machine, fit, number, missing)
            additions.append(
                Candidate(f"{instrument.name}: {what}", len(rows), f"probe in {what} too", rows)
            )
    for number, instrument in enumerate(data.instruments):
        if not data.posed[data.instrument == number].all():
            continue
        for count in FURTHER:
            more = _more_poses(machine, fit, number, count)
            if more is not None:
                sentence = (
                    f"measure {count} more poses over the whole workspace with {instrument.name}"
                )
                name = f"{instrument.name}: {count} poses"
                additions.append(Candidate(name, len(more), sentence, more))
    axes = [axis for axis in "xyz" if axis in machine.components]
    tracked = any(set(axes) <= set(data.observables(at)) for at in range(len(data.instruments)))
    if not tracked and data.posed.any():
        rows = _tracker_rows(machine, fit, axes)
        sentence = f"measure {', '.join(axes)} of the tool at these poses, as a laser tracker does"
        additions.append(Candidate("tracker", 2 * len(rows), sentence, rows))
    return [candidate for candidate in additions if np.isfinite(candidate.rows).all()]


def _rows(machine: Machine, fit: Fit, data: Measurements) -> Floats:
    """(m, n) whitened derivatives of other readings, at the fitted values."""
    problem = IdentificationProblem(machine, data, fit.unknowns)
    jacobian: Floats = problem.jacobian(fit.values) / data.uncertainty[:, np.newaxis]
    return jacobian


def _observing(
    data: Measurements, rows: np.ndarray, observables: list[str], uncertainty: float, by: int
) -> Measurements:
    """The rows `rows` of data, each with these observables and no values."""
    kept = data.select(np.isin(np.arange(data.n_row), rows))
    codes = np.array([OBSERVABLES.index(name) for name in observables], np.intp)
    count = kept.n_row * codes.size
    return dataclasses.replace(
        kept,
        instrument=np.full(kept.n_row, by, np.intp),
        row=np.repeat(np.arange(kept.n_row), codes.size),
        observable=np.tile(codes, kept.n_row),
        strut=np.full(count, -1, np.intp),
        value=np.zeros(count),
        uncertainty=np.full(count, uncertainty),
    )


def _typical_uncertainty(data: Measurements, number: int) -> float:
    own = data.instrument[data.row] == number
    return float(np.median(data.uncertainty[own])) if own.any() else 1e-5


def _more_coordinates(machine: Machine, fit: Fit, number: int, axes: list[str]) -> Floats:
    data = fit.measurements
    rows = np.flatnonzero(data.instrument == number)
    return _rows(
        machine, fit, _observing(data, rows, axes, _typical_uncertainty(data, number), number)
    )


def _more_poses(machine: Machine, fit: Fit, number: int, count: int) -> Floats | None:
    """More rows of one instrument, of the kind that it has most, over the workspace."""
    data = fit.measurements
    own = np.flatnonzero(data.instrument == number)
    if machine.workspace is None or not own.size:
        return None
    poses = machine.poses()
    poses = poses[np.linspace(0, len(poses) - 1, count).round().astype(np.intp)]
    joints, placements, status = machine.kernel.place(poses)
    usable = status == OK
    joints, placements = joints[usable], placements[usable]
    first = own[0]
    of_first = data.row == first
    size = int(of_first.sum())
    total = len(joints)
    more = dataclasses.replace(
        data,
        joints=joints,
        placements=placements,
        instrument=np.full(total, number, np.intp),
        conditions=(data.conditions[first],) * total,
        held_out=np.zeros(total, np.bool_),
        row=np.repeat(np.arange(total), size),
        observable=np.tile(data.observable[of_first], total),
        strut=np.tile(data.strut[of_first], total),
        value=np.zeros(total * size),
        uncertainty=np.tile(data.uncertainty[of_first], total),
        lines=np.zeros(total, np.intp),
        other_joints=None,
        other_placements=None,
    )
    if data.between[first]:
        # From each pose to the one half of them further on.
        half = max(total // 2, 1)
        more = dataclasses.replace(
            more,
            other_joints=np.roll(joints, half, axis=0),
            other_placements=np.roll(placements, half, axis=0),
        )
    return _rows(machine, fit, more) if total else None


def _tracker_rows(machine: Machine, fit: Fit, axes: list[str]) -> Floats:
    """Coordinates of the tool point in the base frame at every row, to 10 um."""
    data = fit.measurements
    tracker = Instrument("tracker", "position", Frame())
    wide = dataclasses.replace(data, instruments=(*data.instruments, tracker))
    rows = np.flatnonzero(data.posed)
    return _rows(machine, fit, _observing(wide, rows, axes, 10e-6, len(data.instruments)))
