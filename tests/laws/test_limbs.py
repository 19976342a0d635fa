"""Laws of limbs that bend, for every machine file with some: virtual work, symmetry, balance."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from truepose.machine import Machine
from truepose.machine.chains import Beam, ChainJoint
from truepose.machine.limbs import Limb
from truepose.machine.limbs import with_limbs as changed_limbs
from truepose.runs.poses import PoseRun
from truepose.sources import PoseBlock

Array = NDArray[np.float64]

WITH_LIMBS = ("3prs", "3rps", "tricept")
STEP = 1e-6
WRENCH = np.array([300.0, -200.0, 500.0, 12.0, 7.0, -9.0])

with_limbs = pytest.mark.parametrize("name", WITH_LIMBS)


def test_every_machine_with_limbs_is_here() -> None:
    found = {path.stem for path in MACHINES.glob("*.toml") if tp.load(path).limbs}
    assert found == set(WITH_LIMBS)


def loaded(name: str) -> tuple[Machine, PoseBlock]:
    machine = tp.load(MACHINES / f"{name}.toml")
    poses = machine.poses()
    condition = machine.condition.replace(force=WRENCH[:3].tolist(), moment=WRENCH[3:].tolist())
    chosen = poses[np.unique(np.linspace(0, len(poses) - 1, 9).astype(int))]
    return machine, next(iter(PoseRun(machine, chosen, condition)))


@with_limbs
def test_a_load_on_an_offset_is_the_work_of_the_wrench(name: str) -> None:
    """By finite differences of the forward solution, with the offset a little off."""
    machine, block = loaded(name)
    columns = np.array(machine.kernel.limb_parameters)
    loads = block.loads(columns, "tool")
    for at, column in enumerate(columns):
        moved = []
        for step in (STEP, -STEP):
            errors, status = machine.kernel.displacement(
                block.joints, block.placements, [int(column)], np.array([[step]])
            )
            assert (status == 0).all()
            moved.append(errors)
        work = (moved[0] - moved[1]) @ WRENCH / (2 * STEP)
        np.testing.assert_allclose(loads[:, at], work, rtol=1e-6, atol=1e-5)


@with_limbs
def test_closure_forces_of_limbs_balance_the_wrench(name: str) -> None:
    """Of every part: what the limbs pull at the platform, about the tool point, and the wrench."""
    machine, block = loaded(name)
    kernel = machine.kernel
    wrenches = kernel.limb_wrenches_at(block.joints, block.placements)
    columns = np.array(kernel.limb_parameters)
    loads = block.loads(columns, "tool")
    # A closure's force is minus the load on what it gives way by.
    total = np.einsum("nk,nki->ni", -loads, wrenches)
    in_limbs = {limb.strut for limb in machine.limbs}
    for index, strut in enumerate(machine.struts):
        if strut.name not in in_limbs:
            centres, along = block.centres[:, index, 1], block.directions[:, index]
            pull = -block.loads(kernel.length_parameters[[index]], "tool")
            arm = centres - block.placements[:, :3]
            total += pull * np.concatenate([along, np.cross(arm, along)], axis=1)
    np.testing.assert_allclose(total, np.broadcast_to(-WRENCH, total.shape), atol=1e-6)


@with_limbs
def test_compliance_is_symmetric_and_stores_energy(name: str) -> None:
    machine, block = loaded(name)
    poses = block.requested[block.indices]
    compliance = machine.compliance(poses)
    size = np.repeat([1.0, 1.0 / machine.characteristic_length], 3)
    scaled = compliance / np.outer(size, size)
    np.testing.assert_allclose(
        scaled, np.swapaxes(scaled, 1, 2), atol=1e-12 * float(np.abs(scaled).max())
    )
    # Half force times displacement: what all parts store, each under its own load.
    (elastic,) = (source for source in machine.sources if source.name == "elastic")
    deviation = elastic.deviation(machine, block.condition, block)  # type: ignore[attr-defined]
    loads = block.loads(deviation.parameters, "tool")
    stored = 0.5 * (loads * deviation.shift).sum(axis=1)
    work = 0.5 * np.einsum("i,nij,j->n", WRENCH, compliance, WRENCH)
    np.testing.assert_allclose(stored, work, rtol=1e-10)
    assert (np.linalg.eigvalsh(scaled) > -1e-12 * np.abs(scaled).max()).all()


@with_limbs
def test_deflections_under_two_wrenches_add_up(name: str) -> None:
    _, block = loaded(name)
    yielding = block.compliances
    one, other = (block.loads_of(wrench[np.newaxis], yielding.columns) for wrench in np.eye(6)[:2])
    together = block.loads_of((np.eye(6)[0] + np.eye(6)[1])[np.newaxis], yielding.columns)
    np.testing.assert_allclose(
        yielding.deflection(together),
        yielding.deflection(one) + yielding.deflection(other),
        rtol=1e-12, atol=1e-18,
    )  # fmt: skip


def stiffened(limb: Limb, factor: float) -> Limb:
    """All of a limb's parts so many times as stiff."""

    def harder(part: ChainJoint | Beam) -> ChainJoint | Beam:
        if isinstance(part, Beam):
            return dataclasses.replace(
                part, modulus=part.modulus * factor, shear_modulus=part.shear_modulus * factor
            )
        return dataclasses.replace(
            part,
            radial=part.radial * factor,
            axial=part.axial * factor,
            across=(part.across[0] * factor, part.across[1] * factor),
            tilt=(part.tilt[0] * factor, part.tilt[1] * factor, part.tilt[2] * factor),
        )

    return dataclasses.replace(limb, chain=tuple(harder(part) for part in limb.chain))


@with_limbs
def test_very_stiff_limbs_are_as_rigid_ones(name: str) -> None:
    machine, block = loaded(name)
    poses = block.requested[block.indices]
    soft, stiff, rigid = (
        changed_limbs(machine, tuple(stiffened(limb, factor) for limb in machine.limbs))
        for factor in (1.0, 1e12, math.inf)
    )
    errors = [
        tp.budget(each, poses, block.condition)["error"].sel(source="elastic").to_numpy()
        for each in (soft, stiff, rigid)
    ]
    largest = float(np.abs(errors[0]).max())
    assert np.abs(errors[1] - errors[2]).max() < 1e-9 * largest
    assert np.abs(errors[0] - errors[2]).max() > 1e-3 * largest
    same = tp.budget(machine, poses, block.condition)["error"].sel(source="elastic")
    np.testing.assert_array_equal(errors[0], same)
