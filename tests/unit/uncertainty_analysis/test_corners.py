"""The search for the worst corner, against every corner; the linear norm, against every facet."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from truepose.probability.domain import Domain
from truepose.sources import UNIFORM
from truepose.uncertainty_analysis import corners

Array = NDArray[np.float64]
POSITION = [np.arange(3)]


class Bowl:
    """m quadratic functions of v variables, alike at `n` poses but for a factor; counts calls."""

    def __init__(self, seed: int, variables: int, bend: float, poses: int = 1) -> None:
        random = np.random.default_rng(seed)
        self.slopes = random.normal(size=(3, variables))
        self.bend = random.normal(size=(3, variables, variables)) * bend / np.sqrt(variables)
        self.factor = 1.0 + np.arange(poses)
        self.asked = 0

    def __call__(self, poses: Array, t: Array) -> tuple[Array, Array]:
        self.asked += len(t)
        value = t @ self.slopes.T + np.einsum("si,mij,sj->sm", t, self.bend, t)
        return self.factor[poses][:, np.newaxis] * value, np.zeros(len(t), np.uint8)

    @property
    def centre(self) -> Array:
        return np.zeros((self.factor.size, 3))

    @property
    def effects(self) -> Array:
        return self.factor[:, np.newaxis, np.newaxis] * self.slopes

    @property
    def domain(self) -> Domain:
        return Domain.of([UNIFORM] * self.slopes.shape[1])

    def worst(self) -> Array:
        every = corners.corners(self.slopes.shape[1])
        outputs, _ = self(np.zeros(len(every), np.intp), every)
        most = corners.Targets(3, POSITION).of(outputs).max(axis=0)
        return self.factor[:, np.newaxis] * np.maximum(most, 0.0)


def test_corners_are_all_there_once() -> None:
    every = corners.corners(5)
    assert every.shape == (32, 5)
    assert len(np.unique(every, axis=0)) == 32
    assert (np.abs(every) == 1.0).all()
    assert corners.corners(0).shape == (1, 0)


def test_few_variables_are_looked_at_at_every_corner() -> None:
    bowl = Bowl(1, corners.EVERY_VERTEX, bend=3.0, poses=3)
    found = corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
    assert found.search == "every vertex"
    assert found.evaluated.tolist() == [2**corners.EVERY_VERTEX] * 3
    assert bowl.asked == 3 * 2**corners.EVERY_VERTEX
    assert np.allclose(found.most, bowl.worst(), rtol=1e-13)


@pytest.mark.parametrize("bend", [0.0, 1e-3, 0.1])
@pytest.mark.parametrize("seed", range(5))
def test_a_directed_search_finds_the_worst_of_what_bends_little(bend: float, seed: int) -> None:
    bowl = Bowl(seed, corners.EVERY_VERTEX + 2, bend, poses=2)
    found = corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
    assert found.search == "directed"
    assert bowl.asked == found.evaluated.sum()
    assert np.allclose(found.most, bowl.worst(), rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_a_directed_search_of_what_bends_much_comes_close_and_never_beyond(seed: int) -> None:
    bowl = Bowl(seed, corners.EVERY_VERTEX + 1, bend=1.0)
    found = corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
    reached = found.most / bowl.worst()
    assert reached.max() <= 1.0 + 1e-12
    assert reached.min() > 0.97


def test_where_the_effects_are_nothing_the_search_starts_elsewhere() -> None:
    bowl = Bowl(7, corners.EVERY_VERTEX + 1, bend=1.0)
    bowl.slopes[:] = 0.0
    found = corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
    assert (found.most / bowl.worst()).min() > 0.97


def test_the_same_search_finds_the_same() -> None:
    first, second = (Bowl(3, 15, 1.0) for _ in range(2))
    found = [
        corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
        for bowl in (first, second)
    ]
    assert np.array_equal(found[0].most, found[1].most)
    assert first.asked == second.asked


def test_poses_in_parts_find_what_they_find_together(monkeypatch: pytest.MonkeyPatch) -> None:
    for variables in (4, 14):
        bowl = Bowl(5, variables, 0.3, poses=7)
        whole = corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
        with monkeypatch.context() as context:
            context.setattr(corners, "AT_ONCE", 100)
            parts = corners.worst_corners(bowl, bowl.centre, bowl.effects, bowl.domain, POSITION)
        assert np.array_equal(parts.most, whole.most)
        assert np.array_equal(parts.evaluated, whole.evaluated)


def test_no_variable_leaves_the_centre() -> None:
    centre = np.array([[1.0, -2.0, 2.0]])
    found = corners.worst_corners(
        Bowl(1, 0, 0.0), centre, np.empty((1, 3, 0)), Domain.of([]), POSITION
    )
    assert found.most.tolist() == [[1.0, -2.0, 2.0, -1.0, 2.0, -2.0, 3.0]]
    assert found.evaluated.tolist() == [0]


@pytest.mark.parametrize("variables", [3, 15])
def test_a_corner_that_fails_says_which_pose_it_fails_at(variables: int) -> None:
    bowl = Bowl(2, variables, 0.1, poses=3)

    def failing(poses: Array, t: Array) -> tuple[Array, Array]:
        outputs, _ = bowl(poses, t)
        bad = (poses == 1) & (t[:, 0] > 0.0)
        return np.where(bad[:, np.newaxis], np.nan, outputs), np.where(bad, 4, 0).astype(np.uint8)

    found = corners.worst_corners(failing, bowl.centre, bowl.effects, bowl.domain, POSITION)
    assert found.status.tolist() == [0, 4, 0]
    worst = bowl.worst()
    assert np.allclose(found.most[[0, 2]], worst[[0, 2]], rtol=1e-12)


def facets_norm(centre: Array, effects: Array) -> float:
    """Largest norm over the corners of a zonotope in space.

    The signs along u change only where u is at right angles to an effect: every corner is beside
    one of the directions at right angles to two of them, with either sign of these two.
    """
    most = 0.0
    for i, j in combinations(range(effects.shape[1]), 2):
        u = np.cross(effects[:, i], effects[:, j])
        for side in (1.0, -1.0):
            signs = np.where(side * (u @ effects) >= 0.0, 1.0, -1.0)
            for at_i in (1.0, -1.0):
                for at_j in (1.0, -1.0):
                    signs[[i, j]] = at_i, at_j
                    most = max(most, float(np.linalg.norm(centre + effects @ signs)))
    return most


@pytest.mark.parametrize("flat", [1.0, 0.3, 0.01])
def test_the_linear_norm_is_the_largest_at_any_corner_in_space(flat: float) -> None:
    random = np.random.default_rng(12)
    effects = random.normal(size=(6, 3, 30)) * np.array([1.0, 1.0, flat])[:, np.newaxis]
    centre = random.normal(size=(6, 3))
    norms, reached = corners.linear_norms(centre, effects, Domain.of([UNIFORM] * effects.shape[2]))
    expected = [facets_norm(*each) for each in zip(centre, effects, strict=True)]
    assert np.allclose(norms.max(axis=1), expected, rtol=1e-12)
    points = centre[:, np.newaxis] + reached @ effects.transpose(0, 2, 1)
    assert np.allclose(np.linalg.norm(points, axis=2), norms, rtol=1e-13)


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_the_linear_norm_is_the_largest_over_all_corners(dimensions: int) -> None:
    random = np.random.default_rng(3)
    effects, centre = random.normal(size=(8, dimensions, 9)), random.normal(size=(8, dimensions))
    norms, _ = corners.linear_norms(centre, effects, Domain.of([UNIFORM] * effects.shape[2]))
    points = centre[:, np.newaxis] + corners.corners(9) @ effects.transpose(0, 2, 1)
    assert np.allclose(norms.max(axis=1), np.linalg.norm(points, axis=2).max(axis=1), rtol=1e-13)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_directions_are_unit_vectors_all_round(n: int) -> None:
    found = corners.directions(n)
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0)
    assert np.abs(found.mean(axis=0)).max() < 0.01
