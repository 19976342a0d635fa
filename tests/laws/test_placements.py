"""Poses and placements are one thing said twice, at any orientation."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from build_machine import MACHINES
from machine_under_test import MachineUnderTest
from reference_kinematics import rotation_of, rotation_of_quaternion

KERNEL = MachineUnderTest(MACHINES / "hexapod.toml").kernel
QUARTER = math.pi / 2

angle = st.floats(-2 * math.pi, 2 * math.pi)
coordinate = st.floats(-10, 10)


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.tuples(coordinate, coordinate, coordinate), st.tuples(angle, angle, angle))
@example((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
@example((0.1, -0.2, 0.3), (0.3, QUARTER, 0.5))  # only a - c counts: any pair of them will do
@example((0.1, -0.2, 0.3), (0.3, -QUARTER, 0.5))
@example((0.0, 0.0, 0.0), (math.pi, 0.0, 0.0))  # half a turn: the quaternion's w is 0
@example((0.0, 0.0, 0.0), (0.0, math.pi, 0.0))
@example((0.0, 0.0, 0.0), (0.0, 0.0, math.pi))
@example((0.0, 0.0, 0.0), (1e-9, QUARTER - 1e-9, -1e-9))
def test_a_pose_of_any_orientation_comes_back_as_that_orientation(
    point: tuple[float, float, float], angles: tuple[float, float, float]
) -> None:
    placement = KERNEL.placement_of(np.array([[*point, *angles]]))[0]
    assert np.array_equal(placement[:3], point)
    assert abs(np.linalg.norm(placement[3:]) - 1) < 1e-15 * 10
    rotation = rotation_of(angles)
    assert np.abs(rotation_of_quaternion(placement[3:]) - rotation).max() < 1e-14

    pose = KERNEL.pose_of(placement[None])[0]
    assert np.array_equal(pose[:3], point)
    # At the end of b's range the angle's sine is flat: half the digits are all there are.
    near_the_end = abs(abs(rotation[2, 0]) - 1) < 1e-10
    assert np.abs(rotation_of(pose[3:]) - rotation).max() < (1e-7 if near_the_end else 1e-12)


def test_freedoms_not_commanded_are_placed_at_home(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    placements = kernel.placement_of(machine.poses)
    for pose, placement in zip(machine.poses, placements, strict=True):
        point, rotation = machine.reference.placement(kernel.commanded, pose)
        assert np.array_equal(placement[:3], point)
        assert np.abs(rotation_of_quaternion(placement[3:]) - rotation).max() < 1e-15
