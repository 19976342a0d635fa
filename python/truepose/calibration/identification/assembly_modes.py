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
from truepose.calibration.identification.fit import place_instruments
from truepose.calibration.identification.frames import rebase_frame
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.instruments import Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.spatial import euler_to_matrix, matrix_to_quaternion, quaternion_to_matrix

NEARER = 0.2
"""A placement is taken that is nearer to what was read than this share of the one before."""

APART = 1e-3
"""Placements nearer than this share of the machine are one; two modes meet only where singular."""

CODE = "other-assembly-mode"


def placed_as_read(
    machine: Machine, measurements: Measurements, unknowns: Unknowns
) -> tuple[Measurements, Flags]:
    """The measurements with each row placed in the assembly mode that its readings show.

    And the rows (n_row,) that changed. What an instrument does not read of the pose starts from
    the mode that is reached from home. Nothing changes where frames that are to be found cannot be.
    """
    changed = np.zeros(measurements.n_row, np.bool_)
    reading = [_reads_pose(measurements, number) for number in range(len(measurements.instruments))]
    if not any(reading):
        return measurements, changed
    if any(any(each.frame.unknown) for each in measurements.instruments):
        try:
            problem, values = place_instruments(machine, measurements, unknowns)
        except RequestError:
            return measurements, changed
        instruments = rebase_frame(problem.measurements, unknowns, values).instruments
    else:
        instruments = measurements.instruments
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
    numbers = np.flatnonzero(rows)
    if not numbers.size:
        return ()
    lines = tuple(int(line) for line in measurements.lines[numbers])
    word = "line" if all(lines) else "row"
    shown = [str(line) for line in (lines if all(lines) else (numbers + 1).tolist())]
    more = [f"{len(shown) - 6} more"] if len(shown) > 6 else []
    sentence = (
        f"{word}{'s' if numbers.size > 1 else ''} {listed([*shown[:6], *more])}: the readings are "
        "of another assembly mode of the machine than the one that it is in at home; they were "
        "taken as of that one"
    )
    return (
        Suspicion(
            CODE,
            sentence,
            rows=tuple(numbers.tolist()),
            lines=lines if all(lines) else (),
            refuses=False,
        ),
    )


__all__ = ["CODE", "of_other_modes", "placed_as_read"]
