"""What the data explain as well under another supposition is said, and asked for."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_blunders import drawn, elsewhere, good, shown, with_noise
from made_measurements import made_measurements, poses_within
from truepose.calibration.calibrate import Calibration, calibrate
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import joined
from truepose.machine import Machine

WARPED = (0, 2)
"""Seeds of machines whose bed is off by more than what its heights leave uncertain."""


@functools.cache
def delta() -> Machine:
    return tp.load(MACHINES / "linear_delta.toml")


def bed_heights(seed: int, height: float) -> Measurements:
    """Heights of a machine within its tolerances, probed at 19 points of one commanded height."""
    poses = delta().poses()
    bed = np.unique(np.c_[poses[:, :2], np.full(len(poses), height)], axis=0)[3:22]
    made = made_measurements(delta(), "coordinate", bed, observables=["z"], uncertainty=10e-6)
    return with_noise(made, shown(delta(), drawn(delta(), seed), made), seed)


def mirrored(data: Measurements) -> Measurements:
    """The deviations from the command with the other sign."""
    return data.with_values(2.0 * data.placements[:, 2] - data.value)


def tool_error(calibration: Calibration, actual: Machine) -> float:
    """m: the largest error of the tool where the calibrated machine thinks that it is right."""
    found = calibration.calibrated()
    poses = delta().poses()
    joints, placements, status = found.kernel.place(poses)
    reached, there = actual.kernel.forward(joints, found.kernel.pose_of(placements), status=True)
    assert not status.any()
    assert (there <= 1).all()
    return float(np.linalg.norm((reached - found.kernel.pose_of(placements))[:, :3], axis=1).max())


@pytest.mark.parametrize("height", [0.0, 0.1])
@pytest.mark.parametrize("sign", [1, -1])
def test_heights_of_one_bed_leave_their_sign_open(height: float, sign: int) -> None:
    for seed in WARPED:
        data = bed_heights(seed, height)
        answer = calibrate(delta(), data if sign > 0 else mirrored(data))
        (said,) = [each for each in answer.suspicions if each.refuses]
        assert said.code == "open-choice"
        assert not answer.accepted
        assert "one row at another commanded z" in said.sentence
        words = "z axis points the other way" if height == 0.0 else "deviations of z"
        assert words in said.sentence


@pytest.mark.parametrize("seed", WARPED)
def test_the_row_that_is_asked_for_settles_it(seed: int) -> None:
    data, actual = bed_heights(seed, 0.0), drawn(delta(), seed)
    (said,) = calibrate(delta(), data).suspicions
    (z,) = re.findall(r"such as ([\d.]+) mm", said.sentence)
    pose = np.append(data.placements[0, :2], float(z) * 1e-3)
    row = made_measurements(delta(), "coordinate", pose, observables=["z"], uncertainty=10e-6)
    further = with_noise(row, shown(delta(), actual, row), 5)
    right = calibrate(delta(), joined(data, further))
    assert not right.suspicions
    # All readings of the other sign: the row that settles it is off by twice its height.
    both = joined(data, further)
    wrong = calibrate(delta(), both.with_values(-both.value))
    assert not wrong.accepted
    assert wrong.suspicions[0].code == "flipped-axis"
    assert wrong.suspicions[0].refuses


def test_what_is_named_would_put_the_tool_elsewhere() -> None:
    """Two machines explain the heights equally well, and differ by what is said of them."""
    for seed in (0, 1, 2):
        data = bed_heights(seed, 0.0)
        one, other = calibrate(delta(), data), calibrate(delta(), mirrored(data))
        assert one.gate.rms == pytest.approx(other.gate.rms, rel=0.05)
        named = [each for each in one.suspicions if each.code == "open-choice"]
        (apart,) = [tool_error(one, other.calibrated())]
        beyond = apart > 2.0 * one.gate.after.position_max
        assert bool(named) >= beyond
        if named and "z is too" not in named[0].sentence:
            (told,) = re.findall(r"up to ([\d.]+) mm elsewhere", named[0].sentence)
            assert float(told) * 1e-3 == pytest.approx(apart, rel=0.1)


@pytest.mark.parametrize("name", ["hexapod", "linear_delta", "tripod", "planar_two_slider", "3rrr"])
@pytest.mark.parametrize("kind", ["pose", "position", "strut-length"])
def test_good_data_over_the_workspace_are_not_refused(name: str, kind: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    answer = calibrate(machine, good(machine, kind, seed=4))
    assert not [each for each in answer.suspicions if each.refuses]
    if kind == "position":
        assert not answer.suspicions


def test_struts_of_one_length_may_have_been_exchanged() -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    (said,) = calibrate(machine, good(machine, "strut-length", seed=4)).suspicions
    assert (said.code, said.refuses) == ("open-choice", False)
    assert set(said.where) == {f"strut.{strut.name}.length" for strut in machine.struts}


def test_an_instrument_that_may_stand_anywhere_leaves_nothing_open() -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    made = made_measurements(
        machine, "position", poses_within(machine, 24), frame="unknown", values="nominal"
    )
    there = elsewhere(made.instruments[0], [0.3, -0.2, 0.4], [0.1, 0.2, -0.1])
    data = with_noise(made, shown(machine, drawn(machine, 3), made, there), 3)
    assert not calibrate(machine, data).suspicions
