"""Sobol indices and Shapley shares of plain models whose own are known in closed form."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from truepose.probability.distributions import TWO_POINT, UNIFORM, Distribution, normal
from truepose.uncertainty_analysis import shapley, sobol
from truepose.uncertainty_analysis.random_points import Drawing

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

UNIT = normal(1.0)
SEED = 11


def drawing(distributions: list[Distribution], correlation: Floats | None = None) -> Drawing:
    count = len(distributions)
    zeros, numbers = np.zeros(count, np.intp), np.arange(count)
    return Drawing(distributions, correlation, zeros, numbers, [str(n) for n in numbers], SEED)


def single(count: int) -> list[NDArray[np.intp]]:
    return list(np.arange(count)[:, np.newaxis])


def sobol_of(
    evaluate: sobol.Evaluate,
    drawn: Drawing,
    effects: Floats,
    *,
    sets: list[NDArray[np.intp]] | None = None,
    samples: int = 1 << 14,
    confidence: float = 0.99,
    floor: float = 1e-12,
) -> sobol.SobolIndices:
    return sobol.indices(
        evaluate,
        drawn,
        single(len(effects)) if sets is None else sets,
        effects,
        samples=samples,
        seed=SEED,
        confidence=confidence,
        floor=np.full(effects.shape[1], floor),
    )


def shapley_of(
    evaluate: sobol.Evaluate, drawn: Drawing, slopes: Floats, samples: int = 1 << 13
) -> shapley.ShapleyShares:
    return shapley.shares(
        evaluate,
        drawn,
        slopes,
        samples=samples,
        seed=SEED,
        confidence=0.99,
        floor=np.full(slopes.shape[1], 1e-12),
    )


def within(estimate: sobol.Estimate, wanted: Floats, widest: float) -> None:
    """The estimate is right within its half widths, and these are no wider than that."""
    assert (np.abs(estimate.share - wanted) <= estimate.half_width + 1e-9).all()
    assert (estimate.half_width <= widest).all()


def ishigami(t: Floats) -> tuple[Floats, Flags]:
    """a = 7, b = 0.1, on [-pi, pi] (Ishigami & Homma 1990)."""
    x, y, z = math.pi * t.T
    values = np.sin(x) + 7.0 * np.sin(y) ** 2 + 0.1 * z**4 * np.sin(x)
    return values[:, np.newaxis], np.ones(len(t), np.bool_)


PI4 = math.pi**4
V1, V2, V13 = 0.5 * (1 + 0.1 * PI4 / 5) ** 2, 49 / 8, 0.01 * PI4**2 * (1 / 18 - 1 / 50)
ISHIGAMI_FIRST = np.array([[V1], [V2], [0.0]]) / (V1 + V2 + V13)
ISHIGAMI_TOTAL = np.array([[V1 + V13], [V2], [V13]]) / (V1 + V2 + V13)
ISHIGAMI_SHAPLEY = 0.5 * (ISHIGAMI_FIRST + ISHIGAMI_TOTAL)
# First-order change with the coordinates: x is the only one that is not level at the centre.
ISHIGAMI_EFFECTS = np.array([[math.pi], [0.0], [0.0]]) / math.sqrt(3)


def test_ishigami_against_the_closed_form() -> None:
    drawn = drawing([UNIFORM] * 3)
    found = sobol_of(ishigami, drawn, ISHIGAMI_EFFECTS, samples=1 << 15)
    within(found.first, ISHIGAMI_FIRST, 0.02)
    within(found.total, ISHIGAMI_TOTAL, 0.025)
    assert found.variance == pytest.approx([V1 + V2 + V13], rel=0.02)
    assert found.points == (1 << 15) * 5
    assert found.failed == 0
    divided = shapley_of(ishigami, drawn, found.slopes, 1 << 14)
    within(divided.shares, ISHIGAMI_SHAPLEY, 0.03)
    assert divided.shares.share.sum() == pytest.approx(1.0, abs=1e-12)
    assert divided.points == (1 << 14) * 4


def test_sets_are_exchanged_as_a_whole() -> None:
    sets = [np.array([0, 2]), np.array([1]), np.array([0, 1, 2])]
    found = sobol_of(ishigami, drawing([UNIFORM] * 3), ISHIGAMI_EFFECTS, sets=sets)
    whole = V1 + V2 + V13
    wanted = np.array([[(V1 + V13) / whole], [V2 / whole], [1.0]])
    within(found.first, wanted, 0.04)
    within(found.total, wanted, 0.03)


def test_the_confidence_intervals_hold_what_they_say() -> None:
    """Over many seeds, 90 % intervals hold the truth about 90 times of 100."""
    inside = []
    for seed in range(60):
        drawn = Drawing([UNIFORM] * 3, None, np.zeros(3, np.intp), np.arange(3), "xyz", seed)
        found = sobol.indices(
            ishigami,
            drawn,
            single(3),
            ISHIGAMI_EFFECTS,
            samples=512,
            seed=seed,
            confidence=0.9,
            floor=np.zeros(1),
        )
        inside.append(np.abs(found.first.share - ISHIGAMI_FIRST) <= found.first.half_width)
        inside.append(np.abs(found.total.share - ISHIGAMI_TOTAL) <= found.total.half_width)
    # 360 of which three each hang together: 90 % +- 6 %.
    assert 0.84 <= np.mean(inside) <= 0.96


# Three variables of one block, two of another, one alone; two outputs.
BLOCKS = np.eye(6)
BLOCKS[:3, :3] = [[1.0, 0.7, -0.2], [0.7, 1.0, 0.4], [-0.2, 0.4, 1.0]]
BLOCKS[3, 4] = BLOCKS[4, 3] = -0.8
SLOPES = np.array([[1.0, 0.5, -1.0, 2.0, 1.5, 0.7], [0.0, 1.0, 1.0, 0.0, 0.3, -2.0]]).T


def linear(t: Floats) -> tuple[Floats, Flags]:
    return 3.0 + t @ SLOPES, np.ones(len(t), np.bool_)


def explained(given: NDArray[np.intp], correlation: Floats = BLOCKS) -> Floats:
    """(m,) variance of the linear model's mean given some variables, by least squares."""
    if not given.size:
        return np.zeros(2)
    known = correlation[np.ix_(given, given)]
    cross = correlation[given] @ SLOPES
    return np.einsum("gm,gm->m", cross, np.linalg.lstsq(known, cross, rcond=1e-10)[0])


