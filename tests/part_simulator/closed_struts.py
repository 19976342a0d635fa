"""Where machines that are closed by struts alone go, many machines and poses at once.

The closures are written out for arrays (s, n) of machines and poses: a strut's two joint centres
are as far apart as it is long. Newton's method takes the rows of `reference_kinematics` and goes on
until rounding. A deviation is a dict of a parameter's name, as the kernel has them, and its
change, m, rad or a ratio, of a shape that broadcasts to (s, n).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference_kinematics import ANGLES, POSITION, Reference, rotation_of, tangents, unit

Floats = NDArray[np.float64]
Deviation = Mapping[str, Floats | float]

NOMINAL: Deviation = MappingProxyType({})

CLOSE = 1e-8
"""m and rad: a step after which one more is all that rounding leaves to be done."""
MOST = 30
AT_ONCE = 10_000
"""Machines times poses that are closed together: as many as a processor's cache holds."""


class NotClosedError(ValueError):
    """Newton's method did not close every machine at every pose."""


def closed_by_struts_alone(description: Mapping[str, Any]) -> bool:
    """Whether the closures are those of struts, as many as freedoms."""
    struts = description["struts"]
    plain = not description.get("guides") and not description.get("limbs")
    plain = plain and not any(strut.get("ring_radius") for strut in struts)
    return plain and len(struts) == len(description["dof"])


