"""The benchmarks' peer: a hexapod's kinematics in vectorised NumPy, as a careful user writes it.

Every function takes n poses at once. Lengths in m, rotations as quaternions w x y z or matrices,
rotation vectors in rad, all in the base frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAX_STEPS = 20
# Newton converges quadratically: a step of this relative size leaves an error near its square.
LAST_STEP = 1e-7


def rotation_matrices(quaternions: Array) -> Array:
    """(n, 3, 3) rotations of quaternions (n, 4), which need not have unit length."""
    w, x, y, z = quaternions.T
    s = 2.0 / (w * w + x * x + y * y + z * z)
    result = np.empty((len(quaternions), 3, 3))
    result[:, 0, 0] = 1 - s * (y * y + z * z)
    result[:, 0, 1] = s * (x * y - w * z)
    result[:, 0, 2] = s * (x * z + w * y)
    result[:, 1, 0] = s * (x * y + w * z)
    result[:, 1, 1] = 1 - s * (x * x + z * z)
    result[:, 1, 2] = s * (y * z - w * x)
    result[:, 2, 0] = s * (x * z - w * y)
    result[:, 2, 1] = s * (y * z + w * x)
    result[:, 2, 2] = 1 - s * (x * x + y * y)
    return result


def closure_pose_rows(arms: Array, struts: Array) -> Array:
    """(n, 6, 6) rows (d, r x d): strut vectors d and their moments about the tool point."""
    rows = np.empty((*arms.shape[:2], 6))
    rows[..., :3] = struts
    # np.cross costs twice as much as the three products written out.
    rows[..., 3] = arms[..., 1] * struts[..., 2] - arms[..., 2] * struts[..., 1]
    rows[..., 4] = arms[..., 2] * struts[..., 0] - arms[..., 0] * struts[..., 2]
    rows[..., 5] = arms[..., 0] * struts[..., 1] - arms[..., 1] * struts[..., 0]
    return rows


def displacement(
    placements: Array, base: Array, platform: Array, lengths: Array
) -> tuple[Array, int]:
    """(n, 6) displacement of tool point and rotation vector from `placements`; and Newton's steps.

    Newton on |p + R b - a|^2 = L^2 with all samples in step; the rotation is taken relative to the
    start, so that the displacement needs no subtraction of large numbers.
    """
    count = len(placements)
    start_arms = platform @ rotation_matrices(placements[:, 3:]).transpose(0, 2, 1)
    start = placements[:, None, :3] - base
    squares = lengths * lengths
    shift = np.zeros((count, 3))
    turn = np.zeros((count, 4))
    turn[:, 0] = 1.0
    size = np.sqrt(squares.mean())
    steps, last = 0, np.inf
    while last >= LAST_STEP and steps < MAX_STEPS:
        steps += 1
        arms = start_arms @ rotation_matrices(turn).transpose(0, 2, 1)
        struts = start + shift[:, None] + arms
        residual = 0.5 * (squares - np.einsum("nij,nij->ni", struts, struts))
        step = np.linalg.solve(closure_pose_rows(arms, struts), residual[..., None])[..., 0]
        shift += step[:, :3]
        turn = turned(turn, step[:, 3:])
        last = max(np.abs(step[:, :3]).max() / size, np.abs(step[:, 3:]).max())
    return np.concatenate([shift, rotation_vectors(turn)], axis=1), steps


def turned(quaternions: Array, step: Array) -> Array:
    """Quaternions (n, 4) after a further small rotation `step` (n, 3), not normalised."""
    w, x, y, z = quaternions.T
    a, b, c = 0.5 * step.T
    return np.stack(
        [w - a * x - b * y - c * z, x + a * w + b * z - c * y, y + b * w + c * x - a * z,
         z + c * w + a * y - b * x],
        axis=1,
    )  # fmt: skip


def turned_by(quaternions: Array, vectors: Array) -> Array:
    """Unit quaternions (n, 4) turned further by rotation vectors (n, 3), base frame."""
    angle = np.sqrt(np.einsum("ni,ni->n", vectors, vectors))
    factor = 0.5 * np.sinc(angle / (2.0 * np.pi))
    w, x, y, z = quaternions.T
    c = np.cos(0.5 * angle)
    a, b, d = (factor[:, None] * vectors).T
    return np.stack(
        [c * w - a * x - b * y - d * z, c * x + a * w + b * z - d * y,
         c * y + b * w + d * x - a * z, c * z + d * w + a * y - b * x],
        axis=1,
    )  # fmt: skip


def rotation_vectors(quaternions: Array) -> Array:
    """(n, 3) rotation vectors of quaternions (n, 4) with a positive real part."""
    imaginary = quaternions[:, 1:]
    sine = np.sqrt(np.einsum("ni,ni->n", imaginary, imaginary))
    half = np.arctan2(sine, quaternions[:, 0])
    # For the smallest rotations 2 half / sine is 2 / w to rounding, and 0 / 0 is avoided.
    tiny = sine < 1e-150
    factor = np.where(tiny, 2.0 / quaternions[:, 0], 2.0 * half / np.where(tiny, 1.0, sine))
    return imaginary * factor[:, None]


def sensitivity(placements: Array, base: Array, platform: Array, strokes: Array) -> Array:
    """(n, 6, 51) sensitivity of the pose to base joints, platform joints, offsets, scales and tool.

    Analytic: -W^-1 dg/dp with g = |p + R (b - t) - a| - (scale q + offset). Geometry and strokes
    are the nominal (6, 3), (6, 3) and the commanded (n, 6).
    """
    count = len(placements)
    rotations = rotation_matrices(placements[:, 3:])
    arms = platform @ rotations.transpose(0, 2, 1)
    struts = placements[:, None, :3] + arms - base
    units = struts / np.sqrt(np.einsum("nij,nij->ni", struts, struts))[..., None]
    inverse = np.linalg.inv(closure_pose_rows(arms, units))
    result = np.empty((count, 6, 51))
    by_strut = inverse[..., None]
    result[:, :, :18] = (by_strut * units[:, None]).reshape(count, 6, 18)
    result[:, :, 18:36] = (by_strut * -(units @ rotations)[:, None]).reshape(count, 6, 18)
    result[:, :, 36:42] = inverse
    result[:, :, 42:48] = inverse * strokes[:, None]
    # Moving the tool point in the platform moves nothing but the point itself.
    result[:, :3, 48:] = rotations
    result[:, 3:, 48:] = 0.0
    return result
