"""Where the same joints lead, and which joints lead there: against what is known in closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import MACHINES
from machine_texts import PLANAR, load_text
from oracle_cases import case, dietmaier_text
from oracle_cases import pose as pose_of
from sweeps import sweep
from truepose.errors import ArgumentError
from truepose.machine import Machine
from truepose.runs.forward_solutions import ForwardSolutions
from two_slider import LENGTH, RAILS, carriages, tool

DIETMAIER = case("d01_dietmaier")
LENGTHS = np.array(DIETMAIER["leg_lengths"], float)
SAME = 1e-6


@pytest.fixture(scope="module")
def forty(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    """Dietmaier's hexapod, of which forty poses are known, as a machine file."""
    return load_text(tmp_path_factory.mktemp("forty"), dietmaier_text())


def numbers_of(machine: Machine, found: ForwardSolutions) -> list[int]:
    """Which of the forty each solution is."""
    known = np.array(
        [
            pose_of(row[:3], np.array(row[3:]).reshape(3, 3))
            for row in DIETMAIER["computed_reference"]["solutions"]
        ]
    )
    there, known = machine.kernel.placement_of(found.poses), machine.kernel.placement_of(known)
    numbers = []
    for one in there:
        cosines = np.abs(known[:, 3:] @ one[3:])
        away = np.linalg.norm(known[:, :3] - one[:3], axis=1) + np.sqrt(2 - 2 * cosines.clip(0, 1))
        assert away.min() < SAME
        numbers.append(int(away.argmin()))
    return numbers


def test_most_of_forty_known_poses_are_found_and_none_besides(forty: Machine) -> None:
    found = tp.forward_solutions(forty, LENGTHS)
    numbers = numbers_of(forty, found)
    assert len(set(numbers)) == len(numbers)
    # Not proven complete: these starts miss some of them.
    assert 35 <= len(numbers) < 40
    assert found.residual.max() < 1e-9
    assert found.joint_residual.max() < 1e-9


@sweep
def test_of_more_starts_all_forty_are_found(forty: Machine) -> None:
    found = tp.forward_solutions(forty, LENGTHS, starts=20_000)
    assert sorted(numbers_of(forty, found)) == list(range(40))


def test_the_two_poses_of_the_two_slider_are_those_of_its_circles(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    joints = machine.inverse([0.31, 0.17])
    found = tp.forward_solutions(machine, joints, [0.31, 0.17])
    centres = carriages(joints[np.newaxis])
    lengths = np.full((1, 2), LENGTH)
    below, above = (tool(centres, lengths, np.array([[0.3, y]]))[0] for y in (-9.0, 9.0))
    assert found.poses == pytest.approx(np.array([below, above]), abs=1e-14)
    assert found.working_modes == ("++", "--")
    assert found.in_workspace is not None
    assert found.in_workspace.tolist() == [True, False]
    assert found.apart[0, 1] == pytest.approx(np.linalg.norm(below - above), rel=1e-12)


def test_the_four_working_modes_of_the_two_slider(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    (x, y), found = (0.31, 0.17), tp.inverse_solutions(machine, [0.31, 0.17])
    away = np.sqrt(LENGTH**2 - (x - np.array(RAILS)) ** 2)
    assert found.working_modes[0] == "++"
    assert set(found.working_modes) == {"++", "+-", "-+", "--"}
    for mode, joints in zip(found.working_modes, found.joints, strict=True):
        signs = np.array([1.0 if sign == "+" else -1.0 for sign in mode])
        assert joints == pytest.approx(y + signs * away, abs=1e-14)
    assert found.status == ("ok", "out_of_travel", "out_of_travel", "out_of_travel")
    beyond = tp.inverse_solutions(machine, [5.0, 0.0])
    assert (beyond.joints.shape, beyond.unsolved) == ((0, 2), 4)


def test_of_a_flat_base_and_platform_every_pose_has_its_mirror_image() -> None:
    """The hexapod of the library: base joints in z = 0, platform joints in a plane of their own."""
    machine = tp.load(MACHINES / "hexapod.toml")
    pose = machine.poses()[100]
    found = tp.forward_solutions(machine, machine.inverse(pose), pose)
    assert len(found.poses) == 8
    mirror = np.diag([1.0, 1.0, -1.0])
    placements = machine.kernel.placement_of(found.poses)
    many = np.repeat(found.joints[np.newaxis], len(placements), axis=0)
    platforms = machine.kernel.joint_centres(many, placements)[:, :, 1]
    images = platforms @ mirror
    for image in images:
        assert np.abs(platforms - image).max(axis=(1, 2)).min() < 1e-9
    assert set(found.working_modes) == {"......"}
    assert not tp.inverse_solutions(machine, pose).has_modes


def test_a_seed_gives_the_same_and_any_seed_gives_what_is_there() -> None:
    machine = tp.load(MACHINES / "3rpr.toml")
    joints = machine.inverse(machine.poses()[3])
    one, same, other = (tp.forward_solutions(machine, joints, seed=seed) for seed in (0, 0, 1))
    assert (one.poses == same.poses).all()
    assert (one.converged, one.reached.tolist()) == (same.converged, same.reached.tolist())
    assert other.reached.tolist() != one.reached.tolist()
    assert other.poses == pytest.approx(one.poses, abs=1e-9)


def test_joints_that_close_nowhere_have_no_solution(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    found = tp.forward_solutions(machine, [0.0, 30.0])
    assert (found.poses.shape, found.converged, found.status) == ((0, 2), 0, ())
    assert found.apart.shape == (0, 0)
    assert "0" in repr(found)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"joints": [0.1]}, "joints"),
        ({"joints": [[0.1, 0.2]]}, "joints"),
        ({"joints": [0.1, np.nan]}, "joints"),
        ({"start": [0.1]}, "start"),
        ({"starts": 0}, "starts"),
        ({"starts": 2_000_000}, "starts"),
        ({"starts": 1.5}, "starts"),
        ({"seed": -1}, "seed"),
        ({"seed": True}, "seed"),
        ({"seed": 2**64}, "seed"),
    ],
)
def test_what_is_refused(wrong: dict[str, Any], name: str, tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    with pytest.raises(ArgumentError) as failure:
        tp.forward_solutions(machine, **{"joints": [0.2, 0.2], **wrong})
    (problem,) = failure.value.problems
    assert problem.code == "bad-argument"
    assert problem.message.startswith(name)


def test_one_pose_at_a_time(tmp_path: Path) -> None:
    with pytest.raises(ArgumentError):
        tp.inverse_solutions(load_text(tmp_path, PLANAR), [[0.3, 0.2], [0.3, 0.1]])
