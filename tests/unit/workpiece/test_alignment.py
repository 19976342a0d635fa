"""Alignment: a rigid motion of the part is taken off, and to first order what is left is linear."""

from __future__ import annotations

import numpy as np
import pytest

from features_of_elements import face, wall
from truepose.arrays import Floats
from truepose.spatial import rotate_about
from truepose.workpiece.alignment import Alignment
from truepose.workpiece.datum_frame import datum_alignment
from truepose.workpiece.first_order import FrameMotion

RNG = np.random.default_rng(7)
NOMINAL = RNG.uniform(-0.05, 0.05, (40, 3))
AXIS = np.array([1.0, 2.0, -2.0]) / 3.0


def of_datums(*, least_squares: bool) -> Alignment:
    """A face and two walls."""
    datums = [
        face("F", (-0.05, -0.04), (0.1, 0.09), 0.01),
        wall("A", (-0.04, -0.04, 0.01), (0.05, -0.04, 0.01), 20),
        wall("B", (-0.05, -0.03, 0.01), (-0.05, 0.05, 0.01), 20),
    ]
    nominal = np.concatenate([one.points for one in datums])
    frame = datum_alignment(datums, least_squares=least_squares)
    motion = FrameMotion.of(frame.frame)
    return Alignment("datums", nominal, np.arange(len(nominal)), frame, motion)


ALIGNMENTS = {
    "best-fit": Alignment("best-fit", NOMINAL, np.arange(40)),
    "datums": of_datums(least_squares=True),
}


def moved(points: Floats) -> Floats:
    """By a turn and a shift that are not small."""
    turned = rotate_about(points, AXIS, np.array([0.3]))
    return np.asarray(turned + np.array([0.2, -0.1, 0.4]))


@pytest.mark.parametrize("name", ALIGNMENTS)
def test_a_rigid_motion_is_taken_off(name: str) -> None:
    """However the part lies, it is looked at where the drawing has it."""
    nominal = ALIGNMENTS[name].nominal
    (aligned,) = ALIGNMENTS[name].apply(moved(nominal)[np.newaxis])
    assert np.abs(aligned - nominal).max() < 1e-15 * 50


@pytest.mark.parametrize("name", ALIGNMENTS)
def test_linear_forms_follow_the_alignment(name: str) -> None:
    """To first order: halving the errors divides what is left over by four."""
    alignment = ALIGNMENTS[name]
    weights = RNG.normal(size=(3, *alignment.nominal.shape))
    errors = RNG.normal(size=alignment.nominal.shape) * 1e-5
    off = []
    for share in (1.0, 0.5):
        exact, linear = exact_and_linear(alignment, weights, share * errors)
        off.append(np.abs(exact - linear).max())
    assert off[0] < 1e-3 * np.abs(errors).max() * np.abs(weights).sum()
    assert off[1] < 0.3 * off[0]


def exact_and_linear(
    alignment: Alignment, weights: Floats, errors: Floats
) -> tuple[Floats, Floats]:
    """(k,) forms (k, n, 3) of errors (n, 3) after the alignment, and to first order before it."""
    (aligned,) = alignment.apply((alignment.nominal + errors)[np.newaxis])
    exact = np.tensordot(weights, aligned - alignment.nominal, axes=([1, 2], [0, 1]))
    linear = np.tensordot(alignment.linear(weights), errors, axes=([1, 2], [0, 1]))
    return exact, linear


def test_minimum_zones_lie_within_what_their_datums_allow() -> None:
    """They have no derivative: they are off least squares by their datums' form at most."""
    alignment = of_datums(least_squares=False)
    far = 0.0
    for _ in range(200):
        weights = RNG.normal(size=(1, *alignment.nominal.shape))
        errors = RNG.normal(size=alignment.nominal.shape) * 1e-7
        exact, linear = exact_and_linear(alignment, weights, errors)
        allowed = 0.0
        for one in alignment.besides(weights):
            values = np.tensordot(one.weights, errors, axes=([1, 2], [0, 1]))
            # The residuals' forms are over the datum's own points, which are members in order.
            allowed += one.factor * float(np.ptp(values))
        assert np.abs(exact - linear).max() <= 1.001 * allowed
        far = max(far, float(np.abs(exact - linear).max()) / allowed)
    assert far > 0.05


def test_a_part_that_is_shifted_is_shifted_back() -> None:
    """By the linear response too: what all points share is taken off whole."""
    for least_squares in (True, False):
        alignment = of_datums(least_squares=least_squares)
        weights = RNG.normal(size=(5, *alignment.nominal.shape))
        left = alignment.linear(weights).sum(axis=1)
        assert np.abs(left).max() < 1e-12 * np.abs(weights).sum()


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
    assert alignment.invariant(distance, np.arange(40))
    assert not alignment.invariant(coordinate, np.arange(40))


def test_clamped_is_left_alone() -> None:
    """The very numbers."""
    alignment = Alignment("clamped", NOMINAL, np.arange(40))
    parts = moved(NOMINAL)[np.newaxis]
    assert np.array_equal(alignment.apply(parts), parts)
    assert not alignment.moves
