"""Where a machine cannot go it says so: a status a pose, never a number that only looks right."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose
from build_machine import MACHINES
from drive_kinds import is_strut
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import rotation_of_quaternion, vector_of
from truepose import _kernel

OUT_OF_TRAVEL, UNREACHABLE, SINGULAR, NOT_CONVERGED, JOINT_LIMIT = (
    _kernel.STATUS.index(name)
    for name in ("out_of_travel", "unreachable", "singular", "not_converged", "joint_limit")
)
CLOSED = 1e-9
# Parasitic freedoms are found by iteration from home: so far from its attitude at least.
CERTAIN = np.radians(30)


def test_statuses_have_these_names() -> None:
    assert _kernel.STATUS == (
        "ok",
        "out_of_travel",
        "unreachable",
        "singular",
        "not_converged",
        "branch_lost",
        "joint_limit",
    )


def test_out_of_travel_still_has_its_joints(machine: MachineUnderTest) -> None:
    joints = machine.kernel.inverse(machine.poses)
    narrow = copy.deepcopy(machine.description)
    last = narrow["drives"][-1]
    middle = float(np.median(joints[:, -1]))
    # No more than a turn, for a drive that turns is told in the turn that its travel has.
    last["travel"] = [middle, middle + 3.0]
    found, status = _kernel.Machine(narrow).inverse(machine.poses, status=True)
    outside = joints[:, -1] < middle
    assert outside.any()
    assert not outside.all()
    assert np.abs(found - joints).max() < 1e-12
    assert (status[outside] == OUT_OF_TRAVEL).all()
    assert (status[joints[:, -1] > middle] == OK).all()


def leaning(machine: MachineUnderTest, strut: int, end: str, axis: NDArray) -> NDArray[np.float64]:
    """(37,) rad between a direction at a strut's joint and the strut, on the reference's road."""
    reference = machine.reference
    row = reference.struts[strut]
    angles = []
    for joints, placement in zip(*machine.placed, strict=True):
        rotation = rotation_of_quaternion(placement[3:])
        base = reference.base_joint(row, joints)
        along = reference.platform_joint(row, placement[:3], rotation) - base
        axes = rotation if end == "platform" else reference.base_axes(row, joints)
        carried = axes @ axis
        angles.append(np.arccos(carried @ along / np.linalg.norm(carried) / np.linalg.norm(along)))
    return np.array(angles)


@pytest.mark.parametrize("end", ["base", "platform"])
def test_a_strut_that_leans_too_far_is_told(machine: MachineUnderTest, end: str) -> None:
    random = np.random.default_rng(machine.seed + 12)
    number = int(random.integers(len(machine.description["struts"])))
    axis = random.normal(size=3)
    angles = leaning(machine, number, end, axis)
    limit = float(np.median(angles)) + 1e-9
    limited = copy.deepcopy(machine.description)
    limited["struts"][number] |= {f"{end}_axis": axis.tolist(), f"{end}_angle_limit": limit}
    kernel = _kernel.Machine(limited)
    joints, status = kernel.inverse(machine.poses, status=True)
    assert (status == np.where(angles > limit, JOINT_LIMIT, OK)).all()
    assert (angles > limit).any()
    # Such a pose still has its joints.
    assert np.array_equal(joints, machine.kernel.inverse(machine.poses))


def test_far_away_is_not_reached(machine: MachineUnderTest) -> None:
    commanded = machine.kernel.commanded
    away = machine.poses.copy()
    # Across every guideway, for along one a carriage would follow; up where nothing goes across.
    across = [name for name in "xy" if name in commanded] or ["z"]
    away[:, [commanded.index(name) for name in across]] += 50.0
    joints, status = machine.kernel.inverse(away, status=True)
    stretches = all(is_strut(drive["kind"]) for drive in machine.description["drives"])
    follows = stretches or across == ["z"]
    tilts = any(guide["kind"] == "line" for guide in machine.description["guides"])
    if tilts:
        # The tube would have to lie level: the solution, if there is one, is far from home.
        assert np.isin(status, [OUT_OF_TRAVEL, UNREACHABLE, NOT_CONVERGED]).all()
    else:
        assert (status == (OUT_OF_TRAVEL if follows else UNREACHABLE)).all()
    if follows and not tilts:
        expected = [machine.reference.inverse(pose)[0] for pose in away]
        assert np.abs(joints - expected).max() < 1e-9
    with pytest.raises(truepose.errors.PoseError) as caught:
        machine.kernel.inverse(away[:5])
    assert (caught.value.count, caught.value.index) == (5, 0)
    assert caught.value.status == _kernel.STATUS[status[0]]


def test_the_first_pose_that_fails_is_told(machine: MachineUnderTest) -> None:
    poses = machine.poses.copy()
    poses[[3, 20], 0] += 50.0
    poses[[3, 20], 1] += 50.0
    with pytest.raises(truepose.errors.PoseError) as caught:
        machine.kernel.sensitivity(poses)
    assert (caught.value.count, caught.value.index) == (2, 3)


def test_every_answer_to_wild_poses_is_finite_or_has_a_status(machine: MachineUnderTest) -> None:
    kernel, poses = machine.kernel, machine.wild_poses
    joints, placements, status = kernel.place(poses)
    assert np.isfinite(placements).all()
    answered = np.isin(status, [OK, OUT_OF_TRAVEL])
    assert answered.any()
    assert np.isfinite(joints[answered]).all()
    # What is answered closes, by the reference.
    for i in np.flatnonzero(answered):
        rotation = rotation_of_quaternion(placements[i, 3:])
        closures = machine.reference.closures(joints[i], placements[i, :3], rotation)
        assert np.abs(closures).max() < CLOSED
    for call in (kernel.sensitivity, kernel.jac_pose_joint, kernel.conditioning):
        found, found_status = call(poses, status=True)
        finite = np.isfinite(found.reshape(len(found), -1)).all(1)
        assert (found_status[~finite] != OK).all()
        assert finite[found_status == OK].all()
    tension, tension_status = kernel.forces(poses, np.ones(6), status=True)
    assert np.isfinite(tension[tension_status == OK]).all()


def test_forward_from_wild_joints_is_never_a_false_ok(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    random = np.random.default_rng(machine.seed + 11)
    joints, _ = machine.placed
    span = np.maximum(np.ptp(joints, axis=0), 0.2)
    wild = joints.mean(0) + 3 * span * random.uniform(-1, 1, (400, joints.shape[1]))
    found, status = kernel.forward(wild, status=True)
    placements = kernel.placement_of(np.where(np.isfinite(found), found, 0.0))
    good = status == OK
    assert good.any()
    assert np.isfinite(found[good]).all()
    for i in np.flatnonzero(good):
        rotation = rotation_of_quaternion(placements[i, 3:])
        closures = machine.reference.closures(wild[i], placements[i, :3], rotation)
        assert np.abs(closures).max() < CLOSED


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e300])
def test_what_is_no_number_is_no_pose(machine: MachineUnderTest, value: float) -> None:
    kernel = machine.kernel
    poses = machine.poses[:11].copy()
    poses[4, 0] = value
    joints, status = kernel.inverse(poses, status=True)
    assert status[4] != OK
    others = np.arange(11) != 4
    assert (status[others] == OK).all()
    assert np.array_equal(joints[others], kernel.inverse(poses[others]))

    coordinates = kernel.inverse(machine.poses[:11])
    coordinates[4, 0] = value
    found, status = kernel.forward(coordinates, status=True)
    assert status[4] not in (OK, OUT_OF_TRAVEL)
    assert (status[others] == OK).all()
    assert np.isfinite(found[others]).all()


def shipped(name: str) -> MachineUnderTest:
    return MachineUnderTest(MACHINES / f"{name}.toml")


def singular_pose(name: str) -> tuple[MachineUnderTest, NDArray[np.float64]]:
    """A machine and a pose at which it is singular, by the geometry of its type."""
    machine = shipped(name)
    if name == "five_bar":
        # Both rods in line between the elbows, which are then 700 mm apart.
        cosine = (0.35 - 0.125) / 0.25
        return machine, np.array([0.0, 0.25 * np.sqrt(1 - cosine**2)])
    # Base and platform joints in one plane: no strut can hold the platform up.
    return machine, np.zeros(6)


@pytest.mark.parametrize("name", ["five_bar", "hexapod"])
def test_a_singular_pose_is_called_so(name: str) -> None:
    machine, pose = singular_pose(name)
    kernel = machine.kernel
    joints, status = kernel.inverse(pose, status=True)
    assert status in (OK, OUT_OF_TRAVEL)
    expected, point, rotation = machine.reference.inverse(pose)
    assert np.abs(joints - expected).max() < 1e-7  # the crank's arc cosine is flat here
    assert np.abs(machine.reference.closures(joints, point, rotation)).max() < CLOSED
    assert kernel.conditioning(pose, status=True)[0] < 1e-6
    assert kernel.sensitivity(pose, status=True)[1] == SINGULAR
    assert kernel.jac_pose_joint(pose, status=True)[1] == SINGULAR
    assert kernel.forces(pose, [1.0, 2, 3, 0, 0, 0], status=True)[1] == SINGULAR
    joints_of, placements, _ = kernel.place(pose[None])
    columns = np.asarray(kernel.length_parameters)
    soft = np.full((1, len(columns)), 1e-8)
    assert kernel.compliance_at(joints_of, placements, columns, soft)[1][0] == SINGULAR
    assert kernel.displacement(joints_of, placements, columns, 0 * soft)[1][0] != OK


def test_explain_names_the_strut_and_how_far_it_is_short() -> None:
    machine = shipped("planar_two_slider")
    # 700 mm from the guideway of strut 2, which is 500 mm long.
    (found,) = machine.kernel.explain(np.array([-0.1, 0.2]))
    assert (found["what"], found["name"]) == ("strut", "2")
    assert np.isclose(found["amount"], 0.2, rtol=1e-9)
    # At x = 400 mm, strut 1 rises by 300 mm and strut 2 by 458 mm; travel ends at 900 mm.
    (found,) = machine.kernel.explain(np.array([0.4, 0.55]))
    assert (found["what"], found["name"]) == ("travel", "d2")
    assert np.isclose(found["amount"], 0.55 + np.sqrt(0.21) - 0.9, rtol=1e-9)


def test_where_the_reference_finds_no_inverse_the_kernel_says_unreachable(
    machine: MachineUnderTest,
) -> None:
    poses = machine.wild_poses
    _, status = machine.kernel.inverse(poses, status=True)
    home = [machine.reference.home[name] for name in machine.kernel.commanded]
    _, _, attitude = machine.reference.inverse(home)
    for pose, code in zip(poses, status, strict=True):
        try:
            _, _, rotation = machine.reference.inverse(pose)
        except ValueError:
            assert code not in (OK, OUT_OF_TRAVEL)
        else:
            tilt = np.linalg.norm(vector_of(rotation @ attitude.T))
            direct = not machine.reference.parasitic
            assert code in (OK, OUT_OF_TRAVEL) or (tilt > CERTAIN and not direct)
