"""Inverse and forward solutions of one pose: each closes, and leads back to where it came from."""

from __future__ import annotations

import copy

import numpy as np

import truepose as tp
from drive_kinds import is_strut, turned_alike, turns
from machine_under_test import MachineUnderTest
from reference_kinematics import Reference, rotation_of_quaternion
from truepose import _kernel

STARTS = 200
"""Few: what is found has to be right, not complete."""

CLOSED = 1e-9
"""m or rad, by the closures in plain NumPy, and by the inverse."""


def closed(machine: MachineUnderTest, joints: np.ndarray, pose: np.ndarray) -> float:
    """How far the worst closure is open, struts and guides, by the second road."""
    placement = machine.kernel.placement_of(pose[np.newaxis])[0]
    rotation = rotation_of_quaternion(placement[3:])
    gaps = machine.reference.closures(joints, placement[:3], rotation)
    return float(np.abs(gaps).max())


def test_every_working_mode_closes_at_the_pose(machine: MachineUnderTest) -> None:
    pose = machine.poses[0]
    found = tp.inverse_solutions(machine.loaded, pose)
    drives = machine.description["drives"]
    ways = sum(not is_strut(drive["kind"]) for drive in drives)
    assert len(set(found.working_modes)) == len(found.joints)
    assert len(found.joints) + found.unsolved == 2**ways
    assert found.has_modes is (ways > 0)
    assert np.abs(found.joints[0] - machine.loaded.inverse(pose)).max() < CLOSED
    assert found.status[0] == "ok"
    columns = [machine.loaded.dof.index(name) for name in machine.loaded.commanded]
    for joints, platform in zip(found.joints, found.poses, strict=True):
        assert np.abs(platform[columns] - pose).max() < CLOSED
        if not machine.reference.overconstrained:
            assert closed(machine, joints, platform) < CLOSED


def test_every_forward_solution_closes_and_its_inverse_gives_the_joints(
    machine: MachineUnderTest,
) -> None:
    there = tp.inverse_solutions(machine.loaded, machine.poses[0])
    joints = there.joints[0]
    found = tp.forward_solutions(machine.loaded, joints, there.poses[0], starts=STARTS)
    length = machine.loaded.characteristic_length
    kernel = machine.kernel
    one, other = kernel.placement_of(np.stack([found.poses[0], there.poses[0]]))
    assert np.abs(one - other).max() < CLOSED
    assert len(found.poses) >= (1 if machine.reference.overconstrained else 2)
    assert found.reached.sum() == found.converged <= found.starts == STARTS + 1
    assert found.residual.max() < CLOSED
    assert found.joint_residual.max() < CLOSED
    columns = [machine.loaded.dof.index(name) for name in machine.loaded.commanded]
    for pose, mode in zip(found.poses, found.working_modes, strict=True):
        assert closed(machine, joints, pose) < CLOSED
        description = copy.deepcopy(machine.description)
        description["home"] = dict(zip(machine.loaded.dof, pose.tolist(), strict=True))
        for drive, sign in zip(description["drives"], mode, strict=True):
            drive["working_mode"] = None if sign == "." else sign
            drive["travel"] = [-np.pi, np.pi] if turns(drive["kind"]) else [-10.0, 10.0]
        for strut in description["struts"]:
            for end in ("base", "platform"):
                strut.pop(f"{end}_angle_limit", None)
        again = _kernel.Machine(description).inverse(pose[columns])
        assert np.abs(turned_alike(description, again, joints)).max() < CLOSED
        if not (machine.reference.parasitic or machine.reference.overconstrained):
            roots = Reference(description).inverse(pose[columns])[0]
            assert np.abs(turned_alike(description, roots, joints)).max() < CLOSED
    assert np.abs(found.apart - found.apart.T).max() < 1e-12
    apart = found.apart[~np.eye(len(found.poses), dtype=bool)]
    assert (apart > 1e-6 * length).all()
    assert (np.diff(found.apart[0]) >= -1e-9).all()
