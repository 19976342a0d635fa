"""Inverse and forward undo each other and agree with plain NumPy and SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from machine_under_test import OK, MachineUnderTest
from random_machines import DrawnMachine
from reference_kinematics import Reference, rotation_of, rotation_of_quaternion

CLOSED = 1e-10  # m or rad against machines of some 0.3 m to 1 m


def assert_same_pose(reference: Reference, found: NDArray, expected: NDArray) -> None:
    """Two poses over the machine's dof: positions as lengths, rotations as rotations."""
    (point, rotation), (point_expected, rotation_expected) = (
        reference.placement(reference.dof, pose) for pose in (found, expected)
    )
    assert np.abs(point - point_expected).max() < CLOSED
    assert np.abs(rotation - rotation_expected).max() < CLOSED


def test_inverse_agrees_with_the_reference(machine: MachineUnderTest) -> None:
    joints = machine.kernel.inverse(machine.poses)
    for pose, found in zip(machine.poses, joints, strict=True):
        expected, _, _ = machine.reference.inverse(pose)
        assert np.abs(found - expected).max() < CLOSED


def test_every_pose_of_the_workspace_is_within_travel(machine: MachineUnderTest) -> None:
    _, status = machine.kernel.inverse(machine.poses, status=True)
    assert (status == OK).all()


def test_placements_agree_with_the_reference(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    assert np.array_equal(joints, machine.kernel.inverse(machine.poses))
    for pose, placement in zip(machine.poses, placements, strict=True):
        _, point, rotation = machine.reference.inverse(pose)
        assert np.abs(placement[:3] - point).max() < CLOSED
        assert np.abs(rotation_of_quaternion(placement[3:]) - rotation).max() < CLOSED


@pytest.mark.parametrize("start", ["home", "the pose", "nearby", "nearby, commanded only"])
def test_forward_returns_the_pose(machine: MachineUnderTest, start: str) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    expected = kernel.pose_of(placements)
    random = np.random.default_rng(machine.seed + 1)
    unit = np.array([kernel.characteristic_length if n in "xyz" else 1.0 for n in kernel.dof])
    nearby = expected + 0.02 * unit * random.uniform(-1, 1, size=expected.shape)
    commanded = [kernel.dof.index(name) for name in kernel.commanded]
    starts = {
        "home": None,
        "the pose": expected,
        "nearby": nearby,
        "nearby, commanded only": nearby[:, commanded],
    }[start]

    found, status = kernel.forward(joints, starts, status=True)

    assert (status == OK).all()
    for one, other in zip(found, expected, strict=True):
        assert_same_pose(machine.reference, one, other)
    # What was commanded is what comes back.
    assert np.abs(found[:, commanded] - machine.poses).max() < CLOSED


def test_forward_agrees_with_the_reference(machine: MachineUnderTest) -> None:
    # Joints of no pose in particular: each moved by itself, so platforms tilt as they like.
    kernel, (joints, placements) = machine.kernel, machine.placed
    random = np.random.default_rng(machine.seed + 2)
    moved = joints + 1e-2 * kernel.characteristic_length * random.uniform(-1, 1, joints.shape)
    found = kernel.forward(moved, kernel.pose_of(placements))
    for one, coordinates, placement in zip(found, moved, placements, strict=True):
        point, rotation = machine.reference.forward(
            coordinates, placement[:3], rotation_of_quaternion(placement[3:])
        )
        point_found, rotation_found = machine.reference.placement(machine.reference.dof, one)
        assert np.abs(point_found - point).max() < CLOSED
        assert np.abs(rotation_found - rotation).max() < CLOSED


def test_joint_centres_and_lengths_agree_with_the_reference(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    centres = machine.kernel.joint_centres(joints, placements)
    lengths = machine.kernel.lengths_at(joints, placements)
    reference = machine.reference
    for i in range(len(joints)):
        rotation = rotation_of_quaternion(placements[i, 3:])
        for s, strut in enumerate(reference.struts):
            base = reference.base_joint(strut, joints[i])
            platform = reference.platform_joint(strut, placements[i, :3], rotation)
            assert np.abs(centres[i, s] - [base, platform]).max() < 1e-12
            assert abs(lengths[i, s] - reference.length(strut, joints[i])) < CLOSED


def test_poses_and_placements_are_two_ways_to_say_it(machine: MachineUnderTest) -> None:
    kernel, (_, placements) = machine.kernel, machine.placed
    poses = kernel.pose_of(placements)
    again = kernel.placement_of(poses)
    for pose, one, other in zip(poses, placements, again, strict=True):
        rotation = rotation_of_quaternion(one[3:])
        assert np.abs(one[:3] - other[:3]).max() < 1e-15
        assert np.abs(rotation - rotation_of_quaternion(other[3:])).max() < 1e-14
        angles = [pose[kernel.dof.index(n)] if n in kernel.dof else 0.0 for n in "abc"]
        assert np.abs(rotation - rotation_of(angles)).max() < 1e-14


def test_forward_of_a_drawn_machine_returns_the_pose(drawn: DrawnMachine) -> None:
    test_forward_returns_the_pose(drawn, "home")
    test_every_pose_of_the_workspace_is_within_travel(drawn)
