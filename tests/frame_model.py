"""Frames of beams, joints and rigid bodies by the direct stiffness method: an oracle, NumPy alone.

J. S. Przemieniecki, Theory of Matrix Structural Analysis, McGraw-Hill 1968, chapters 5 and 6: the
12 x 12 stiffness of a beam with shear deformation in its own axes, turned into the frame's, and the
sum over all beams. Joints are springs between two nodes in one place; what is rigid is a linear
equation between displacements, taken out by a basis of what the equations leave. SI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

RIGID = math.inf
REFINEMENTS = 4


@dataclass(frozen=True)
class Beam:
    """What a beam's stiffness takes: E, G, area, I about y and z, J, shear coefficients."""

    young: float
    shear: float
    area: float
    about_y: float
    about_z: float
    torsion: float
    shear_y: float
    shear_z: float

    def stiffness(self, length: float) -> Array:
        """12 x 12 in its own axes: displacements and turns at the first end, then at the second.

        Przemieniecki, section 5.6 (there with the shear parameter phi = 12 E I / (G A_s l^2)).
        """
        k = np.zeros((12, 12))
        for at, rigidity in ((0, self.young * self.area), (3, self.shear * self.torsion)):
            for i, j in ((at, at), (at + 6, at + 6)):
                k[i, j] = rigidity / length
            k[at, at + 6] = k[at + 6, at] = -rigidity / length
        # Bending in the x-y plane turns about z, in the x-z plane about minus y.
        for across, turn, inertia, coefficient, sign in (
            (1, 5, self.about_z, self.shear_y, 1.0),
            (2, 4, self.about_y, self.shear_z, -1.0),
        ):
            bending = self.young * inertia
            phi = 12.0 * bending / (self.shear * self.area * coefficient * length**2)
            factor = bending / (length**3 * (1.0 + phi))
            places = [across, turn, across + 6, turn + 6]
            lever = sign * 6.0 * length
            near, far = (4.0 + phi) * length**2, (2.0 - phi) * length**2
            block = factor * np.array(
                [
                    [12.0, lever, -12.0, lever],
                    [lever, near, -lever, far],
                    [-12.0, -lever, 12.0, -lever],
                    [lever, far, -lever, near],
                ]
            )
            k[np.ix_(places, places)] += block
        return k


