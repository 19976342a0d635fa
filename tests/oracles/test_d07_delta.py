"""D07, linear and rotary delta: step counts at seven points of a calibrated printer (mm, deg).

The source takes a pair of rods as one line; any equal and parallel pair must give its points. So
each machine is built with two spacings and two effector radii, and the shipped files are asked too.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from build_machine import MACHINES, SPATIAL, Description, described, description_of
from oracle_cases import Published, case
from reference_kinematics import Reference, Vector
from truepose import _kernel

CASE = case("d07_delta_stable_positions")
MM = 1e-3
LAYOUTS = [(0.03, 0.05), (0.045, 0.08)]  # effector radius, spacing of a pair, m


def delta(kind: str, layout: tuple[float, float]) -> Description:
    """Three drives with two rods each, their joints moved out with the effector's by its radius."""
    data, (effector, spacing) = CASE[kind], layout
    rotary = kind == "rotary"
    angles = np.radians(data["shoulder_angles" if rotary else "angles"])
    drives, struts = [], []
    for tower, angle in enumerate(angles):
        out = np.array([math.cos(angle), math.sin(angle), 0.0])
        beside = np.array([-math.sin(angle), math.cos(angle), 0.0])
        up = np.array([0.0, 0.0, 1.0])
        if rotary:
            shoulder = (data["shoulder_radius"] * MM + effector) * out
            origin = shoulder + data["shoulder_height"] * MM * up
            # Positive angles raise the arm over the horizontal; elbow outward is the larger one.
            kind_of_drive, axis, arm = "crank", np.cross(out, up), data["upper_arm"] * MM * out
            length = data["lower_arms"][tower] * MM
        else:
            origin = (data["delta_radius"] * MM + effector) * out
            kind_of_drive, axis, arm = "slider", up, np.zeros(3)
            length = data["arms"][tower] * MM
        drives.append(
            {
                "kind": kind_of_drive,
                "origin": origin.tolist(),
                "axis": axis.tolist(),
                "working_mode": "+",
                "travel": [-1.5, 1.5],
            }
        )
        for side in (-0.5, 0.5):
            aside = side * spacing * beside
            struts.append(
                {
                    "drive": f"d{tower + 1}",
                    "base": (arm + aside).tolist(),
                    "platform": (effector * out + aside).tolist(),
                    "length": length,
                }
            )
    return described(SPATIAL, drives, struts, commanded=["x", "y", "z"])


def descriptions(kind: str) -> list[Any]:
    shipped = description_of(MACHINES / f"{kind}_delta.toml")
    built = [pytest.param(delta(kind, layout), id=f"spacing {layout[1]}") for layout in LAYOUTS]
    return [*built, pytest.param(shipped, id="shipped")]


def probed(description: Description, joints: Vector) -> Vector:
    """(7, 6) poses that the machine closes at, checked to be level."""
    machine = _kernel.Machine(description)
    poses = machine.forward(joints)
    assert np.abs(poses[:, 3:]).max() < 1e-9  # the rods of a pair are equal: no tilt
    back = machine.inverse(poses[:, :3])
    assert np.abs(back - joints).max() < 1e-12
    return np.asarray(poses)


@pytest.mark.parametrize("description", descriptions("linear"))
def test_linear_delta(description: Description, published: Published) -> None:
    data = CASE["linear"]
    arms, endstops = np.array(data["arms"]), np.array(data["endstops"])
    top = endstops + np.sqrt(arms**2 - data["delta_radius"] ** 2)
    poses = probed(description, (top - np.array(data["steps"]) * data["step_mm"]) * MM)
    found = poses[:, :3] / MM
    published("heights of the bed", 0.0, found[:, 2], within=1e-5, unit="mm")  # 7e-6 reproduced
    published("points probed", data["expected_xy"], found[:, :2], within=2e-4, unit="mm")


@pytest.mark.parametrize("description", descriptions("rotary"))
def test_rotary_delta(description: Description) -> None:
    data = CASE["rotary"]
    reference = Reference(description)
    ends = []
    for drive, height in zip(reference.drives, data["endstop_z"], strict=True):
        ends.append(reference.roots(drive, np.array([0, 0, height * MM]), np.eye(3))[-1])
    assert np.abs(np.degrees(ends) - data["endstop_angle_deg_computed"]).max() < 1e-6
    # The step of 1e-5 rad is inferred, and counts are whole: 6e-4 mm in z, 2e-3 mm in x and y.
    poses = probed(description, np.array(ends) - np.array(data["steps"]) * data["step_rad"])
    assert np.abs(poses[:, 2]).max() < 6.5e-4 * MM
    assert np.abs(poses[:, :2] - np.array(data["expected_xy"]) * MM).max() < 2e-3 * MM
