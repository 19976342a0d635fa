"""The simulator's own fits, on points whose minimum zone is known by construction."""

from __future__ import annotations

import numpy as np
import pytest

from part_simulator.shapes import (
    circle_of_least_squares,
    wall_of_least_squares,
    zone_of_circle,
    zone_of_face,
    zone_of_wall,
)

SIZE, FORM = 0.05, 2e-5
"""m: of walls and circles, and of their form."""


def test_a_wall_has_the_zone_of_the_three_points_that_hold_it() -> None:
    """One at the top between two at the bottom, all others inside: no narrower zone is there."""
    random = np.random.default_rng(1)
    for turn in random.uniform(0.0, np.pi, 20):
        along = np.r_[-SIZE, 0.3 * SIZE, SIZE, random.uniform(-SIZE, SIZE, 40)]
        across = np.r_[0.0, FORM, 0.0, random.uniform(0.1, 0.9, 40) * FORM]
        ways = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        width, normal = zone_of_wall(np.column_stack([along, across]) @ ways)
        assert width == pytest.approx(FORM, rel=1e-10)
        assert abs(normal @ ways[0]) < 1e-10


def test_a_face_has_the_zone_of_the_four_points_that_hold_it() -> None:
    """One at the top above a triangle at the bottom; and two across two, a saddle."""
    random = np.random.default_rng(2)
    triangle = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0], [0.1, -0.2, 1.0]])
    saddle = np.array([[1.0, 1.0, 1.0], [-1.0, -1.0, 1.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]])
    for held in (triangle, saddle) * 5:
        others = random.uniform(-1.0, 1.0, (60, 3))
        others[:, 2] = random.uniform(0.05, 0.95, 60)
        points = np.vstack([held, others]) * [SIZE, SIZE, FORM]
        ways = np.linalg.qr(random.normal(size=(3, 3)))[0]
        width, normal = zone_of_face(points @ ways.T)
        assert width == pytest.approx(FORM, rel=1e-9)
        assert abs(abs(normal @ ways[:, 2]) - 1.0) < 1e-12


def test_a_circle_has_the_zone_of_two_points_outside_and_two_inside_by_turns() -> None:
    random = np.random.default_rng(3)
    for _ in range(20):
        angles = np.r_[0.3, 1.9, 3.2, 4.9, random.uniform(0.0, 2 * np.pi, 80)]
        radii = SIZE + FORM * np.r_[0.0, 1.0, 0.0, 1.0, random.uniform(0.05, 0.95, 80)]
        centre = random.uniform(-1.0, 1.0, 2)
        ways = np.column_stack([np.cos(angles), np.sin(angles)])
        width, found = zone_of_circle(centre + radii[:, np.newaxis] * ways)
        assert width == pytest.approx(FORM, abs=1e-14)
        assert np.abs(found - centre).max() < 1e-13


def test_least_squares_leave_no_slope() -> None:
    random = np.random.default_rng(4)
    angles = random.uniform(0.0, 2 * np.pi, 100)
    radii = SIZE + FORM * random.uniform(-1.0, 1.0, 100)
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    points = radii[:, np.newaxis] * ways + [0.2, -0.1]
    centre, radius = circle_of_least_squares(points)
    spokes = points - centre
    lengths = np.hypot(*spokes.T)
    slopes = np.column_stack([spokes / lengths[:, np.newaxis], np.ones(len(points))])
    assert np.abs((lengths - radius) @ slopes / len(points)).max() < 1e-16
    face = random.uniform(-1.0, 1.0, (50, 3)) * [SIZE, SIZE, FORM]
    normal = wall_of_least_squares(face)
    heights = (face - face.mean(axis=0)) @ normal
    for turn in np.linalg.qr(np.column_stack([normal, np.eye(3)[:, :2]]))[0].T[1:]:
        tilted = [
            np.sum((heights * np.cos(a) + (face - face.mean(axis=0)) @ turn * np.sin(a)) ** 2)
            for a in (-1e-4, 0.0, 1e-4)
        ]
        assert tilted[1] < min(tilted[0], tilted[2])
