"""Readings of machines drawn within their tolerances, and blunders made in them, for tests."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike, NDArray

from made_measurements import made_measurements, nominal_values, poses_within, rotation_matrix
from truepose.calibration.instruments import Instrument
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.machine import Machine
from truepose.sources.tolerance import DimensionalTolerance
from truepose.spatial import matrix_to_quaternion, vector_to_matrix

Floats = NDArray[np.float64]


def drawn(machine: Machine, seed: int) -> Machine:
    """The machine with every tolerance somewhere in its band."""
    (bands,) = (each.bands for each in machine.sources if isinstance(each, DimensionalTolerance))
    t = np.random.default_rng(seed).uniform(-1.0, 1.0, bands.n_variable)
    moved = np.zeros(len(machine.parameters))
    np.add.at(moved, bands.parameters, (bands.shift + bands.signed_half * t[bands.variables])[0])
    columns = np.flatnonzero(moved)
    return machine.replace(
        {machine.parameters[k]: float(machine.nominal[k] + moved[k]) for k in columns}
    )


def shown(
    nominal: Machine,
    actual: Machine,
    measurements: Measurements,
    instrument: Instrument | None = None,
) -> Floats:
    """(n_observation,) what an actual machine shows at the commanded joints, without noise.

    `instrument`: the one that measured, where it is not as declared.
    """

    def standing(joints: Floats, placements: Floats) -> Floats:
        start = nominal.kernel.pose_of(placements)
        poses, status = actual.kernel.forward(joints, start, status=True)
        assert (status <= 1).all()
        return np.asarray(actual.kernel.placement_of(poses))

    there = dataclasses.replace(
        measurements, placements=standing(measurements.joints, measurements.placements)
    )
    joints, others = measurements.other_joints, measurements.other_placements
    if joints is not None and others is not None:
        there = dataclasses.replace(there, other_placements=standing(joints, others))
    if instrument is not None:
        there = dataclasses.replace(there, instruments=(instrument,))
    return nominal_values(actual, there)


def elsewhere(
    instrument: Instrument, origin: ArrayLike, rotation: ArrayLike, target: ArrayLike | None = None
) -> Instrument:
    """The instrument with its frame moved by `origin`, m, and turned by a vector, rad."""
    frame = instrument.frame
    matrix = vector_to_matrix(np.asarray(rotation, float)) @ rotation_matrix(frame.rotation)
    return dataclasses.replace(
        instrument,
        frame=dataclasses.replace(
            frame,
            origin=tuple(np.add(frame.origin, origin).tolist()),
            rotation=matrix_to_quaternion(matrix),
        ),
        target=instrument.target if target is None else tuple(np.asarray(target).tolist()),
    )


def with_noise(measurements: Measurements, value: Floats, seed: int) -> Measurements:
    noise = np.random.default_rng(seed + 1000).standard_normal(value.size)
    return measurements.with_values(value + noise * measurements.uncertainty)


def good(
    machine: Machine, kind: str, *, seed: int = 0, count: int = 24, frame: str = "base"
) -> Measurements:
    """Good readings of a machine within its tolerances; an unknown frame stands anywhere."""
    made = made_measurements(
        machine, kind, poses_within(machine, count, seed), frame=frame, values="nominal"
    )
    true = made.instruments[0]
    if frame == "unknown":
        random = np.random.default_rng(seed + 7)
        unknown = np.array(true.frame.unknown, float)
        far = unknown * np.r_[random.uniform(-1.0, 1.0, 3), random.uniform(-0.3, 0.3, 3)]
        true = elsewhere(true, far[:3], far[3:])
    return with_noise(made, shown(machine, drawn(machine, seed), made, true), seed)


def column(measurements: Measurements, name: str, strut: int = -1) -> NDArray[np.intp]:
    """Places of a column among the observations, in the order of rows."""
    mine = (measurements.observable == OBSERVABLES.index(name)) & (measurements.strut == strut)
    return np.flatnonzero(mine)


def exchanged(
    measurements: Measurements, one: NDArray[np.intp], other: NDArray[np.intp]
) -> Measurements:
    value = measurements.value.copy()
    value[one], value[other] = measurements.value[other], measurements.value[one]
    return measurements.with_values(value)


def scaled(
    measurements: Measurements, at: NDArray[np.intp] | slice, factor: ArrayLike
) -> Measurements:
    value = measurements.value.copy()
    value[at] *= factor
    return measurements.with_values(value)


def recommanded(machine: Machine, measurements: Measurements, joints: Floats) -> Measurements:
    """The same readings beside other joints, where the nominal machine then is."""
    poses, status = machine.kernel.forward(joints, status=True)
    assert (status <= 1).all()
    placements = machine.kernel.placement_of(poses)
    return dataclasses.replace(measurements, joints=joints, placements=placements)
