"""Axes of a program, in mm and degrees, and the freedoms of a machine, in m and rad."""

from __future__ import annotations

import math

import numpy as np

from truepose.arrays import Floats
from truepose.machine import Machine

AXES = "XYZABCUVW"
"""Axes of a program, in the order of the columns of its points."""

LINEAR = "XYZUVW"
"""Those of them that are measured in mm."""

MILLIMETRE = 1e-3
DEGREE = math.pi / 180.0


class Axes:
    """Which columns of a program's points are which commanded freedoms of a machine.

    `columns` (n_commanded,) and `scale` (n_commanded,), SI to the mm or degree; `passed`: whether
    an axis is none of the machine's, and passes through as it is; `uncommanded`: axes in which the
    platform moves but that cannot be commanded, so that a program cannot ask for them.
    """

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.columns = np.array([AXES.index(name.upper()) for name in machine.commanded])
        self.scale = np.array([scale_of(name) for name in machine.commanded])
        self.names = "".join(AXES[column] for column in self.columns)
        parasitic = [name.upper() for name in machine.dof if name not in machine.commanded]
        self.uncommanded = np.array([AXES.index(name) for name in parasitic], np.intp)
        self._angles = np.array([name in "abc" for name in machine.commanded])

    def poses(self, points: Floats) -> Floats:
        """(n, n_commanded) poses, m and rad, of points (n, 9), mm and degrees."""
        return np.ascontiguousarray(points[:, self.columns] * self.scale)

    def with_poses(self, points: Floats, poses: Floats) -> Floats:
        """(n, 9) points, mm and degrees, with the machine's axes from `poses` (n, n_commanded)."""
        changed = points.copy()
        changed[:, self.columns] = poses / self.scale
        return changed

    def turn(self, points: Floats, others: Floats) -> Floats:
        """(n,) rad, the most that one of the machine's angles differs between points (n, 9)."""
        if not self._angles.any():
            return np.zeros(len(points))
        columns = self.columns[self._angles]
        turned: Floats = np.abs(points[:, columns] - others[:, columns]).max(axis=1) * DEGREE
        return turned

    def in_words(self, pose: Floats) -> str:
        """A pose (n_commanded,), SI, as a program has it: "X200 Y100", machine coordinates.

        Lengths in mm or, of a machine file in inches, in inches; angles in degrees.
        """
        values = pose / self.scale
        inches = MILLIMETRE * self.machine.shown.length.per_si
        values = np.where(self._angles, values, values * inches)
        return " ".join(f"{n}{v:.6g}" for n, v in zip(self.names, values, strict=True))

    def home(self) -> dict[str, float]:
        """The machine's home on its own axes, mm and degrees."""
        dof = self.machine.dof
        home = {name: self.machine.home[dof.index(name)] for name in self.machine.commanded}
        return {name.upper(): float(value) / scale_of(name) for name, value in home.items()}


def scale_of(axis: str) -> float:
    """SI to the mm or degree of an axis."""
    return MILLIMETRE if axis.upper() in LINEAR else DEGREE


__all__ = ["AXES", "DEGREE", "LINEAR", "MILLIMETRE", "Axes", "scale_of"]
