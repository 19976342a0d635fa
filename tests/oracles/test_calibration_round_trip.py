"""A calibrated file goes through the other commands, and they say of it what validation shows.

Machines within their tolerances are measured, calibrated, written as machine files and read again.
The uncertainty at the tool that the budget then states must be what the calibrated machines are
really off, and what rows that were not used show.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import machine_files
from made_measurements import made_measurements, poses_within
from sweeps import long_member, thinned
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import Unknowns, unknowns_of
from truepose.machine import Machine
from truepose.runs.displacement import displacement

FILES = {path.stem: path for path in machine_files()}
MACHINES = 24
"""Of each kind: the mean of their squared errors is then known to a tenth or so."""


def truth_of(unknowns: Unknowns, random: np.random.Generator) -> np.ndarray:
    """(n,) a machine within its tolerances, normal ones."""
    known = unknowns.has_prior
    values = unknowns.prior_mean.copy()
    factor = np.linalg.cholesky(unknowns.prior_covariance[np.ix_(known, known)])
    values[known] += factor @ random.standard_normal(int(known.sum()))
    return values


def measured(
    machine: Machine, rows: int, held_out: int, seed: int
) -> tuple[Calibration, np.ndarray]:
    """A calibration of some machine by a tracker in the base frame, and that machine."""
    random = np.random.default_rng(seed)
    poses = poses_within(machine, rows + held_out, seed=seed, share=1.0)
    flags = np.arange(rows + held_out) >= rows
    data = made_measurements(machine, "pose", poses, uncertainty=4e-6, held_out=flags)
    unknowns = unknowns_of(machine, data)
    truth = truth_of(unknowns, random)
    read = IdentificationProblem(machine, data, unknowns).predict(truth)
    read += data.uncertainty * random.standard_normal(read.size)
    return calibrate(machine, data.with_values(read)), truth


def error_of(calibration: Calibration, truth: np.ndarray) -> np.ndarray:
    """(n_pose, n_component) where the true machine goes when the calibrated one is commanded."""
    machine, calibrated = calibration.machine, calibration.calibrated()
    joints, placements, status = calibrated.kernel.place(calibration.poses)
    assert not status.any()
    unknowns = calibration.fit.unknowns
    change = unknowns.parameter_change(truth)[np.newaxis, :]
    error, solved = displacement(machine, joints, placements, (unknowns.columns, change))
    assert not solved.any()
    return error


@pytest.mark.parametrize(
    "name", [*thinned(["planar_crossed", "hexaglide"]), long_member("hexapod")]
)
def test_the_budget_of_the_calibrated_file_is_what_the_tool_is_off(
    name: str, tmp_path: Path
) -> None:
    machine = tp.load(FILES[name])
    actual, stated, shown, promised = [], [], [], []
    for seed in range(MACHINES):
        calibration, truth = measured(machine, rows=15, held_out=30, seed=seed)
        path = tmp_path / f"{name}_{seed}.toml"
        written = calibration.save(
            path,
            original=FILES[name],
            date="2026-11-21",
            controller_holds="calibrated",
            force=True,
        )
        linear = [written.components.index(axis) for axis in "xyz" if axis in written.components]
        budget = tp.budget(written, calibration.poses)
        tolerance = budget["uncertainty"].sel(source="tolerance").values
        stated.append(np.mean(np.sum(tolerance[:, linear] ** 2, axis=1)))
        error = error_of(calibration, truth)
        actual.append(np.mean(np.sum(error[:, linear] ** 2, axis=1)))
        # Rows that were not used, less their own noise, in their own uncertainties.
        checked = calibration.validation
        assert checked is not None
        shown.append(np.mean(checked.after[checked.used] ** 2) - 1.0)
        fit = calibration.fit
        rows = calibration.measurements.select(calibration.measurements.held_out)
        problem = IdentificationProblem(machine, rows, fit.unknowns)
        slope = problem.jacobian(fit.values) / rows.uncertainty[:, np.newaxis]
        promised.append(np.mean(np.einsum("ij,jk,ik->i", slope, fit.covariance, slope)))
    ratio = np.sqrt(np.mean(actual) / np.mean(stated))
    assert 0.85 < ratio < 1.15, ratio
    noise = np.sqrt(2.0 / (MACHINES * 30 * len(machine.components)))
    assert abs(np.mean(shown) - np.mean(promised)) < 0.35 * np.mean(promised) + 4.0 * noise


def test_a_calibrated_file_goes_through_the_other_commands(tmp_path: Path) -> None:
    name = "planar_crossed"
    machine = tp.load(FILES[name])
    calibration, _ = measured(machine, rows=20, held_out=0, seed=1)
    assert calibration.accepted
    path = tmp_path / "calibrated.toml"
    written = calibration.save(
        path, original=FILES[name], date="2026-11-21", controller_holds="calibrated"
    )
    assert path.read_text(encoding="utf-8").count("#") >= FILES[name].read_text(
        encoding="utf-8"
    ).count("#")
    # An axis that was tilted by u and v is written as the direction that it has: the same machine.
    ours = calibration.calibrated().inverse(calibration.poses)
    np.testing.assert_allclose(written.inverse(calibration.poses), ours, rtol=1e-13)
    before = tp.budget(machine)
    after = tp.budget(written)
    at = {"source": "tolerance"}
    assert after["uncertainty"].sel(at).max() < 0.5 * before["uncertainty"].sel(at).max()
    compensated = tp.compensate(written)
    assert np.isfinite(compensated["residual_middle"]).all()
    bounds = tp.bounds(written, calibration.poses[:3], truncate=3.0)
    assert (bounds["status"] == "proven").all()
    exported = tp.export(written, "c")
    assert exported.files