def linear_indices(sets: list[NDArray[np.intp]]) -> tuple[Floats, Floats]:
    whole = explained(np.arange(6))
    others = [np.setdiff1d(np.arange(6), members) for members in sets]
    first = np.array([explained(members) for members in sets]) / whole
    total = 1.0 - np.array([explained(members) for members in others]) / whole
    return first, total


def linear_shapley(correlation: Floats = BLOCKS) -> Floats:
    """Over every order, one after the other."""
    parts = np.zeros((6, 2))
    for order in itertools.permutations(range(6)):
        before = np.zeros(2)
        for place, variable in enumerate(order):
            after = explained(np.array(order[: place + 1]), correlation)
            parts[variable] += after - before
            before = after
    return parts / parts.sum(axis=0)


@pytest.mark.parametrize("known", [True, False], ids=["slopes known", "slopes not known"])
def test_correlated_variables_of_a_linear_model(known: bool) -> None:
    """Exact where the first-order effects are given, else within the intervals."""
    drawn = drawing([UNIT] * 6, BLOCKS)
    effects = SLOPES if known else np.zeros_like(SLOPES)
    sets = [*single(6), np.array([0, 4]), np.array([0, 1, 2]), np.array([1, 5])]
    first, total = linear_indices(sets)
    found = sobol_of(linear, drawn, effects, sets=sets)
    within(found.first, first, 1e-9 if known else 0.08)
    within(found.total, total, 1e-9 if known else 0.03)
    divided = shapley_of(linear, drawn, effects)
    within(divided.shares, linear_shapley(), 1e-9 if known else 0.05)


def test_shapley_shares_of_two_in_closed_form() -> None:
    """Owen & Prieur (2017), section 5: two correlated normal variables."""
    for rho, one, other in itertools.product((-0.9, 0.3, 1.0), (0.5, 1.0), (-0.5, 2.0)):
        latent = np.array([[1.0, rho], [rho, 1.0]])
        slopes = np.array([[one], [other]])
        variance = one**2 + 2 * rho * one * other + other**2
        wanted = one**2 * (1 - rho**2 / 2) + rho * one * other + other**2 * rho**2 / 2
        found = shapley.linear_shares(drawing([UNIT] * 2, latent), slopes, 0)
        assert found[0, 0] == pytest.approx(wanted, abs=1e-12)
        assert found.sum() == pytest.approx(variance, abs=1e-12)


