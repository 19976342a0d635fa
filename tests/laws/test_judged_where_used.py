"""The gate judges the tool where the calibrated machine is used: at the poses commanded then.

Its covariance at each pose is that of `tp.uncertainty` of the calibrated file there, tolerances
alone, after the same projection of where the machine stands, and without what was not identified.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from made_measurements import made_measurements, poses_within, reference_condition
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.identification.consider_covariance import consider_covariance
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.result.bands import tolerance_covariance
from truepose.machine import Machine
from truepose.machine.tables.controller import Holds

Floats = NDArray[np.float64]
NEAR = 0.01
"""Of the largest variance."""


@dataclass(frozen=True, eq=False)
class Made:
    """A machine that is far from its drawing, measured and calibrated."""

    found: Calibration
    original: Path

    def written(self, folder: Path, holds: Holds = "calibrated") -> Machine:
        """The machine of its file, forced where the answer is no."""
        path = folder / f"{self.original.stem}_{holds}.toml"
        settings = {"original": self.original, "date": "2026-01-31", "force": True}
        return self.found.save(path, controller_holds=holds, **settings)


def made(name: str, band: str = "", *, frame: str = "base", identify: tuple[str, ...] = ()) -> Made:
    """A machine at random within its tolerances, or within a half band of its lengths."""
    path = MACHINES / f"{name}.toml"
    machine = tp.load(path)
    kind = "pose" if len(machine.components) == 6 else "position"
    data = made_measurements(machine, kind, poses_within(machine, 40, share=0.5), frame=frame)
    unknowns = unknowns_of(machine, data)
    if band:
        # Not the offsets: they would take the joints out of their travel.
        own = zip(unknowns.names[: unknowns.n_machine], unknowns.units, strict=False)
        wide = [(each, unit == "m" and not each.endswith("offset")) for each, unit in own]
        identify = tuple(f"{each}={band}" if widened else each for each, widened in wide)
        unknowns = unknowns_of(machine, data, identify)
    rng = np.random.default_rng(0)
    deviations = np.sqrt(np.diagonal(unknowns.prior_covariance)[: unknowns.n_machine])
    true = np.zeros(unknowns.count)
    true[: unknowns.n_machine] = deviations * rng.uniform(-1.7, 1.7, unknowns.n_machine)
    read = IdentificationProblem(machine, data, unknowns).predict(true)
    data = data.with_values(read + data.uncertainty * rng.standard_normal(read.size))
    poses = machine.poses()
    thinned = poses[:: max(1, len(poses) // 30)]
    return Made(calibrate(machine, data, identify=identify, poses=thinned), path)


def covariance_of(machine: Machine, poses: Floats) -> tuple[Floats, NDArray[np.intp]]:
    """(n, n_component, n_component) of the tolerances alone, at n poses with these indices."""
    shown = tp.uncertainty(machine, poses, reference_condition(machine))
    return np.asarray(shown["covariance"]), np.asarray(shown["pose"])


def assert_near(found: Floats, expected: Floats) -> None:
    """Of each component's variance, to 1 % of the largest over the workspace."""
    sizes = np.sqrt(np.einsum("pcc->pc", expected).max(axis=0))
    sizes = np.where(sizes > 0.0, sizes, 1.0)
    scale = np.outer(sizes, sizes)
    assert np.abs((found - expected) / scale).max() < NEAR


CASES = [
    ("five_bar", ""),
    ("3rpr", ""),
    ("linear_delta", ""),
    ("3prs", ""),
    ("walking_6psu", ""),
    ("hexapod", ""),
    ("tricept", "5 mm"),
    ("walking_6psu", "3 mm"),
    ("hexapod", "50 mm"),
    ("hexapod_telescope", "1 mm"),
]


@pytest.mark.parametrize(("name", "band"), CASES)
def test_the_covariance_is_that_of_the_file(name: str, band: str, tmp_path: Path) -> None:
    case = made(name, band)
    gate, poses = case.found.gate, case.found.poses[case.found.usable]
    assert not gate.relative
    expected, kept = covariance_of(case.written(tmp_path), poses)
    assert len(kept) > 10
    assert_near(gate.after.covariance[kept], expected)


