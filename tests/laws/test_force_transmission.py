"""The second road to the sensitivities: unit wrenches on the platform, and nothing differentiated.

How far the tool goes along a direction for a unit of a parameter is the force that a unit load in
that direction puts on the parameter (Pott & Hiller, "A new approach to error analysis in parallel
kinematic structures", ARK 2004). The forces are found here as a mechanic would: members by the
balance of the platform, then what each exerts on its joints, carriages, arms and guides, dotted
with how a parameter moves that point. Geometry is the reference's, at the kernel's poses.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drive_kinds import formulas, is_strut
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import actual_coordinate, rotation_of_quaternion, tangents, unit

Vector = NDArray[np.float64]

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
AXES = np.eye(3)


@dataclass(frozen=True)
class Member:
    """What can act on the platform: a unit of it is `force` at the point `at`, and `couple`."""

    kind: str
    row: Mapping[str, Any]
    force: Vector
    at: Vector
    couple: Vector

    def wrench_about(self, point: Vector) -> Vector:
        """(6,) force and moment about `point` of a unit of the member."""
        moment = np.cross(self.at - point, self.force) + self.couple
        return np.concatenate([self.force, moment])


class Mechanics:
    """A machine at one of its poses, as bodies and the forces between them."""

    def __init__(self, machine: MachineUnderTest, number: int) -> None:
        self.reference = machine.reference
        self.components = [COMPONENTS.index(name) for name in machine.kernel.components]
        joints, placements = machine.placed
        self.joints, self.point = joints[number], placements[number, :3]
        self.rotation = rotation_of_quaternion(placements[number, 3:])
        self.members = [self.strut(row) for row in self.reference.struts]
        for row in self.reference.guides:
            self.members += self.guide(row)

    def strut(self, row: Mapping[str, Any]) -> Member:
        """Tension 1: the platform's joint is pulled towards the base."""
        base = self.reference.base_joint(row, self.joints)
        joint = self.reference.platform_joint(row, self.point, self.rotation)
        return Member("strut", row, unit(base - joint), joint, np.zeros(3))

    def guide(self, row: Mapping[str, Any]) -> list[Member]:
        """What holds the platform where it may not go, and no more: guides have no friction."""
        none = np.zeros(3)
        if row["kind"] == "universal":
            couple = np.cross(self.rotation @ unit(row["platform_axis"]), unit(row["base_axis"]))
            return [Member("universal", row, none, self.point, couple)]
        if row["kind"] == "plane":
            at = self.own(row)
            return [Member("plane", row, unit(row["normal"]), at, none)]
        across = tangents(row["axis"]) @ self.rotation.T
        return [Member("line", row, way, self.origin(row), none) for way in across]

    def own(self, row: Mapping[str, Any]) -> Vector:
        """A guide's point of the platform, base frame."""
        return self.reference.platform_point(
            row.get("platform", np.zeros(3)), self.point, self.rotation
        )

    @staticmethod
    def origin(row: Mapping[str, Any]) -> Vector:
        """A guide's point of the frame."""
        return np.array(row.get("origin", [0.0, 0.0, 0.0]), float)

    def amounts(self, wrench: Vector) -> Vector:
        """(n_member,) of each member, so that all of them and `wrench` leave the platform at rest.

        With more members than freedoms, those of least elastic energy: each deflects by its
        compliance as the motion of one rigid platform says.
        """
        acting = np.array([member.wrench_about(self.point) for member in self.members])
        acting, kept = acting[:, self.components], wrench[self.components]
        if not self.reference.overconstrained:
            return np.linalg.solve(acting.T, -kept)
        assert self.reference.stiffness is not None
        stiff = self.reference.stiffness[:, None] * acting
        return np.asarray(-stiff @ np.linalg.solve(acting.T @ stiff, kept))

    def loads(self, wrench: Vector) -> dict[str, float]:
        """The load on every parameter by its name; positive drives it up."""
        found: dict[str, float] = {}
        pulled = np.zeros(3)  # by all members, on the platform

        def add(name: str, value: float) -> None:
            found[name] = found.get(name, 0.0) + value

        for member, amount in zip(self.members, self.amounts(wrench), strict=True):
            force = amount * member.force
            pulled += force
            path = "strut" if member.kind == "strut" else "guide"
            name = f"{path}.{member.row['name']}"
            at_platform = self.rotation.T @ force
            if member.kind == "strut":
                for parameter, value in self.on_base(member, -force).items():
                    add(parameter, value)
                add(f"{name}.length", amount)
                if member.row.get("ring_radius"):
                    centre = self.own(member.row)
                    add(f"{name}.ring_radius", float(force @ unit(member.at - centre)))
            for k, axis in enumerate("xyz"):
                if member.kind != "universal":
                    add(f"{name}.platform.{axis}", at_platform[k])
                if member.kind in ("plane", "line"):
                    add(f"{name}.origin.{axis}", -force[k])
            for parameter, value in self.on_directions(member, amount).items():
                add(f"{name}.{parameter}", value)
            if member.kind == "line":
                number = 2 if f"{name}.offset.1" in found else 1
                add(f"{name}.offset.{number}", amount)
            elif member.kind in ("plane", "universal"):
                size = 1.0 if member.kind == "plane" else self.reference.characteristic_length
                add(f"{name}.offset", -amount / size)
        for k, axis in enumerate("xyz"):
            # The tool point moves in the platform: the platform goes back against its members.
            add(f"tool.{axis}", float(-pulled @ self.rotation[:, k]))
        return found

    def on_base(self, member: Member, force: Vector) -> dict[str, float]:
        """Loads on a base joint, and on the drive that has it, as the strut pulls with `force`."""
        row = member.row
        axes = AXES
        found: dict[str, float] = {}
        drive = next((d for d in self.reference.drives if d["name"] == row["drive"]), None)
        if drive is not None:
            name, joint = drive["name"], self.joints[self.reference.index[drive["name"]]]
            actual = actual_coordinate(drive, joint)
            slopes = formulas(drive["kind"]).slopes(drive, np.array(row["base"], float), actual)
            if is_strut(drive["kind"]):
                slopes = {"offset": -member.force}
            axes = self.reference.base_axes(row, self.joints)
            found = {f"drive.{name}.{key}": float(force @ way) for key, way in slopes.items()}
            found[f"drive.{name}.scale"] = found[f"drive.{name}.offset"] * joint
        return found | named(f"strut.{row['name']}.base", "xyz", force @ axes)

    def on_directions(self, member: Member, amount: float) -> dict[str, float]:
        """Loads on the directions of a guide."""
        row, force = member.row, amount * member.force
        if member.kind == "plane":
            # The plane turns about its origin, and goes down where the point is.
            away = self.own(row) - self.origin(row)
            ways = {"normal": amount * tangents(row["normal"]) @ away}
        elif member.kind == "line":
            # The line turns about the platform's point and moves across where the frame holds it.
            axis = self.rotation @ unit(row["axis"])
            reach = (self.origin(row) - self.own(row)) @ axis
            ways = {"axis": reach * tangents(row["axis"]) @ self.rotation.T @ force}
        elif member.kind == "universal":
            base, own = unit(row["base_axis"]), self.rotation @ unit(row["platform_axis"])
            ways = {
                "base_axis": amount * tangents(base) @ own,
                "platform_axis": amount * tangents(row["platform_axis"]) @ self.rotation.T @ base,
            }
        else:
            return {}
        return {
            name: value
            for field, values in ways.items()
            for name, value in named(field, "uv", values).items()
        }


