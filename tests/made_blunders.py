"""Readings of machines drawn within their tolerances, and blunders made in them, for tests."""

from __future__ import annotations

import dataclasses
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from made_measurements import made_measurements, poses_within
from truepose.calibration.data_checks.nominal import Geometry, Placement, nominal_readings
from truepose.calibration.measurements import Measurements
from truepose.calibration.observables import OBSERVABLES
from truepose.machine import Machine
from truepose.sources.tolerance import DimensionalTolerance
from truepose.spatial import vector_to_matrix

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
    setups: list[Placement] | None = None,
) -> Floats:
    """(n_observation,) what an actual machine shows at the commanded joints, without noise."""

    def standing(joints: Floats, placements: Floats) -> Geometry:
        start = nominal.kernel.pose_of(placements)
        poses, status = actual.kernel.forward(joints, start, status=True)
        assert (status <= 1).all()
        return Geometry.of(actual.kernel, joints, actual.kernel.placement_of(poses))

    geometry = standing(measurements.joints, measurements.placements)
    others, placements = measurements.other_joints, measurements.other_placements
    if others is not None and placements is not None:
        geometry = replace(geometry, others=standing(others, placements))
    return nominal_readings(nominal, measurements, setups, geometry)


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
    setups = None
    if frame == "unknown":
        random = np.random.default_rng(seed + 7)
        unknown = np.array(made.instruments[0].frame.unknown, float)
        far = unknown * np.r_[random.uniform(-1.0, 1.0, 3), random.uniform(-0.3, 0.3, 3)]
        stated = Placement.stated(made.instruments[0])
        setups = [
            Placement(
                stated.origin + far[:3], vector_to_matrix(far[3:]) @ stated.rotation, stated.target
            )
        ]
    return with_noise(made, shown(machine, drawn(machine, seed), made, setups), seed)


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