def test_it_is_not_that_of_the_joints_of_the_drawing(tmp_path: Path) -> None:
    case = made("hexapod", "50 mm")
    unknowns = case.found.fit.unknowns
    assert np.abs(unknowns.parameter_change(case.found.fit.values)).max() > 0.04
    # Values as known deviations, and nothing is compensated: the tool is elsewhere.
    elsewhere, kept = covariance_of(
        case.written(tmp_path, "drawing"), case.found.poses[case.found.usable]
    )
    after = case.found.gate.after.covariance[kept]
    sizes = np.einsum("pcc->pc", after).max(axis=0)
    assert (np.abs(np.einsum("pcc->pc", after - elsewhere)).max(axis=0) > 10 * NEAR * sizes).any()


def test_corrected_commands_of_known_deviations_lead_there(tmp_path: Path) -> None:
    """By draws: machines of the file, commanded as `truepose compensate` does, about the pose."""
    case = made("walking_6psu", "3 mm")
    written, found = case.written(tmp_path, "drawing"), case.found
    poses = found.poses[found.usable]
    bands = tolerance_covariance(written)
    corrected = tp.compensate(written, poses, reference_condition(written))
    rng = np.random.default_rng(1)
    drawn = rng.multivariate_normal(np.zeros(len(bands.correlation)), bands.correlation, 4000)
    moved = bands.shift + drawn @ bands.effects.T
    every = np.arange(len(written.parameters))
    assert corrected.sizes["pose"] > 10
    for at in np.asarray(corrected["pose"])[::7]:
        joints = np.asarray(corrected["joint_corrected"].sel(pose=at))
        error, status = written.kernel.displacement(
            np.tile(joints, (len(moved), 1)),
            np.tile(written.kernel.placement_of(poses[at : at + 1]), (len(moved), 1)),
            every,
            moved,
        )
        assert not status.any()
        expected = found.gate.after.covariance[at]
        scale = np.sqrt(np.outer(np.diagonal(expected), np.diagonal(expected)))
        # Four standard errors of a variance of so many draws.
        assert np.abs((np.cov(error.T) - expected) / scale).max() < 4.0 * np.sqrt(2.0 / len(moved))


def sensitivity(machine: Machine, poses: Floats) -> Floats:
    """(n_pose, n_component, n_parameter) by central differences of exact displacements."""
    joints, placements, _ = machine.kernel.place(poses)
    steps = 1e-6
    slopes = np.empty((len(poses), len(machine.components), len(machine.parameters)))
    for column in range(len(machine.parameters)):
        ahead, behind = (
            machine.kernel.displacement(
                joints, placements, np.array([column]), np.array([[sign * steps]])
            )[0]
            for sign in (1.0, -1.0)
        )
        slopes[:, :, column] = (ahead - behind) / (2.0 * steps)
    return slopes


def without(slopes: Floats, moves: Floats, points: Floats) -> Floats:
    """Slopes (n_pose, 6, n) less what fits best of the `moves` (n_pose, 6, k), by least squares.

    Rotations count as displacements at the root mean square distance of the points.
    """
    length = np.sqrt(((points - points.mean(axis=0)) ** 2).sum(axis=1).mean())
    weights = np.repeat([1.0, length], 3)[:, np.newaxis]
    flat = (moves * weights).reshape(-1, moves.shape[2])
    of_slopes = (slopes * weights).reshape(len(flat), -1)
    fitted = np.linalg.lstsq(flat, of_slopes, rcond=None)[0]
    left: Floats = (of_slopes - flat @ fitted).reshape(slopes.shape) / weights
    return left


