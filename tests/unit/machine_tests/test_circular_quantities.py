"""The quantities of polar data that are known in closed form, and what patterns look like."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from machine_texts import load_text
from made_circular import CENTRE, circle, joints_at, with_keys
from truepose.machine_tests.circle import least_squares, ring_widths
from truepose.machine_tests.circular_diagnosis import shape_of
from truepose.machine_tests.circular_prediction import evaluate
from truepose.machine_tests.circular_quantities import QUANTITIES, evaluated
from two_slider import LENGTH, tool

R = 0.1
ANGLES = 2.0 * np.pi * np.arange(360) / 360.0


def of(there: np.ndarray, back: np.ndarray) -> dict[str, float]:
    result = evaluated(ANGLES, np.stack([there, back])[np.newaxis], R)
    return dict(zip(QUANTITIES, result.values[0].tolist(), strict=True))


def test_axes_that_are_not_square_make_an_ellipse_at_45_degrees() -> None:
    """x + gamma y: a circle's points by hand, as an instrument in the middle reads them."""
    gamma = 1e-4
    x, y = R * np.cos(ANGLES), R * np.sin(ANGLES)
    radii = np.hypot(x + gamma * y, y)
    values = of(radii, radii)
    # The singular values of the shear are sqrt(1 + gamma^2 / 4) +- gamma / 2.
    assert values["G_b"] == pytest.approx(gamma * R, abs=1e-9)
    assert values["F_max_ccw"] - values["F_min_ccw"] == pytest.approx(gamma * R, abs=1e-9)
    assert values["H"] == pytest.approx(0.0, abs=1e-15)
    pattern = np.stack([radii - R, radii - R])
    assert shape_of(ANGLES, pattern) == "ellipse, long at 45 deg"
    assert shape_of(ANGLES, -pattern) == "ellipse, long at 135 deg"


def test_unequal_scales_make_an_ellipse_along_an_axis() -> None:
    one, other = 3e-5, -1e-5
    radii = np.hypot(R * (1.0 + one) * np.cos(ANGLES), R * (1.0 + other) * np.sin(ANGLES))
    values = of(radii, radii)
    assert values["G_b"] == pytest.approx((one - other) * R, abs=1e-9)
    assert values["D"] == pytest.approx(0.5 * (one + other) * R, abs=1e-9)
    assert shape_of(ANGLES, np.stack([radii - radii.mean()] * 2)) == "ellipse, long at 0 deg"


def test_a_step_of_both_ways_is_hysteresis() -> None:
    step = 4e-6 * np.sign(np.sin(2.0 * ANGLES + 0.1))
    values = of(R + step, R - step)
    assert values["H"] == pytest.approx(8e-6, abs=1e-12)
    assert values["G_b"] == pytest.approx(8e-6, abs=1e-12)
    assert shape_of(ANGLES, np.stack([step, -step])).startswith("steps")


@pytest.mark.parametrize("centre", [0.0, 2e-5 - 1e-5j, 1e-3 + 2e-3j])
def test_where_the_ball_bar_stands_is_in_no_quantity(centre: complex) -> None:
    """Three lobes about another centre, of points that are exactly on it."""
    radii = R + 5e-6 * np.cos(3.0 * ANGLES)
    values = of(radii, radii)
    assert values["G_b"] == pytest.approx(1e-5, abs=1e-12)
    points = radii * np.exp(1j * ANGLES) + centre
    angles, distances = np.angle(points), np.abs(points)
    assert ring_widths(angles, distances[np.newaxis])[0] == pytest.approx(1e-5, abs=1e-12)
    fit = least_squares(angles, distances[np.newaxis])
    assert fit.centre[0] == pytest.approx([centre.real, centre.imag], abs=1e-9)
    assert fit.radius[0] == pytest.approx(R, abs=1e-9)


def test_a_guideway_that_is_tilted_is_one_by_hand(tmp_path: Path) -> None:
    """Rail 1 leans by a known angle: its carriage goes along it, circles about the carriages."""
    lean = 2e-4
    text = with_keys(drive="").replace("length_tolerance = [-0.3, 0.3]\n", "")
    text += '\n[tolerance]\n"drive.d1.axis.u" = ["0.19 mrad", "0.21 mrad"]\n'
    test = evaluate(load_text(tmp_path, text), 0.05, {"x": CENTRE[0], "y": CENTRE[1]}, samples=100)
    name = test.path.machine.parameters.index("drive.d1.axis.u")
    moved, shift = test.before.state.variables.shift
    assert moved[shift.any(axis=0)].tolist() == [name]
    wanted = circle(test.path.angles, 0.05)
    joints = joints_at(wanted)
    best = np.inf
    for sign in (1.0, -1.0):
        axis = np.array([np.sin(sign * lean), np.cos(lean)])
        first = joints[:, :1] * axis
        second = np.stack([np.full(len(joints), 0.6), joints[:, 1]], axis=1)
        points = tool(np.stack([first, second], axis=1), np.full(joints.shape, LENGTH), wanted)
        radii = np.linalg.norm(points - points.mean(axis=0), axis=1)
        expected = evaluated(test.path.angles, np.stack([radii, radii])[np.newaxis], 0.05)
        best = min(best, float(np.abs(expected.values - test.before.nominal.values).max()))
    assert float(test.before.nominal.values[0, 0]) > 1e-6
    assert best < 1e-9
