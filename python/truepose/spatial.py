"""Rotations, directions and rigid registration of points in space.

Conventions, here and everywhere: a rotation R (3, 3) takes a body's axes to those that the body is
seen from; quaternions are of length 1, w x y z; rotation vectors and angles are in rad; the Euler
angles a b c mean R = Rz(c) Ry(b) Rx(a). Leading axes `...` are of many at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats

Quaternion = tuple[float, float, float, float]
"""One unit quaternion, w x y z."""


def norm(vectors: Floats) -> Floats:
    """(...,) lengths of vectors (..., k)."""
    return np.asarray(np.sqrt(np.einsum("...k,...k->...", vectors, vectors)))


def cross(left: Floats, right: Floats) -> Floats:
    """(..., 3) vector product of (..., 3); quicker than NumPy's on many short vectors."""
    x, y, z = left[..., 0], left[..., 1], left[..., 2]
    a, b, c = right[..., 0], right[..., 1], right[..., 2]
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], axis=-1)


def skew(vectors: Floats) -> Floats:
    """(..., 3, 3) matrices V of vectors v (..., 3): V x is the vector product of v and x."""
    matrices = np.zeros((*vectors.shape, 3))
    for row, column, axis in ((2, 1, 0), (0, 2, 1), (1, 0, 2)):
        matrices[..., row, column] = vectors[..., axis]
        matrices[..., column, row] = -vectors[..., axis]
    return matrices


def tangents(axes: ArrayLike) -> Floats:
    """(..., 2, 3) unit vectors across unit vectors (..., 3) and each other, right-handed with them.

    The kernel's (`tangents` in `crates/kernel/src/spatial/vector.rs`): the first is the coordinate
    axis least aligned with the unit vector (the earlier of equal ones), made perpendicular to it.
    """
    unit = np.asarray(axes, np.float64)
    least = np.argmin(np.abs(unit), axis=-1)
    first = np.eye(3)[least] - np.take_along_axis(unit, least[..., np.newaxis], -1) * unit
    first = first / norm(first)[..., np.newaxis]
    return np.stack([first, cross(unit, first)], axis=-2)


def rotate_about(vectors: Floats, axes: Floats, angles: Floats) -> Floats:
    """(..., 3) vectors (..., 3) turned about unit axes (..., 3) by angles (..., 1), rad.

    Rodrigues' formula; the three broadcast.
    """
    along = (vectors * axes).sum(axis=-1, keepdims=True) * axes
    across = np.cos(angles) * (vectors - along) + np.sin(angles) * cross(axes, vectors)
    return np.asarray(along + across)


def vector_to_matrix(vectors: Floats) -> Floats:
    """(..., 3, 3) rotations of rotation vectors (..., 3), rad; exact at zero as well."""
    angle = np.linalg.norm(vectors, axis=-1)[..., np.newaxis, np.newaxis]
    matrix = skew(vectors)
    # sin(x) / x, and (1 - cos x) / x^2 without the digits that the difference loses.
    half = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * matrix + half * (matrix @ matrix))


def left_jacobian(vectors: Floats) -> Floats:
    """(..., 3, 3) rotation, about the fixed axes, per change of rotation vectors v (..., 3).

    exp(v + dv) = exp(J dv) exp(v) to first order; J. Sola, J. Deray, D. Atchuthan, A micro Lie
    theory for state estimation in robotics (2018), appendix B. Below 1e-3 rad by a series.
    """
    angle = np.linalg.norm(vectors, axis=-1)[..., np.newaxis, np.newaxis]
    matrix = skew(vectors)
    half = 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        cubic = np.where(
            angle > 1e-3,
            (angle - np.sin(angle)) / angle**3,
            1.0 / 6.0 - angle * angle / 120.0,
        )
    return np.asarray(np.eye(3) + half * matrix + cubic * (matrix @ matrix))


def rotation_angle(rotations: Floats) -> Floats:
    """(...,) angles, rad, 0 to pi, of rotations (..., 3, 3); small ones keep their digits."""
    turn = rotations - np.swapaxes(rotations, -1, -2)
    double_sine = np.stack([turn[..., 2, 1], turn[..., 0, 2], turn[..., 1, 0]], axis=-1)
    double_cosine = np.trace(rotations, axis1=-2, axis2=-1) - 1.0
    return np.asarray(np.arctan2(norm(double_sine), double_cosine))