@pytest.mark.parametrize("name", ["hexapod", "walking_6psu"])
def test_where_the_machine_stands_is_projected_out(name: str, tmp_path: Path) -> None:
    case = made(name, frame="unknown")
    gate, poses = case.found.gate, case.found.poses[case.found.usable]
    assert gate.relative
    unknowns = case.found.fit.unknowns
    written = case.written(tmp_path)
    slopes = sensitivity(written, poses)
    standing = [each.effects for each in gate.directions if each.kind == "gauge"]
    effects = unknowns.effects[:, : unknowns.n_machine] @ np.transpose(standing)
    moves = slopes[:, :, unknowns.columns] @ effects
    slopes = without(slopes, moves, written.kernel.placement_of(poses)[:, :3])
    covariance = tolerance_covariance(written).covariance
    assert_near(gate.after.covariance, slopes @ covariance @ slopes.transpose(0, 2, 1))


def test_without_what_was_not_identified(tmp_path: Path) -> None:
    lengths = ("strut.*.length",)
    case = made("walking_6psu", identify=lengths)
    found, poses = case.found, case.found.poses[case.found.usable]
    left_out = consider_covariance(found.machine, found.fit, lengths, poses)
    assert left_out is not None
    written = case.written(tmp_path)
    columns = [name.endswith(".length") for name in written.parameters]
    covariance = tolerance_covariance(written).covariance * np.outer(columns, columns)
    slopes = sensitivity(written, poses)
    assert_near(left_out.alone.covariance, slopes @ covariance @ slopes.transpose(0, 2, 1))
    # What was not identified comes on top, in the answer.
    more = np.einsum("pcc->pc", found.gate.after.covariance - left_out.alone.covariance)
    assert (more > 0.0).all()


def test_the_headline_is_the_quantile_over_what_is_commanded() -> None:
    """Against draws of the gate's covariance at each pose."""
    found = made("3prs").found
    gate, machine = found.gate, found.machine
    assert machine.commanded == ("z", "a", "b")
    assert gate.answer.startswith("Yes: the tool's position becomes known to within ")
    assert "its parasitic motion in x, y and c left out" in gate.answer
    drawn = np.random.default_rng(2).standard_normal((100_000, 3))
    for columns, within in zip(((2,), (3, 4)), gate.after.within, strict=True):
        sizes = []
        for covariance in gate.after.covariance:
            root = np.linalg.cholesky(covariance[np.ix_(columns, columns)])
            sizes.append(
                np.quantile(np.linalg.norm(drawn[:, : len(columns)] @ root.T, axis=1), 0.95)
            )
        assert within == pytest.approx(max(sizes), rel=0.01)


def test_the_tool_in_use_is_within_the_headline() -> None:
    """Machines at random, measured, calibrated and commanded as found: 95 % at the worst pose."""
    machine = tp.load(MACHINES / "five_bar.toml")
    data = made_measurements(machine, "position", poses_within(machine, 40, share=0.5))
    unknowns = unknowns_of(machine, data)
    problem, poses = IdentificationProblem(machine, data, unknowns), machine.poses()[::7]
    count, ratios = 60, []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        true = rng.multivariate_normal(np.zeros(unknowns.count), unknowns.prior_covariance)
        noise = data.uncertainty * rng.standard_normal(data.n_observation)
        found = calibrate(machine, data.with_values(problem.predict(true) + noise), poses=poses)
        assert found.accepted
        variances = np.linalg.eigvalsh(found.gate.after.covariance)
        pose = found.poses[found.usable][[int(variances[:, -1].argmax())]]
        joints = found.calibrated().kernel.place(pose)[0]
        off, status = machine.kernel.displacement(
            joints,
            machine.kernel.placement_of(pose),
            unknowns.columns,
            unknowns.parameter_change(true)[np.newaxis],
        )
        assert not status.any()
        ratios.append(np.linalg.norm(off) / found.gate.after.within[0])
    error = np.sqrt(0.95 * 0.05 / count)
    assert np.mean(np.array(ratios) <= 1.0) >= 0.95 - 3.0 * error
    # And it is no wider than it has to be.
    assert np.mean(np.array(ratios) <= 0.5) < 0.95 - 3.0 * error
