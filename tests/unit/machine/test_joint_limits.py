"""How far a strut may lean at its joints: poses beyond are counted, explained and left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from machine_texts import PLANAR, edited, load_text
from truepose import _kernel
from truepose.errors import PoseError, RequestError
from truepose.machine import Machine
from truepose.reporting.workspace_check import check_workspace
from truepose.runs.poses import faults_text

LIMIT = _kernel.STATUS.index("joint_limit")
OK = _kernel.STATUS.index("ok")


def limited(folder: Path, joint: str, limit: float, axis: str = "[0, -1, 0]") -> Machine:
    """The planar machine whose first strut may lean `limit` degrees at one joint."""
    line = f"{joint} = {{ axis = {axis}, angle_limit = {limit} }}"
    return load_text(folder, edited(PLANAR, ('name = "1"\n', f'name = "1"\n{line}\n')))


@pytest.mark.parametrize("limit", [25.0, 35.0, 41.0, 50.0, 60.0])
@pytest.mark.parametrize("joint", ["base_joint", "platform_joint"])
def test_the_angle_is_that_between_strut_and_axis(joint: str, limit: float, tmp_path: Path) -> None:
    """Strut 1, 500 mm long, leans asin(x / 500) off its guideway at x = 0."""
    machine = limited(tmp_path, joint, limit)
    poses = machine.poses()
    _, _, status = machine.kernel.place(poses)
    beyond = np.degrees(np.arcsin(poses[:, 0] / 0.5)) > limit
    np.testing.assert_array_equal(status, np.where(beyond, LIMIT, OK))


def test_just_within_and_just_beyond(tmp_path: Path) -> None:
    machine = limited(tmp_path, "base_joint", 30.0)
    for x, expected in ((0.25 * (1 - 1e-9), OK), (0.25 * (1 + 1e-9), LIMIT)):
        assert machine.kernel.place([[x, 0.2]])[2][0] == expected


def test_an_axis_leans_with_the_platform(tmp_path: Path) -> None:
    """At the platform the axis is in the platform's axes, at the base in those of the frame.

    Angles of the hexapod's struts by NumPy, from joint centres and the pose's rotation.
    """
    axis = np.array([0.2, -0.1, 1.0])
    hexapod = tp.load(MACHINES / "hexapod.toml")
    grid = hexapod.poses()
    poses = grid[np.random.default_rng(3).integers(0, len(grid), 200)]
    poses = poses + np.random.default_rng(4).uniform(-0.1, 0.1, poses.shape) * [0, 0, 0, 1, 1, 1]
    joints, placements, status = hexapod.kernel.place(poses)
    poses, joints, placements = (each[status == OK] for each in (poses, joints, placements))
    assert len(poses) > 100
    centres = hexapod.kernel.joint_centres(joints, placements)
    along = centres[:, 2, 1] - centres[:, 2, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    name = hexapod.struts[2].name
    for joint in ("base_joint", "platform_joint"):
        axes = np.broadcast_to(axis, along.shape)
        if joint == "platform_joint":
            axes = np.array([rotation(pose[3:]) @ axis for pose in poses])
        cosines = (along * axes).sum(axis=1) / np.linalg.norm(axis)
        angles = np.degrees(np.arccos(cosines))
        limit = float(np.median(angles))
        machine = tp.load(
            MACHINES / "hexapod.toml",
            [f'strut.{name}.{joint}={{ axis = {axis.tolist()}, angle_limit = "{limit} deg" }}'],
        )
        found = machine.kernel.place(poses)[2]
        clear = np.abs(angles - limit) > 1e-9
        expected = np.where(angles > limit, LIMIT, OK)
        np.testing.assert_array_equal(found[clear], expected[clear])
        assert {OK, LIMIT} == set(found.tolist())


def rotation(angles: np.ndarray) -> np.ndarray:
    """(3, 3) Rz(c) Ry(b) Rx(a)."""
    turns = []
    for axis, angle in enumerate(angles):
        turn = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn[i, i] = turn[j, j] = np.cos(angle)
        turn[j, i], turn[i, j] = np.sin(angle), -np.sin(angle)
        turns.append(turn)
    return np.asarray(turns[2] @ turns[1] @ turns[0])


def test_poses_beyond_are_left_out_and_counted(tmp_path: Path) -> None:
    machine = limited(tmp_path, "base_joint", 40.0)
    poses = machine.poses()
    beyond = np.degrees(np.arcsin(poses[:, 0] / 0.5)) > 40.0
    assert 0 < beyond.sum() < len(poses)
    for result in (tp.budget(machine), tp.compensate(machine)):
        assert result.attrs["poses_left_out"] == beyond.sum()
        np.testing.assert_array_equal(result.left_out_index, np.flatnonzero(beyond))
        assert set(result.left_out_status.values) == {"joint_limit"}
        np.testing.assert_array_equal(result.pose, np.flatnonzero(~beyond))


def test_the_reason_says_which_joint_and_by_how_much(tmp_path: Path) -> None:
    machine = limited(tmp_path, "platform_joint", 30.0)
    faults = machine.kernel.explain([0.5 * np.sin(np.radians(33.0)), 0.2])
    assert faults_text(machine, faults) == (
        "strut 1 leans 3 deg beyond the limit of its platform joint"
    )
    with pytest.raises(PoseError, match=r"strut 1 leans .* platform joint") as caught:
        machine.inverse([0.4, 0.2])
    assert caught.value.status == "joint_limit"


def test_the_check_says_so_too(tmp_path: Path) -> None:
    machine = limited(tmp_path, "base_joint", 30.0)
    found = check_workspace(machine)
    (reason,) = found.reasons
    assert reason.count == (found.status == "joint_limit").sum() == 11
    text = reason.text(machine.shown)
    assert text == "strut 1: leans up to 23.130 ° beyond the limit of its base joint"


def test_where_no_pose_is_left_the_reason_is_told(tmp_path: Path) -> None:
    machine = limited(tmp_path, "base_joint", 1.0)
    with pytest.raises(RequestError) as caught:
        tp.budget(machine)
    (problem,) = caught.value.problems
    assert problem.code == "no-pose-left"
    assert problem.found is not None
    assert problem.found.startswith("15 joint limit; nearest at x = 200 mm, ")
    assert "strut 1 leans 22.5782 deg beyond the limit of its base joint" in problem.found
