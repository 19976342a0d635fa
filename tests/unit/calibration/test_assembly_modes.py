"""Rows beyond a singular pose: placed in the assembly mode that was read, and named."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import machine_files
from made_measurements import made_measurements, poses_within
from truepose.calibration.calibrate import calibrate
from truepose.calibration.identification.problem import IdentificationProblem
from truepose.calibration.identification.unknowns import unknowns_of
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.read_csv import read_measurements
from truepose.calibration.measurements.write_csv import write_measurements
from truepose.machine import Machine

Floats = NDArray[np.float64]
FILES = {path.stem: path for path in machine_files()}
OTHER = (4, 11)


def crossed_circles(machine: Machine, joints: Floats, other: Floats) -> Floats:
    """(2,) where the two rods of a five-bar meet, not at `other`: its mirror image, in NumPy."""
    placement = machine.kernel.placement_of(other[np.newaxis])
    ends = machine.kernel.joint_centres(joints[np.newaxis], placement)[0, :, 0, :2]
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    away = other - ends[0]
    mirrored: Floats = ends[0] + 2.0 * along * (along @ away) - away
    return mirrored


def read_in_two_modes(frame: str) -> tuple[Machine, Measurements, Floats]:
    """Positions of a drawn five-bar, two of them in the other mode; rows placed as from home."""
    machine = tp.load(FILES["five_bar"])
    poses = poses_within(machine, 25, seed=3)
    data = made_measurements(machine, "position", poses, frame=frame)
    unknowns = unknowns_of(machine, data)
    random = np.random.default_rng(1)
    truth = np.where(unknowns.has_prior, unknowns.half, 0.0)
    truth = truth * random.uniform(-1.0, 1.0, unknowns.count)
    placements = data.placements.copy()
    for row in OTHER:
        other = crossed_circles(machine, data.joints[row], poses[row])
        placements[row] = machine.kernel.placement_of(other[np.newaxis])[0]
    there = dataclasses.replace(data, placements=placements)
    read = IdentificationProblem(machine, there, unknowns).predict(truth)
    assert np.isfinite(read).all()
    read += data.uncertainty * random.standard_normal(read.size)
    return machine, data.with_values(read), placements


@pytest.mark.parametrize("frame", ["base", "unknown"])
def test_rows_in_another_assembly_mode_start_from_what_was_read(frame: str) -> None:
    machine, data, placements = read_in_two_modes(frame)
    apart = np.linalg.norm((placements - data.placements)[:, :3], axis=1)
    assert np.flatnonzero(apart > 0.05).tolist() == list(OTHER)
    found = calibrate(machine, data)
    assert found.outliers == ()
    assert found.fit.noise < 1.5
    np.testing.assert_allclose(found.measurements.placements, placements, atol=1e-9)
    (named,) = [each for each in found.suspicions if each.code == "other-assembly-mode"]
    assert named.rows == OTHER
    assert "rows 5 and 12" in named.sentence
    assert not named.refuses
    # As if these rows were not there, but for what they add.
    others = calibrate(machine, data.select(~np.isin(np.arange(25), OTHER)))
    assert [each.code for each in others.suspicions] == []
    ends = (found.fit.values - others.fit.values)[: others.fit.unknowns.n_machine]
    assert np.abs(ends / others.fit.deviations[: ends.size]).max() < 3.0


def test_good_rows_stay_where_they_are() -> None:
    machine = tp.load(FILES["hexapod"])
    poses = poses_within(machine, 20, seed=3)
    data = made_measurements(machine, "pose", poses, values="nominal")
    found = calibrate(machine, data)
    np.testing.assert_array_equal(found.measurements.placements, data.placements)


HEAD = """#: [instrument.probe]
#: kind = "coordinate"
#: frame = "base"
#: uncertainty = "10 um"
"""


def written(path: Path, machine: Machine, modes: list[str]) -> tuple[Path, Floats]:
    """A file of heights of the five-bar, with the mode of each row; where its tool is."""
    poses = poses_within(machine, len(modes), seed=3)
    joints = machine.kernel.inverse(poses)
    places = [
        crossed_circles(machine, joints[row], poses[row]) if mode == "-" else poses[row]
        for row, mode in enumerate(modes)
    ]
    lines = ["joint.left (rad), joint.right (rad), y (m), assembly_mode"]
    lines += [
        f"{joints[row, 0]!r}, {joints[row, 1]!r}, {places[row][1]!r}, {mode}".replace(
            "np.float64(", ""
        ).replace(")", "")
        for row, mode in enumerate(modes)
    ]
    path.write_text(HEAD + "\n".join([lines[0], *lines[1:]]) + "\n", encoding="utf-8")
    return path, np.array(places)


def test_a_column_says_which_assembly_mode(tmp_path: Path) -> None:
    machine = tp.load(FILES["five_bar"])
    modes = ["+", "-", "", "-", "+"]
    file, places = written(tmp_path / "heights.csv", machine, modes)
    data = read_measurements(file, machine)
    np.testing.assert_allclose(data.placements[:, :2], places, atol=1e-9)
    again = tmp_path / "again.csv"
    write_measurements(again, machine, data)
    np.testing.assert_allclose(
        read_measurements(again, machine).placements, data.placements, atol=1e-9
    )


def test_a_mode_that_is_neither_is_refused(tmp_path: Path) -> None:
    machine = tp.load(FILES["five_bar"])
    file, _ = written(tmp_path / "heights.csv", machine, ["+", "+"])
    text = file.read_text(encoding="utf-8")
    file.write_text(text.rstrip("\n +") + " up\n", encoding="utf-8")
    with pytest.raises(tp.errors.RequestError) as refused:
        read_measurements(file, machine)
    (problem,) = refused.value.problems
    assert problem.code == "unknown-choice"
    assert problem.line == 7
    assert problem.path is not None
    assert "assembly_mode" in problem.path
    assert problem.expected is not None
    assert "+" in problem.expected


def test_a_row_that_stays_on_another_branch_is_named() -> None:
    """Heights alone do not say where the tool is: the row is given up, and said to be of a mode."""
    machine = tp.load(FILES["five_bar"])
    poses = poses_within(machine, 30, seed=3)
    data = made_measurements(machine, "coordinate", poses, observables=["y"])
    unknowns = unknowns_of(machine, data)
    truth = 0.5 * np.where(unknowns.has_prior, unknowns.half, 0.0)
    other = crossed_circles(machine, data.joints[8], poses[8])
    placements = data.placements.copy()
    placements[8] = machine.kernel.placement_of(other[np.newaxis])[0]
    there = dataclasses.replace(data, placements=placements)
    read = IdentificationProblem(machine, there, unknowns).predict(truth)
    read += data.uncertainty * np.random.default_rng(3).standard_normal(read.size)
    found = calibrate(machine, data.with_values(read))
    assert {one.row for one in found.outliers} == {8}
    assert found.fit.noise < 1.5
    (named,) = [each for each in found.suspicions if each.code == "other-assembly-mode"]
    assert named.rows == (8,)
    assert named.sentence.startswith("row 9:")
    assert "assembly_mode" in named.sentence
