"""A machine at a pose as a truss in CalculiX: what gives way, weighs and grows, part by part.

Struts are elastic members between joint centres, the platform is a rigid body; passive guides are
linear equations, derived here from what each lets the platform do. Geometry is the reference's
(tests/reference_kinematics.py); of the kernel it has the poses and joint coordinates alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from calculix import EVERY_WAY, Deck
from drive_kinds import formulas, has_carriage, is_strut
from machine_under_test import MachineUnderTest
from reference_kinematics import (
    actual_coordinate,
    rotation_of_quaternion,
    tangents,
    unit,
)
from truepose.machine import Body, Condition, Drive, Machine, Strut

Vector = NDArray[np.float64]

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")


class Truss:
    """A machine at one pose in a deck: `tool` is the node of its tool point, `turn` of turns."""

    def __init__(
        self,
        deck: Deck,
        machine: Machine,
        under_test: MachineUnderTest,
        pose: int,
        condition: Condition,
        *,
        weight: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None:
        """`weight` (3,): of a kilogram, N, base axes; 0 where masses are not to act."""
        self.deck, self.machine, self.condition = deck, machine, condition
        self.weight = np.asarray(weight, float)
        self.reference = under_test.reference
        joints, placements = under_test.placed
        self.joints, self.point = joints[pose], placements[pose, :3]
        self.rotation = rotation_of_quaternion(placements[pose, 3:])
        self.carriages: dict[str, int] = {}

        ends = [self.strut(number) for number in range(len(machine.struts))]
        platform = machine.platform
        spindle = deck.node(
            self.reference.platform_point(platform.centre_of_mass, self.point, self.rotation)
        )
        deck.load(spindle, platform.mass * (self.weight - np.array(condition.acceleration)))
        self.body = deck.body([*ends, spindle], self.point)
        deck.load(self.body.point, condition.force)
        deck.load(self.body.turn, condition.moment)
        self.turn = self.body.turn
        self.tool = self.grown(self.body.point, self.point, self.rotation @ self.tool_growth())
        self.passive()

    # What grows.

    def strain(self, part: Body | Drive) -> float:
        """Relative growth of a part that is equally warm all over."""
        return (part.expansion or 0.0) * self.condition.temperature_rise(part.part)

    def measured(self, drive: Drive) -> float:
        """m by which a screw or scale, growing from where it is fixed, takes what it moves."""
        number = self.reference.index[drive.name]
        row = self.reference.drives[number]
        fixed = drive.fixed_at
        if fixed is None:  # where a strut that is a drive would have no length
            fixed = -row.get("offset", 0.0) / row.get("scale", 1.0)
        travelled = self.joints[number] - fixed
        return float(self.strain(drive) * self.reference.drives[number].get("scale", 1) * travelled)

    def growth(self, body: Body, at: ArrayLike) -> Vector:
        """(3,) how far a body's growth moves its point `at`, in the axes of both."""
        return np.asarray(self.strain(body) * (np.asarray(at, float) - body.anchor))

    def tool_growth(self) -> Vector:
        """(3,) platform axes: the tool grows from where the platform holds it, and with that."""
        platform, tool = self.machine.platform, self.machine.tool
        if tool.expansion is None:
            return self.growth(platform, self.reference.tool)
        return self.growth(platform, tool.anchor) + self.growth(tool, self.reference.tool)

    def grown(self, node: int, at: Vector, shift: Vector) -> int:
        """A node that growth shifts from `node`, base axes; the node itself if none does."""
        if not shift.any():
            return node
        return self.deck.shifted(at, [(self.deck.one(), shift)], node)

    # Limbs, from the frame to the platform.

    def strut(self, number: int) -> int:
        """A strut and all that gives way between it and the frame; its node on the platform."""
        deck, strut = self.deck, self.machine.struts[number]
        row = self.reference.struts[number]
        start = self.reference.base_joint(row, self.joints)
        end = self.reference.platform_joint(row, self.point, self.rotation)
        length = float(np.linalg.norm(end - start))
        along = (end - start) / length
        # In line, one after the other: what the base end carries, the strut, the platform joint.
        below = [strut.base_joint.stiffness]
        drive = self.drive_of(strut)
        joint = foot = self.foot(strut, start)
        if drive is not None and is_strut(drive.kind):
            below.append(drive.held_stiffness)
            joint = self.grown(joint, start, self.measured(drive) * along)
        stiffness = strut.axial_stiffness(length)
        assert stiffness is not None, "a strut is an elastic member here"
        for spring in filter(None, below):
            joint = deck.shifted(start, [(deck.spring(spring), along)], joint)
        platform = deck.node(end)
        shift = self.growth(self.machine.platform, row["platform"])
        if row.get("ring_radius"):
            centre = self.reference.platform_point(row["platform"], self.point, self.rotation)
            shift += self.strain(self.machine.platform) * self.rotation.T @ (end - centre)
        grown = self.grown(platform, end, self.rotation @ shift)
        if strut.platform_joint.stiffness is not None:
            spring = deck.spring(strut.platform_joint.stiffness)
            grown = deck.shifted(end, [(spring, along)], grown)
        # An element's weight is half at each end; what a centre elsewhere adds is a load there. The
        # springs of joints and drive stand between these ends and what carries the strut.
        even = min(strut.centre_of_mass, 1.0 - strut.centre_of_mass)
        deck.truss(
            joint,
            grown,
            stiffness,
            mass=2.0 * even * strut.mass if self.weight.any() else 0.0,
            expansion=strut.expansion or 0.0,
        )
        deck.load(grown, (strut.centre_of_mass - even) * strut.mass * self.weight)
        deck.load(joint, (1.0 - strut.centre_of_mass - even) * strut.mass * self.weight)
        if drive is not None:
            # A carriage weighs on the joints that it carries, in equal parts.
            carried = sum(other.drive == drive.name for other in self.machine.struts)
            deck.load(foot, drive.mass / carried * self.weight)
        temperature = self.condition.temperature(strut.part)
        deck.heat(joint, temperature)
        deck.heat(grown, temperature + length * self.condition.gradient(strut.part)[0])
        return platform

    def drive_of(self, strut: Strut) -> Drive | None:
        """The drive that carries the strut, or is it."""
        return next((d for d in self.machine.drives if d.name == strut.drive), None)

    def foot(self, strut: Strut, at: Vector) -> int:
        """The node of a strut's base joint, on the frame, a carriage or an arm."""
        deck, drive, axes = self.deck, self.drive_of(strut), np.eye(3)
        by: list[tuple[int, Vector]] = []
        on_frame, grown = at, np.zeros(3)
        if drive is not None and not is_strut(drive.kind):
            number = self.reference.index[drive.name]
            row = self.reference.drives[number]
            carried = self.reference.struts[self.machine.struts.index(strut)]
            base, origin = np.array(carried["base"], float), row.get("origin", [0.0, 0.0, 0.0])
            on_frame = np.array(origin, float)
            actual = actual_coordinate(row, self.joints[number])
            way = formulas(drive.kind).slopes(row, base, actual)["offset"]
            axes = self.reference.base_axes(carried, self.joints)
            if has_carriage(drive.kind):
                # The frame has the bearing of the screw, the screw the carriage, that the joint.
                on_frame = on_frame + actual_coordinate(row, drive.fixed_at) * way
                grown = self.measured(drive) * way + self.growth(drive.carriage, base)
            else:
                grown = self.strain(drive) * (at - on_frame)
            if drive.held_stiffness is not None:
                by.append((self.carriage(drive.name, drive.held_stiffness), way))
        for stiffness, axis in zip(strut.base_stiffness or (), axes.T, strict=False):
            if np.isfinite(stiffness):
                by.append((deck.spring(stiffness), axis))
        grown = grown + self.growth(self.machine.frame, on_frame)
        if grown.any():
            by.append((deck.one(), grown))
        return deck.shifted(at, by, None)

    def carriage(self, name: str, stiffness: float) -> int:
        """The spring behind a carriage or an arm: all its struts share it."""
        if name not in self.carriages:
            self.carriages[name] = self.deck.spring(stiffness)
        return self.carriages[name]

    # What keeps the platform from moving, besides.

    def passive(self) -> None:
        """The tool point has no freedoms but the machine's; passive guides take theirs."""
        deck, shift = self.deck, self.rotation @ self.tool_growth()
        nodes = [(node, way) for node in (self.body.point, self.turn) for way in EVERY_WAY]
        rows = np.array([row for guide in self.reference.guides for row in self.guided(guide)])
        rows = rows.reshape(-1, 7)
        for k, (node, way) in enumerate(nodes):
            if COMPONENTS[k] in self.machine.components:
                continue
            # The tool point stays where the body, which holds it, gives way to its growth.
            stays = -shift[k] if k < 3 else 0.0
            if stays:
                deck.equation([(node, way, 1.0), (deck.one(), 1, -stays)])
            else:
                deck.hold(node, [way])
            rows[:, 6] += rows[:, k] * stays
            rows[:, k] = 0.0
        for pivot, row in reduced(rows):
            terms = [(*node, factor) for node, factor in zip(nodes, row[:6], strict=True)]
            dependent = terms.pop(pivot)
            known = [(deck.one(), 1, row[6])] if row[6] else []
            deck.equation([dependent, *terms, *known])

    def guided(self, guide: Mapping[str, Any]) -> list[Vector]:
        """Rows (7,): velocity, turning, 1 . row = 0. The last is what grows."""
        if guide["kind"] == "universal":
            base, own = unit(guide["base_axis"]), self.rotation @ unit(guide["platform_axis"])
            return [np.r_[np.zeros(3), np.cross(own, base), 0.0]]
        fixed = np.array(guide.get("origin", [0.0, 0.0, 0.0]), float)
        own = np.array(guide.get("platform", [0.0, 0.0, 0.0]), float)
        grown = self.rotation @ self.growth(self.machine.platform, own)
        grown -= self.growth(self.machine.frame, fixed)
        if guide["kind"] == "plane":
            # The platform's point moves in the plane.
            ways = np.array([unit(guide["normal"])])
            at = self.reference.platform_point(own, self.point, self.rotation)
        else:
            # What the platform has at the frame's point moves along the line.
            ways, at = tangents(self.rotation @ unit(guide["axis"])), fixed
        return [np.r_[way, np.cross(at - self.point, way), way @ grown] for way in ways]


def reduced(rows: Vector) -> list[tuple[int, Vector]]:
    """Rows that say the same, each with a column (its number) that stands in no other row.

    The last column is no unknown. Rows that say nothing of their own are left out.
    """
    left, pivots = rows.copy(), list[int]()
    for done in range(len(rows)):
        i, k = divmod(int(np.abs(left[done:, :-1]).argmax()), left.shape[1] - 1)
        if abs(left[done + i, k]) < 1e-9 * np.abs(rows).max():
            break
        left[[done, done + i]] = left[[done + i, done]]
        left[done] /= left[done, k]
        others = np.arange(len(left)) != done
        left[others] -= np.outer(left[others, k], left[done])
        pivots.append(k)
    return list(zip(pivots, left, strict=False))