class ClosedStruts:
    """The machine of a description (tests/build_machine.py), closed by struts alone."""

    def __init__(self, description: Mapping[str, Any]) -> None:
        if not closed_by_struts_alone(description):
            raise ValueError("more than struts closes this machine")
        self.reference = Reference(description)
        self.drives, self.struts = self.reference.drives, self.reference.struts
        self.names = [drive["name"] for drive in self.drives]
        dof = self.reference.dof
        self._moves = [at for at, name in enumerate((*POSITION, *ANGLES)) if name in dof]

    def joint(self, drive: str) -> int:
        """Number of a drive's coordinate."""
        return self.names.index(drive)

    def inverse(
        self, poses: Floats, deviation: Deviation = NOMINAL
    ) -> tuple[Floats, Floats, Floats]:
        """Joints (n, n_drive), tool points (n, 3), rotations (n, 3, 3) at poses (n, n_commanded).

        A deviation is of one machine: what the control believes.
        """
        reference, n = self.reference, len(poses)
        every = np.tile([reference.home[name] for name in (*POSITION, *ANGLES)], (n, 1))
        for column, name in enumerate(reference.commanded):
            every[:, (*POSITION, *ANGLES).index(name)] = poses[:, column]
        free = [(*POSITION, *ANGLES).index(name) for name in reference.parasitic]
        joints = np.array([self._first_joints(row) for row in every])
        count, last = len(self.drives), np.inf
        for _ in range(MOST):
            points, rotations = every[:, :3], _rotations(every[:, 3:])
            gaps, rows, of_joints = self._closures(joints, points, rotations, deviation)
            slopes = [of_joints, *(self._slope(rows, every, k)[..., np.newaxis] for k in free)]
            step = np.linalg.solve(np.concatenate(slopes, axis=-1), -gaps[..., np.newaxis])[..., 0]
            joints = joints + step[:, :count]
            every[:, free] += step[:, count:]
            if last < CLOSE:
                return joints, every[:, :3].copy(), _rotations(every[:, 3:])
            last = np.abs(step).max()
        raise NotClosedError(f"the last step was {last:.3g}")

    def forward(
        self, joints: Floats, points: Floats, rotations: Floats, deviation: Deviation
    ) -> tuple[Floats, Floats]:
        """Tool points (s, n, 3) and rotations (s, n, 3, 3) of s machines at joints (n, n_drive).

        They are near points (n, 3) and rotations (n, 3, 3), where the nominal machine is.
        """
        shape = np.broadcast_shapes((1, len(joints)), *(np.shape(v) for v in deviation.values()))
        each = max(1, AT_ONCE // shape[1])
        if shape[0] > each:
            every = {name: np.asarray(value) for name, value in deviation.items()}
            blocks = [
                self.forward(joints, points, rotations, _some(every, first, first + each))
                for first in range(0, shape[0], each)
            ]
            found, turned = zip(*blocks, strict=True)
            return np.concatenate(found), np.concatenate(turned)
        point = np.broadcast_to(points, (*shape, 3)).copy()
        rotation = np.broadcast_to(rotations, (*shape, 3, 3)).copy()
        last = np.inf
        for _ in range(MOST):
            gaps, rows, _ = self._closures(joints, point, rotation, deviation)
            step = np.zeros((*shape, 6))
            step[..., self._moves] = np.linalg.solve(
                rows[..., self._moves], -gaps[..., np.newaxis]
            )[..., 0]
            point += step[..., :3]
            if max(self._moves) > 2:
                rotation = _turned(step[..., 3:]) @ rotation
            if last < CLOSE:
                return point, rotation
            last = np.abs(step).max()
        raise NotClosedError(f"the last step was {last:.3g}")

    def tensions(self, joints: Floats, points: Floats, rotations: Floats, force: Floats) -> Floats:
        """(n, n_strut) N, positive where pulled, under a force (3,) or (n, 3) on the tool.

        The balance of the platform: the struts' tensions and the force hold it.
        """
        _, rows, _ = self._closures(joints, points, rotations, {})
        wrench = np.zeros((len(joints), 6))
        wrench[:, :3] = force
        held = np.swapaxes(rows[..., self._moves], -1, -2)
        # A strut that is pulled pulls the platform back along its row.
        return np.linalg.solve(held, wrench[:, self._moves, np.newaxis])[..., 0]

    def _first_joints(self, pose: Floats) -> list[float]:
        point, rotation = pose[:3], rotation_of(pose[3:])
        joints = []
        for drive in self.drives:
            roots = self.reference.roots(drive, point, rotation)
            if not roots:
                raise ValueError(f"drive {drive['name']} does not reach {pose}")
            joints.append(roots[0] if drive["working_mode"] == "-" else roots[-1])
        return joints

    def _closures(
        self, joints: Floats, points: Floats, rotations: Floats, deviation: Deviation
    ) -> tuple[Floats, Floats, Floats]:
        """Gaps (..., k); slopes to a twist (..., k, 6) and to joints (..., k, n_drive)."""
        shape = np.broadcast_shapes(points.shape[:-1], joints.shape[:-1])

        def moved(prefix: str, value: Sequence[float] | Floats) -> Floats:
            """(1 or s, 1 or n, 3): no larger than it has to be."""
            parts = [
                np.atleast_2d(value[k] + deviation.get(f"{prefix}.{axis}", 0.0))
                for k, axis in enumerate("xyz")
            ]
            found = np.stack(np.broadcast_arrays(*parts), axis=-1)
            return found if len(shape) > 1 else found[0]

        tool = moved("tool", self.reference.tool)
        gaps = np.empty((*shape, len(self.struts)))
        rows = np.empty((*shape, len(self.struts), 6))
        of_joints = np.zeros((*shape, len(self.struts), len(self.drives)))
        for k, strut in enumerate(self.struts):
            name = f"strut.{strut['name']}"
            own = moved(f"{name}.platform", strut["platform"]) - tool
            platform = points + _times(rotations, own)
            base = moved(f"{name}.base", strut["base"])
            length: Floats | float = (strut["length"] or 0.0) + deviation.get(f"{name}.length", 0.0)
            way = np.zeros((*shape, 3))
            longer: Floats | float = 0.0
            if strut["drive"] is not None:
                at = self.joint(strut["drive"])
                drive = self.drives[at]
                own_name = f"drive.{drive['name']}"
                scale = drive.get("scale", 1.0) + deviation.get(f"{own_name}.scale", 0.0)
                offset = drive.get("offset", 0.0) + deviation.get(f"{own_name}.offset", 0.0)
                actual = np.broadcast_to(scale * joints[..., at] + offset, shape)
                if drive["kind"] == "telescopic":
                    length, longer = actual, scale
                else:
                    origin = moved(f"{own_name}.origin", drive.get("origin", [0.0, 0.0, 0.0]))
                    axis = self._axis(drive, deviation, shape)
                    carried = _CARRIED[drive["kind"]]
                    base, along = carried(axis, base, actual)
                    base, way = origin + base, along * np.asarray(scale)[..., np.newaxis]
            span = platform - base
            distance = np.sqrt((span**2).sum(axis=-1))
            along = span / distance[..., np.newaxis]
            gaps[..., k] = distance - length
            rows[..., k, :3] = along
            rows[..., k, 3:] = _cross(platform - points, along)
            if strut["drive"] is not None:
                of_joints[..., k, at] = -(along * way).sum(axis=-1) - longer
        return gaps, rows, of_joints

    @staticmethod
    def _axis(drive: Mapping[str, Any], deviation: Deviation, shape: tuple[int, ...]) -> Floats:
        """(..., 3) unit, turned along its tangents."""
        axis = np.broadcast_to(unit(drive["axis"]), (*shape, 3))
        for name, tangent in zip("uv", tangents(drive["axis"]), strict=True):
            turn = np.asarray(deviation.get(f"drive.{drive['name']}.axis.{name}", 0.0))
            axis = axis + turn[..., np.newaxis] * tangent
        return np.asarray(axis / np.sqrt((axis**2).sum(axis=-1, keepdims=True)))

    @staticmethod
    def _slope(rows: Floats, every: Floats, component: int) -> Floats:
        """(n, k) of the gaps, to a component x y z a b c of R = Rz(c) Ry(b) Rx(a)."""
        if component < 3:
            return np.asarray(rows[..., component])
        angles = np.zeros((len(every), 3))
        # About x after the turns about y and z, about y after that about z, and about z.
        angles[:, component - 2 :] = every[:, component + 1 :]
        axis = _rotations(angles)[:, :, component - 3]
        return np.einsum("nki,ni->nk", rows[..., 3:], axis)


def _on_carriage(axis: Floats, base: Floats, actual: Floats) -> tuple[Floats, Floats]:
    """A joint centre from the drive's origin, and its way for a unit of the coordinate."""
    return base + actual[..., np.newaxis] * axis, axis


def _on_arm(axis: Floats, base: Floats, actual: Floats) -> tuple[Floats, Floats]:
    """The same about the axis: what is along it stays, what is across it turns."""
    along = (axis * base).sum(axis=-1, keepdims=True) * axis
    across, side = base - along, np.cross(axis, base)
    cosine, sine = np.cos(actual)[..., np.newaxis], np.sin(actual)[..., np.newaxis]
    return along + cosine * across + sine * side, cosine * side - sine * across


_CARRIED = {"slider": _on_carriage, "crank": _on_arm}


def _rotations(angles: Floats) -> Floats:
    """(n, 3, 3) of angles (n, 3)."""
    return np.array([rotation_of(one) for one in angles])


def _some(deviation: Mapping[str, Floats], first: int, last: int) -> Deviation:
    """Of some of the machines."""
    return {
        name: value[first:last] if value.ndim > 1 and len(value) > 1 else value
        for name, value in deviation.items()
    }


def _times(matrices: Floats, vectors: Floats) -> Floats:
    """(..., 3) of matrices (..., 3, 3): written out, which for so small ones is quicker."""
    x, y, z = (vectors[..., k, np.newaxis] for k in range(3))
    return np.asarray(matrices[..., 0] * x + matrices[..., 1] * y + matrices[..., 2] * z)


def _cross(one: Floats, other: Floats) -> Floats:
    """(..., 3), written out."""
    (a, b, c), (x, y, z) = (np.moveaxis(v, -1, 0) for v in (one, other))
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


def _turned(vector: Floats) -> Floats:
    """(..., 3, 3) rotations of rotation vectors (..., 3)."""
    x, y, z = np.moveaxis(vector, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
    cross = cross.reshape(*x.shape, 3, 3)
    angle = np.sqrt((vector**2).sum(axis=-1))[..., np.newaxis, np.newaxis]
    # sin(a)/a and (1 - cos a)/a^2, by the half angle: neither loses digits near 0.
    half = np.sinc(angle / (2.0 * np.pi))
    return np.eye(3) + np.sinc(angle / np.pi) * cross + 0.5 * half**2 * (cross @ cross)