class Frame:
    """A frame: six displacements of each node, x y z and turns about them, base axes."""

    def __init__(self) -> None:
        self.points: list[Array] = []
        self._stiffness: list[tuple[list[int], Array]] = []
        self._equations: list[dict[int, float]] = []
        self._loads: dict[int, float] = {}

    def node(self, point: ArrayLike) -> int:
        """A node at a point, m."""
        self.points.append(np.asarray(point, float))
        return len(self.points) - 1

    def beam(self, first: int, second: int, beam: Beam, y: ArrayLike) -> Array:
        """A beam between two nodes, its y axis nearest to `y`; returns its axes (3, 3), rows."""
        along = self.points[second] - self.points[first]
        length = float(np.linalg.norm(along))
        axes = triad(along, y)
        turned = np.kron(np.eye(4), axes)
        places = [*_places(first), *_places(second)]
        self._stiffness.append((places, turned.T @ beam.stiffness(length) @ turned))
        return axes

    def bar(self, first: int, second: int, stiffness: float) -> None:
        """A strut between two ball joints: an axial stiffness, N/m."""
        along = self.points[second] - self.points[first]
        unit = along / np.linalg.norm(along)
        row = np.concatenate([-unit, np.zeros(3), unit, np.zeros(3)])
        places = [*_places(first), *_places(second)]
        self._stiffness.append((places, stiffness * np.outer(row, row)))

    def joint(self, first: int, second: int, axes: ArrayLike, stiffness: Sequence[float]) -> None:
        """Springs between two nodes of one place: along and about three axes (rows), N/m, N m/rad.

        0 is free, infinite is rigid.
        """
        axes = np.asarray(axes, float)
        places = [*_places(first), *_places(second)]
        for at, value in enumerate(stiffness):
            row = np.zeros(6)
            row[3 * (at // 3) : 3 * (at // 3) + 3] = axes[at % 3]
            difference = np.concatenate([-row, row])
            if math.isinf(value):
                self._equations.append(dict(zip(places, difference.tolist(), strict=True)))
            elif value:
                self._stiffness.append((places, value * np.outer(difference, difference)))

    def rigid(self, first: int, second: int) -> None:
        """Two nodes on one rigid body: u2 = u1 + turn x arm, and the same turn."""
        arm = self.points[second] - self.points[first]
        cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        one, other = _places(first), _places(second)
        for axis in range(3):
            # (turn x arm)_axis = -(arm x turn)_axis
            row = {other[axis]: 1.0, one[axis]: -1.0}
            row |= {one[3 + k]: float(cross[axis, k]) for k in range(3)}
            self._equations.append(row)
            self._equations.append({other[3 + axis]: 1.0, one[3 + axis]: -1.0})

    def clamp(self, node: int) -> None:
        """A node that does not move."""
        self._equations += [{place: 1.0} for place in _places(node)]

    def load(self, node: int, wrench: ArrayLike) -> None:
        """Force and moment (6,) on a node, N and N m."""
        for place, value in zip(_places(node), np.asarray(wrench, float), strict=True):
            self._loads[place] = self._loads.get(place, 0.0) + float(value)

    def uniform(self, first: int, second: int, force: ArrayLike) -> None:
        """A uniform load (3,) N/m along a beam: its equivalent forces and end moments.

        Exact with shear too where the load is uniform: q l / 2 and q l^2 / 12 at each end.
        """
        along = self.points[second] - self.points[first]
        length = float(np.linalg.norm(along))
        total = np.asarray(force, float) * length
        moment = np.cross(along, total) / 12.0
        self.load(first, [*(total / 2), *moment])
        self.load(second, [*(total / 2), *(-moment)])

    def curved(
        self, first: int, second: int, beam: Beam, y: ArrayLike, curvature: ArrayLike
    ) -> None:
        """Heat bends a beam: free curvatures about y and z, 1/m, as the moments that hold them."""
        along = self.points[second] - self.points[first]
        axes = triad(along, y)
        about_y, about_z = np.asarray(curvature, float)
        moment = beam.young * (beam.about_y * about_y * axes[1] + beam.about_z * about_z * axes[2])
        self.load(first, [0, 0, 0, *(-moment)])
        self.load(second, [0, 0, 0, *moment])

    def solve(self) -> Array:
        """(n_node, 6) displacements. Raises `ValueError` for a mechanism."""
        size = 6 * len(self.points)
        stiffness, force = np.zeros((size, size)), np.zeros(size)
        for places, block in self._stiffness:
            stiffness[np.ix_(places, places)] += block
        for place, value in self._loads.items():
            force[place] = value
        rows = np.zeros((len(self._equations), size))
        for at, equation in enumerate(self._equations):
            for place, value in equation.items():
                rows[at, place] += value
        basis = scipy.linalg.null_space(rows, rcond=1e-11) if len(rows) else np.eye(size)
        reduced = basis.T @ stiffness @ basis
        scale = 1.0 / np.sqrt(np.diag(reduced))
        scaled = scale[:, np.newaxis] * reduced * scale
        if np.linalg.cond(scaled) > 1e14:
            raise ValueError("the frame is a mechanism")
        factors = scipy.linalg.lu_factor(scaled)
        target = (scale * (basis.T @ force)).astype(np.longdouble)
        exact = scaled.astype(np.longdouble)
        found = np.zeros(len(target), np.longdouble)
        for _ in range(REFINEMENTS):
            left = target - exact @ found
            found = found + scipy.linalg.lu_solve(factors, left.astype(float))
        moved = basis @ (scale * found.astype(float))
        return np.asarray(moved).reshape(-1, 6)


def triad(along: ArrayLike, y: ArrayLike) -> Array:
    """Unit vectors as rows: x along, y across it and nearest to what is given, z."""
    x = np.asarray(along, float)
    x = x / np.linalg.norm(x)
    across = np.asarray(y, float) - (np.asarray(y, float) @ x) * x
    across = across / np.linalg.norm(across)
    return np.stack([x, across, np.cross(x, across)])


def _places(node: int) -> list[int]:
    return list(range(6 * node, 6 * node + 6))
