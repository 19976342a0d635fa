"""The Deviation form: shapes, bands, groups, and what it refuses."""

from __future__ import annotations

import numpy as np
import pytest

from truepose.sources import (
    ARCSINE,
    OWN_GROUP,
    TRIANGULAR,
    TWO_POINT,
    UNIFORM,
    Deviation,
    Distribution,
    normal,
)


def test_numbers_stand_for_every_pose_and_column() -> None:
    deviation = Deviation.of([3, 7, 9], 1e-3, [0.0, 2e-4, 0.0])
    assert deviation.shift.shape == (1, 3)
    assert deviation.half.tolist() == [[0.0, 2e-4, 0.0]]
    assert deviation.banded.tolist() == [1]
    assert deviation.groups.tolist() == [OWN_GROUP] * 3
    assert deviation.variables.tolist() == [0, 1, 2]
    assert deviation.distribution == (UNIFORM,) * 3


def test_a_band_at_one_pose_is_a_band() -> None:
    deviation = Deviation.of([0, 1], half=np.array([[0.0, 0.0], [0.0, 1e-4]]))
    assert deviation.banded.tolist() == [1]


def test_edges_move_lengths_and_offsets_only() -> None:
    deviation = Deviation.of([0, 1], [1.0, 2.0], [0.1, 0.2], edge=[True, False])
    assert deviation.at_edge(-1.0).tolist() == [[0.9, 2.0]]
    assert deviation.at_edge(+1.0).tolist() == [[1.1, 2.0]]


def test_members_of_a_group_share_one_variable_with_their_signs() -> None:
    deviation = Deviation.of(
        [4, 5, 6, 7], 0.0, [1.0, 2.0, 3.0, 4.0], groups=[8, OWN_GROUP, 8, 2], sign=[1, -1, -1, 1]
    )
    variables = deviation.variables
    assert variables[0] == variables[2]
    assert len(set(variables.tolist())) == 3
    # In a group of its own a sign says nothing; in a common one it turns the member round.
    assert deviation.signed_half.tolist() == [[1.0, 2.0, -3.0, 4.0]]
    assert deviation.at_edge(+1.0).tolist() == [[1.0, 2.0, -3.0, 4.0]]


def test_a_group_s_sign_may_differ_from_pose_to_pose() -> None:
    deviation = Deviation.of(
        [0, 1], half=0.5, groups=0, sign=np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0]])
    )
    assert deviation.signed_half.tolist() == [[0.5, 0.5], [0.5, -0.5], [-0.5, 0.5]]


def test_variables_may_be_correlated() -> None:
    """Numbers are those of `variables`: groups first, in the order of their ids."""
    coefficients = np.array([[1.0, 0.5, 0.2], [0.5, 1.0, 0.0], [0.2, 0.0, 1.0]])
    deviation = Deviation.of(
        [4, 5, 6, 7],
        half=[1.0, 0.0, 3.0, 4.0],
        groups=[8, OWN_GROUP, 8, OWN_GROUP],
        correlation=coefficients,
        group_names={8: "batch"},
    )
    assert deviation.n_variable == 3
    assert deviation.variables.tolist() == [0, 1, 0, 2]
    assert deviation.group_names == {8: "batch"}
    # Column 5, of variable 1, has no band.
    assert deviation.banded_correlation is not None
    assert deviation.banded_correlation.tolist() == [[1.0, 0.2], [0.2, 1.0]]
    coefficients[0, 2] = 9.0
    assert deviation.correlation is not None
    assert deviation.correlation[0, 2] == 0.2


def test_what_has_a_band_may_be_independent_though_something_is_not() -> None:
    coefficients = [[1.0, 0.5], [0.5, 1.0]]
    assert (
        Deviation.of([4, 5], half=[1.0, 0.0], correlation=coefficients).banded_correlation is None
    )
    assert Deviation.of([4, 5], half=1.0).banded_correlation is None
    assert Deviation.of([], half=1.0).n_variable == 0


@pytest.mark.parametrize(
    ("coefficients", "words"),
    [
        ([[1.0]], "shape"),
        ([[1.0, 2.0], [2.0, 1.0]], "from -1 to 1"),
        ([[1.0, np.nan], [np.nan, 1.0]], "from -1 to 1"),
        ([[1.0, 0.5], [0.4, 1.0]], "not symmetric"),
        ([[0.5, 0.0], [0.0, 1.0]], "one with itself"),
    ],
)
def test_correlations_that_contradict_themselves(coefficients: list, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Deviation.of([4, 5], half=1.0, correlation=coefficients)


def test_a_distribution_says_how_many_sigmas_its_band_is() -> None:
    assert UNIFORM.sigmas == pytest.approx(3**0.5, abs=1e-15)
    assert str(UNIFORM) == "uniform"
    assert str(normal()) == "normal, 3 sigma"
    assert normal(2.0).sigmas == 2.0
    with pytest.raises(ValueError, match="no band"):
        normal(0.0)


EVENLY = (np.arange(1_000_000) + 0.5) / 1_000_000
"""Probabilities: what a distribution's quantiles have there is a sample without chance."""


@pytest.mark.parametrize(
    ("distribution", "quantiles"),
    [
        (UNIFORM, 2 * EVENLY - 1),
        (
            TRIANGULAR,
            np.where(EVENLY < 0.5, np.sqrt(2 * EVENLY) - 1, 1 - np.sqrt(2 * (1 - EVENLY))),
        ),
        (ARCSINE, np.sin(np.pi * (EVENLY - 0.5))),
        (TWO_POINT, np.where(EVENLY < 0.5, -1.0, 1.0)),
    ],
    ids=str,
)
def test_a_half_band_is_so_many_standard_deviations(
    distribution: Distribution, quantiles: np.ndarray
) -> None:
    assert quantiles.min() >= -1
    assert quantiles.max() <= 1
    assert np.std(quantiles) == pytest.approx(1 / distribution.sigmas, rel=1e-6)
    assert str(distribution) == distribution.name


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"half": -1e-6}, "negative"),
        ({"shift": float("nan")}, "shift has a value that is not finite"),
        ({"shift": np.zeros((4, 3))}, r"shift has shape \(4, 3\), expected \(n or 1, 2\)"),
        ({"sign": 0.5}, "neither"),
        ({"distribution": (UNIFORM,)}, "1 distributions, expected 2"),
        ({"groups": 1, "distribution": (UNIFORM, normal())}, "two distributions"),
    ],
)
def test_what_contradicts_itself_is_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        Deviation.of([0, 1], **arguments)  # type: ignore[arg-type]
