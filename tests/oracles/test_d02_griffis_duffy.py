"""D02, Griffis-Duffy platform: every pose is singular, and nothing may pretend otherwise."""

from __future__ import annotations

import numpy as np
import pytest

import truepose
from build_machine import hexapod
from oracle_cases import Published, case, pose_in_order
from truepose import _kernel

CASE = case("d02_griffis_duffy")
LENGTHS = np.array(CASE["leg_lengths"], float)
MACHINE = _kernel.Machine(hexapod(CASE["base_points"], CASE["platform_points"]))
SAMPLE = CASE["computed_reference"]["sample_pose"]
POSE = pose_in_order("xyz", SAMPLE["p"], SAMPLE["euler_RxRyRz_rad"])
SINGULAR = _kernel.STATUS.index("singular")
OK = _kernel.STATUS.index("ok")

LENGTH_DIGITS = 1e-6  # the table's lengths have six decimals


def test_inverse_still_answers(published: Published) -> None:
    joints, status = MACHINE.inverse(POSE, status=True)
    assert status == OK
    published("strut lengths", LENGTHS, joints, within=LENGTH_DIGITS)


def test_forward_is_singular() -> None:
    _, status = MACHINE.forward(LENGTHS, POSE, status=True)
    assert status == SINGULAR
    with pytest.raises(truepose.errors.PoseError) as caught:
        MACHINE.forward(LENGTHS, POSE)
    assert caught.value.status == "singular"


def test_forward_from_elsewhere_is_never_ok() -> None:
    random = np.random.default_rng(2)
    starts = POSE + random.uniform(-0.3, 0.3, size=(60, 6))
    _, status = MACHINE.forward(np.tile(LENGTHS, (60, 1)), starts, status=True)
    assert OK not in status
    assert SINGULAR in status


def test_sensitivity_is_singular() -> None:
    _, status = MACHINE.sensitivity(POSE, status=True)
    assert status == SINGULAR
    _, status = MACHINE.jac_pose_joint(POSE, status=True)
    assert status == SINGULAR


def test_forces_are_singular() -> None:
    _, status = MACHINE.forces(POSE, [0.0, 0, 1, 0, 0, 0], status=True)
    assert status == SINGULAR


def test_compliance_is_singular() -> None:
    joints, placements, _ = MACHINE.place(POSE[None])
    lengths = np.asarray(MACHINE.length_parameters)
    _, status = MACHINE.compliance_at(joints, placements, lengths, np.ones((1, 6)))
    assert status[0] == SINGULAR


def test_conditioning_tells_how_near() -> None:
    conditioning = MACHINE.conditioning(POSE, status=True)[0]
    smallest, next_one = CASE["computed_reference"]["smallest_singular_values"]
    assert 0 <= conditioning < 1e-6
    assert conditioning < 100 * smallest < next_one
