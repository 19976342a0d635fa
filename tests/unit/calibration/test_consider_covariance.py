"""Tolerances that are not identified count in what the tool is known to."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from made_measurements import made_measurements, nominal_values, poses_within
from truepose.arrays import Floats
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.identification.consider_covariance import consider_covariance
from truepose.calibration.measurements import Measurements
from truepose.calibration.result.bands import tolerance_covariance
from truepose.machine import Machine

MACHINES = Path(__file__).parents[3] / "machines"
LENGTHS = ("strut.*.length",)


@pytest.fixture(scope="module")
def walking() -> Machine:
    return tp.load(MACHINES / "walking_6psu.toml")


def made(machine: Machine, rng: np.random.Generator) -> Machine:
    """A machine within the tolerances."""
    bands = tolerance_covariance(machine)
    off = rng.multivariate_normal(np.zeros(len(bands.correlation)), bands.correlation)
    values = machine.nominal + bands.shift + bands.effects @ off
    return machine.replace(dict(zip(machine.parameters, values.tolist(), strict=True)))


def measured(machine: Machine, true: Machine, rng: np.random.Generator) -> Measurements:
    """Forty positions of the true machine."""
    data = made_measurements(machine, "position", poses_within(machine, 40, share=0.5))
    starts = machine.kernel.pose_of(data.placements)
    reached = true.kernel.placement_of(true.kernel.forward(data.joints, start=starts))
    read = nominal_values(true, dataclasses.replace(data, placements=reached))
    return data.with_values(read + data.uncertainty * rng.standard_normal(read.shape))


def off_at_tool(found: Calibration, true: Machine) -> Floats:
    """(n_pose,) how far the true machine is from where the calibrated one has the tool, m."""
    joints, placements, _ = found.calibrated().kernel.place(found.poses[::5])
    off, status = true.kernel.displacement(joints, placements, np.arange(1), np.zeros((1, 1)))
    assert not status.any()
    return np.asarray(np.linalg.norm(off[:, :3], axis=1))


def test_the_stated_uncertainty_is_that_of_machines_as_they_are_made(walking: Machine) -> None:
    actual, stated = [], []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        true = made(walking, rng)
        found = calibrate(walking, measured(walking, true, rng), identify=LENGTHS)
        actual.append(off_at_tool(found, true))
        stated.append(found.gate.after.position_rms)
    ratio = float(np.mean(stated) / np.sqrt(np.mean(np.square(actual))))
    assert ratio == pytest.approx(1.0, abs=0.25)
    assert found.accepted
    warned = [each for each in found.gate.warnings if each.code == "not-identified"]
    assert len(warned) == 1
    assert "drive offsets" in warned[0].sentence


def test_what_is_left_out_may_be_all_that_counts(walking: Machine) -> None:
    rng = np.random.default_rng(1)
    true = made(walking, rng)
    found = calibrate(walking, measured(walking, true, rng), identify=["strut.1.length"])
    (reason,) = [each for each in found.gate.reasons if each.code == "not-identified"]
    assert "identify them too" in reason.sentence
    assert "of the machine as filed" in reason.sentence
    assert not found.accepted
    assert found.gate.remedy is None


def test_everything_identified_leaves_nothing_to_consider(walking: Machine) -> None:
    rng = np.random.default_rng(2)
    data = measured(walking, walking, rng)
    plain = calibrate(walking, data)
    named = calibrate(walking, data, identify=["*"])
    assert "not-identified" not in {each.code for each in plain.gate.warnings}
    part = calibrate(walking, data, identify=LENGTHS)
    # The file's own uncertainty is that of all tolerances, whatever is identified.
    assert part.gate.before is not None
    assert plain.gate.before is not None
    np.testing.assert_allclose(part.gate.before.position, plain.gate.before.position, rtol=1e-2)
    assert part.gate.after.position_max > plain.gate.after.position_max
    assert named.gate.before is None or named.gate.before.position_max > 0.0


def test_the_parts_add_up(walking: Machine) -> None:
    rng = np.random.default_rng(3)
    data = measured(walking, walking, rng)
    part = calibrate(walking, data, identify=LENGTHS)
    found = consider_covariance(walking, part.fit, LENGTHS, part.poses)
    assert found is not None
    assert found.every[: len(found.labels)] != found.labels
    assert (found.alone.position <= found.after.position).all()
    squares = found.alone.position**2 + found.part.position**2
    np.testing.assert_allclose(found.after.position**2, squares, rtol=1e-3)
    assert consider_covariance(walking, part.fit, (), part.poses) is None


@pytest.mark.parametrize("use_prior", [True, False])
def test_in_an_unknown_frame(walking: Machine, use_prior: bool) -> None:
    data = made_measurements(
        walking, "position", poses_within(walking, 40, share=0.5), frame="unknown", values="nominal"
    )
    noise = np.random.default_rng(4).standard_normal(data.n_observation)
    data = data.with_values(data.value + data.uncertainty * noise)
    found = calibrate(walking, data, identify=LENGTHS, use_prior=use_prior)
    assert found.gate.relative
    assert found.gate.accepted
    assert found.gate.before is not None
    assert 0.0 < found.gate.after.position_max < found.gate.before.position_max