def test_shapley_shares_of_many_are_the_mean_over_orders(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawn = drawing([UNIT] * 6, BLOCKS)
    exact = shapley.linear_shares(drawn, SLOPES, 0)
    monkeypatch.setattr(shapley, "SUBSETS", 1)
    drawn_orders = shapley.linear_shares(drawn, SLOPES, 0)
    assert drawn_orders.sum(axis=0) == pytest.approx(exact.sum(axis=0), rel=1e-12)
    assert drawn_orders == pytest.approx(exact, abs=0.05 * exact.sum(axis=0).max())


def test_a_product_of_two_correlated_variables() -> None:
    """V = 1 + r^2, Var E[xy | x] = 2 r^2, E Var[xy | y] = 1 - r^2; no linear part at all."""
    r = 0.6
    drawn = drawing([UNIT] * 2, np.array([[1.0, r], [r, 1.0]]))

    def product(t: Floats) -> tuple[Floats, Flags]:
        return (t[:, 0] * t[:, 1])[:, np.newaxis], np.ones(len(t), np.bool_)

    found = sobol_of(product, drawn, np.zeros((2, 1)), samples=1 << 16)
    within(found.first, np.full((2, 1), 2 * r**2 / (1 + r**2)), 0.04)
    within(found.total, np.full((2, 1), (1 - r**2) / (1 + r**2)), 0.03)
    within(shapley_of(product, drawn, np.zeros((2, 1)), 1 << 15).shares, np.full((2, 1), 0.5), 0.04)


def test_variables_that_are_one_share_alike() -> None:
    drawn = drawing([UNIT] * 2, np.ones((2, 2)))

    def both(t: Floats) -> tuple[Floats, Flags]:
        return t.sum(axis=1, keepdims=True), np.ones(len(t), np.bool_)

    effects = np.ones((2, 1))
    found = sobol_of(both, drawn, effects)
    assert found.first.share == pytest.approx(np.ones((2, 1)))
    assert found.total.share == pytest.approx(np.zeros((2, 1)), abs=1e-9)
    assert shapley_of(both, drawn, effects).shares.share == pytest.approx(np.full((2, 1), 0.5))


def test_an_output_that_does_not_vary_has_no_shares() -> None:
    def constant(t: Floats) -> tuple[Floats, Flags]:
        return np.stack([np.full(len(t), 0.1), t[:, 0]], axis=1), np.ones(len(t), np.bool_)

    effects = np.array([[0.0, 1.0 / math.sqrt(3)], [0.0, 0.0]])
    found = sobol_of(constant, drawing([UNIFORM] * 2), effects)
    for estimate in (found.first, found.total):
        assert np.isnan(estimate.share[:, 0]).all()
        assert np.isnan(estimate.half_width[:, 0]).all()
        assert estimate.share[:, 1] == pytest.approx([1.0, 0.0], abs=1e-12)
    assert found.variance == pytest.approx([0.0, 1.0 / 3.0])


def test_base_samples_that_fail_are_left_out_whole() -> None:
    def fails(t: Floats) -> tuple[Floats, Flags]:
        good = t[:, 0] < 0.8
        return np.where(good, t[:, 0] + t[:, 1], np.nan)[:, np.newaxis], good

    effects = np.ones((2, 1)) / math.sqrt(3)
    drawn = drawing([UNIFORM] * 2)
    found = sobol_of(fails, drawn, effects, samples=2000)
    # Both A and B of a base sample are good at 0.9 x 0.9.
    assert found.failed == pytest.approx(380, abs=60)
    assert np.isfinite(found.first.share).all()
    divided = shapley_of(fails, drawn, effects, 2000)
    assert divided.failed == pytest.approx(380, abs=60)
    assert divided.shares.share.sum() == pytest.approx(1.0)

    def never(t: Floats) -> tuple[Floats, Flags]:
        return np.full((len(t), 1), np.nan), np.zeros(len(t), np.bool_)

    found = sobol_of(never, drawn, effects, samples=100)
    assert found.failed == 100
    assert np.isnan(found.first.share).all()
    assert np.isnan(found.variance).all()
    assert np.isnan(shapley_of(never, drawn, effects, 100).shares.share).all()


def test_the_result_does_not_depend_on_the_parts(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = drawing([UNIT] * 6, BLOCKS)
    effects = np.zeros_like(SLOPES)
    whole, walks = sobol_of(linear, drawn, effects, samples=500), shapley_of(linear, drawn, effects)
    monkeypatch.setattr(sobol, "STACK", 1000)
    parts = sobol_of(linear, drawn, effects, samples=500)
    # The first part's mean is taken off all: a first-order index moves by a part of its own width.
    assert parts.first.share == pytest.approx(whole.first.share, abs=0.01)
    assert parts.total.share == pytest.approx(whole.total.share, abs=1e-9)
    assert parts.total.half_width == pytest.approx(whole.total.half_width, rel=1e-6)
    again = shapley_of(linear, drawn, effects)
    assert again.shares.share == pytest.approx(walks.shares.share, abs=1e-9)


def test_a_variable_draws_the_same_whatever_else_acts() -> None:
    few = drawing([UNIFORM, TWO_POINT]).points(0).next(100)
    distributions = [TWO_POINT, normal(2.0), UNIFORM]
    numbers = np.array([1, 5, 0])
    more = (
        Drawing(distributions, None, np.zeros(3, np.intp), numbers, "abc", SEED).points(0).next(100)
    )
    assert (few == more[:, [2, 0]]).all()
    others = drawing([UNIFORM, TWO_POINT]).points(1).next(100)
    assert not (few == others).all(axis=0).any()


def test_random_numbers_have_the_distribution_and_unit_variance() -> None:
    drawn = drawing([UNIFORM, TWO_POINT, normal(2.0)])
    points = drawn.points(0).next(100_000)
    assert points.mean(axis=0) == pytest.approx(np.zeros(3), abs=0.02)
    assert points.std(axis=0) == pytest.approx(np.ones(3), rel=0.02)
    variables = drawn.variables(points)
    assert np.abs(variables[:, :2]).max() <= 1.0
    assert variables[:, 2].std() == pytest.approx(0.5, rel=0.02)
