"""Sensitivities by dual numbers, by differences, by statics and by the reference are one number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from build_machine import deviated
from drive_kinds import turns
from machine_under_test import OK, MachineUnderTest
from random_machines import DrawnMachine
from reference_kinematics import Reference, rotation_of_quaternion, vector_of
from truepose import _kernel

# Of a unit (the characteristic length, or 1): the third derivative leaves about STEP squared, and
# rounding about 1e-15 / STEP.
STEP = 3e-6
AGREES = 2e-8


def sensitivity(machine: MachineUnderTest) -> NDArray[np.float64]:
    """(37, n_component, n_parameter) in units: displacement over deviation, both per unit."""
    found, status = machine.kernel.sensitivity(machine.poses, status=True)
    assert (status == OK).all()
    return np.asarray(found / machine.unit_of_component[:, None] * machine.unit_of_parameter)


def test_sensitivity_is_the_central_difference(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    expected = sensitivity(machine)
    for column, unit in enumerate(machine.unit_of_parameter):
        moved = []
        for step in (STEP, -STEP):
            errors, status = machine.kernel.displacement(
                joints, placements, np.array([column]), np.array([[step * unit]])
            )
            assert (status == OK).all()
            moved.append(errors / machine.unit_of_component)
        difference = (moved[0] - moved[1]) / (2 * STEP)
        size = max(1.0, np.abs(expected[:, :, column]).max())
        name = machine.kernel.parameters[column]
        assert np.abs(difference - expected[:, :, column]).max() < AGREES * size, name


def test_columns_asked_for_are_those_columns(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    columns = np.random.default_rng(machine.seed).permutation(machine.all_columns)[:5]
    found, status = machine.kernel.sensitivity_at(joints, placements, columns)
    assert (status == OK).all()
    whole = machine.kernel.sensitivity(machine.poses)
    assert np.abs(found - whole[:, :, columns]).max() < 1e-12 * max(1.0, np.abs(whole).max())


def test_virtual_work_gives_the_same_sensitivity(machine: MachineUnderTest) -> None:
    # The load on a parameter under a unit wrench is the tool's displacement along that wrench by a
    # unit of the parameter: the other road, through the forces and not through the displacements.
    joints, placements = machine.placed
    expected, _ = machine.kernel.sensitivity_at(joints, placements, machine.all_columns)
    for row, component in enumerate(machine.kernel.components):
        wrench = np.zeros((1, 6))
        wrench[0, ("x", "y", "z", "rx", "ry", "rz").index(component)] = 1.0
        load, status = machine.kernel.loads_at(joints, placements, wrench, machine.all_columns)
        assert (status == OK).all()
        size = max(1.0, np.abs(expected[:, row]).max())
        assert np.abs(load - expected[:, row]).max() < 1e-11 * size


def test_jac_pose_joint_is_the_central_difference(machine: MachineUnderTest) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    jacobian = kernel.jac_pose_joint(machine.poses)
    assert jacobian.shape == (len(joints), len(kernel.components), len(kernel.joints))
    start = kernel.pose_of(placements)
    for j, drive in enumerate(machine.description["drives"]):
        unit = 1.0 if turns(drive["kind"]) else kernel.characteristic_length
        shift = np.zeros(joints.shape[1])
        shift[j] = STEP * unit
        after = kernel.placement_of(kernel.forward(joints + shift, start))
        before = kernel.placement_of(kernel.forward(joints - shift, start))
        moved = small_displacements(after, before, kernel.components)
        difference = moved / (2 * STEP * unit) / machine.unit_of_component * unit
        expected = jacobian[:, :, j] / machine.unit_of_component * unit
        assert np.abs(difference - expected).max() < AGREES * max(1.0, np.abs(expected).max())


def small_displacements(
    after: NDArray[np.float64], before: NDArray[np.float64], components: tuple[str, ...]
) -> NDArray[np.float64]:
    """(n, n_component) from placements to placements (n, 7), on the reference's road."""
    moved = np.empty((len(after), 6))
    moved[:, :3] = after[:, :3] - before[:, :3]
    for i, (one, other) in enumerate(zip(after, before, strict=True)):
        turned = rotation_of_quaternion(one[3:]) @ rotation_of_quaternion(other[3:]).T
        moved[i, 3:] = vector_of(turned)
    return moved[:, [("x", "y", "z", "rx", "ry", "rz").index(name) for name in components]]


