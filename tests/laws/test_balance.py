"""The forces on every part, its weight included, sum to zero: platform, struts, carriages.

Free bodies in numpy, from joint centres and the forces that are stated, on every machine with
masses everywhere, standing askew, under a wrench on the tool. What each part of a limb carries
decides how far it gives way, so that the last law asks the error source.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose
from drive_kinds import formulas, is_strut
from guided_machines import rigidly_guided
from machine_under_test import MachineUnderTest
from random_machines import DrawnMachine
from reference_kinematics import actual_coordinate, rotation_of, rotation_of_quaternion
from truepose.machine import Condition, Machine, Strut
from truepose.sources import Loads, PoseBlock

Floats = NDArray[np.float64]

POSES = [0, 5, 20, 36]
"""Anywhere in the workspace, at its border and at its corner."""
BALANCED = 1e-9
"""Of all forces on a part, or of their moments: what is left over is rounding."""
G = 9.80665
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


def heavy(under_test: MachineUnderTest) -> Machine:
    """The machine with masses everywhere, soft joints, a wrench on the tool, standing askew."""
    # What limbs bend by is held against frames (tests/oracles/test_limbs_against_frames.py).
    found = truepose.load(rigidly_guided(under_test.path))
    random = np.random.default_rng(under_test.seed + 30)
    length = found.characteristic_length

    def vector(size: float) -> tuple[float, float, float]:
        x, y, z = random.uniform(-size, size, 3)
        return (x, y, z)

    def strut(one: Strut) -> Strut:
        base, platform = random.uniform(2e7, 2e8, 2)
        return dataclasses.replace(
            one,
            mass=random.uniform(1, 9),
            centre_of_mass=random.choice([0.2, 0.5, 0.8]),
            base_joint=dataclasses.replace(one.base_joint, stiffness=base),
            platform_joint=dataclasses.replace(one.platform_joint, stiffness=platform),
        )

    return dataclasses.replace(
        found,
        mounting=vector(3.0),
        platform=dataclasses.replace(
            found.platform, mass=random.uniform(10, 60), centre_of_mass=vector(length)
        ),
        drives=tuple(
            dataclasses.replace(
                drive, mass=random.uniform(1, 9), stiffness=random.uniform(2e7, 2e8)
            )
            for drive in found.drives
        ),
        struts=tuple(strut(one) for one in found.struts),
        condition=Condition(
            force=vector(500.0), moment=vector(500.0 * length), acceleration=vector(5.0)
        ),
    )


@dataclass(frozen=True, eq=False)
class Bodies:
    """A heavy machine at some poses, with what truepose says of the forces in it."""

    under_test: MachineUnderTest
    machine: Machine

    @cached_property
    def block(self) -> PoseBlock:
        joints, placements = (np.ascontiguousarray(all_[POSES]) for all_ in self.under_test.placed)
        poses = self.under_test.poses[POSES]
        return PoseBlock(
            self.machine, self.machine.condition, poses, np.arange(len(poses)), joints, placements
        )

    @cached_property
    def field(self) -> Floats:
        """(3,) N/kg in base axes."""
        return np.asarray(rotation_of(self.machine.mounting).T @ [0.0, 0.0, -G])

    @cached_property
    def along(self) -> Floats:
        """(n, n_strut, 3) unit vectors from base joint to platform joint."""
        centres = self.block.centres
        along = centres[:, :, 1] - centres[:, :, 0]
        return np.asarray(along / np.linalg.norm(along, axis=2, keepdims=True))

    @cached_property
    def weights(self) -> Floats:
        """(n_strut, 3) N."""
        return np.array([strut.mass * self.field for strut in self.machine.struts])

    @cached_property
    def shares(self) -> Floats:
        """(n, n_strut, 2, 3) N: what a strut, as a beam, lays across itself on its two joints."""
        along = self.along
        axial = (along @ self.field)[..., np.newaxis] * along
        across = np.array([strut.mass for strut in self.machine.struts])[:, np.newaxis] * (
            self.field - axial
        )
        centres = np.array([strut.centre_of_mass for strut in self.machine.struts])[:, np.newaxis]
        return np.stack([(1 - centres) * across, centres * across], axis=2)

    def rows(self, at: int) -> Floats:
        """(n_closure, 6) wrench on the platform, reversed, of a unit of each closure's force."""
        placement = self.block.placements[at]
        rotation = rotation_of_quaternion(placement[3:])
        return self.under_test.reference.rows(self.block.joints[at], placement[:3], rotation)

    def on_platform(self, at: int) -> list[Floats]:
        """Wrenches (6,) at the tool point but for limbs along themselves and guides."""
        condition, platform = self.machine.condition, self.machine.platform
        point = self.block.placements[at, :3]
        rotation = rotation_of_quaternion(self.block.placements[at, 3:])
        centre = self.under_test.reference.platform_point(platform.centre_of_mass, point, rotation)
        own = platform.mass * (self.field - np.array(condition.acceleration))
        wrenches = [np.r_[condition.force, condition.moment], wrench(own, centre - point)]
        heads = self.block.centres[at, :, 1] - point
        return wrenches + [
            wrench(share, head) for share, head in zip(self.shares[at, :, 1], heads, strict=True)
        ]

    def on_base_side(self, at: int, strut: int) -> Floats:
        """(3,) N: with what a strut pulls at its base joint, its own axial force as stated."""
        axial = self.block.end_forces[at, strut, 0] * self.along[at, strut]
        return np.asarray(axial + self.shares[at, strut, 0])

    def carriage_share(self, strut: Strut) -> Floats:
        """(3,) N: the strut's part of the weight of the carriage that it stands on."""
        for drive in self.machine.drives:
            if drive.name == strut.drive:
                carried = sum(other.drive == drive.name for other in self.machine.struts)
                return np.asarray(drive.mass / carried * self.field)
        return np.zeros(3)

    def base_side(self, at: int, strut: int) -> tuple[Floats, Floats]:
        """(3, 3) axes of what the base joint stands on, (3,) its velocity per speed of the drive.

        Of a drive that is the strut's length: the strut's direction.
        """
        name = self.machine.struts[strut].drive
        if name is None:
            return np.eye(3), np.zeros(3)
        reference, joints = self.under_test.reference, self.block.joints[at]
        number = reference.index[name]
        drive, row = reference.drives[number], reference.struts[strut]
        if is_strut(drive["kind"]):
            return np.eye(3), self.along[at, strut]
        slopes = formulas(drive["kind"]).slopes(
            drive, np.array(row["base"], float), actual_coordinate(drive, joints[number])
        )
        return reference.base_axes(row, joints), slopes["offset"]


