"""Minimum zones: sets whose zone is known by construction, and a linear programme as an oracle."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.optimize

from truepose.arrays import Floats
from truepose.workpiece.fits import (
    AnyPlane,
    CircleInPlane,
    Contour,
    FittedShape,
    TurnedPlane,
    associate,
)

W = np.array([[0.0, 0.0, 1.0]])
ZONE = 2e-5
COUNT = 360


def _turned(points: Floats, angle: float, shift: tuple[float, float, float]) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    return points @ rotation.T + shift


def _spread(shape: FittedShape, points: Floats) -> float:
    return float(np.ptp(associate(shape, points[np.newaxis])[1]))


@pytest.mark.parametrize("seed", range(20))
def test_a_line_touched_on_alternate_sides(seed: int) -> None:
    """Upper, lower, upper in their order along the line: no narrower pair of lines holds them."""
    rng = np.random.default_rng(seed)
    along = np.sort(rng.uniform(-0.05, 0.05, COUNT))
    across = rng.uniform(-0.499, 0.499, COUNT) * ZONE
    first, middle, last = np.sort(rng.choice(COUNT, 3, replace=False))
    side = rng.choice([-1.0, 1.0])
    across[[first, middle, last]] = side * np.array([0.5, -0.5, 0.5]) * ZONE
    # Turned by little against the size: the nominal line is where the fit starts from.
    points = _turned(
        np.column_stack([along, across, 0 * along]), rng.uniform(-0.01, 0.01), (1, 2, 0)
    )
    shape = TurnedPlane(np.array([[0.0, 1.0, 0.0]]), W, 0.1)
    assert _spread(shape, points - points.mean(axis=0)) == pytest.approx(ZONE, abs=1e-15)


@pytest.mark.parametrize("seed", range(20))
def test_a_circle_touched_in_and_out_by_turns(seed: int) -> None:
    """Two points on the outer circle, two on the inner, by turns round the centre."""
    rng = np.random.default_rng(seed)
    radius = 0.02
    angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, COUNT))
    off = rng.uniform(-0.499, 0.499, COUNT) * ZONE
    touching = np.sort(rng.choice(COUNT, 4, replace=False))
    off[touching] = np.array([0.5, -0.5, 0.5, -0.5]) * ZONE
    rows = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = rows * (radius + off)[:, np.newaxis] + [1e-4, -2e-4, 0.0]
    shape = CircleInPlane(np.zeros((1, 2)))
    fitted, radii = associate(shape, points[np.newaxis])
    assert np.ptp(radii) == pytest.approx(ZONE, abs=1e-15)
    np.testing.assert_allclose(fitted.centre, [[1e-4, -2e-4]], rtol=0, atol=1e-12)


@pytest.mark.parametrize("seed", range(20))
def test_a_plane_touched_inside_a_triangle(seed: int) -> None:
    """Three points on one side about one on the other."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(-0.05, 0.05, (COUNT, 2))
    corners = np.array([[-0.04, -0.03], [0.045, -0.02], [0.0, 0.04]]) + rng.normal(0, 1e-3, (3, 2))
    share = rng.dirichlet(np.ones(3))
    places[:4] = [*corners, share @ corners]
    off = rng.uniform(-0.499, 0.499, COUNT) * ZONE
    off[:4] = np.array([0.5, 0.5, 0.5, -0.5]) * rng.choice([-1.0, 1.0]) * ZONE
    points = np.column_stack([places, off])
    axis = rng.normal(size=3)
    tilt = 1e-3 * axis / np.linalg.norm(axis)
    rotation = scipy.spatial.transform.Rotation.from_rotvec(tilt).as_matrix()
    assert _spread(AnyPlane(W, 0.1), points @ rotation.T) == pytest.approx(ZONE, abs=1e-15)


