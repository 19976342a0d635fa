"""A machine's kinematics in plain NumPy and SciPy: the second road of the tests.

Nothing here is shared with the kernel. It takes the same description (tests/build_machine.py),
writes the closures of struts and guides by their formulas (a drive's are in tests/drives), finds
the inverse in closed form, or by MINPACK where the platform has parasitic freedoms, and the forward
solution by MINPACK with a numerical Jacobian; where there are more closures than freedoms, the pose
of least elastic energy by Gauss and Newton. Slow and plain. All in SI and the base
frame, R = Rz(c) Ry(b) Rx(a).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import fsolve  # type: ignore[import-untyped]

from drive_kinds import formulas

Vector = NDArray[np.float64]

POSITION = ("x", "y", "z")
ANGLES = ("a", "b", "c")
# Far below every tolerance asked of the kernel, well above what rounding leaves of a metre.
CLOSED = 1e-11
# Of a central difference of closures, m or rad: cut-off and rounding both leave about 1e-11.
STEP = 1e-5


def rotation_of(angles: ArrayLike) -> Vector:
    """(3, 3) rotation Rz(c) Ry(b) Rx(a) of angles (a, b, c), rad."""
    (a, b, c) = np.asarray(angles, float)
    ca, sa, cb, sb, cc, sc = np.cos(a), np.sin(a), np.cos(b), np.sin(b), np.cos(c), np.sin(c)
    about_x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    about_y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    about_z = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def rotation_in_order(order: str, angles: ArrayLike) -> Vector:
    """(3, 3) product of turns about the axes named, left to right: "xyz" is Rx(a) Ry(b) Rz(c).

    `angles` is always (a, b, c), rad: about x, about y, about z.
    """
    unit = np.eye(3)
    given = dict(zip("xyz", np.asarray(angles, float), strict=True))
    result = np.eye(3)
    for name in order:
        result = result @ turned_about(unit["xyz".index(name)], given[name])
    return result


def angles_of(rotation: Vector) -> Vector:
    """(3,) angles (a, b, c), rad, with rotation = Rz(c) Ry(b) Rx(a) and b within a quarter turn."""
    return np.array(
        [
            math.atan2(rotation[2, 1], rotation[2, 2]),
            math.atan2(-rotation[2, 0], math.hypot(rotation[0, 0], rotation[1, 0])),
            math.atan2(rotation[1, 0], rotation[0, 0]),
        ]
    )


def rotation_of_quaternion(quaternion: ArrayLike) -> NDArray[np.float64]:
    """(3, 3) rotation of the unit quaternion w x y z."""
    (w, x, y, z) = np.asarray(quaternion, float)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def turned_about(axis: ArrayLike, angle: float) -> Vector:
    """(3, 3) rotation by `angle`, rad, about the unit vector `axis` (Rodrigues)."""
    (x, y, z) = np.asarray(axis, float)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross)


def rotation_by_vector(vector: ArrayLike) -> Vector:
    """(3, 3) rotation of the rotation vector (3,), rad."""
    turn = np.asarray(vector, float)
    angle = float(np.linalg.norm(turn))
    return turned_about(turn / angle, angle) if angle > 0 else np.eye(3)


def vector_of(rotation: Vector) -> Vector:
    """(3,) rotation vector, rad, of a rotation matrix that turns by less than half a turn."""
    twice_sine = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = float(np.linalg.norm(twice_sine)) / 2
    angle = math.atan2(sine, (float(np.trace(rotation)) - 1) / 2)
    return twice_sine / 2 * (angle / sine if sine > 0 else 1.0)


def unit(direction: ArrayLike) -> Vector:
    """(3,) of length 1."""
    vector = np.asarray(direction, float)
    return np.asarray(vector / np.linalg.norm(vector))


def tangents(direction: ArrayLike) -> Vector:
    """(2, 3) unit vectors across a direction, by the rule that the kernel documents.

    The first is the base axis that the direction is least along, made perpendicular to it; the
    second completes the right-handed frame.
    """
    axis = unit(direction)
    first = np.eye(3)[np.abs(axis).argmin()]
    first = unit(first - (first @ axis) * axis)
    return np.array([first, np.cross(axis, first)])


def actual_coordinate(drive: Mapping[str, Any], joint: float) -> float:
    """`scale q + offset` of a drive, m or rad."""
    return float(drive.get("scale", 1.0) * joint + drive.get("offset", 0.0))


class Reference:
    """The machine of a description, with the closures of its struts and guides written out."""

    def __init__(self, description: Mapping[str, Any]) -> None:
        self.dof: list[str] = list(description["dof"])
        self.commanded: list[str] = list(description["commanded"])
        self.parasitic = [name for name in self.dof if name not in self.commanded]
        self.home = dict.fromkeys((*POSITION, *ANGLES), 0.0) | dict(description["home"])
        self.tool = np.array(description["tool"], float)
        self.drives: list[dict[str, Any]] = list(description["drives"])
        self.struts: list[dict[str, Any]] = list(description["struts"])
        self.guides: list[dict[str, Any]] = list(description.get("guides", []))
        self.index = {drive["name"]: i for i, drive in enumerate(self.drives)}
        self.characteristic_length = float(
            description["characteristic_length"] or self._geometric_length()
        )
        compliance = description.get("closure_compliance")
        self.stiffness = None if compliance is None else 1.0 / np.array(compliance, float)

    def placement(self, names: Sequence[str], values: ArrayLike) -> tuple[Vector, Vector]:
        """Tool point (3,) and rotation (3, 3); freedoms not named in `names` are at home."""
        pose = self.home | dict(zip(names, np.asarray(values, float), strict=True))
        return np.array([pose[n] for n in POSITION]), rotation_of([pose[n] for n in ANGLES])

    def _geometric_length(self) -> float:
        """Root mean square of the platform joints' distances from the tool point, m.

        Where they all lie in the tool point: the mean length of the struts, at home.
        """
        arms = np.array([strut["platform"] for strut in self.struts], float) - self.tool
        spread = math.sqrt((arms**2).sum(1).mean())
        point, rotation = self.placement([], [])
        lengths = [
            np.linalg.norm(self.platform_point(s["platform"], point, rotation) - s["base"])
            if s["length"] is None
            else s["length"]
            for s in self.struts
        ]
        return float(spread if spread > 0 else np.mean(lengths))

    def base_joint(self, strut: Mapping[str, Any], joints: Vector) -> Vector:
        """Base-side joint centre (3,) of a strut, m."""
        base = np.array(strut["base"], float)
        if strut["drive"] is None:
            return base
        i = self.index[strut["drive"]]
        drive = self.drives[i]
        return formulas(drive["kind"]).centre(drive, base, actual_coordinate(drive, joints[i]))

    def base_axes(self, strut: Mapping[str, Any], joints: Vector) -> Vector:
        """(3, 3) axes, as columns, of what carries a strut's base joint: frame, carriage or arm."""
        foot = self.base_joint({**strut, "base": np.zeros(3)}, joints)
        heads = [self.base_joint({**strut, "base": axis}, joints) for axis in np.eye(3)]
        return np.array([head - foot for head in heads]).T

    def platform_joint(self, strut: Mapping[str, Any], point: Vector, rotation: Vector) -> Vector:
        """Platform-side joint centre (3,) of a strut, base frame, m.

        On a ring it stands where the ring comes nearest to the base joint.
        """
        centre = self.platform_point(strut["platform"], point, rotation)
        if not strut.get("ring_radius"):
            return centre
        axis = rotation @ unit(strut["ring_axis"])
        away = np.array(strut["base"], float) - centre
        return np.asarray(centre + strut["ring_radius"] * unit(away - (away @ axis) * axis))

    def platform_point(self, own: ArrayLike, point: Vector, rotation: Vector) -> Vector:
        """A point of the platform's axes in the base frame, m."""
        return np.asarray(point + rotation @ (np.asarray(own, float) - self.tool))

    def length(self, strut: Mapping[str, Any], joints: Vector) -> float:
        """The length that a strut closes at, m."""
        if strut["length"] is not None:
            return float(strut["length"])
        i = self.index[strut["drive"]]
        return actual_coordinate(self.drives[i], joints[i])

    def closures(self, joints: Vector, point: Vector, rotation: Vector) -> Vector:
        """(n_closure,) residuals, m: of struts distance less length, then those of guides."""
        struts = [
            np.linalg.norm(
                self.platform_joint(strut, point, rotation) - self.base_joint(strut, joints)
            )
            - self.length(strut, joints)
            for strut in self.struts
        ]
        guides = [self.guided(g, point, rotation) for g in self.guides]
        given_way = [np.array(g.get("offset", [0.0, 0.0]), float) for g in self.guides]
        off = [found - by[: found.size] for found, by in zip(guides, given_way, strict=True)]
        return np.concatenate([struts, *off])

    def guided(self, guide: Mapping[str, Any], point: Vector, rotation: Vector) -> Vector:
        """Residuals (1,) or (2,) of a guide, m."""
        if guide["kind"] == "universal":
            across = unit(guide["base_axis"]) @ rotation @ unit(guide["platform_axis"])
            return np.array([self.characteristic_length * across])
        origin = np.array(guide.get("origin", [0.0, 0.0, 0.0]), float)
        own = self.platform_point(guide.get("platform", [0.0, 0.0, 0.0]), point, rotation)
        if guide["kind"] == "plane":
            return np.array([unit(guide["normal"]) @ (own - origin)])
        return np.asarray(self._across(guide) @ rotation.T @ (origin - own))

    def rows(self, joints: Vector, point: Vector, rotation: Vector) -> Vector:
        """(n_closure, 6) derivatives of the closures to the platform's twist at the tool point.

        They are also the wrenches by which a unit of each closure's tension holds the platform.
        """
        rows = []
        for strut in self.struts:
            platform = self.platform_joint(strut, point, rotation)
            along = unit(platform - self.base_joint(strut, joints))
            rows.append([*along, *np.cross(platform - point, along)])
        for guide in self.guides:
            rows += self._rows_of_guide(guide, point, rotation)
        return np.array(rows)

    @staticmethod
    def _across(guide: Mapping[str, Any]) -> Vector:
        """(2, 3) across a line, platform axes: the tangents of the nominal one, less what is along.

        They are of unit length only where the line is not tilted; a residual counts by them.
        """
        axis, ways = unit(guide["axis"]), tangents(guide.get("nominal_axis", guide["axis"]))
        return np.asarray(ways - np.outer(ways @ axis, axis))

    def _rows_of_guide(
        self, guide: Mapping[str, Any], point: Vector, rotation: Vector
    ) -> list[list[float]]:
        if guide["kind"] == "universal":
            cross = np.cross(rotation @ unit(guide["platform_axis"]), unit(guide["base_axis"]))
            return [[0.0, 0.0, 0.0, *(self.characteristic_length * cross)]]
        if guide["kind"] == "plane":
            normal = unit(guide["normal"])
            arm = self.platform_point(guide["platform"], point, rotation) - point
            return [[*normal, *np.cross(arm, normal)]]
        # The platform's line slides on the frame's point: that is where the force acts.
        arm = np.array(guide.get("origin", [0.0, 0.0, 0.0]), float) - point
        across = self._across(guide) @ rotation.T
        return [[*-one, *-np.cross(arm, one)] for one in across]

    def roots(self, drive: Mapping[str, Any], point: Vector, rotation: Vector) -> list[float]:
        """Joint coordinates [in working mode "-", in "+"] that close a drive's first strut.

        One value only for a drive that is the strut's length, none where the strut cannot reach.
        """
        strut = next(s for s in self.struts if s["drive"] == drive["name"])
        platform, base = self.platform_joint(strut, point, rotation), np.array(strut["base"], float)
        roots = formulas(drive["kind"]).roots(drive, base, platform, strut["length"])
        return [(value - drive.get("offset", 0.0)) / drive.get("scale", 1.0) for value in roots]

    def inverse(self, pose: ArrayLike) -> tuple[Vector, Vector, Vector]:
        """Joints (n_drive,), tool point (3,) and rotation (3, 3) of a commanded pose.

        Raises ValueError where a strut cannot reach. Parasitic freedoms start at home.
        """
        point, rotation = self.placement(self.commanded, pose)
        joints = []
        for drive in self.drives:
            roots = self.roots(drive, point, rotation)
            if not roots:
                raise ValueError(f"drive {drive['name']} does not reach {pose}")
            joints.append(roots[0] if drive["working_mode"] == "-" else roots[-1])
        if not self.parasitic:
            return np.array(joints), point, rotation

        def closures(unknown: Vector) -> Vector:
            found = self._with_parasitic(pose, unknown[len(self.drives) :])
            return self.closures(unknown[: len(self.drives)], *found)

        start = np.concatenate([joints, [self.home[name] for name in self.parasitic]])
        solved = self._solved(closures, start)
        return solved[: len(joints)], *self._with_parasitic(pose, solved[len(joints) :])

    def forward(self, joints: ArrayLike, point: Vector, rotation: Vector) -> tuple[Vector, Vector]:
        """Tool point (3,) and rotation (3, 3) that close at `joints`, near the placement given."""
        coordinates = np.asarray(joints, float)
        moves = [i for i, name in enumerate((*POSITION, *ANGLES)) if name in self.dof]

        def placed(small: Vector) -> tuple[Vector, Vector]:
            whole = np.zeros(6)
            whole[moves] = small
            return point + whole[:3], rotation_by_vector(whole[3:]) @ rotation

        def closures(small: Vector) -> Vector:
            return self.closures(coordinates, *placed(small))

        if self.overconstrained:
            return placed(self._relaxed(closures, np.zeros(len(moves))))
        return placed(self._solved(closures, np.zeros(len(moves))))

    @property
    def overconstrained(self) -> bool:
        """Whether there are more closures than freedoms."""
        per_guide = {"line": 2}
        count = len(self.struts) + sum(per_guide.get(g["kind"], 1) for g in self.guides)
        return count > len(self.dof)

    def _with_parasitic(self, pose: ArrayLike, parasitic: Vector) -> tuple[Vector, Vector]:
        names = [*self.commanded, *self.parasitic]
        return self.placement(names, np.concatenate([np.asarray(pose, float), parasitic]))

    def _relaxed(self, closures: Any, start: Vector) -> Vector:
        """The unknowns at which the closures' elastic energy, stiffness times square, is least."""
        assert self.stiffness is not None
        weight = np.sqrt(self.stiffness / self.stiffness.max())
        at = start
        for _ in range(100):
            sides = [
                [closures(at + sign * STEP * one) for sign in (1, -1)] for one in np.eye(len(at))
            ]
            jacobian = np.array([(after - before) / (2 * STEP) for after, before in sides]).T
            step, *_ = np.linalg.lstsq(
                weight[:, None] * jacobian, -weight * closures(at), rcond=None
            )
            at = at + step
            if np.abs(step).max() < 1e-14:
                return np.asarray(at)
        if np.abs(step).max() > CLOSED:
            raise ValueError("the reference found no pose of least energy")
        return np.asarray(at)

    def _solved(self, closures: Any, start: Vector) -> Vector:
        """The root near `start`; with more closures than unknowns they must agree."""
        if self.overconstrained:
            solved = self._relaxed(closures, start)
            if np.abs(closures(solved)).max() > CLOSED:
                raise ValueError("the reference found no root")
            return solved
        solved, found, _, message = fsolve(closures, start, xtol=1e-14, full_output=True)
        # MINPACK calls "no further progress" a failure even where it stands on the root.
        if np.abs(found["fvec"]).max() > CLOSED:
            raise ValueError(f"the reference found no root: {message}")
        return np.asarray(solved)
