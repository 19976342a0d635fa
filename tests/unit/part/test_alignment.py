"""Alignment: a rigid motion of the part is taken off, and to first order what is left is linear."""

from __future__ import annotations

import numpy as np
import pytest

from truepose.arrays import Floats
from truepose.part.alignment import Alignment
from truepose.spatial import rotate_about

RNG = np.random.default_rng(7)
NOMINAL = RNG.uniform(-0.05, 0.05, (40, 3))
NOMINAL[[3, 17, 29]] = [[-0.04, -0.04, 0.0], [0.04, -0.03, 0.01], [0.0, 0.05, -0.01]]
AXIS = np.array([1.0, 2.0, -2.0]) / 3.0


def of_three_points(points: Floats) -> tuple[Floats, Floats]:
    """A frame: origin at the first, x towards the second, the third in the xy plane."""
    origin = points[:, 0]
    x = points[:, 1] - origin
    z = np.cross(x, points[:, 2] - origin)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    z = z / np.linalg.norm(z, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=2), origin


ALIGNMENTS = {
    "best-fit": Alignment("best-fit", NOMINAL, np.arange(40)),
    "datums": Alignment("datums", NOMINAL, np.array([3, 17, 29]), of_three_points),
}


def moved(points: Floats) -> Floats:
    """By a turn and a shift that are not small."""
    turned = rotate_about(points, AXIS, np.array([0.3]))
    return np.asarray(turned + np.array([0.2, -0.1, 0.4]))


@pytest.mark.parametrize("name", ALIGNMENTS)
def test_a_rigid_motion_is_taken_off(name: str) -> None:
    """However the part lies, it is looked at where the drawing has it."""
    (aligned,) = ALIGNMENTS[name].apply(moved(NOMINAL)[np.newaxis])
    assert np.abs(aligned - NOMINAL).max() < 1e-15 * 50


@pytest.mark.parametrize("name", ALIGNMENTS)
def test_linear_forms_follow_the_alignment(name: str) -> None:
    """To first order: halving the errors divides what is left over by four."""
    alignment = ALIGNMENTS[name]
    weights = RNG.normal(size=(3, 40, 3))
    errors = RNG.normal(size=(40, 3)) * 1e-5
    off = []
    for share in (1.0, 0.5):
        (aligned,) = alignment.apply((NOMINAL + share * errors)[np.newaxis])
        exact = np.tensordot(weights, aligned - NOMINAL, axes=([1, 2], [0, 1]))
        linear = np.tensordot(alignment.linear(weights), share * errors, axes=([1, 2], [0, 1]))
        off.append(np.abs(exact - linear).max())
    assert off[0] < 1e-3 * np.abs(errors).max() * np.abs(weights).sum()
    assert off[1] < 0.3 * off[0]


def test_best_fit_leaves_the_least() -> None:
    """No other small motion leaves a smaller sum of squares."""
    alignment = ALIGNMENTS["best-fit"]
    parts = NOMINAL + RNG.normal(size=(1, 40, 3)) * 1e-4
    (aligned,) = alignment.apply(parts)
    least = np.square(aligned - NOMINAL).sum()
    for axis in np.eye(3):
        for size in (1e-6, -1e-6):
            shifted = aligned + size * axis
            turned = aligned + np.cross(size * 10.0 * axis, aligned)
            assert np.square(shifted - NOMINAL).sum() > least
            assert np.square(turned - NOMINAL).sum() > least


def test_a_mirrored_part_is_not_mirrored_back() -> None:
    """A best fit turns and shifts, nothing else: a wrong hand stays wrong."""
    mirrored = NOMINAL * np.array([-1.0, 1.0, 1.0])
    (aligned,) = ALIGNMENTS["best-fit"].apply(mirrored[np.newaxis])
    assert np.abs(aligned - NOMINAL).max() > 0.01


def test_what_a_motion_does_not_change_is_known() -> None:
    """A distance of two points is invariant, a coordinate is not."""
    alignment = ALIGNMENTS["best-fit"]
    along = NOMINAL[1] - NOMINAL[0]
    distance = np.zeros((1, 40, 3))
    distance[0, 1], distance[0, 0] = along, -along
    coordinate = np.zeros((1, 40, 3))
    coordinate[0, 5, 0] = 1.0
    assert alignment.invariant(distance)
    assert not alignment.invariant(coordinate)


def test_clamped_is_left_alone() -> None:
    """The very numbers."""
    alignment = Alignment("clamped", NOMINAL, np.arange(40))
    parts = moved(NOMINAL)[np.newaxis]
    assert np.array_equal(alignment.apply(parts), parts)
    assert not alignment.moves
