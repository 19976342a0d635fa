"""Alignment: in which coordinates a part is looked at, as it is clamped or as it is measured.

    clamped     the machine's coordinates count: nothing is moved
    best-fit    the part is moved as a rigid body so that all its points together are off least,
                in the least-squares sense (Kabsch 1976, Acta Cryst. A32)
    datums      the frame of its datums is brought to where the drawing has it

What does not change when a part is moved, as a size or a form, is the same in all three.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.workpiece.features import Forms
from truepose.workpiece.first_order import FrameMotion

Kind = Literal["clamped", "best-fit", "datums"]

ROUNDING = 1e-9
"""Of the sum of a form's weights: what is none."""

Frame = Callable[[Floats], tuple[Floats, Floats]]
"""Rotations (s, 3, 3) and origins (s, 3) of points (s, m, 3)."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """Of a part whose n programmed points are `nominal` (n, 3), m.

    `frame` (of datums): of the points numbered `members` (m,), and its `motion` to first order.
    """

    kind: Kind
    nominal: Floats
    members: Indices
    frame: Frame | None = None
    motion: FrameMotion | None = None

    def apply(self, points: Floats) -> Floats:
        """(s, n, 3) the parts (s, n, 3) where they are looked at, m."""
        if self.kind == "clamped":
            return points
        if self.kind == "best-fit":
            rotation, origin, home = self._best_fit(points)
        else:
            assert self.frame is not None
            axes, origin = self.frame(points[:, self.members])
            (drawn,), (home,) = self.frame(self.nominal[np.newaxis, self.members])
            rotation = drawn @ np.swapaxes(axes, 1, 2)
        moved = (points - origin[:, np.newaxis]) @ np.swapaxes(rotation, 1, 2)
        moved += home
        return np.asarray(moved)

    def _best_fit(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Rotations, and where the middle of the points is, and should be."""
        home = self.nominal.mean(axis=0)
        origin = points.mean(axis=1)
        about = self.nominal - home
        spread = np.swapaxes(points - origin[:, np.newaxis], 1, 2) @ about
        u, _, vt = np.linalg.svd(spread)
        mirrored = np.linalg.det(u) * np.linalg.det(vt) < 0.0
        vt[mirrored, 2] *= -1.0
        return np.swapaxes(u @ vt, 1, 2), origin, home

    @property
    def moves(self) -> bool:
        """Whether parts are moved at all."""
        return self.kind != "clamped"

    def linear(self, weights: Floats) -> Floats:
        """Linear forms (k, n, 3) of errors after alignment, as forms of the errors before it.

        To first order an alignment takes from the errors the rigid motion that it answers to them
        with: weights - (weights . motions) response.
        """
        if not self.moves:
            return weights
        motions = self._motions
        along = np.tensordot(weights, motions, axes=([1, 2], [1, 2]))
        moved = weights.copy()
        moved[:, self.members] -= np.tensordot(along, self._response(), axes=1)
        return moved

    def invariant(self, weights: Floats, points: Indices) -> bool:
        """Whether forms (k, m, 3) over `points` (m,) stay as they are when the part is moved."""
        along = np.tensordot(weights, self._motions[:, points], axes=([1, 2], [1, 2]))
        size = np.abs(weights).sum()
        return bool(np.abs(along).max(initial=0.0) <= ROUNDING * size)

    @property
    def _size(self) -> float:
        return float(np.ptp(self.nominal, axis=0).max()) or 1.0

    @cached_property
    def _motions(self) -> Floats:
        """(6, n, 3) of the points in the unit rigid motions: along, and about the middle."""
        away = (self.nominal - self.nominal.mean(axis=0)) / self._size
        along = np.broadcast_to(np.eye(3)[:, np.newaxis], (3, *away.shape))
        about = np.stack([np.cross(axis, away) for axis in np.eye(3)])
        return np.concatenate([along, about])

    def _response(self) -> Floats:
        """(6, m, 3) the rigid motion with which an alignment answers errors of its members."""
        motions = self._motions[:, self.members].reshape(6, -1)
        if self.kind == "best-fit":
            inverse: Floats = np.linalg.pinv(motions.T, rcond=1e-12).astype(np.float64)
            return inverse.reshape(6, -1, 3)
        assert self.motion is not None
        shift, turn = self.motion.response[:3], self.motion.response[3:]
        away = self.nominal.mean(axis=0) - self.motion.about
        shift = shift + np.cross(turn, away, axis=0)
        return np.concatenate([shift, turn * self._size])

    def besides(self, weights: Floats) -> tuple[Forms, ...]:
        """What the datums' own forms move linear forms (k, n, 3) by, the one that they move most.

        Forms over `members`. A minimum zone lies elsewhere than the first order says, by those.
        """
        if self.motion is None:
            return ()
        along = np.tensordot(weights, self._motions, axes=([1, 2], [1, 2]))
        away = np.abs(self.nominal.mean(axis=0) - self.motion.about)
        levers = self.motion.levers.copy()
        levers[:3] += _crossed(levers[3:], away)
        levers[3:] *= self._size
        factors = (np.abs(along) @ levers).max(axis=0)
        return tuple(
            Forms("spread", residuals, np.zeros(len(residuals)), 0.0, factor=float(factor))
            for residuals, factor in zip(self.motion.residuals, factors, strict=True)
            if factor > 0.0
        )


def _crossed(turns: Floats, away: Floats) -> Floats:
    """(3, d) the most that vector products of turns (3, d) and a vector (3,) can be, by sizes."""
    x, y, z = away[:, np.newaxis]
    a, b, c = turns
    return np.stack([b * z + c * y, c * x + a * z, a * y + b * x])