def test_displacement_agrees_with_the_reference(machine: MachineUnderTest) -> None:
    # All parameters at once, moved as far as a badly made machine's.
    kernel, (joints, placements) = machine.kernel, machine.placed
    random = np.random.default_rng(machine.seed + 3)
    values = 2e-3 * machine.unit_of_parameter * random.uniform(-1, 1, len(kernel.parameters))
    errors, status = kernel.displacement(joints, placements, machine.all_columns, values[None])
    assert (status == OK).all()

    deviation = dict(zip(kernel.parameters, values, strict=True))
    # The size by which a universal joint's offset counts is that of the nominal machine.
    size = {"characteristic_length": kernel.characteristic_length}
    actual = Reference(deviated(machine.description, deviation) | size)
    for i in range(0, len(joints), 4):
        rotation = rotation_of_quaternion(placements[i, 3:])
        point, turned = actual.forward(joints[i], placements[i, :3], rotation)
        moved = np.r_[point - placements[i, :3], vector_of(turned @ rotation.T)]
        kept = [("x", "y", "z", "rx", "ry", "rz").index(name) for name in kernel.components]
        assert np.abs(errors[i] - moved[kept]).max() < 1e-10


def test_displacement_takes_values_per_pose(machine: MachineUnderTest) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    columns = machine.all_columns[::3]
    random = np.random.default_rng(machine.seed + 4)
    values = (
        1e-3
        * machine.unit_of_parameter[columns]
        * random.uniform(-1, 1, (len(joints), len(columns)))
    )
    together, _ = kernel.displacement(joints, placements, columns, values)
    for i in range(0, len(joints), 5):
        alone, _ = kernel.displacement(
            joints[i : i + 1], placements[i : i + 1], columns, values[i : i + 1]
        )
        assert np.abs(together[i] - alone[0]).max() < 1e-12


def test_replaced_parameter_changes_forward_as_displacement_says(
    machine: MachineUnderTest,
) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    start = kernel.pose_of(placements)
    for column, name in enumerate(kernel.parameters):
        change = 1e-3 * machine.unit_of_parameter[column]
        other = kernel.replace({name: kernel.nominal[column] + change})
        assert other.nominal[column] == kernel.nominal[column] + change
        found = other.placement_of(other.forward(joints[:5], start[:5]))
        errors, _ = kernel.displacement(
            joints[:5], placements[:5], np.array([column]), np.array([[change]])
        )
        moved = small_displacements(found, placements[:5], kernel.components)
        assert np.abs(moved - errors).max() < 1e-11, name


def test_corrected_command_reaches_what_was_commanded(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    random = np.random.default_rng(machine.seed + 5)
    values = 1e-3 * machine.unit_of_parameter * random.uniform(-1, 1, len(kernel.parameters))
    joints, placements, status = kernel.corrected(machine.poses, machine.all_columns, values[None])
    assert set(status) <= {OK, _kernel.STATUS.index("out_of_travel")}

    # What is driven to is nominal placement + displacement; the commanded freedoms are met.
    _, nominal = machine.placed
    errors, status = kernel.displacement(joints, nominal, machine.all_columns, values[None])
    assert (status == OK).all()
    commanded = [
        kernel.components.index(name if name in "xyz" else f"r{'xyz'['abc'.index(name)]}")
        for name in kernel.commanded
    ]
    assert np.abs(errors[:, commanded]).max() < 1e-11

    # And it is the inverse of the machine that has those parameters.
    actual = kernel.replace(dict(zip(kernel.parameters, kernel.nominal + values, strict=True)))
    again = actual.inverse(machine.poses, status=True)[0]
    assert np.abs(joints - again).max() < 1e-12
    expected = small_displacements(placements, nominal, kernel.components)
    assert np.abs(errors - expected).max() < 1e-10


def test_sensitivity_of_a_drawn_machine_is_one_on_all_roads(drawn: DrawnMachine) -> None:
    test_sensitivity_is_the_central_difference(drawn)
    test_virtual_work_gives_the_same_sensitivity(drawn)
