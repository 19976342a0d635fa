"""How a free body grows when its temperature is uniform, or linear in space.

A body that nothing holds stays free of stress exactly where its temperature is linear in space
(Boley & Weiner, Theory of Thermal Stresses, 1960). With the arm r from the point that stays, the
rise T there and the gradient g, its strain alpha (T + g . r) times the unit tensor is that of

    u = alpha [T r + (g . r) r - |r|^2 g / 2]

up to a motion of the whole, which is chosen so that neither the point nor its neighbourhood's
orientation changes. The field turns the body at r by alpha g x r, half the curl of u.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats


@dataclass(frozen=True)
class Growth:
    """The field of one body: `expansion` (1/K), `rise` (K, one number or (n, 1)) at its `anchor`.

    `anchor` (3,) and `gradient` (3,), K/m, are in the axes in which points are given.
    """

    expansion: float
    rise: float | Floats
    gradient: Floats
    anchor: Floats

    @property
    def any(self) -> bool:
        """Whether anything moves."""
        return self.expansion != 0.0 and bool(np.any(self.rise) or np.any(self.gradient))

    def displacement(self, points: ArrayLike) -> Floats:
        """(n or 1, 3) m, of points (3,) or (n, 3), m."""
        arm = np.atleast_2d(np.asarray(points, np.float64)) - self.anchor
        along = arm @ self.gradient[:, np.newaxis]
        square = np.sum(arm * arm, axis=1, keepdims=True)
        return np.asarray(
            self.expansion * ((self.rise + along) * arm - 0.5 * square * self.gradient)
        )

    def turn(self, points: ArrayLike) -> Floats:
        """(n or 1, 3) rad, rotation vector of the body at points (3,) or (n, 3), m."""
        arm = np.atleast_2d(np.asarray(points, np.float64)) - self.anchor
        return np.asarray(self.expansion * np.cross(self.gradient, arm))

    def strain(self, points: ArrayLike) -> Floats:
        """(n or 1, 1) at points (3,) or (n, 3), m."""
        arm = np.atleast_2d(np.asarray(points, np.float64)) - self.anchor
        return np.asarray(self.expansion * (self.rise + arm @ self.gradient[:, np.newaxis]))


def along_line(expansion: float, rise: float | Floats, gradient: float, way: Floats) -> Floats:
    """(n, 1) m by which a rod grows over `way` (n, 1) m from where it is held.

    The temperature rises by `rise` K there and by `gradient` K/m along it: the integral of
    expansion (rise + gradient s) ds.
    """
    return np.asarray(expansion * (rise * way + 0.5 * gradient * way * way))
