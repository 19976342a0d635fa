"""The largest length of a set of errors: against corners, climbing and what a machine shows."""

from __future__ import annotations

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from truepose.error_budget.largest import largest, lengths
from truepose.probability.distributions import UNIFORM
from truepose.probability.domain import Domain, unit
from truepose.runs.quantities import quantities
from truepose.uncertainty_analysis import corners

POSITION = [np.arange(3)]


def box(count: int) -> Domain:
    return Domain.of([UNIFORM] * count)


@pytest.mark.parametrize("components", [1, 2, 3])
def test_it_is_the_farthest_corner(components: int) -> None:
    random = np.random.default_rng(components)
    value, effects = random.normal(size=(50, components)), random.normal(size=(50, components, 9))
    found = largest(value, effects, box(9), [np.arange(components)])
    points = value[:, np.newaxis] + corners.corners(9) @ effects.transpose(0, 2, 1)
    expected = np.linalg.norm(points, axis=2).max(axis=1)
    assert np.allclose(found.length[:, 0], expected, rtol=1e-12)
    assert np.allclose(found.reached[:, 0], expected, rtol=1e-12)
    t = found.maximiser(effects, box(9), [np.arange(components)])[:, 0]
    reached = value + (effects @ t[:, :, np.newaxis])[:, :, 0]
    assert np.allclose(np.linalg.norm(reached, axis=1), expected, rtol=1e-12)


def test_climbing_elsewhere_finds_nothing_longer() -> None:
    random = np.random.default_rng(4)
    value, effects = random.normal(size=(40, 3)), random.normal(size=(40, 3, 42))
    norms, _ = corners.linear_norms(value, effects, box(42))
    found = largest(value, effects, box(42), POSITION).length[:, 0]
    assert np.allclose(found, norms.max(axis=1), rtol=1e-12)


def test_ends_that_are_not_symmetric_and_a_direction() -> None:
    random = np.random.default_rng(5)
    domain = Domain(
        np.array([-0.2, -1.0, -1.0, -1.0, -1.0]),
        np.array([3.0, 1.0, 1.0, 1.0, 1.0]),
        (np.array([1, 3, 4]),),
    )
    value, effects = random.normal(size=(20, 3)), random.normal(size=(20, 3, 5))
    found = largest(value, effects, domain, POSITION)
    t = domain.lower + random.random((40_000, 5)) * (domain.upper - domain.lower)
    t[:, [0, 2]] = np.where(
        random.random((40_000, 2)) < 0.5, domain.lower[[0, 2]], domain.upper[[0, 2]]
    )
    t[:, domain.directions[0]] = unit(random.normal(size=(40_000, 3)))
    points = value[:, np.newaxis] + t @ effects.transpose(0, 2, 1)
    sampled = np.linalg.norm(points, axis=2).max(axis=1)
    assert (found.length[:, 0] >= sampled).all()
    assert (found.length[:, 0] <= sampled * 1.01).all()
    assert (found.reached <= found.length).all()
    at = found.maximiser(effects, domain, POSITION)[:, 0]
    assert np.allclose(np.linalg.norm(at[:, domain.directions[0]], axis=1), 1.0)
    reached = np.linalg.norm(value + (effects @ at[:, :, np.newaxis])[:, :, 0], axis=1)
    assert np.allclose(reached, found.reached[:, 0], rtol=1e-12)


def test_quantities_are_apart_and_known_errors_are_points() -> None:
    random = np.random.default_rng(6)
    value, effects = random.normal(size=(9, 6)), random.normal(size=(9, 6, 7))
    kinds = list(quantities(("x", "y", "z", "rx", "ry", "rz")).values())
    both = largest(value, effects, box(7), kinds)
    for at, columns in enumerate(kinds):
        alone = largest(value[:, columns], effects[:, columns], box(7), POSITION)
        assert np.array_equal(both.length[:, at], alone.length[:, 0])
    none = largest(value, np.zeros((9, 6, 0)), box(0), kinds)
    assert np.allclose(none.length, lengths(value, kinds), rtol=1e-15)
    assert np.allclose(none.length[:, 0], np.linalg.norm(value[:, :3], axis=1), rtol=1e-15)


def test_what_is_no_number_has_no_length() -> None:
    effects = np.ones((2, 3, 2))
    effects[1, 0, 1] = np.nan
    found = largest(np.zeros((2, 3)), effects, box(2), POSITION)
    assert np.isfinite(found.length[0, 0])
    assert np.isnan(found.length[1, 0])


def test_the_papers_machine() -> None:
    # Own enumeration: two lengths, four corners, each solved exactly at every pose.
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    found = tp.budget(machine)
    exact = tp.worst_case(machine)
    assert exact.attrs["unbounded"] == "none"
    assert (exact["search"].values == "every vertex").all()
    assert np.allclose(found.linear_maximum, exact.magnitude_exact, rtol=2e-4)
    assert float(found.linear_maximum.max()) * 1e6 == pytest.approx(682.5, abs=0.1)
