"""Rows that the machine stands in another assembly mode in than the one reached from home.

Joints alone leave open in which assembly mode the machine stands. From home it is found in one;
beyond a singular pose it stands in another. Where readings give the pose, the forward solution
starts from there.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.calibration.data_checks import Suspicion
from truepose.calibration.data_checks._base import listed
from truepose.calibration.identification.fit import Fit
from truepose.calibration.identification.placement import Placements
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.robust import OUTLIER
from truepose.calibration.instruments import Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.assembly_modes import other_modes
from truepose.calibration.observables import OBSERVABLES
from truepose.machine import Machine
from truepose.spatial import euler_to_matrix, matrix_to_quaternion, quaternion_to_matrix

NEARER = 0.2
"""A placement is taken that is nearer to what was read than this share of the one before."""

APART = 1e-3
"""Placements nearer than this share of the machine are one; two modes meet only where singular."""

CODE = "other-assembly-mode"

MOST_ROWS = 50
"""So many rows that do not fit are tried in the other mode; more are no matter of modes."""


def placed_as_read(
    machine: Machine, measurements: Measurements, standing: Placements | None
) -> tuple[Measurements, Flags]:
    """The measurements with each row placed in the assembly mode that its readings show.

    And the rows (n_row,) that changed. `standing`: where the instruments stand. What an instrument
    does not read of the pose starts from the mode that is reached from home. Nothing changes where
    frames that are to be found cannot be.
    """
    changed = np.zeros(measurements.n_row, np.bool_)
    reading = [_reads_pose(measurements, number) for number in range(len(measurements.instruments))]
    if not any(reading) or standing is None:
        return measurements, changed
    instruments = list(measurements.instruments)
    for number, placement in standing.of.items():
        instruments[number] = dataclasses.replace(instruments[number], frame=placement.frame)
    placements = measurements.placements.copy()
    for number, instrument in enumerate(instruments):
        rows = np.flatnonzero(measurements.instrument == number)
        if reading[number] and rows.size:
            placements[rows] = _nearest(machine, measurements, instrument, rows)
    changed = (placements != measurements.placements).any(axis=1)
    return dataclasses.replace(measurements, placements=placements), changed


def _reads_pose(measurements: Measurements, number: int) -> bool:
    """Whether an instrument reads coordinates of its target, in all that it can move in."""
    return measurements.instruments[number].kind in ("pose", "position")


def _nearest(
    machine: Machine, measurements: Measurements, instrument: Instrument, rows: np.ndarray
) -> Floats:
    """(k, 7) placements of rows, or, where these are far from what was read, those found there."""
    before = measurements.placements[rows]
    frame = quaternion_to_matrix(instrument.frame.rotation)
    target = np.array(instrument.target)
    turned = quaternion_to_matrix(before[:, 3:])
    seen = (before[:, :3] + turned @ target - np.array(instrument.frame.origin)) @ frame
    read, angles = seen.copy(), np.full(seen.shape, np.nan)
    place = {int(row): at for at, row in enumerate(rows)}
    for at in np.flatnonzero(np.isin(measurements.row, rows)).tolist():
        name, row = OBSERVABLES[measurements.observable[at]], place[int(measurements.row[at])]
        if name in "xyz":
            read[row, "xyz".index(name)] = measurements.value[at]
        elif name in "abc":
            angles[row, "abc".index(name)] = measurements.value[at]
    with_angles = np.isfinite(angles).all(axis=1)
    rotations = turned.copy()
    rotations[with_angles] = frame @ euler_to_matrix(angles[with_angles])
    away = np.linalg.norm(seen - read, axis=1)
    points = read @ frame.T + np.array(instrument.frame.origin) - rotations @ target
    starts = before.copy()
    starts[:, :3] = points
    for at in np.flatnonzero(with_angles).tolist():
        starts[at, 3:] = matrix_to_quaternion(rotations[at])
    kernel = machine.kernel
    poses, status = kernel.forward(measurements.joints[rows], kernel.pose_of(starts), status=True)
    after = before.copy()
    solved = status <= 1
    after[solved] = kernel.placement_of(poses[solved])
    turned = quaternion_to_matrix(after[:, 3:])
    shown = (after[:, :3] + turned @ target - np.array(instrument.frame.origin)) @ frame
    nearer = solved & (np.linalg.norm(shown - read, axis=1) < NEARER * away)
    apart = np.linalg.norm(shown - seen, axis=1) > APART * machine.characteristic_length
    placements: Floats = np.where((nearer & apart)[:, np.newaxis], after, before)
    return placements


def of_other_modes(measurements: Measurements, rows: Flags) -> tuple[Suspicion, ...]:
    """What is said of rows (n_row,) that were placed in another assembly mode."""
    return _named(
        measurements,
        rows,
        "the readings are of another assembly mode of the machine than the one that it is in at "
        "home; they were taken as of that one",
    )


def in_unstated_modes(machine: Machine, fitted: Fit, whole: Measurements) -> tuple[Suspicion, ...]:
    """Rows that do not fit, and would, did the machine stand in its other assembly mode there.

    Readings that do not give the pose leave that to whoever measured. `whole`: all measurements, in
    which rows are counted.
    """
    data = fitted.measurements
    odd = np.zeros(data.n_row, np.bool_)
    odd[data.row[np.abs(fitted.standardised) >= OUTLIER]] = True
    numbers = np.flatnonzero(odd | fitted.unplaced)[:MOST_ROWS]
    if not numbers.size:
        return ()
    placements = data.placements.copy()
    placements[numbers], has = other_modes(machine, data.joints[numbers], placements[numbers])
    there = dataclasses.replace(data, placements=placements)
    problems = (fitted.problem, IdentificationProblem(machine, there, fitted.unknowns))
    here, other = (
        np.bincount(data.row, problem.residual(fitted.values) ** 2, data.n_row)[numbers]
        for problem in problems
    )
    better = has & (np.isnan(here) & np.isfinite(other) | (other < NEARER**2 * here))
    rows = np.zeros(whole.n_row, np.bool_)
    rows[np.flatnonzero(~whole.held_out)[numbers[better]]] = True
    return _named(
        whole,
        rows,
        "the readings would fit, did the machine stand in its other assembly mode there: if it "
        'did, say so by "-" in a column assembly_mode',
    )


def _named(measurements: Measurements, rows: Flags, sentence: str) -> tuple[Suspicion, ...]:
    numbers = np.flatnonzero(rows)
    if not numbers.size:
        return ()
    lines = tuple(int(line) for line in measurements.lines[numbers])
    in_file = all(lines)
    shown = [str(number) for number in (lines if in_file else (numbers + 1).tolist())]
    more = [f"{len(shown) - 6} more"] if len(shown) > 6 else []
    word = f"{'line' if in_file else 'row'}{'s' if len(shown) > 1 else ''}"
    return (
        Suspicion(
            CODE,
            f"{word} {listed([*shown[:6], *more])}: {sentence}",
            rows=tuple(numbers.tolist()),
            lines=lines if in_file else (),
            refuses=False,
        ),
    )


__all__ = ["CODE", "in_unstated_modes", "of_other_modes", "placed_as_read"]
