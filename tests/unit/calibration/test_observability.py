"""Rank, indices, covariance and shares of what measurements see."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from truepose.calibration.acceptance import observability as seen

Floats = NDArray[np.float64]


def drawn(seed: int, m: int, n: int) -> Floats:
    return np.random.default_rng(seed).normal(size=(m, n))


def with_singular(values: list[float], m: int) -> Floats:
    n = len(values)
    u = np.linalg.qr(drawn(1, m, n))[0]
    v = np.linalg.qr(drawn(2, n, n))[0]
    return np.asarray(u @ np.diag(values) @ v.T)


def test_indices_by_their_definitions() -> None:
    values = [8.0, 4.0, 2.0, 1.0]
    rows = seen.project_out_instruments(with_singular(values, 20), 4)
    found = seen.observability(rows, 20, np.ones(4))
    assert found.scaling == "prior"
    assert found.singular == pytest.approx(values)
    assert found.o1 == pytest.approx((8.0 * 4.0 * 2.0 * 1.0) ** (1 / 4) / np.sqrt(20))
    assert found.o2 == pytest.approx(1.0 / 8.0)
    assert found.o3 == pytest.approx(1.0)
    assert found.o4 == pytest.approx(1.0 / 8.0)
    assert found.o5 == pytest.approx(1.0 / (1 / 8 + 1 / 4 + 1 / 2 + 1))
    assert found.condition == pytest.approx(8.0)
    assert (found.rank, found.n_null) == (4, 0)


def test_indices_are_of_what_is_seen() -> None:
    rows = seen.project_out_instruments(with_singular([8.0, 4.0, 0.0], 20), 3)
    found = seen.observability(rows, 20, np.ones(3))
    assert (found.rank, found.n_null) == (2, 1)
    assert found.o1 == pytest.approx(np.sqrt(32.0) / np.sqrt(20))
    assert found.o3 == pytest.approx(4.0)
    assert found.condition == np.inf


def test_nothing_seen_at_all() -> None:
    found = seen.observability(seen.project_out_instruments(np.zeros((3, 2)), 2), 3)
    assert (found.rank, found.n_null) == (0, 2)
    assert (found.o1, found.o2, found.o3, found.o4, found.o5) == (0.0,) * 5


def test_without_a_prior_columns_are_scaled() -> None:
    jacobian = drawn(4, 12, 3) * np.array([1.0, 1e6, 1e-5])
    found = seen.observability(seen.project_out_instruments(jacobian, 3), 12, [1.0, np.inf, 1.0])
    assert found.scaling == "column"
    expected = np.linalg.svd(jacobian / np.linalg.norm(jacobian, axis=0))[1]
    assert found.singular == pytest.approx(expected)


@pytest.mark.parametrize("scale", [1.0, 1e9])
def test_rank_does_not_depend_on_units(scale: float) -> None:
    jacobian = drawn(5, 12, 4)
    jacobian[:, 3] = jacobian[:, 0] - jacobian[:, 1]
    jacobian[:, 3] *= scale
    assert seen.row_covariance(seen.project_out_instruments(jacobian, 4)).rank == 3
    # Both sides of the threshold.
    near = jacobian.copy()
    near[:, 3] += 1e-7 * scale * drawn(6, 12, 1)[:, 0]
    assert seen.row_covariance(seen.project_out_instruments(near, 4)).rank == 4
    near[:, 3] = jacobian[:, 3] + 1e-11 * scale * drawn(6, 12, 1)[:, 0]
    assert seen.row_covariance(seen.project_out_instruments(near, 4)).rank == 3


def test_instruments_are_projected_out() -> None:
    jacobian = drawn(7, 30, 9)
    left = seen.row_covariance(seen.project_out_instruments(jacobian, 6))
    whole = np.linalg.inv(jacobian.T @ jacobian)
    assert left.root @ left.root.T == pytest.approx(whole[:6, :6], rel=1e-10)
    assert left.standard() == pytest.approx(np.sqrt(np.diagonal(whole)[:6]))


def test_what_an_instrument_can_imitate_is_not_seen() -> None:
    jacobian = drawn(8, 30, 7)
    jacobian[:, 6] = jacobian[:, 0] + 2.0 * jacobian[:, 1]  # a frame that moves as 0 and 1 do
    left = seen.row_covariance(seen.project_out_instruments(jacobian, 6))
    assert left.rank == 5
    direction = left.null[0] / left.null[0][0]
    assert direction == pytest.approx([1.0, 2.0, 0.0, 0.0, 0.0, 0.0], abs=1e-9)
    standard = left.standard()
    assert np.isinf(standard[:2]).all()
    assert np.isfinite(standard[2:]).all()


def test_an_unknown_without_effect_is_not_seen() -> None:
    jacobian = drawn(9, 20, 3)
    jacobian[:, 1] *= 1e-16
    assert np.isinf(seen.row_covariance(seen.project_out_instruments(jacobian, 3)).standard()[1])
    # Not even with the scale of a prior, where it moves nothing by a millionth of the noise ...
    jacobian[:, 1] *= 1e6
    unit = np.array([1.0, 1e3, 1.0])
    assert np.isinf(
        seen.row_covariance(seen.project_out_instruments(jacobian, 3, unit)).standard()[1]
    )
    # ... but a larger one is seen, however badly.
    unit[1] = 1e8
    assert np.isfinite(
        seen.row_covariance(seen.project_out_instruments(jacobian, 3, unit)).standard()[1]
    )


def test_covariance_with_a_correlated_prior() -> None:
    jacobian = drawn(10, 20, 4)
    root = drawn(11, 3, 3)
    covariance = np.full((4, 4), 0.0)
    covariance[:3, :3] = root @ root.T
    covariance[3, 3] = np.inf
    both = seen.stacked(seen.project_out_instruments(jacobian, 4), seen.prior(covariance))
    information = jacobian.T @ jacobian
    information[:3, :3] += np.linalg.inv(root @ root.T)
    found = seen.row_covariance(both)
    assert found.root @ found.root.T == pytest.approx(np.linalg.inv(information), rel=1e-9)
    again = seen.covariance_root(covariance)
    assert (again @ again.T)[:3, :3] == pytest.approx(root @ root.T)
    assert not (again @ again.T)[3].any()


def test_shares() -> None:
    after, before = np.array([0.5, 1.0, 0.1, np.inf]), np.array([1.0, 1.0, np.inf, np.inf])
    assert seen.share(after, before, use_prior=True) == pytest.approx([0.75, 0.0, 1.0, 0.0])
    assert seen.share(after, before, use_prior=False) == pytest.approx([1.0, 1.0, 1.0, 0.0])


def test_degrees_of_freedom() -> None:
    jacobian = drawn(12, 30, 4)
    assert seen.fitted(jacobian, np.zeros((0, 4))) == pytest.approx(4.0)
    jacobian[:, 3] = jacobian[:, 0]
    assert seen.fitted(jacobian, np.zeros((0, 4))) == pytest.approx(3.0)
    # A prior takes away from what the data have to give up: s^2 / (1 + s^2) in each direction.
    values = np.array([3.0, 1.0, 0.1])
    rows = with_singular(values.tolist(), 12)
    assert seen.fitted(rows, np.eye(3)) == pytest.approx(np.sum(values**2 / (1.0 + values**2)))
    assert np.isnan(seen.normalised_rms(np.ones(3), np.ones(3), 0.0))
    assert seen.normalised_rms(np.full(8, 2.0), np.ones(8), 8.0) == pytest.approx(2.0)


def test_robust_weights_weigh_rows() -> None:
    jacobian = drawn(13, 10, 2)
    weights = np.linspace(0.0, 1.0, 10)
    rows = seen.weighted(jacobian, weights)
    assert rows.T @ rows == pytest.approx(jacobian.T @ np.diag(weights) @ jacobian)
    assert seen.weighted(jacobian) is not None


def test_what_instruments_imitate_altogether_is_not_seen() -> None:
    # Every column of the machine is one of the instrument's, but for rounding.
    jacobian = drawn(14, 40, 3)
    jacobian = np.hstack([jacobian @ drawn(15, 3, 3), jacobian])
    left = seen.row_covariance(seen.project_out_instruments(jacobian, 3))
    assert left.rank == 0
    assert np.isinf(left.standard()).all()