def named(field: str, parts: str, values: Vector) -> dict[str, float]:
    """Values of a field's components by their names."""
    return {f"{field}.{part}": float(value) for part, value in zip(parts, values, strict=True)}


def test_unit_wrenches_give_the_sensitivities(machine: MachineUnderTest) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    found, status = kernel.sensitivity_at(joints, placements, machine.all_columns)
    assert (status == OK).all()
    for number in range(len(joints)):
        mechanics = Mechanics(machine, number)
        for row, component in enumerate(kernel.components):
            load = mechanics.loads(np.eye(6)[COMPONENTS.index(component)])
            expected = np.array([load[name] for name in kernel.parameters])
            scale = machine.unit_of_parameter / machine.unit_of_component[row]
            difference = np.abs(found[number, row] - expected) * scale
            assert difference.max() < 1e-10 * max(1.0, np.abs(expected * scale).max()), component


def test_the_kernels_loads_are_those_forces(machine: MachineUnderTest) -> None:
    kernel, (joints, placements) = machine.kernel, machine.placed
    wrench = np.random.default_rng(machine.seed + 9).uniform(-1, 1, 6)
    found, status = kernel.loads_at(joints, placements, wrench[None], machine.all_columns)
    assert (status == OK).all()
    for number in range(0, len(joints), 4):
        mechanics = Mechanics(machine, number)
        load = mechanics.loads(wrench)
        expected = np.array([load[name] for name in kernel.parameters])
        assert np.abs(found[number] - expected).max() < 1e-10 * max(1.0, np.abs(expected).max())
