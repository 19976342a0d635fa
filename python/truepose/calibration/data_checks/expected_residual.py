"""How far readings may be from the nominal machine's: by tolerances, other sources and noise."""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import Unknowns
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES, UNITS, is_parameter
from truepose.machine import Machine
from truepose.sources import Deviation, PoseBlock, acting
from truepose.sources.tolerance import DimensionalTolerance, bands_of

A, LENGTH, DIRECTION = (OBSERVABLES.index(name) for name in ("a", "length", "direction.x"))

OF_TARGET = [OBSERVABLES.index(name) for name in ("x", "y", "z", "distance", "separation")]
"""What an uncertain target makes uncertain."""

MACHINES = 24
"""Machines that are drawn, each tolerance at one of its ends: the spread is known to a seventh."""

ASSUMED = 5e-3
"""Where a file states no tolerance: this share of the machine's size, and this angle in rad."""


def expected_residual(machine: Machine, measurements: Measurements) -> Floats:
    """(n_observation,) SI: root of the sum of squares of what each cause may do to a reading.

    Tolerances by machines drawn at the ends of their bands and solved, so that a reading of a strut
    counts with its own length. Coordinates of one row share one number, and so do angles and
    directions, because an unknown frame may turn one into another.
    """
    size = _size(machine, measurements)
    by_tolerance = _by_tolerance(machine, measurements, size)
    linear, angular, own = _by_others(machine, measurements)
    row, observable = measurements.row, measurements.observable
    others = np.select(
        [
            is_parameter(observable),  # measured cold and without loads
            observable == LENGTH,
            np.array([unit == "m" for unit in UNITS])[observable],
        ],
        [np.zeros(row.size), np.hypot(linear, own)[row], linear[row]],
        np.hypot(angular, linear / size)[row],
    )
    known = np.array([max(each.target_uncertainty) for each in measurements.instruments])
    target = known[measurements.instrument[row]]
    target[~np.isin(observable, OF_TARGET)] = 0.0
    squares = by_tolerance**2 + others**2 + measurements.uncertainty**2 + target**2
    allowed: Floats = np.sqrt(squares)
    return allowed


def _size(machine: Machine, measurements: Measurements) -> float:
    """Of the machine, m: its longest strut and the reach of its tool, whichever is more."""
    centres = machine.kernel.joint_centres(measurements.joints, measurements.placements)
    along = centres[:, :, 1] - centres[:, :, 0]
    reach = np.ptp(measurements.placements[:, :3], axis=0)
    return float(max(np.linalg.norm(along, axis=2).max(), np.linalg.norm(reach)))


def _by_tolerance(machine: Machine, measurements: Measurements, size: float) -> Floats:
    unit = np.array(UNITS)[measurements.observable]
    assumed = np.where(unit == "m", ASSUMED * size, ASSUMED)
    bands = bands_of(machine)
    if bands is None:
        return assumed
    problem = IdentificationProblem(machine, measurements, _in_half_bands(bands))
    ends = np.random.default_rng(0).choice([-1.0, 1.0], (MACHINES, bands.n_variable))
    nominal = problem.residual(np.zeros(bands.n_variable + 1))
    gaps = [problem.residual(np.append(signs, 1.0)) - nominal for signs in ends]
    # Of angles, the nearest way round.
    turn = 2.0 * np.pi / measurements.uncertainty
    table = np.where(unit == "rad", gaps - turn * np.round(gaps / turn), gaps)
    table = (table * measurements.uncertainty) ** 2
    solved = np.isfinite(table)
    # Where no drawn machine could be solved, as near a singularity: as if no tolerance were given.
    mean = np.where(solved, table, 0.0).sum(axis=0) / np.maximum(solved.sum(axis=0), 1)
    return _shared(measurements, np.where(solved.any(axis=0), mean, assumed**2))


def _in_half_bands(bands: Deviation) -> Unknowns:
    """The variables of the tolerances, each in its half bands, and after them the bands' middles.

    A reading is predicted of them as of any unknowns.
    """
    columns, places = np.unique(bands.parameters, return_inverse=True)
    count = bands.n_variable + 1
    effects = np.zeros((columns.size, count))
    np.add.at(effects, (places, bands.variables), bands.signed_half[0])
    np.add.at(effects[:, -1], places, bands.shift[0])
    none = ("",) * count
    return Unknowns(
        none,
        none,
        none,
        count,
        columns.astype(np.intp),
        effects,
        np.zeros(count),
        np.eye(count),
        np.ones(count),
    )


def _shared(measurements: Measurements, squares: Floats) -> Floats:
    """(n_observation,) roots, with one mean for the coordinates, angles, directions of a row."""
    observable = measurements.observable
    family = np.select(
        [
            observable < A,
            observable < A + 3,
            (observable >= DIRECTION) & (observable < DIRECTION + 3),
        ],
        [0, 1, 2],
        3 + np.arange(observable.size),
    )
    key = np.stack([measurements.row, family, measurements.strut], axis=1)
    _, which = np.unique(key, axis=0, return_inverse=True)
    which = which.ravel()
    mean = np.bincount(which, squares) / np.bincount(which)
    roots: Floats = np.sqrt(mean[which])
    return roots


def _by_others(machine: Machine, measurements: Measurements) -> tuple[Floats, Floats, Floats]:
    """What sources other than tolerances do: (n_row,) m and rad at the tool, m to struts' lengths.

    What they know of the rows' temperatures and loads, and the half bands of what they do not; to a
    length in itself as much as to any parameter of that unit.
    """
    linear, angular, own = np.zeros((3, measurements.n_row))
    columns = [machine.dof.index(freedom) for freedom in machine.commanded]
    poses = machine.kernel.pose_of(measurements.placements)[:, columns]
    moves = np.array([component in "xyz" for component in machine.components])
    metres = np.array([unit == "m" for unit in machine.units])
    number = {id(condition): condition for condition in measurements.conditions}
    which = np.array([id(condition) for condition in measurements.conditions])
    for key, condition in number.items():
        rows = np.flatnonzero(which == key)
        joints, placements = measurements.joints[rows], measurements.placements[rows]
        block = PoseBlock(machine, condition, poses[rows], np.arange(rows.size), joints, placements)
        known = np.zeros((rows.size, moves.size))
        squares = np.zeros((rows.size, moves.size))
        for source in acting(machine, condition):
            if isinstance(source, DimensionalTolerance):
                continue
            deviation = source.deviation(machine, condition, block)
            if not deviation.parameters.size:
                continue
            slope, _ = machine.kernel.sensitivity_at(joints, placements, deviation.parameters)
            slope = np.nan_to_num(slope)
            shift = np.broadcast_to(deviation.shift, (rows.size, deviation.parameters.size))
            half = np.broadcast_to(deviation.half, shift.shape)
            known += np.einsum("nik,nk->ni", slope, shift)
            squares += np.einsum("nik,nk->ni", slope**2, half**2)
            lengths = metres[deviation.parameters]
            if lengths.any():
                own[rows] += (np.abs(shift) + half)[:, lengths].max(axis=1)
        total = known**2 + squares
        linear[rows] = np.sqrt(total[:, moves].sum(axis=1))
        angular[rows] = np.sqrt(total[:, ~moves].sum(axis=1))
    return linear, angular, own
