"""Errors drawn much larger than they are: where the platform really is, arrows over the poses."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.reporting.display import is_position, where_highest
from truepose.reporting.study import Study
from truepose.reporting.uncertainty_tables import spread_over
from truepose.verdict.answer import BEFORE, Answer

LONGEST = 0.15
"""Of the machine's size: the most that the largest error is drawn long."""


@dataclass(frozen=True)
class Magnified:
    """One machine's error at one pose, and known errors at others, drawn `factor` times larger.

    `pose` (n_commanded,), SI; `moved`, `turned` (3,): displacement of the tool point, m, and small
    rotation, rad. `size`: of the position, m. `poses` (n, 3) tool points and `known` (n, 3) their
    errors, m, commanded as filed.
    """

    pose: Floats
    moved: Floats
    turned: Floats
    size: float
    factor: float
    poses: Floats
    known: Floats

    def actual(self, points: Floats, tool: Floats) -> Floats:
        """(..., 3) points of the platform where they really are, the error magnified."""
        arms = points - tool
        return np.asarray(points + self.factor * (self.moved + np.cross(self.turned, arms)))

    @property
    def tips(self) -> Floats:
        """(n, 3) ends of the arrows."""
        return np.asarray(self.poses + self.factor * self.known)


def magnified(study: Study, extent: float) -> Magnified:
    """The worst that was found as commanded, and what is known elsewhere; `extent`: of all, m.

    The witness of the verdict; where there is none, the known error where that is largest.
    """
    pose, error = worst(study)
    moved, turned = _vector(study, error, rotation=False), _vector(study, error, rotation=True)
    axes = [at for at, name in enumerate(study.machine.commanded) if is_position(name)]
    chosen = spread_over(study.poses, axes)
    known = np.array(
        [_vector(study, row, rotation=False) for row in study.values("overall_error")[chosen]]
    ).reshape(-1, 3)
    size = float(np.linalg.norm(moved))
    largest = max(size, float(np.linalg.norm(known, axis=1).max(initial=0.0)))
    return Magnified(
        pose=pose,
        moved=moved,
        turned=turned,
        size=size,
        factor=_round_factor(LONGEST * extent / largest) if largest > 0.0 else 1.0,
        poses=study.machine.kernel.placement_of(study.poses[chosen])[:, :3],
        known=known,
    )


def worst(study: Study) -> tuple[Floats, Floats]:
    """Pose and error (n_component,) of the worst machine found as commanded."""
    for answer in study.accuracy:
        error = _error_of(answer)
        if error is not None:
            return np.asarray(answer.witness.pose), error
    known = study.values("overall_error")
    at = where_highest(study.position_norm(known))
    return study.poses[at], np.asarray(known[at])


def _error_of(answer: Answer) -> Floats | None:
    """The witness's error, where it is one of a position that is commanded as filed."""
    example = answer.example
    if answer.state != BEFORE or answer.quantity != "position" or example is None:
        return None
    return example.error


def _vector(study: Study, error: Floats, *, rotation: bool) -> Floats:
    """(3,) the displacement or the rotation among the components of an error."""
    vector = np.zeros(3)
    for name, value in zip(study.components, error, strict=True):
        if is_position(name) != rotation:
            vector["xyz".index(name[-1])] = value
    return vector


def _round_factor(factor: float) -> float:
    """Rounded down to 1, 2 or 5 times a power of ten; at least 1."""
    if factor <= 1.0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(factor))
    steps = [step for step in (1.0, 2.0, 5.0) if step * power <= factor * (1.0 + 1e-9)]
    return max(steps, default=1.0) * power
