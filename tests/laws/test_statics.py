"""Forces balance, work is what energy says, and compliance and stiffness undo each other."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from machine_under_test import OK, MachineUnderTest
from reference_kinematics import rotation_of_quaternion

ALL_COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


def unit_wrenches(machine: MachineUnderTest) -> NDArray[np.float64]:
    """(6, 6) forces along each axis, and as large ones about it at the characteristic length."""
    length = machine.kernel.characteristic_length
    return np.diag([1000.0] * 3 + [1000.0 * length] * 3)


def kept(machine: MachineUnderTest) -> list[int]:
    """Which of the six components the platform can move in."""
    return [ALL_COMPONENTS.index(name) for name in machine.kernel.components]


def random_wrenches(machine: MachineUnderTest) -> NDArray[np.float64]:
    random = np.random.default_rng(machine.seed + 6)
    return random.uniform(-1, 1, (len(machine.poses), 6)) @ unit_wrenches(machine)


def part_compliance(machine: MachineUnderTest) -> NDArray[np.float64]:
    """(37, n_column) of `soft_columns`, m/N or rad/(N m), unlike from part to part and in poses.

    Where closures share a load by their stiffness the parts must be as stiff as those said to the
    kernel, but for a factor, if compliance and stiffness are to be those of one structure.
    """
    random = np.random.default_rng(machine.seed + 7)
    columns, length = machine.soft_columns, machine.kernel.characteristic_length
    softness = random.uniform(1e-8, 5e-8, (len(machine.poses), len(columns)))
    if machine.kernel.overconstrained:
        return softness[:, :1] / 2e-8 * np.array(machine.description["closure_compliance"])
    return np.asarray(softness * (machine.unit_of_parameter[columns] / length) ** 2)


def rows_of(machine: MachineUnderTest, i: int) -> NDArray[np.float64]:
    """(n_closure, 6) of the reference at pose `i`: what a unit of each tension holds."""
    joints, placements = machine.placed
    rotation = rotation_of_quaternion(placements[i, 3:])
    return machine.reference.rows(joints[i], placements[i, :3], rotation)


def test_the_platform_is_in_equilibrium(machine: MachineUnderTest) -> None:
    # Worked out from the joint centres of the reference: each strut pulls with its tension.
    wrenches = random_wrenches(machine)
    tension = machine.kernel.forces(machine.poses, wrenches)
    for i, wrench in enumerate(wrenches):
        total = wrench - tension[i] @ rows_of(machine, i)
        scale = np.abs(wrench).max() + np.abs(tension[i]).max()
        assert np.abs(total[kept(machine)]).max() < 1e-10 * scale


def test_one_wrench_serves_all_poses(machine: MachineUnderTest) -> None:
    wrench = random_wrenches(machine)[0]
    one = machine.kernel.forces(machine.poses, wrench)
    many = machine.kernel.forces(machine.poses, np.tile(wrench, (len(machine.poses), 1)))
    assert np.array_equal(one, many)


def test_load_on_a_parameter_is_the_work_of_the_wrench(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    wrenches = random_wrenches(machine)
    load, status = machine.kernel.loads_at(joints, placements, wrenches, machine.all_columns)
    assert (status == OK).all()
    sensitivity = machine.kernel.sensitivity(machine.poses)
    work = np.einsum("ni,nik->nk", wrenches[:, kept(machine)], sensitivity)
    assert np.abs(load - work).max() < 1e-10 * np.abs(work).max()


def test_load_on_a_length_is_the_tension(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    wrenches = random_wrenches(machine)
    columns = np.asarray(machine.kernel.length_parameters)
    load, _ = machine.kernel.loads_at(joints, placements, wrenches, columns)
    tension = machine.kernel.forces(machine.poses, wrenches)[:, : len(columns)]
    assert np.abs(load - tension).max() < 1e-12 * np.abs(tension).max()


def test_length_parameters_move_the_strut(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    struts = kernel.closures[: len(machine.description["struts"])]
    for name, column in zip(struts, kernel.length_parameters, strict=True):
        drive = {s["name"]: s["drive"] for s in machine.description["struts"]}[name]
        assert kernel.parameters[column] in (f"strut.{name}.length", f"drive.{drive}.offset")


def test_compliance_is_symmetric_positive_and_inverse_of_stiffness(
    machine: MachineUnderTest,
) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    columns, soft = machine.soft_columns, part_compliance(machine)
    compliance, status = kernel.compliance_at(joints, placements, columns, soft)
    stiffness, status_stiff = kernel.stiffness_at(joints, placements, columns, soft)
    assert (status == OK).all()
    assert (status_stiff == OK).all()
    # In units of the characteristic length, so that no entry is small for its unit alone.
    unit = machine.unit_of_component
    compliance = compliance / unit[:, None] / unit
    stiffness = stiffness * unit[:, None] * unit
    for flexible, stiff in zip(compliance, stiffness, strict=True):
        assert np.abs(flexible - flexible.T).max() < 1e-14 * np.abs(flexible).max()
        assert np.abs(stiff - stiff.T).max() < 1e-14 * np.abs(stiff).max()
        assert np.linalg.eigvalsh(flexible).min() > 0
        assert np.abs(stiff @ flexible - np.eye(len(unit))).max() < 1e-9


def test_compliance_of_many_parameters_is_positive_semidefinite(
    machine: MachineUnderTest,
) -> None:
    # Joints and drives give way too: any parameter may, some rigid (0).
    kernel, (joints, placements) = machine.kernel, machine.placed
    random = np.random.default_rng(machine.seed + 8)
    soft = 1e-8 * random.uniform(size=(1, len(machine.all_columns))) / machine.unit_of_parameter**2
    soft[0, ::4] = 0.0
    compliance, status = kernel.compliance_at(joints, placements, machine.all_columns, soft)
    assert (status == OK).all()
    sensitivity = kernel.sensitivity(machine.poses)
    expected = np.einsum("nik,k,njk->nij", sensitivity, soft[0], sensitivity)
    assert np.abs(compliance - expected).max() < 1e-11 * np.abs(expected).max()
    for flexible in compliance:
        values = np.linalg.eigvalsh(flexible)
        assert values.min() > -1e-12 * values.max()


def test_the_tool_moves_as_its_struts_stretch(machine: MachineUnderTest) -> None:
    # Compliance x wrench, and each part longer by compliance x load: exactly, so small loads.
    kernel, (joints, placements) = machine.kernel, machine.placed
    columns, soft = machine.soft_columns, 1e-2 * part_compliance(machine)
    wrenches = random_wrenches(machine)
    compliance, _ = kernel.compliance_at(joints, placements, columns, soft)
    linear = np.einsum("nij,nj->ni", compliance, wrenches[:, kept(machine)])
    load, status = kernel.loads_at(joints, placements, wrenches, columns)
    assert (status == OK).all()
    exact, status = kernel.displacement(joints, placements, columns, soft * load)
    assert (status == OK).all()
    size = np.abs(linear / machine.unit_of_component).max()
    difference = np.abs((exact - linear) / machine.unit_of_component).max()
    assert difference < max(1e-4 * size, 1e-13)

    # The wrench's work is the energy in the parts: F . C F / 2 = sum c T^2 / 2.
    work = np.einsum("ni,ni->n", wrenches[:, kept(machine)], linear)
    assert np.allclose(work, (soft * load**2).sum(1), rtol=1e-10, atol=0)


@pytest.mark.parametrize("factor", [0.5, 3.0])
def test_softer_parts_give_more_in_proportion(machine: MachineUnderTest, factor: float) -> None:
    joints, placements = machine.placed
    columns, soft = machine.soft_columns, part_compliance(machine)
    one, _ = machine.kernel.compliance_at(joints, placements, columns, soft)
    other, _ = machine.kernel.compliance_at(joints, placements, columns, factor * soft)
    assert np.abs(other - factor * one).max() < 1e-14 * np.abs(one).max()


def test_conditioning_is_the_ratio_of_singular_values(machine: MachineUnderTest) -> None:
    length = machine.kernel.characteristic_length
    found = machine.kernel.conditioning(machine.poses)
    for i in range(len(machine.poses)):
        rows = rows_of(machine, i) / np.array([1, 1, 1, length, length, length])
        values = np.linalg.svd(rows[:, kept(machine)], compute_uv=False)
        assert abs(found[i] - values[-1] / values[0]) < 1e-10


def test_characteristic_length(machine: MachineUnderTest) -> None:
    expected = machine.reference.characteristic_length
    assert np.isclose(machine.kernel.characteristic_length, expected, rtol=1e-12)