def _programme(columns: Floats, values: Floats) -> float:
    """Twice the smallest largest residual, of columns (k, n), by linear programming."""
    size = np.abs(values).max() or 1.0
    count = len(values)
    rows = np.column_stack([columns.T, -np.ones(count)])
    mirrored = np.column_stack([-columns.T, -np.ones(count)])
    solution = scipy.optimize.linprog(
        [*np.zeros(len(columns)), 1.0],
        A_ub=np.concatenate([rows, mirrored]),
        b_ub=np.concatenate([values, -values]) / size,
        bounds=[(None, None)] * len(columns) + [(0.0, None)],
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    assert solution.success
    return float(2.0 * size * solution.fun)


def _shapes(count: int) -> dict[str, tuple[FittedShape, Floats]]:
    """A shape for each of `count` samples, and its nominal points."""
    angles = 2.0 * np.pi * np.arange(90) / 90
    circle = np.column_stack([0.02 * np.cos(angles), 0.02 * np.sin(angles), 0 * angles])
    grid = np.stack(np.meshgrid(np.linspace(0, 0.1, 9), np.linspace(0, 0.05, 7)), -1).reshape(-1, 2)
    oval = circle[:, :2] * [1.0, 1.5]
    normals = oval * [1.5, 1 / 1.5]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    many = np.tile(W, (count, 1))
    line = np.column_stack([np.linspace(-0.05, 0.05, 40), np.zeros((40, 2))])
    still = (np.zeros((count, 1)), np.zeros((count, 2)))
    return {
        "line": (TurnedPlane(np.tile([0.0, 1.0, 0.0], (count, 1)), many, 0.1), line),
        "circle": (CircleInPlane(np.zeros((count, 2))), circle),
        "half circle": (CircleInPlane(np.zeros((count, 2))), circle[:46]),
        "closed circle": (CircleInPlane(np.zeros((count, 2))), circle[[*range(90), 0]]),
        "grid": (AnyPlane(many, 0.1), np.column_stack([grid, np.zeros(len(grid))])),
        "contour": (
            Contour(oval, normals, 0.06, np.eye(3), *still),
            np.column_stack([oval, 0 * angles]),
        ),
    }


@pytest.mark.parametrize("name", _shapes(1))
@pytest.mark.parametrize("kind", ["normal", "steps", "one", "signs"])
def test_no_zone_is_narrower(name: str, kind: str) -> None:
    rng = np.random.default_rng(7)
    shape, nominal = _shapes(30)[name]
    size = (30, *nominal.shape)
    errors = {
        "normal": lambda: rng.standard_normal(size),
        "steps": lambda: rng.integers(-2, 3, size).astype(float),
        "one": lambda: rng.standard_normal(size) * (rng.uniform(size=(*size[:2], 1)) < 0.03),
        "signs": lambda: rng.choice([-1.0, 1.0], size),
    }[kind]()
    points = nominal + 1e-5 * errors
    fitted, residuals = associate(shape, points)
    columns, values = fitted.linearised(points)
    width = 2.0 * np.abs(residuals).max(axis=1)
    if fitted.offset:
        columns = np.concatenate([columns, np.ones((1, *values.shape))])
        values = values - values.mean(axis=1, keepdims=True)
        width = np.ptp(residuals, axis=1)
    best = [_programme(columns[:, s], values[s]) for s in range(len(values))]
    np.testing.assert_allclose(width, best, rtol=1e-8, atol=1e-15)


@pytest.mark.parametrize("name", _shapes(1))
def test_least_squares_are_stationary(name: str) -> None:
    """The residuals are orthogonal to every column: no step makes their squares less."""
    rng = np.random.default_rng(3)
    shape, nominal = _shapes(50)[name]
    points = nominal + 1e-4 * rng.standard_normal((50, *nominal.shape))
    fitted, residuals = associate(shape, points, least_squares=True)
    columns, values = fitted.linearised(points)
    if fitted.offset:
        values = values - values.mean(axis=1, keepdims=True)
    assert np.abs(np.einsum("ksn,sn->ks", columns, values)).max() < 1e-12 * len(nominal)
    assert residuals.shape == values.shape


def test_samples_are_independent() -> None:
    """Each of more samples than are taken at once has what it has alone, to the last digit."""
    rng = np.random.default_rng(11)
    shape, nominal = _shapes(1201)["circle"]
    points = nominal + 1e-5 * rng.standard_normal((1201, *nominal.shape))
    together = np.ptp(associate(shape, points)[1], axis=1)
    for sample in (0, 499, 500, 1200):
        one = _shapes(1)["circle"][0]
        alone = np.ptp(associate(one, points[sample : sample + 1])[1])
        assert alone == pytest.approx(together[sample], abs=1e-16)