def wrench(force: Floats, arm: Floats) -> Floats:
    return np.r_[force, np.cross(arm, force)]


def balance(wrenches: list[Floats], size: float, kept: list[int] | slice = slice(None)) -> None:
    """Their sum is zero in the components kept, by the forces, or moments, that add up to it."""
    every = np.array(wrenches) / np.r_[np.ones(3), np.full(3, size)]
    left_over = np.abs(every.sum(axis=0))[kept]
    assert np.abs(every).sum(axis=0).max() > 1.0
    assert left_over.max() <= BALANCED * np.abs(every).sum(axis=0).max()


def platform_balances(bodies: Bodies) -> None:
    """Struts at its joints, guides, weight, inertia and tool: in what the machine can move in."""
    block, n_strut = bodies.block, len(bodies.machine.struts)
    kept = [COMPONENTS.index(name) for name in bodies.machine.components]
    for at in range(block.indices.size):
        rows = bodies.rows(at)
        limbs = np.r_[block.end_forces[at, :, 1], block.forces[at, n_strut:]]
        held = [-force * row for force, row in zip(limbs, rows, strict=True)]
        balance([*held, *bodies.on_platform(at)], bodies.machine.characteristic_length, kept)


def struts_balance(bodies: Bodies) -> None:
    """Both joints and the weight at its centre of mass: forces, and moments about a joint."""
    block = bodies.block
    for at in range(block.indices.size):
        for k, strut in enumerate(bodies.machine.struts):
            foot, head = block.centres[at, k]
            base_end, platform_end = block.end_forces[at, k]
            by_base = -bodies.on_base_side(at, k)
            by_platform = platform_end * bodies.along[at, k] - bodies.shares[at, k, 1]
            weight = wrench(bodies.weights[k], strut.centre_of_mass * (head - foot))
            wrenches = [wrench(by_base, 0 * foot), wrench(by_platform, head - foot), weight]
            balance(wrenches, float(np.linalg.norm(head - foot)))
            # The tension stated is the mean, which the centre of mass divides as it does the strut.
            mean = (1 - strut.centre_of_mass) * platform_end + strut.centre_of_mass * base_end
            scale = np.abs(block.tension[at]).max()
            assert mean == pytest.approx(block.tension[at, k], abs=BALANCED * scale)