def quaternion_to_matrix(quaternions: ArrayLike) -> Floats:
    """(..., 3, 3) rotations of unit quaternions (..., 4), w x y z."""
    w, x, y, z = np.moveaxis(np.asarray(quaternions, np.float64), -1, 0)
    rows = [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def matrix_to_quaternion(rotation: Floats) -> Quaternion:
    """Unit quaternion w x y z, w >= 0, of one rotation (3, 3)."""
    m = rotation
    # 4 times each squared component; the largest is safe to divide by (S. W. Shepperd, 1978).
    squares = np.array(
        [
            1.0 + m[0, 0] + m[1, 1] + m[2, 2],
            1.0 + m[0, 0] - m[1, 1] - m[2, 2],
            1.0 - m[0, 0] + m[1, 1] - m[2, 2],
            1.0 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    odd = (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1])
    even = (m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1])
    rows = [
        [squares[0], odd[0], odd[1], odd[2]],
        [odd[0], squares[1], even[0], even[1]],
        [odd[1], even[0], squares[2], even[2]],
        [odd[2], even[1], even[2], squares[3]],
    ]
    row = np.array(rows[int(np.argmax(squares))])
    row /= np.linalg.norm(row)
    if row[0] < 0.0:
        row = -row
    w, x, y, z = row.tolist()
    return (w, x, y, z)


def rotate_quaternions(quaternions: Floats, vectors: Floats) -> Floats:
    """(n, 4) w x y z of rotations (n, 4) turned on by rotation vectors (n, 3) about fixed axes."""
    half = 0.5 * np.linalg.norm(vectors, axis=1)
    # sin(x) / x, of 2 * half the angle: exact at 0 as well.
    v = vectors * (0.5 * np.sinc(half / np.pi))[:, np.newaxis]
    u, (x, y, z) = np.cos(half), v.T
    w, a, b, c = quaternions.T
    return np.stack(
        [
            u * w - x * a - y * b - z * c,
            u * a + x * w + y * c - z * b,
            u * b - x * c + y * w + z * a,
            u * c + x * b - y * a + z * w,
        ],
        axis=1,
    )


def angle_between(left: Floats, right: Floats) -> Floats:
    """(n,) angles, rad, between the rotations of unit quaternions (n, 4).

    By the chord between them, which keeps its digits where the angle is small.
    """
    side = np.where(np.sum(left * right, axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    chord = np.linalg.norm(left - side * right, axis=1)
    angles: Floats = 4.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
    return angles


def euler_to_matrix(angles: Floats) -> Floats:
    """(n, 3, 3) rotations R = Rz(c) Ry(b) Rx(a) of angles a b c (n, 3), rad."""
    (sa, sb, sc), (ca, cb, cc) = np.sin(angles).T, np.cos(angles).T
    rows = [
        [cb * cc, sa * sb * cc - ca * sc, ca * sb * cc + sa * sc],
        [cb * sc, sa * sb * sc + ca * cc, ca * sb * sc - sa * cc],
        [-sb, sa * cb, ca * cb],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def euler_to_matrix_in_order(angles: Floats, order: str) -> Floats:
    """(n, 3, 3) product, left to right, of turns about the axes in `order`; angles a b c (n, 3).

    "zyx" is `euler_to_matrix`, "xyz" is Rx(a) Ry(b) Rz(c).
    """
    product = np.broadcast_to(np.eye(3), (len(angles), 3, 3))
    for axis in order:
        k = "xyz".index(axis)
        i, j = (k + 1) % 3, (k + 2) % 3
        turn = np.zeros((len(angles), 3, 3))
        turn[:, k, k] = 1.0
        turn[:, i, i] = turn[:, j, j] = np.cos(angles[:, k])
        turn[:, j, i] = np.sin(angles[:, k])
        turn[:, i, j] = -turn[:, j, i]
        product = product @ turn
    return product


def matrix_to_euler(rotations: Floats) -> Floats:
    """(n, 3) angles a b c of rotations (n, 3, 3), R = Rz(c) Ry(b) Rx(a), |b| at most pi/2."""
    a = np.arctan2(rotations[:, 2, 1], rotations[:, 2, 2])
    b = np.arctan2(-rotations[:, 2, 0], np.hypot(rotations[:, 0, 0], rotations[:, 1, 0]))
    c = np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0])
    return np.column_stack([a, b, c])


def euler_to_quaternion(angles: tuple[float, float, float]) -> Quaternion:
    """Unit quaternion w x y z of R = Rz(c) Ry(b) Rx(a), angles a b c in rad."""
    ca, cb, cc = (math.cos(0.5 * angle) for angle in angles)
    sa, sb, sc = (math.sin(0.5 * angle) for angle in angles)
    return (
        cc * cb * ca + sc * sb * sa,
        cc * cb * sa - sc * sb * ca,
        cc * sb * ca + sc * cb * sa,
        sc * cb * ca - cc * sb * sa,
    )


def nearest_rotation(product: Floats) -> Floats:
    """(d, d) the rotation R for which trace(R^T `product`) is largest, never a reflection.

    `product` (d, d) is the sum over pairs of vectors p, q of p q^T; R q is then nearest to p.
    W. Kabsch, A solution for the best rotation to relate two sets of vectors, Acta Cryst. A32
    (1976) 922-923.
    """
    left, _, right = np.linalg.svd(product)
    proper = np.ones(len(product))
    proper[-1] = np.sign(np.linalg.det(left @ right))
    rotation: Floats = (left * proper) @ right
    return rotation


def register(points: Floats, seen: Floats) -> tuple[Floats, Floats]:
    """Rotation R (d, d) and origin o (d,) for which `points` (n, d) are nearest to R `seen` + o.

    In the least squares over the points, all of one weight; see `nearest_rotation`.
    """
    middle, seen_middle = points.mean(axis=0), seen.mean(axis=0)
    rotation = nearest_rotation((points - middle).T @ (seen - seen_middle))
    return rotation, middle - rotation @ seen_middle
