"""Exact designs by exchange: against all subsets, published designs and direct evaluation."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np
import pytest

from truepose.calibration.planning import exchange
from truepose.calibration.planning.exchange import (
    CRITERIA,
    Candidates,
    Criterion,
    best,
    greedy,
    ordered,
)

Floats = np.ndarray


def problem(seed: int, *, count: int = 12, readings: int = 2, unknowns: int = 5) -> Candidates:
    """Candidates of random readings, whose unknowns have units of very different size."""
    generator = np.random.default_rng(seed)
    units = 10.0 ** generator.integers(-4, 5, unknowns)
    blocks = generator.normal(size=(count, readings, unknowns)) * units
    tool = generator.normal(size=(30, 3, unknowns)) * units
    return Candidates(blocks, tool, np.diag(0.1 * units**2))


def of_polynomials(degree: int, points: int = 21) -> Candidates:
    """Readings of a polynomial on [-1, 1], wanted evenly over the interval."""
    at = np.linspace(-1.0, 1.0, points)
    # Gauss points and weights make the mean over the interval exact.
    nodes, weights = np.polynomial.legendre.leggauss(8)
    wanted = np.vander(nodes, degree + 1) * np.sqrt(4.0 * weights)[:, np.newaxis]
    return Candidates(np.vander(at, degree + 1)[:, np.newaxis], wanted[:, np.newaxis])


def counts(chosen: Floats, size: int = 21) -> dict[float, int]:
    at = np.linspace(-1.0, 1.0, size)[chosen]
    values, times = np.unique(at, return_counts=True)
    return dict(zip(values.tolist(), times.tolist(), strict=True))


@pytest.mark.parametrize("criterion", CRITERIA)
@pytest.mark.parametrize("seed", range(8))
def test_the_best_of_all_subsets_is_found(seed: int, criterion: Criterion) -> None:
    candidates = problem(seed)
    sets = np.array(list(combinations(range(12), 4)))
    values = candidates.values(sets, criterion)
    wanted = values.min() if criterion == "tool" else values.max()
    found = best(candidates, 4, criterion=criterion, seed=seed)
    assert found.value == pytest.approx(wanted, rel=1e-9)
    assert len(set(found.chosen.tolist())) == 4


@pytest.mark.parametrize(
    ("degree", "support"), [(1, [-1.0, 1.0]), (2, [-1.0, 0.0, 1.0])], ids=["line", "parabola"]
)
def test_d_optimal_designs_of_polynomials_are_the_known_ones(
    degree: int, support: list[float]
) -> None:
    """Equal numbers at the ends and the roots of the derivative of a Legendre polynomial.

    P. G. Hoel, Efficiency problems in polynomial estimation, Annals of Mathematical Statistics 29
    (1958) 1134-1145.
    """
    found = best(of_polynomials(degree), 6, criterion="determinant", repeats=True)
    assert counts(found.chosen) == dict.fromkeys(support, 6 // len(support))


def test_the_i_optimal_parabola_has_half_its_readings_in_the_middle() -> None:
    """Weights 1/4, 1/2, 1/4 at -1, 0, 1: least mean variance over the interval."""
    found = best(of_polynomials(2), 8, repeats=True)
    assert counts(found.chosen) == {-1.0: 2, 0.0: 4, 1.0: 2}


def test_readings_are_repeated_only_where_candidates_are_fewer_unless_asked() -> None:
    candidates = of_polynomials(2, points=5)
    assert len(set(best(candidates, 5).chosen.tolist())) == 5
    assert best(candidates, 7).chosen.size == 7
    with pytest.raises(ValueError, match="7 of 5 candidates"):
        best(candidates, 7, repeats=False)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_updates_equal_direct_evaluation(criterion: Criterion) -> None:
    candidates = problem(3, count=15, readings=3, unknowns=7)
    state = exchange.ExchangeState(candidates, criterion, [1, 4, 9, 12])
    change = state.without(2)
    rest = [1, 4, 12]
    sign = 1.0 if criterion == "tool" else -1.0
    lost = sign * (candidates.value(rest, criterion) - candidates.value([*rest, 9], criterion))
    assert change.lost == pytest.approx(lost, rel=1e-9)
    direct = [
        sign * (candidates.value(rest, criterion) - candidates.value([*rest, number], criterion))
        for number in range(15)
    ]
    np.testing.assert_allclose(state.gains(change.seen, change.spread), direct, rtol=1e-8)
    state.exchange(2, change, 6)
    fresh = exchange.ExchangeState(candidates, criterion, [1, 4, 6, 12])
    np.testing.assert_allclose(state.seen, fresh.seen, atol=1e-9)
    np.testing.assert_allclose(state.spread, fresh.spread, atol=1e-9)
    np.testing.assert_allclose(state.covariance, fresh.covariance, atol=1e-9)


def test_values_are_the_criteria_themselves() -> None:
    generator = np.random.default_rng(5)
    blocks, tool = generator.normal(size=(6, 2, 4)), generator.normal(size=(9, 3, 4))
    candidates = Candidates(blocks, tool, np.eye(4))
    information = np.eye(4) + sum(blocks[i].T @ blocks[i] for i in (0, 2, 5))
    covariance = np.linalg.inv(information)
    mean = np.mean([np.trace(each @ covariance @ each.T) for each in tool])
    assert candidates.value([0, 2, 5]) == pytest.approx(mean, rel=1e-9)
    assert candidates.value([0, 2, 5], "determinant") == pytest.approx(
        np.linalg.slogdet(information)[1], rel=1e-9
    )
    np.testing.assert_allclose(candidates.covariance([0, 2, 5]), covariance, rtol=1e-9)


@pytest.mark.parametrize("criterion", CRITERIA)
def test_a_change_of_units_changes_no_choice(criterion: Criterion) -> None:
    generator = np.random.default_rng(7)
    blocks, tool = generator.normal(size=(40, 2, 6)), generator.normal(size=(20, 3, 6))
    units = 10.0 ** np.arange(-6, 6, 2)
    one = best(Candidates(blocks, tool, np.eye(6)), 8, criterion=criterion)
    other = best(
        Candidates(blocks * units, tool * units, np.diag(units**2)), 8, criterion=criterion
    )
    assert one.chosen.tolist() == other.chosen.tolist()


def test_no_single_exchange_betters_the_result() -> None:
    candidates = problem(11, count=30, readings=1, unknowns=6)
    chosen = best(candidates, 9).chosen
    value = candidates.value(chosen)
    sets = [
        [*np.delete(chosen, place), number]
        for place in range(9)
        for number in range(30)
        if number not in chosen
    ]
    assert candidates.values(np.array(sets)).min() >= value * (1.0 - 1e-9)


def test_the_order_is_that_of_what_each_buys() -> None:
    candidates = problem(2, count=20)
    chosen = ordered(candidates, [3, 8, 1, 15, 6])
    assert sorted(chosen) == [1, 3, 6, 8, 15]
    first = min((1, 3, 6, 8, 15), key=lambda number: candidates.value([number]))
    assert chosen[0] == first
    steps = [candidates.value(chosen[:size]) for size in range(6)]
    assert all(later < earlier for earlier, later in pairwise(steps))


def test_nothing_is_known_before_without_a_prior() -> None:
    candidates = of_polynomials(2)
    known = candidates.value(greedy(candidates, 3))
    assert known < 10.0
    assert candidates.value(greedy(candidates, 2)) > 1e6 * known


def test_the_same_seed_gives_the_same_design_and_progress_is_told() -> None:
    candidates = problem(4, count=60)
    told: list[tuple[int, int]] = []
    one = best(candidates, 10, seed=3, progress=lambda done, total: told.append((done, total)))
    assert one.chosen.tolist() == best(candidates, 10, seed=3).chosen.tolist()
    assert told == [(done, 5) for done in range(1, 6)]
    assert one.value == pytest.approx(one.reached.min(), rel=1e-12)


def test_ctrl_c_gives_the_best_of_the_starts_done() -> None:
    candidates = problem(4, count=60)
    whole = best(candidates, 10, seed=3)

    def stop(done: int, _: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    found = best(candidates, 10, seed=3, progress=stop)
    assert found.interrupted
    assert not whole.interrupted
    assert found.reached.tolist() == whole.reached[:2].tolist()
    assert found.value == pytest.approx(found.reached.min(), rel=1e-12)


def test_ctrl_c_before_there_is_a_plan_ends_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(exchange, "_exchange", stopped)
    with pytest.raises(KeyboardInterrupt):
        best(problem(4), 3)


@pytest.mark.parametrize(
    ("blocks", "tool", "prior", "said"),
    [
        (np.ones((3, 2)), np.ones((2, 3, 2)), None, "blocks have shape"),
        (np.ones((3, 1, 2)), np.ones((2, 3)), None, "tool has shape"),
        (np.ones((3, 1, 2)), np.ones((2, 3, 2)), np.eye(3), "prior has shape"),
        (np.full((3, 1, 2), np.nan), np.ones((2, 3, 2)), None, "blocks has a value"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(
    blocks: Floats, tool: Floats, prior: Floats | None, said: str
) -> None:
    with pytest.raises(ValueError, match=said):
        Candidates(blocks, tool, prior)


def test_requests_that_cannot_be_are_refused() -> None:
    candidates = problem(1)
    with pytest.raises(ValueError, match="criterion"):
        best(candidates, 3, criterion="best")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="0 of the candidates"):
        best(candidates, 0)