def base_sides_balance(bodies: Bodies) -> None:
    """What the base joints stand on holds struts and carriage, the drive what it has to of that."""
    block, machine = bodies.block, bodies.machine
    names, n_pose = machine.parameters, block.indices.size
    held = np.zeros((n_pose, len(machine.drives)))
    sizes = np.zeros_like(held)
    for k, strut in enumerate(machine.struts):
        columns = np.array([names.index(f"{strut.part}.base.{axis}") for axis in "xyz"])
        stated = block.loads(columns, "all")
        carriage = bodies.carriage_share(strut)
        for at in range(n_pose):
            pull = bodies.on_base_side(at, k)
            axes, way = bodies.base_side(at, k)
            size = np.abs(pull + carriage).sum()
            assert axes @ stated[at] == pytest.approx(pull + carriage, abs=BALANCED * size)
            if strut.drive is None:
                continue
            number = machine.joints.index(strut.drive)
            if not is_strut(machine.drives[number].kind):
                pull = pull + carriage
            held[at, number] += pull @ way
            sizes[at, number] += np.abs(pull) @ np.abs(way)
    drives = block.drive_loads(range(len(machine.drives)))
    assert (np.abs(drives - held) <= BALANCED * sizes).all()


def limbs_give_way_by_what_they_carry(bodies: Bodies) -> None:
    """The error source's shift is force x compliance, added up part by part of each limb."""
    machine = bodies.machine
    still = machine.condition.replace(force=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 0.0))
    resting = Bodies(bodies.under_test, dataclasses.replace(machine, condition=still))
    block = resting.block
    deviation = Loads(weighs=True).deviation(resting.machine, still, block)
    columns = deviation.parameters.tolist()
    for at in range(block.indices.size):
        pulls = head_pulls(resting, at)
        for k, strut in enumerate(machine.struts):
            own = resting.weights[k] @ resting.along[at, k]
            drive = next((one for one in machine.drives if one.name == strut.drive), None)
            foot, head = (softness(joint.stiffness) for joint in strut.joints)
            if drive is not None and is_strut(drive.kind):
                foot += softness(drive.held_stiffness)
            body = softness(strut.axial_stiffness(block.lengths[at, k]))
            parts = [
                foot * (pulls[k] + own),
                body * (pulls[k] + strut.centre_of_mass * own),
                head * pulls[k],
            ]
            shift = deviation.shift[at, columns.index(machine.kernel.length_parameters[k])]
            scale = (foot + body + head) * (np.abs(pulls).max() + abs(own))
            assert shift == pytest.approx(sum(parts), rel=0.0, abs=BALANCED * scale)


def head_pulls(bodies: Bodies, at: int) -> Floats:
    """(n_strut,) N at the platform joints, by the platform's balance.

    With more closures than freedoms that leaves them open: then by the tension that is stated.
    """
    kept = [COMPONENTS.index(name) for name in bodies.machine.components]
    rows, n_strut = bodies.rows(at)[:, kept], len(bodies.machine.struts)
    if len(rows) == len(kept):
        loads = np.sum(bodies.on_platform(at), axis=0)[kept]
        return np.asarray(np.linalg.solve(rows.T, loads)[:n_strut])
    shares = np.array([one.centre_of_mass for one in bodies.machine.struts])
    own = (bodies.weights * bodies.along[at]).sum(axis=1)
    return np.asarray(bodies.block.tension[at] - shares * own)


def softness(stiffness: float | None) -> float:
    return 0.0 if stiffness is None else 1.0 / stiffness


@cache
def bodies_of(under_test: MachineUnderTest) -> Bodies:
    return Bodies(under_test, heavy(under_test))


LAWS = (
    platform_balances,
    struts_balance,
    base_sides_balance,
    limbs_give_way_by_what_they_carry,
)


@pytest.fixture(params=LAWS, ids=lambda law: law.__name__)
def law(request: pytest.FixtureRequest) -> Callable[[Bodies], None]:
    found: Callable[[Bodies], None] = request.param
    return found


def test_balance(machine: MachineUnderTest, law: Callable[[Bodies], None]) -> None:
    law(bodies_of(machine))


def test_balance_of_machines_drawn(drawn: DrawnMachine, law: Callable[[Bodies], None]) -> None:
    law(bodies_of(drawn))
