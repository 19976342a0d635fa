"""3-PRS, Tricept, pentapod and double parallelogram against closed forms worked out by hand.

What the guides make of the parasitic freedoms can be written down for each: the conditions stand in
the tests. For the 3-PRS they are those of Carretero, Podhorodeski, Nahon and Gosselin (2000),
"Kinematic analysis and optimization of a new three degree-of-freedom spatial parallel manipulator".
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose
from build_machine import MACHINES
from reference_kinematics import rotation_of
from truepose.machine import Machine

Floats = NDArray[np.float64]
AGREES = 1e-12


@cache
def loaded(name: str) -> Machine:
    return truepose.load(MACHINES / f"{name}.toml")


def placed(machine: Machine) -> list[tuple[Floats, Floats, Floats]]:
    """Joints, tool point (3,) and rotation (3, 3) at the poses of the file, by the kernel."""
    joints = machine.inverse(machine.poses())
    poses = np.zeros((len(joints), 6))
    poses[:, ["xyzabc".index(name) for name in machine.dof]] = machine.forward(joints)
    return [(q, pose[:3], rotation_of(pose[3:])) for q, pose in zip(joints, poses, strict=True)]


def test_the_3prs_moves_aside_as_its_planes_ask() -> None:
    # Joints of the platform at radius r, 90, 210 and 330 deg, each in the plane of its limb through
    # the z axis. The first: P_x + r R_01 = 0. Sum and difference of the others: P_y = r (R_11 -
    # R_00) / 2 and R_10 = R_01. P is the platform's origin.
    radius, tool = 0.25, np.array([0.0, 0.0, -0.12])
    for joints, point, rotation in placed(loaded("3prs")):
        origin = point - rotation @ tool
        # The file's joints are in whole nm, its normals have ten digits.
        assert abs(rotation[1, 0] - rotation[0, 1]) < 1e-8
        assert abs(origin[0] + radius * rotation[0, 1]) < 2e-9
        assert abs(origin[1] - radius * (rotation[1, 1] - rotation[0, 0]) / 2) < 2e-9
        # Struts of 500 mm from carriages at 350 mm above, which rise with the joint.
        for angle, height in zip(np.radians([90, 210, 330]), joints, strict=True):
            outward = np.array([np.cos(angle), np.sin(angle), 0])
            centre = origin + rotation @ (radius * outward)
            above = np.sqrt(0.5**2 - np.sum((0.35 * outward - centre)[:2] ** 2))
            assert abs(height - (centre[2] + above)) < 5e-9


def test_the_tricepts_tube_points_from_the_joint_to_the_tool() -> None:
    # The tool point lies on the tube's axis, which passes through the base's origin.
    for joints, point, rotation in placed(loaded("tricept")):
        assert np.abs(rotation[:, 2] + point / np.linalg.norm(point)).max() < AGREES
        assert abs(rotation[0, 1]) < AGREES  # base x across tube y
        centre = point + rotation @ np.array([0, 0, 0.3])
        for angle, length in zip(np.radians([90, 210, 330]), joints, strict=True):
            outward = np.array([np.cos(angle), np.sin(angle), 0])
            span = centre + rotation @ (0.2 * outward) - 0.5 * outward
            assert abs(np.linalg.norm(span) - length) < 1e-9


def test_the_pentapods_struts_end_on_rings() -> None:
    machine = loaded("pentapod")
    for joints, point, rotation in placed(machine):
        assert abs(rotation[1, 0]) < AGREES  # sin c cos b
        spindle = rotation[:, 2]
        nominal = dict(zip(machine.parameters, machine.nominal, strict=True))
        for strut, length in zip(machine.struts, joints, strict=True):
            base = np.array([nominal[f"{strut.part}.base.{axis}"] for axis in "xyz"])
            up = nominal[f"{strut.part}.platform.z"] + 0.2655
            away = base - (point + up * spindle)
            height = away @ spindle
            across = np.sqrt(away @ away - height**2)
            assert abs(np.hypot(across - 0.08032, height) - length) < AGREES


def test_rings_do_not_feel_the_spin() -> None:
    # Turned about the spindle the rings stand as they stood: only the guide holds the spin.
    machine = loaded("pentapod")
    poses = machine.poses()[:5]
    sensitivity = machine.sensitivity(poses)
    spin = machine.parameters.index("guide.spin.base_axis.u")
    for (_, _, rotation), rows in zip(placed(machine), sensitivity, strict=False):
        moved = rows[:, spin]
        assert np.abs(moved[:3]).max() < 1e-12  # the tool point lies on the spindle
        assert np.linalg.norm(np.cross(moved[3:], rotation[:, 2])) < 1e-12


@pytest.mark.parametrize(("left", "right"), [(1e-4, 0.0), (1e-4, -1e-4), (2e-4, 5e-5)])
def test_two_parallelograms_share_a_turn_and_keep_the_rest_as_strain(
    left: float, right: float
) -> None:
    # Each pair of rods, d apart across themselves, alone would turn the platform by the difference
    # of its rods over d, in the opposite sense on the two sides. With equal rods and both pairs as
    # far apart the platform turns by the mean of what the two ask for, to first order.
    machine = loaded("overconstrained")
    pose = np.array([[0.0, 0.15]])  # the middle: both sides lean alike
    lean = 0.3 / 0.5  # horizontal over length of a rod
    apart = 0.12 * lean
    changes = dict.fromkeys(machine.parameters, 0.0)
    changes |= {"strut.l1.length": left, "strut.r1.length": right}
    sensitivity = machine.sensitivity(pose)[0]
    turn = sensitivity[machine.components.index("rz")] @ np.array(list(changes.values()))
    asked = np.array([-left, right]) / apart
    assert abs(abs(turn) - abs(asked.mean())) < 1e-9
