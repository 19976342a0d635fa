"""Where variables can lie: ends of listed values, directions, and the most of a linear function."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from truepose.probability.distributions import discrete, empirical
from truepose.probability.domain import Domain, unit
from truepose.sources import ARCSINE, UNIFORM, Deviation, normal

Floats = NDArray[np.float64]
SKEWED = discrete([-0.2, 0.1, 0.4], [0.5, 0.3, 0.2])


def test_listed_values_end_where_they_do() -> None:
    # Of mean 0.01: 0.21 below it and 0.39 above.
    assert SKEWED.centre == pytest.approx(0.01)
    assert SKEWED.half == pytest.approx(0.39)
    assert SKEWED.distribution.ends == (pytest.approx(-0.21 / 0.39), 1.0)
    assert empirical([1.0, 2.0, 6.0]).distribution.ends == (pytest.approx(-2.0 / 3.0), 1.0)
    for other in (UNIFORM, ARCSINE, normal(2.0), empirical([2.0, 2.0]).distribution):
        assert other.ends == (-1.0, 1.0)


def test_the_reach_is_the_most_over_all_corners_and_every_direction() -> None:
    random = np.random.default_rng(5)
    kinds = [UNIFORM, SKEWED.distribution, UNIFORM, UNIFORM, ARCSINE, ARCSINE, normal(), UNIFORM]
    domain = Domain.of(kinds, [np.array([2, 3, 7]), np.array([4, 5])])
    slopes = random.normal(size=(4, 3, 8))
    down, up = domain.reach(slopes)
    # A fine net of directions, and every corner of what is single.
    ball = unit(random.standard_normal((200_000, 3)))
    angle = np.linspace(0.0, 2.0 * np.pi, 20_000, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    low = -0.21 / 0.39
    for pose, component in np.ndindex(4, 3):
        own = slopes[pose, component]
        corners = [own[[0, 1, 6]] @ np.array(t) for t in product((-1, 1), (low, 1.0), (-1, 1))]
        of_ball, of_circle = ball @ own[[2, 3, 7]], circle @ own[[4, 5]]
        most = max(corners) + of_ball.max() + of_circle.max()
        least = min(corners) + of_ball.min() + of_circle.min()
        assert most <= up[pose, component] <= most * 1.0001
        assert least * 1.0001 <= -down[pose, component] <= least


def test_the_corner_along_slopes_has_the_most() -> None:
    random = np.random.default_rng(6)
    domain = Domain.of([UNIFORM, SKEWED.distribution, *[UNIFORM] * 3], [np.array([2, 3, 4])])
    slopes = random.normal(size=(50, 5))
    t = domain.most_along(slopes)
    assert np.allclose((slopes * t).sum(axis=1), domain.support(slopes), rtol=1e-14)
    assert np.allclose(np.linalg.norm(t[:, 2:], axis=1), 1.0, rtol=1e-14)
    still = domain.most_along(np.zeros((1, 5)))
    assert np.linalg.norm(still[0, 2:]) == 1.0


def test_unit_vectors_of_whatever_size() -> None:
    tiny = unit(np.array([[3e-200, 4e-200], [3e200, 4e200], [0.0, 0.0]]))
    assert np.allclose(tiny, [[0.6, 0.8], [0.6, 0.8], [1.0, 0.0]], rtol=1e-15)


def test_a_deviation_knows_its_lower_and_upper_end() -> None:
    found = Deviation.of(
        [0, 1, 2],
        half=[0.39, 0.39, 0.5],
        groups=[0, 0, -1],
        sign=[1.0, -1.0, 1.0],
        distribution=[SKEWED.distribution, SKEWED.distribution, UNIFORM],
    )
    lower, upper = found.ends
    assert lower == pytest.approx(np.array([[-0.21, -0.39, -0.5]]))
    assert upper == pytest.approx(np.array([[0.39, 0.21, 0.5]]))
    # The edges are those of the common variable: the second member moves the other way.
    assert found.at_edge(-1.0) == pytest.approx(np.array([[-0.21, 0.21, -0.5]]))
    assert found.at_edge(+1.0) == pytest.approx(np.array([[0.39, -0.39, 0.5]]))


def test_the_components_of_a_direction_have_a_band_together_or_none() -> None:
    def direction(*half: float) -> Deviation:
        return Deviation.of(
            range(len(half)),
            half=list(half),
            groups=range(len(half)),
            distribution=UNIFORM if len(half) == 3 else ARCSINE,
            directions=[range(len(half))],
        )

    # In a plane nothing moves along the third axis, and yet the direction may point there.
    flat = direction(1.0, 2.0, 0.0)
    assert flat.banded.tolist() == [0, 1, 2]
    assert [members.tolist() for members in flat.domain.directions] == [[0, 1, 2]]
    assert direction(0.0, 0.0).banded.size == 0
    assert direction(0.0, 0.0).domain.directions == ()


@pytest.mark.parametrize(
    ("groups", "distribution", "directions"),
    [
        ([0, 1], UNIFORM, [(0, 1)]),  # on a circle components are arcsine
        ([0, 1], ARCSINE, [(0, 1), (1, 0)]),
        ([0, 1], ARCSINE, [(0,)]),
        ([0, 1], ARCSINE, [(0, 2)]),  # no such group
    ],
)
def test_what_is_no_direction_is_refused(
    groups: list[int], distribution: object, directions: list[tuple[int, ...]]
) -> None:
    with pytest.raises(ValueError, match=r"direction"):
        Deviation.of(
            [0, 1],
            half=1.0,
            groups=groups,
            distribution=distribution,  # type: ignore[arg-type]
            directions=directions,
        )
