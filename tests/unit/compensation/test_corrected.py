"""The corrected command where sources follow the joints that are commanded."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_source import MadeSource, with_sources
from truepose.compensation.commands import actual_of_joints, corrected_poses
from truepose.errors import RequestError
from truepose.runs.displacement import displacement
from truepose.sources import Deviation, PoseBlock

AMPLITUDE, PITCH = 2e-6, 5e-3
ACTUATOR = 'actuator = { periodic = { amplitude = "2 um", period = 5, phase = "0 deg" } }\n'


@pytest.fixture(scope="module")
def plain() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


@pytest.fixture
def periodic(tmp_path: Path) -> tp.Machine:
    """Screws with a periodic error, on a machine whose heat and load correct it by 0.4 mm."""
    text = (MACHINES / "planar_two_slider.toml").read_text(encoding="utf-8")
    for name in ("d1", "d2"):
        text = text.replace(f'name = "{name}"\n', f'name = "{name}"\n{ACTUATOR}', 1)
    path = tmp_path / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return tp.load(path)


def wave(joints: np.ndarray) -> np.ndarray:
    return AMPLITUDE * np.sin(math.tau * joints / PITCH)


def test_a_periodic_error_is_that_of_the_joints_commanded(
    plain: tp.Machine, periodic: tp.Machine
) -> None:
    found = tp.compensate(periodic)
    joints = found["joint_corrected"].values
    assert np.abs(joints - found.joint_nominal.values).max() > 3e-4
    assert np.abs(found.residual_middle.values).max() < 1e-15
    # By hand: the screws bring the carriages to where those of the machine without it are.
    without = tp.compensate(plain)["joint_corrected"].values
    assert np.abs(joints + wave(joints) - without).max() < 1e-15
    # With the error of the nominal joints most of a micrometre would be left.
    at_nominal = without - wave(found.joint_nominal.values)
    assert np.abs(at_nominal + wave(at_nominal) - without).max() > 7e-7


def test_what_is_known_by_the_program_is_known_by_the_command(periodic: tp.Machine) -> None:
    """The poses to ask a nominal controller for, and where they lead, agree with the joints."""
    poses = periodic.poses()
    asked, status = corrected_poses(periodic, poses)
    assert not status.any()
    joints = periodic.inverse(asked)
    assert np.abs(joints - tp.compensate(periodic)["joint_corrected"].values).max() < 1e-14
    # The actual machine is the one at the pose that it comes to, there the one asked for.
    reached, status = actual_of_joints(periodic, joints, near=poses)
    assert not status.any()
    assert np.abs(reached - poses).max() < 1e-14


def test_loads_and_lengths_stay_those_of_the_nominal_command(plain: tp.Machine) -> None:
    seen: list[tuple[np.ndarray, ...]] = []

    def of_block(block: PoseBlock) -> Deviation:
        seen.append((block.drive_joints, block.joints, block.lengths, block.tension))
        offset = plain.parameters.index("drive.d1.offset")
        return Deviation.of([offset], 1e-3 + 0.01 * block.drive_joints[:, :1])

    machine = with_sources(plain, MadeSource("s", of_block=of_block))
    found = tp.compensate(machine)
    joints = found["joint_corrected"].values[:, 0]
    # q + 1 mm + q / 100 is where the nominal carriage would be.
    assert np.abs(1.01 * joints + 1e-3 - found.joint_nominal.values[:, 0]).max() < 1e-13
    assert len(seen) > 2
    for driven, *nominal in seen[1:]:
        assert not np.array_equal(driven, seen[0][0])
        for one, other in zip(nominal, seen[0][1:], strict=True):
            assert one is other


def test_where_nothing_follows_the_joints_nothing_is_asked_twice(plain: tp.Machine) -> None:
    source = MadeSource("s", Deviation.of(plain.kernel.length_parameters, 1e-4, 3e-4))
    tp.compensate(with_sources(plain, source), [0.3, 0.2])
    assert source.asked == [1]


def test_a_command_that_never_settles_is_left_out(plain: tp.Machine) -> None:
    """An error that changes by more than the joint does: no joint is its own correction's."""
    offset = plain.parameters.index("drive.d1.offset")
    steep = MadeSource(
        "steep",
        of_block=lambda block: Deviation.of(
            [offset], 9.0 * wave(1000.0 * block.drive_joints[:, :1])
        ),
    )
    with pytest.raises(RequestError) as caught:
        tp.compensate(with_sources(plain, steep), [[0.3, 0.2012345], [0.3, 0.2123456]])
    (problem,) = caught.value.problems
    assert "2 correction not converged" in str(problem.found)


def test_the_error_before_is_that_of_the_nominal_joints(periodic: tp.Machine) -> None:
    found = tp.budget(periodic).error.sel(source="actuator")
    joints, placements, _ = periodic.kernel.place(periodic.poses())
    columns = np.array([periodic.parameters.index(f"drive.d{n}.offset") for n in (1, 2)])
    expected, _ = displacement(periodic, joints, placements, (columns, wave(joints)))
    assert np.abs(found.values - expected).max() < 1e-15
