"""Frames that are unknown are found wherever they are: metres off, turned by any angle."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_measurements import made_measurements, nominal_values, poses_within
from sweeps import thinned
from truepose.calibration.calibrate import calibrate
from truepose.calibration.identification.frames import rotated_starts
from truepose.calibration.identification.placement import place_instruments
from truepose.calibration.instruments import REGISTRY, Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import joined
from truepose.machine import Machine

ANGLES = (30, 60, 90, 120, 150, 170)
FAR_OFF = np.array([2.0, -1.2, 0.7])
KINDS = [name for name, kind in REGISTRY.items() if kind.frame and name != "contact"]


@functools.cache
def machine(name: str) -> Machine:
    return tp.load(MACHINES / f"{name}.toml")


def standing(of: str, kind: str, degrees: float, **others: object) -> Measurements:
    """Readings of the machine as filed from a frame that is far off what is declared.

    It is off and turned in what the kind says is unknown of it.
    """
    poses = poses_within(machine(of), 24, seed=3)
    made = made_measurements(machine(of), kind, poses, frame="unknown", **others)  # type: ignore[arg-type]
    (instrument,) = made.instruments
    unknown = np.array(instrument.frame.unknown)
    axis = np.where(unknown[3:], [0.3, 1.0, 0.2], 0.0)
    axis /= max(float(np.linalg.norm(axis)), 1e-300)
    half = 0.5 * np.radians(degrees) * unknown[3:].any()
    x, y, z = (np.sin(half) * axis).tolist()
    off = np.where(unknown[:3], FAR_OFF, 0.0)
    true = Frame(tuple(off.tolist()), (float(np.cos(half)), x, y, z))
    there = dataclasses.replace(made, instruments=(dataclasses.replace(instrument, frame=true),))
    return made.with_values(nominal_values(machine(of), there))


def left(name: str, data: Measurements) -> float:
    """Root mean square of the residuals, in uncertainties, of the machine as filed."""
    placements = place_instruments(machine(name), data).of.values()
    residual = np.concatenate([placement.residual for placement in placements])
    return float(np.sqrt(np.mean(residual**2)))


@pytest.mark.parametrize("degrees", thinned(ANGLES, ANGLES[-1:]))
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["3rrr", "overconstrained", "hexapod", "3prs"])
def test_a_frame_far_off_and_turned_is_found(name: str, kind: str, degrees: float) -> None:
    if not REGISTRY[kind].observed(machine(name).components):
        pytest.skip("it reads nothing of this machine")
    assert left(name, standing(name, kind, degrees)) < 1e-3


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("observables", [["z"], ["x", "z"]])
def test_a_frame_that_reads_few_coordinates_is_found(
    observables: list[str], degrees: float
) -> None:
    assert left("hexapod", standing("hexapod", "coordinate", degrees, observables=observables)) < 1


def test_two_turned_sensors_are_both_found() -> None:
    data = [
        standing("hexapod", "joint-angle", degrees, name=name, struts=struts)
        for name, degrees, struts in (("left", 170.0, [0, 1, 2]), ("right", 150.0, [3, 4, 5]))
    ]
    assert left("hexapod", joined(*data)) < 1e-3


def test_a_frame_with_a_closed_form_is_not_turned_further() -> None:
    assert not rotated_starts(machine("3rrr"), standing("3rrr", "position", 90.0))
    assert not rotated_starts(machine("hexapod"), standing("hexapod", "orientation", 90.0))
    assert len(rotated_starts(machine("3rrr"), standing("3rrr", "orientation", 90.0))) == 7
    assert len(rotated_starts(machine("hexapod"), standing("hexapod", "joint-angle", 90.0))) == 23


@pytest.mark.parametrize("name", ["hexapod", "hexaglide"])
@pytest.mark.parametrize("degrees", [90.0, 170.0])
def test_a_turned_frame_arouses_no_suspicion(name: str, degrees: float) -> None:
    data = standing(name, "orientation", degrees)
    noise = data.uncertainty * np.random.default_rng(1).standard_normal(data.value.size)
    found = calibrate(machine(name), data.with_values(data.value + noise))
    assert not found.suspicions
    assert 0.5 < found.gate.rms < 1.5
