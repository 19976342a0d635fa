"""Where a machine stands and in what unit it is measured change nothing but the numbers' frame."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from build_machine import moved, scaled
from drive_kinds import turns
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import angles_of, rotation_by_vector, rotation_of_quaternion
from sweeps import thinned
from truepose import _kernel


def elsewhere(
    machine: MachineUnderTest, seed: int
) -> tuple[_kernel.Machine, NDArray[np.float64], NDArray[np.float64]]:
    """The machine standing elsewhere, the rotation (3, 3) and the shift (3,) that took it there.

    A planar machine turns and shifts in its plane, for its frame holds what is out of it.
    """
    random = np.random.default_rng(machine.seed + seed)
    turn, shift = random.uniform(-0.6, 0.6, 3), random.uniform(-2, 2, 3)
    planar = "z" not in machine.kernel.dof
    if planar:
        turn[:2], shift[2] = 0.0, 0.0
    rotation = rotation_by_vector(turn)
    description = moved(machine.description, rotation, shift)
    point, home = machine.reference.placement([], [])
    # A point platform is not turned: nothing shows its orientation.
    names = "xyzabc" if "c" in machine.kernel.dof and not planar else "xyz"
    values = np.r_[rotation @ point + shift, angles_of(rotation @ home)]
    description["home"] = dict(zip(names, values, strict=False))
    return _kernel.Machine(description), rotation, shift


@pytest.mark.parametrize("seed", thinned(range(3)))
def test_a_rigid_move_of_the_base_only_moves_the_result(
    machine: MachineUnderTest, seed: int
) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    other, rotation, shift = elsewhere(machine, 20 + seed)
    turned = "c" in machine.kernel.dof

    points = placements[:, :3] @ rotation.T + shift
    angles = [angles_of(rotation @ rotation_of_quaternion(p[3:])) for p in placements]
    whole = np.c_[points, angles] if turned else np.c_[points, np.zeros((len(points), 3))]
    poses = whole[:, ["xyzabc".index(name) for name in other.commanded]]

    found, found_placements, status = other.place(poses)
    assert (status == OK).all()
    assert np.abs(found - joints).max() < 1e-10
    assert np.abs(found_placements[:, :3] - points).max() < 1e-10
    for one, before in zip(found_placements, placements, strict=True):
        expected = rotation_of_quaternion(before[3:])
        expected = rotation @ expected if turned else expected
        assert np.abs(rotation_of_quaternion(one[3:]) - expected).max() < 1e-10

    back = other.placement_of(other.forward(joints))
    assert np.abs(back[:, :3] - points).max() < 1e-10

    # What moves the tool moves it the same way, seen from the other frame.
    columns = np.asarray(kernel.length_parameters)
    before = displaced(kernel, joints, placements, columns)
    after = displaced(other, joints, found_placements, columns)
    assert np.abs(after - before @ np.kron(np.eye(2), rotation).T).max() < 1e-10
    assert np.abs(other.conditioning(poses) - kernel.conditioning(machine.poses)).max() < 1e-9


def displaced(
    kernel: _kernel.Machine,
    joints: NDArray[np.float64],
    placements: NDArray[np.float64],
    columns: NDArray[np.intp],
) -> NDArray[np.float64]:
    """(n, 6) displacement by lengths each moved otherwise, components that do not move at 0."""
    values = 1e-4 * (1.0 + np.arange(len(columns)))[None]
    errors, status = kernel.displacement(joints, placements, columns, values)
    assert (status == OK).all()
    whole = np.zeros((len(joints), 6))
    names = ("x", "y", "z", "rx", "ry", "rz")
    whole[:, [names.index(name) for name in kernel.components]] = errors
    return whole


@pytest.mark.parametrize("factor", thinned([1e-3, 39.37, 1000.0], {39.37}))
def test_all_lengths_times_k_gives_positions_times_k(
    machine: MachineUnderTest, factor: float
) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    other = _kernel.Machine(scaled(machine.description, factor))
    by_pose = np.array([factor if name in "xyz" else 1.0 for name in kernel.commanded])
    by_joint = np.array(
        [1.0 if turns(d["kind"]) else factor for d in machine.description["drives"]]
    )
    found, found_placements, status = other.place(machine.poses * by_pose)
    assert (status == OK).all()
    assert np.abs(found / by_joint - joints).max() < 1e-11
    assert np.abs(found_placements[:, :3] / factor - placements[:, :3]).max() < 1e-11
    assert np.isclose(other.characteristic_length, factor * kernel.characteristic_length)

    by_dof = np.array([factor if name in "xyz" else 1.0 for name in kernel.dof])
    assert np.abs(other.forward(found) / by_dof - kernel.pose_of(placements)).max() < 1e-10

    # Relative tests see no unit: as well conditioned, as singular, as converged.
    conditioning = other.conditioning(machine.poses * by_pose)
    assert np.abs(conditioning - kernel.conditioning(machine.poses)).max() < 1e-11
    by_component = np.array([factor if name in "xyz" else 1.0 for name in kernel.components])
    by_parameter = np.array([factor if unit == "m" else 1.0 for unit in kernel.units])
    sensitivity = other.sensitivity(machine.poses * by_pose)
    expected = kernel.sensitivity(machine.poses)
    difference = sensitivity * by_parameter / by_component[:, None] - expected
    assert np.abs(difference).max() < 1e-10 * np.abs(expected).max()
