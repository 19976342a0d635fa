"""What an instrument in the middle of a circle sees of errors of the tool point on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from truepose.arrays import Floats
from truepose.machine_tests.circle_path import CirclePath
from truepose.machine_tests.circular_quantities import QUANTITIES, Evaluated, evaluated
from truepose.workpiece.states import PartState


@dataclass(frozen=True, eq=False)
class Seen:
    """The path, and one state of the machine on it.

    The instrument reads its distance from the tool point; it stands in the middle of what is driven
    (the mean of both paths), as one that is set up on the machine itself does.
    """

    path: CirclePath
    state: PartState

    def radii(self, errors: Floats) -> Floats:
        """(s, 2, n) what it reads, m, of errors (s, 2 n, 3) in the order of driving."""
        offsets = self.state.points - self.path.middle + errors
        offsets = offsets - offsets.mean(axis=1, keepdims=True)
        return self.path.by_angle(np.sqrt(np.einsum("sna,sna->sn", offsets, offsets)))

    def evaluated(self, errors: Floats) -> Evaluated:
        """The quantities of errors (s, 2 n, 3)."""
        return evaluated(self.path.angles, self.radii(errors), self.path.radius)

    @cached_property
    def nominal(self) -> Evaluated:
        """Of the known errors."""
        return self.evaluated(self.state.known_error[np.newaxis])

    @property
    def deviations(self) -> Floats:
        """(2, n) F of the known errors, m."""
        return np.asarray(self.nominal.deviations[0])

    @staticmethod
    def quantity(of: Evaluated, name: str) -> Floats:
        """(s,) a quantity by its name, m."""
        return np.asarray(of.values[:, list(QUANTITIES).index(name)])

    def radius_of(self, of: Evaluated) -> Floats:
        """(s,) D, m."""
        return self.quantity(of, "D")

    @cached_property
    def outwards(self) -> Floats:
        """(2 n, 3) unit vectors from the middle, in the order of driving."""
        away = self.state.points - self.path.middle
        return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))

    def patterns(self, effects: Floats) -> Floats:
        """(v, 2 n) F of effects (2 n, 3, v), to first order, by angle, counter-clockwise first."""
        radial = np.einsum("na,nav->vn", self.outwards, effects)
        sorted_ = self.path.by_angle(radial).reshape(len(radial), -1)
        return centred(np.tile(self.path.angles, 2), sorted_)


def centred(angles: Floats, radial: Floats) -> Floats:
    """Deviations (v, m) at angles (m,) without those that another centre makes (cos and sin)."""
    columns = np.stack([np.ones_like(angles), np.cos(angles), np.sin(angles)], axis=1)
    fitted = radial @ np.linalg.pinv(columns).T
    return np.asarray(radial - fitted[:, 1:] @ columns[:, 1:].T)
