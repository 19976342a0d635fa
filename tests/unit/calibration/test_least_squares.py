"""The solver of nonlinear least squares: optimum, scaling, rank, status, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize

from truepose.calibration import Tolerances, covariance, least_squares

Array = NDArray[np.float64]


def rosenbrock(x: Array) -> Array:
    return np.array([10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]])


def rosenbrock_slope(x: Array) -> Array:
    return np.array([[-20.0 * x[0], 10.0], [-1.0, 0.0]])


def linear(seed: int, m: int, n: int) -> tuple[Array, Array]:
    generator = np.random.default_rng(seed)
    return generator.normal(size=(m, n)), generator.normal(size=m)


def test_a_curved_valley() -> None:
    found = least_squares(rosenbrock, rosenbrock_slope, [-1.2, 1.0])
    assert found.converged
    assert np.abs(found.values - 1.0).max() < 1e-12
    assert found.cost < 1e-24


@pytest.mark.parametrize("seed", range(3))
def test_a_linear_problem_is_solved_as_linear_algebra_does(seed: int) -> None:
    matrix, right = linear(seed, 30, 6)
    weights = np.random.default_rng(seed + 100).uniform(0.1, 10.0, 30)
    found = least_squares(
        lambda x: matrix @ x - right, lambda x: matrix, np.zeros(6), weights=weights
    )
    expected = np.linalg.lstsq(weights[:, None] * matrix, weights * right, rcond=None)[0]
    assert np.abs(found.values - expected).max() < 1e-12
    assert np.allclose(found.residual, weights * (matrix @ expected - right), atol=1e-12)
    assert found.cost == pytest.approx(float(np.sum(found.residual**2)), rel=1e-14)
    # And what the values are worth, against the normal equations.
    normal = np.linalg.inv((weights[:, None] * matrix).T @ (weights[:, None] * matrix))
    assert np.allclose(covariance(found.jacobian, 0.25)[0], 0.25 * normal, rtol=1e-10)


@pytest.mark.parametrize("seed", range(5))
def test_scipy_finds_the_same_optimum(seed: int) -> None:
    # Circles of unequal centre and radius seen from noisy points: nonlinear, residual not zero.
    generator = np.random.default_rng(seed)
    angle = generator.uniform(0.0, 2.0 * np.pi, 40)
    centre, radius = generator.uniform(-5.0, 5.0, 2), generator.uniform(1.0, 3.0)
    x = centre[0] + radius * np.cos(angle) + generator.normal(0.0, 0.1, 40)
    y = centre[1] + radius * np.sin(angle) + generator.normal(0.0, 0.1, 40)

    def residual(p: Array) -> Array:
        return np.hypot(x - p[0], y - p[1]) - p[2]

    def slope(p: Array) -> Array:
        away = np.hypot(x - p[0], y - p[1])
        return np.stack([(p[0] - x) / away, (p[1] - y) / away, -np.ones(40)], axis=1)

    start = np.array([x.mean() + 2.0, y.mean() - 1.0, 1.0])
    found = least_squares(residual, slope, start)
    other = optimize.least_squares(residual, start, slope, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    # SciPy stops somewhat earlier: it leaves 1e-7 of the gradient, this solver 1e-12 of it.
    assert np.abs(found.jacobian.T @ found.residual).max() < 1e-11
    assert np.abs(found.values - other.x).max() < 1e-8
    assert found.cost == pytest.approx(2.0 * other.cost, rel=1e-9)


def test_units_of_the_values_do_not_matter() -> None:
    scale = np.array([1e9, 1e-7])
    found = least_squares(
        lambda x: rosenbrock(x / scale),
        lambda x: rosenbrock_slope(x / scale) / scale,
        np.array([-1.2, 1.0]) * scale,
    )
    plain = least_squares(rosenbrock, rosenbrock_slope, [-1.2, 1.0])
    assert np.abs(found.values / scale - plain.values).max() < 1e-12
    assert found.iterations == plain.iterations


def test_directions_that_no_equation_sees_stay() -> None:
    # Only the sum of the first two counts; the third is seen by nothing.
    def residual(x: Array) -> Array:
        return np.array([x[0] + x[1] - 3.0, 2.0 * (x[0] + x[1]) - 6.0, 0.0])

    def slope(x: Array) -> Array:
        return np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 0.0]])

    found = least_squares(residual, slope, [0.0, 1.0, 7.0])
    assert found.converged
    assert found.values[2] == 7.0
    assert np.abs(found.values[:2] - [1.0, 2.0]).max() < 1e-12  # the least step
    spread, free = covariance(found.jacobian)
    assert len(free) == 2
    # The variance of the sum, which alone is told, is 1 / (1 + 4).
    assert np.array([1.0, 1.0, 0.0]) @ spread @ np.array([1.0, 1.0, 0.0]) == pytest.approx(0.2)
    assert np.abs(free @ np.array([1.0, 1.0, 0.0])).max() < 1e-12


def test_fewer_equations_than_unknowns() -> None:
    found = least_squares(lambda x: x[:1] ** 2 + x[1:2] - 2.0, lambda x: [[2 * x[0], 1.0]], [1, 5])
    assert found.cost < 1e-24
    _, free = covariance(found.jacobian)
    assert free.shape == (1, 2)


def test_a_step_out_of_reach_is_shortened() -> None:
    # The root of x - 3 must be stepped back from: the model exists below x = 1 only.
    def residual(x: Array) -> Array:
        return np.array([np.log(1.0 - x[0]) + 4.0])

    found = least_squares(residual, lambda x: np.array([[-1.0 / (1.0 - x[0])]]), [-50.0])
    assert found.converged
    assert found.values[0] == pytest.approx(1.0 - np.exp(-4.0), abs=1e-12)


def test_it_starts_at_the_solution() -> None:
    found = least_squares(rosenbrock, rosenbrock_slope, [1.0, 1.0])
    assert found.status == "gradient"
    assert found.iterations == 0
    assert found.evaluations == 1


@pytest.mark.parametrize(
    ("residual", "wrong", "start"),
    [
        (rosenbrock, lambda x: -rosenbrock_slope(x), [-1.2, 1.0]),
        (lambda x: x - 1.0, lambda x: -np.eye(2), [3.0, 2.0]),
    ],
)
def test_a_wrong_jacobian_stalls_and_says_so(residual, wrong, start: list[float]) -> None:
    found = least_squares(residual, wrong, start)
    assert found.status == "stalled"
    assert not found.converged
    assert found.cost == pytest.approx(float(np.sum(residual(np.array(start)) ** 2)))


def test_a_jacobian_that_ends_is_not_gone_to() -> None:
    # Its derivatives are known at the start only.
    found = least_squares(
        lambda x: np.array([x[0] ** 2 - 1.0, 0.0]),
        lambda x: np.array([[2.0 * x[0] if x[0] == 3.0 else np.nan], [0.0]]),
        [3.0],
    )
    assert found.status == "stalled"
    assert found.values == pytest.approx([3.0])
    assert np.isfinite(found.jacobian).all()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("start", [[1.0], [1.0, -2.0], [-30.0]])
def test_a_minimum_at_infinity_ends(start: list[float]) -> None:
    found = least_squares(lambda x: np.exp(-x), lambda x: -np.diag(np.exp(-x)), start)
    assert found.values.min() > 300.0
    assert found.cost < 1e-200


def test_evaluations_are_counted_and_limited() -> None:
    calls = []

    def counted(x: Array) -> Array:
        calls.append(x)
        return rosenbrock(x)

    found = least_squares(counted, rosenbrock_slope, [-1.2, 1.0], most_evaluations=5)
    assert found.status == "exhausted"
    assert not found.converged
    assert found.evaluations == len(calls) == 5


@pytest.mark.parametrize("scale", [None, [1e-3, 1e-3]])
def test_a_root_of_rounding_ends(scale: list[float] | None) -> None:
    # Small differences of large numbers, of unknowns that are nothing at the root.
    generator = np.random.default_rng(1)
    matrix, large = generator.normal(size=(40, 2)), generator.normal(0.0, 1e3, 40)

    def residual(x: Array) -> Array:
        return np.hypot(large + matrix @ x, 1.0) - np.hypot(large, 1.0)

    def slope(x: Array) -> Array:
        moved = large + matrix @ x
        return (moved / np.hypot(moved, 1.0))[:, None] * matrix

    for start in generator.normal(0.0, 1e-3, (5, 2)):
        found = least_squares(residual, slope, start, scale=scale)
        assert found.converged
        assert found.evaluations < 300
        assert np.abs(found.values).max() < 1e-12


@pytest.mark.parametrize("where", [0, 3])
@pytest.mark.parametrize("which", [0, 1])
def test_what_a_callback_raises_is_passed_on(which: int, where: int) -> None:
    calls = []

    def broken(x: Array) -> Array:
        calls.append(x)
        if len(calls) > where:
            raise KeyError("gone")
        return (rosenbrock, rosenbrock_slope)[which](x)

    functions = [rosenbrock, rosenbrock_slope]
    functions[which] = broken
    with pytest.raises(KeyError, match="gone"):
        least_squares(*functions, [-1.2, 1.0])
    assert len(calls) == where + 1


def test_a_given_scale_holds_the_trust_region() -> None:
    # With a tiny scale on the first value it can hardly move in the first step.
    seen: list[Array] = []

    def residual(x: Array) -> Array:
        seen.append(x.copy())
        return np.array([x[0] - 1.0, x[1] - 1.0])

    least_squares(residual, lambda x: np.eye(2), [0.5, 0.5], scale=[1e-3, 1.0], first_radius=1e-3)
    assert abs(seen[1][0] - 0.5) < 0.01 * abs(seen[1][1] - 0.5)


def test_looser_tolerances_stop_earlier() -> None:
    def residual(x: Array) -> Array:
        return np.append(rosenbrock(x), x[1] - 3.0)  # the optimum is not zero

    def slope(x: Array) -> Array:
        return np.vstack([rosenbrock_slope(x), [0.0, 1.0]])

    tight = least_squares(residual, slope, [-1.2, 1.0])
    loose = least_squares(residual, slope, [-1.2, 1.0], tolerances=Tolerances(gradient=1e-3))
    assert loose.status == "gradient"
    assert loose.evaluations < tight.evaluations
    assert np.abs(loose.values - tight.values).max() < 1e-2


@pytest.mark.parametrize(
    ("residual", "slope", "weights", "scale", "words"),
    [
        (lambda x: np.array([np.nan]), lambda x: np.eye(1), None, None, "not finite"),
        (lambda x: x, lambda x: np.array([[np.inf]]), None, None, "not finite"),
        (lambda x: np.eye(2), lambda x: np.eye(1), None, None, "residual has shape"),
        (lambda x: x, lambda x: np.eye(2), None, None, "Jacobian has shape"),
        (lambda x: x, lambda x: np.eye(1), [1.0, 2.0], None, "weights"),
        (lambda x: x, lambda x: np.eye(1), [-1.0], None, "weights"),
        (lambda x: x, lambda x: np.eye(1), None, [-1.0], "scale"),
        (lambda x: x, lambda x: np.eye(1), None, [0.0], "scale"),
        (lambda x: x, lambda x: np.eye(1), None, [np.inf], "scale"),
        (lambda x: x, lambda x: np.eye(1), None, [1.0, 1.0], "scale"),
    ],
)
def test_what_contradicts_itself_is_refused(residual, slope, weights, scale, words) -> None:
    with pytest.raises(ValueError, match=words):
        least_squares(residual, slope, [1.0], weights=weights, scale=scale)


@pytest.mark.parametrize("radius", [0.0, -1.0, np.nan, np.inf])
def test_a_trust_region_has_a_size(radius: float) -> None:
    with pytest.raises(ValueError, match="radius"):
        least_squares(rosenbrock, rosenbrock_slope, [-1.2, 1.0], first_radius=radius)


def test_a_covariance_wants_a_matrix() -> None:
    with pytest.raises(ValueError, match="Jacobian"):
        covariance([1.0, 2.0])
    with pytest.raises(ValueError, match="not finite"):
        covariance([[1.0, np.nan], [0.0, 1.0]])
    with pytest.raises(ValueError, match="variance"):
        covariance(np.eye(2), -1.0)
