"""Rotations, directions and registration, against SciPy's and against the kernel's placements."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from truepose import spatial

Floats = NDArray[np.float64]

EXACT = {"rtol": 0.0, "atol": 1e-14}

ANGLES = [0.0, 1e-12, 1e-8, 1e-4, 9.99e-4, 1.01e-3, 0.3, 2.0, np.pi - 1e-9, np.pi]


def directions(count: int = 60) -> Floats:
    """(n, 3) unit vectors: random ones, those along the axes, and some with equal components."""
    vectors = np.random.default_rng(7).normal(size=(count, 3))
    special = np.array([[1, 0, 0], [0, -1, 0], [0, 0, 1], [1, 1, 1], [-1, 1, 0], [0, 2, 2]], float)
    vectors = np.concatenate([vectors, special])
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def rotations(count: int = 100) -> Rotation:
    """Random ones, and turns by half a turn about each axis, where a quaternion's w is zero."""
    half_turns = Rotation.from_rotvec(np.pi * np.concatenate([np.eye(3), directions(3)]))
    return Rotation.concatenate([Rotation.random(count, random_state=5), half_turns])


def of_quaternions(quaternions: Floats) -> Rotation:
    return Rotation.from_quat(np.roll(quaternions, -1, axis=-1))


@pytest.mark.parametrize("angle", ANGLES)
def test_rotation_vectors(angle: float) -> None:
    vectors = angle * directions()
    expected = Rotation.from_rotvec(vectors).as_matrix()
    np.testing.assert_allclose(spatial.vector_to_matrix(vectors), expected, **EXACT)
    np.testing.assert_allclose(spatial.vector_to_matrix(vectors[0]), expected[0], **EXACT)
    assert spatial.rotation_angle(expected) == pytest.approx(angle, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_axis_and_angle(angle: float) -> None:
    axes = directions()
    vectors = np.random.default_rng(3).normal(size=axes.shape)
    expected = Rotation.from_rotvec(angle * axes).apply(vectors)
    turned = spatial.rotate_about(vectors, axes, np.full((len(axes), 1), angle))
    np.testing.assert_allclose(turned, expected, **EXACT)
    # One vector about one axis by many angles.
    one = spatial.rotate_about(vectors[0], axes[0], np.array([[angle], [0.0]]))
    np.testing.assert_allclose(one, [expected[0], vectors[0]], **EXACT)


@pytest.mark.parametrize("angle", [0.0, 5e-4, 2e-3, 0.7, 3.0])
def test_left_jacobian_is_the_derivative_of_the_exponential(angle: float) -> None:
    vectors, step = angle * directions(5), 1e-6
    jacobian = spatial.left_jacobian(vectors)
    for axis, unit in enumerate(np.eye(3)):
        ahead, behind = (Rotation.from_rotvec(vectors + way * unit) for way in (step, -step))
        slope = (ahead * behind.inv()).as_rotvec() / (2.0 * step)
        np.testing.assert_allclose(jacobian[:, :, axis], slope, rtol=0.0, atol=1e-9)


def test_quaternions_and_matrices() -> None:
    matrices = rotations().as_matrix()
    quaternions = np.array([spatial.matrix_to_quaternion(matrix) for matrix in matrices])
    assert (quaternions[:, 0] >= 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(quaternions, axis=1), 1.0, **EXACT)
    np.testing.assert_allclose(of_quaternions(quaternions).as_matrix(), matrices, **EXACT)
    np.testing.assert_allclose(spatial.quaternion_to_matrix(quaternions), matrices, **EXACT)
    np.testing.assert_allclose(
        spatial.quaternion_to_matrix(tuple(quaternions[0])), matrices[0], **EXACT
    )


@pytest.mark.parametrize("angle", ANGLES)
def test_turned_quaternions_and_the_angle_between(angle: float) -> None:
    vectors = angle * directions()
    before = np.array([spatial.matrix_to_quaternion(m) for m in rotations(60).as_matrix()])
    before = before[: len(vectors)]
    after = spatial.rotate_quaternions(before, vectors)
    expected = (Rotation.from_rotvec(vectors) * of_quaternions(before)).as_matrix()
    np.testing.assert_allclose(of_quaternions(after).as_matrix(), expected, **EXACT)
    # A quaternion and its negative are one rotation. At half a turn the chord turns back.
    precision = 1e-7 if angle > 3.0 else 1e-15
    between = spatial.angle_between(before, -after)
    assert between == pytest.approx(angle, rel=1e-9, abs=precision)


def test_euler_angles() -> None:
    random = np.random.default_rng(11)
    angles = random.uniform([-3.0, -1.5, -3.0], [3.0, 1.5, 3.0], (50, 3))
    matrices = spatial.euler_to_matrix(angles)
    expected = Rotation.from_euler("xyz", angles)
    np.testing.assert_allclose(matrices, expected.as_matrix(), **EXACT)
    np.testing.assert_allclose(spatial.matrix_to_euler(matrices), angles, rtol=0.0, atol=1e-13)
    quaternions = np.array([spatial.euler_to_quaternion(tuple(row)) for row in angles.tolist()])
    np.testing.assert_allclose(of_quaternions(quaternions).as_matrix(), matrices, **EXACT)


@pytest.mark.parametrize("order", ["xyz", "xzy", "yxz", "yzx", "zxy", "zyx"])
def test_euler_angles_in_another_order(order: str) -> None:
    angles = np.random.default_rng(13).uniform(-3.0, 3.0, (20, 3))
    columns = ["xyz".index(axis) for axis in order]
    # Upper case: about the axes as they are turned, so the first axis' turn stands on the left.
    expected = Rotation.from_euler(order.upper(), angles[:, columns]).as_matrix()
    np.testing.assert_allclose(spatial.euler_to_matrix_in_order(angles, order), expected, **EXACT)


def test_vector_products() -> None:
    left, right = directions(), directions()[::-1]
    np.testing.assert_array_equal(spatial.cross(left, right), np.cross(left, right))
    np.testing.assert_array_equal(spatial.cross(left[0], right), np.cross(left[0], right))
    product = (spatial.skew(left) @ right[:, :, np.newaxis])[:, :, 0]
    np.testing.assert_allclose(product, np.cross(left, right), **EXACT)
    np.testing.assert_allclose(spatial.norm(3.0 * left), 3.0, **EXACT)


def test_tangents_make_a_right_handed_frame() -> None:
    units = directions()
    first, second = np.moveaxis(spatial.tangents(units), 1, 0)
    frames = np.stack([first, second, units], axis=1)
    np.testing.assert_allclose(
        frames @ np.swapaxes(frames, 1, 2), np.broadcast_to(np.eye(3), frames.shape), **EXACT
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1.0, **EXACT)
    # Of equal components the earlier one's axis is taken, as by the kernel.
    np.testing.assert_array_equal(spatial.tangents([0.0, 0.0, 1.0]), [[1, 0, 0], [0, 1, 0]])
    np.testing.assert_array_equal(spatial.tangents(units[:4]), spatial.tangents(units)[:4])
    grid = units[:6].reshape(2, 3, 3)
    np.testing.assert_array_equal(
        spatial.tangents(grid), spatial.tangents(units[:6]).reshape(2, 3, 2, 3)
    )


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_registration(noise: float) -> None:
    random = np.random.default_rng(17)
    seen = random.normal(size=(12, 3))
    rotation, origin = Rotation.from_rotvec([0.4, -1.0, 2.0]), np.array([1.0, -2.0, 0.5])
    points = rotation.apply(seen) + origin + noise * random.normal(size=seen.shape)
    fitted, at = spatial.register(points, seen)
    expected, _ = Rotation.align_vectors(points - points.mean(axis=0), seen - seen.mean(axis=0))
    np.testing.assert_allclose(fitted, expected.as_matrix(), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(at, points.mean(axis=0) - fitted @ seen.mean(axis=0), **EXACT)
    if not noise:
        np.testing.assert_allclose(fitted, rotation.as_matrix(), rtol=0.0, atol=1e-13)


def test_registration_in_a_plane_and_never_a_reflection() -> None:
    random = np.random.default_rng(19)
    flat = random.normal(size=(6, 2))
    turn = Rotation.from_rotvec([0.0, 0.0, 2.5]).as_matrix()[:2, :2]
    fitted, origin = spatial.register(flat @ turn.T + [3.0, 4.0], flat)
    np.testing.assert_allclose(fitted, turn, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(origin, [3.0, 4.0], rtol=0.0, atol=1e-13)
    mirrored = flat * [1.0, -1.0]
    assert np.linalg.det(spatial.register(mirrored, flat)[0]) == pytest.approx(1.0)
    spatial_points = random.normal(size=(6, 3))
    rotation, _ = spatial.register(-spatial_points, spatial_points)
    assert np.linalg.det(rotation) == pytest.approx(1.0)
