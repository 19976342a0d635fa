"""Shapes through points: minimum zones by hulls and linear programmes, and least squares.

A minimum zone of a wall is the least width of a convex hull, which an edge of it gives. That of a
face or a circle is a sequence of linear programmes, each about where the last one ended; the points
that hold the last one are solved for exactly, since a programme's own tolerance is too coarse. What
is returned is measured at the points, about the place that was found.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog  # type: ignore[import-untyped]
from scipy.spatial import ConvexHull  # type: ignore[import-untyped]

Floats = NDArray[np.float64]

STEPS = 12
STILL = 1e-13
"""Of the size of the points: a step that is none."""


def zone_of_wall(points: Floats) -> tuple[float, Floats]:
    """Least width of points (n, 2), and the normal (2,) of the zone."""
    centred = points - points.mean(axis=0)
    _, _, ways = np.linalg.svd(centred, full_matrices=False)
    turned = centred @ ways.T
    flat = float(np.ptp(turned[:, 1]))
    if flat < STILL * float(np.ptp(turned[:, 0])):
        return flat, ways[1]
    # A hull does not care how thin it is: across the wall it is stretched.
    stretched = turned * [1.0 / np.ptp(turned[:, 0]), 1.0 / flat]
    hull = ConvexHull(stretched)
    best = (np.inf, ways[1])
    for first, second in hull.simplices:
        edge = turned[second] - turned[first]
        normal = np.array([-edge[1], edge[0]]) / np.hypot(*edge)
        width = float(np.ptp(turned @ normal))
        best = min(best, (width, normal @ ways), key=lambda one: one[0])
    return best


def zone_of_face(points: Floats) -> tuple[float, Floats]:
    """Least distance of two planes with points (n, 3) between them, and their normal (3,)."""
    centred = points - points.mean(axis=0)
    ways = np.linalg.svd(centred, full_matrices=False)[2]
    size = float(np.abs(centred).max())
    for _ in range(STEPS):
        s, t, height = (centred @ ways.T).T
        a, b = least_band(np.column_stack([s, t]) / size, height)
        normal = ways[2] - (a * ways[0] + b * ways[1]) / size
        normal /= np.linalg.norm(normal)
        ways = np.array([*_across(normal), normal])
        if max(abs(a), abs(b)) < STILL * size:
            break
    return float(np.ptp(centred @ normal)), normal


def zone_of_circle(points: Floats) -> tuple[float, Floats]:
    """Least difference of the radii of two circles about one centre with points (n, 2) between."""
    centre, _ = circle_of_least_squares(points)
    size = float(np.abs(points - centre).max())
    for _ in range(STEPS):
        spokes = points - centre
        radii = np.hypot(*spokes.T)
        step = least_band(spokes / radii[:, np.newaxis], radii)
        centre = centre + step
        if np.abs(step).max() < STILL * size:
            break
    return float(np.ptp(np.hypot(*(points - centre).T))), centre


def least_band(columns: Floats, values: Floats) -> Floats:
    """x (k,) of which values - columns x, (n, k), have the least range."""
    middle = 0.5 * (values.max() + values.min())
    ones = np.ones((len(values), 1))
    return least_largest(np.hstack([columns, ones]), values - middle)[:-1]


def least_largest(columns: Floats, values: Floats, trust: float | None = None) -> Floats:
    """x (k,) of which values - columns x, (n, k), have the least largest size.

    `trust`: no x may be larger; it is not solved for exactly then.
    """
    k, size = columns.shape[1], float(np.abs(values).max())
    if size == 0.0:
        return np.zeros(k)
    scaled = values / size
    ones = np.ones((len(values), 1))
    rows = np.vstack([np.hstack([columns, -ones]), np.hstack([-columns, -ones])])
    right = np.r_[scaled, -scaled]
    most = None if trust is None else trust / size
    bounds = [(None if most is None else -most, most)] * k + [(0.0, None)]
    found = linprog(
        np.r_[np.zeros(k), 1.0], A_ub=rows, b_ub=right, bounds=bounds, method="highs-ds"
    )
    # |columns x - scaled| <= h: those with a price hold it, and are solved for exactly.
    price = -found.ineqlin.marginals
    held = np.argsort(-price)[: k + 1]
    exact = found.x
    if trust is None and price[held].min() > 0.0:
        exact = np.linalg.solve(rows[held], right[held])
    return np.asarray(exact[:k] * size)


def wall_of_least_squares(points: Floats) -> Floats:
    """(2,) or (3,) unit normal of the line or plane through points: orthogonal least squares."""
    centred = points - points.mean(axis=0)
    return np.linalg.svd(centred, full_matrices=False)[2][-1]


def circle_of_least_squares(points: Floats) -> tuple[Floats, float]:
    """Centre (2,) and radius of the geometric least-squares circle of points (n, 2)."""
    middle = points.mean(axis=0)
    about = points - middle
    # Begun at the algebraic one: x^2 + y^2 = 2 a x + 2 b y + c.
    rows = np.column_stack([2.0 * about, np.ones(len(points))])
    a, b, c = np.linalg.lstsq(rows, (about**2).sum(axis=1), rcond=None)[0]
    place = np.array([a, b, np.sqrt(c + a * a + b * b)])
    for _ in range(50):
        spokes = about - place[:2]
        radii = np.hypot(*spokes.T)
        rows = np.column_stack([spokes / radii[:, np.newaxis], np.ones(len(points))])
        step = np.linalg.lstsq(rows, radii - place[2], rcond=None)[0]
        place = place + step
        if np.abs(step).max() < STILL * place[2]:
            break
    return middle + place[:2], float(place[2])


def _across(normal: Floats) -> Floats:
    first = np.eye(3)[np.abs(normal).argmin()]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(normal, first)])
