"""A hexapod's forward kinematics in Numba: Newton pose by pose, as loops, compiled for this CPU.

The same equations and units as in `numpy_hexapod`, the six by six systems by elimination with
pivots. Numba is needed (`requirements-peers.txt`).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from benchmarks.numpy_hexapod import LAST_STEP, MAX_STEPS, Array

N_STRUT = 6


def displacement(placements: Array, base: Array, platform: Array, lengths: Array) -> Array:
    """(n, 6) displacement of tool point and rotation vector from `placements` (n, 7).

    Geometry (n, 6, 3), (n, 6, 3) and strut lengths (n, 6), m.
    """
    return _displacements(placements, base, platform, lengths)


@njit(cache=False)
def _rotated(w, x, y, z, vector, result):
    s = 2.0 / (w * w + x * x + y * y + z * z)
    a, b, c = vector
    result[0] = (1 - s * (y * y + z * z)) * a + s * (x * y - w * z) * b + s * (x * z + w * y) * c
    result[1] = s * (x * y + w * z) * a + (1 - s * (x * x + z * z)) * b + s * (y * z - w * x) * c
    result[2] = s * (x * z - w * y) * a + s * (y * z + w * x) * b + (1 - s * (x * x + y * y)) * c


@njit(cache=False)
def _solved(rows, right):
    """Overwrites `right` with the solution."""
    for k in range(N_STRUT):
        pivot = k
        for i in range(k + 1, N_STRUT):
            if abs(rows[i, k]) > abs(rows[pivot, k]):
                pivot = i
        if pivot != k:
            for j in range(k, N_STRUT):
                rows[k, j], rows[pivot, j] = rows[pivot, j], rows[k, j]
            right[k], right[pivot] = right[pivot], right[k]
        inverse = 1.0 / rows[k, k]
        for i in range(k + 1, N_STRUT):
            factor = rows[i, k] * inverse
            for j in range(k + 1, N_STRUT):
                rows[i, j] -= factor * rows[k, j]
            right[i] -= factor * right[k]
    for k in range(N_STRUT - 1, -1, -1):
        total = right[k]
        for j in range(k + 1, N_STRUT):
            total -= rows[k, j] * right[j]
        right[k] = total / rows[k, k]


@njit(cache=False)
def _displacements(placements, base, platform, lengths):
    result = np.empty((len(placements), 6))
    rows, step = np.empty((N_STRUT, 6)), np.empty(6)
    arms, arm = np.empty((N_STRUT, 3)), np.empty(3)
    for n in range(len(placements)):
        px, py, pz, w, x, y, z = placements[n]
        size = 0.0
        for i in range(N_STRUT):
            _rotated(w, x, y, z, platform[n, i], arms[i])
            size += lengths[n, i] ** 2
        size = np.sqrt(size / N_STRUT)
        sx, sy, sz = 0.0, 0.0, 0.0
        tw, tx, ty, tz = 1.0, 0.0, 0.0, 0.0
        for _ in range(MAX_STEPS):
            for i in range(N_STRUT):
                _rotated(tw, tx, ty, tz, arms[i], arm)
                dx = px - base[n, i, 0] + sx + arm[0]
                dy = py - base[n, i, 1] + sy + arm[1]
                dz = pz - base[n, i, 2] + sz + arm[2]
                rows[i, 0], rows[i, 1], rows[i, 2] = dx, dy, dz
                rows[i, 3] = arm[1] * dz - arm[2] * dy
                rows[i, 4] = arm[2] * dx - arm[0] * dz
                rows[i, 5] = arm[0] * dy - arm[1] * dx
                step[i] = 0.5 * (lengths[n, i] ** 2 - (dx * dx + dy * dy + dz * dz))
            _solved(rows, step)
            sx, sy, sz = sx + step[0], sy + step[1], sz + step[2]
            a, b, c = 0.5 * step[3], 0.5 * step[4], 0.5 * step[5]
            tw, tx, ty, tz = (
                tw - a * tx - b * ty - c * tz,
                tx + a * tw + b * tz - c * ty,
                ty + b * tw + c * tx - a * tz,
                tz + c * tw + a * ty - b * tx,
            )
            moved = max(abs(step[0]), abs(step[1]), abs(step[2])) / size
            if max(moved, abs(step[3]), abs(step[4]), abs(step[5])) < LAST_STEP:
                break
        sine = np.sqrt(tx * tx + ty * ty + tz * tz)
        factor = 2.0 / tw if sine < 1e-150 else 2.0 * np.arctan2(sine, tw) / sine
        result[n, 0], result[n, 1], result[n, 2] = sx, sy, sz
        result[n, 3], result[n, 4], result[n, 5] = tx * factor, ty * factor, tz * factor
    return result
