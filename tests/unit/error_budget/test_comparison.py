"""Shares, ranks and verdicts."""

from __future__ import annotations

import numpy as np
import pytest

from truepose.error_budget import comparison
from truepose.machine import Accuracy
from truepose.runs.quantities import quantities

POSITION = {"position": np.arange(3)}
BOTH = {"position": np.arange(3), "orientation": np.arange(3, 6)}


def column(*values: float) -> np.ndarray:
    return np.array(values)[:, np.newaxis]


def test_components_fall_into_position_and_orientation() -> None:
    kinds = quantities(("x", "y", "rz"))
    assert {kind: at.tolist() for kind, at in kinds.items()} == {
        "position": [0, 1],
        "orientation": [2],
    }
    assert list(quantities(("x", "y"))) == ["position"]


def test_highest_passes_over_what_is_missing() -> None:
    highest = comparison.Highest((2,))
    highest.add(np.array([[np.nan, np.nan], [-3.0, np.nan]]))
    highest.add(np.array([[2.0, np.nan]]))
    assert highest.value[0] == 3.0
    assert np.isnan(highest.value[1])


def test_lengths_are_gathered_over_blocks() -> None:
    lengths = np.random.default_rng(5).uniform(size=(20, 3, 2))
    whole, parts = (comparison.LengthStatistics(3, 2) for _ in range(2))
    whole.add(lengths)
    for block in np.split(lengths, [3, 11]):
        parts.add(block)
    for found in (whole, parts):
        assert np.array_equal(found.highest, lengths.max(axis=0))
        assert np.allclose(found.rms, np.sqrt((lengths**2).mean(axis=0)), rtol=1e-14)


def test_shares_add_up_and_nothing_is_shared_of_nothing() -> None:
    assert comparison.share(np.array([3.0, 1.0])).tolist() == [0.75, 0.25]
    assert comparison.share(np.zeros(2)).tolist() == [0.0, 0.0]


def test_equal_ranks_keep_the_order_of_the_sources() -> None:
    assert comparison.rank(np.array([0.2, 0.4, 0.2, 0.2])).tolist() == [2, 1, 3, 4]


@pytest.mark.parametrize(
    ("highest", "target", "expected"),
    [
        # Of the total where nothing is asked: 5 % of 100.
        ((70.0, 26.0, 4.0), None, ["dominant", "dominant", "negligible"]),
        ((80.0, 15.0, 5.0), None, ["dominant", "relevant", "relevant"]),
        # Of the accuracy asked, 50, even where it is among the largest.
        ((70.0, 26.0, 4.0), 1000.0, ["dominant", "negligible", "negligible"]),
        ((70.0, 26.0, 4.0), 60.0, ["dominant", "dominant", "relevant"]),
        # 0.5 + 0.3 is 80 %, rounding or not.
        ((0.5, 0.3, 0.2), None, ["dominant", "dominant", "relevant"]),
        ((0.0, 0.0, 0.0), None, ["negligible"] * 3),
        ((0.0, 0.0, 0.0), 1e-3, ["negligible"] * 3),
    ],
)
def test_verdicts(highest: tuple[float, ...], target: float | None, expected: list[str]) -> None:
    found = comparison.verdict(column(*highest), POSITION, Accuracy(target, None))
    assert found == expected


def test_a_source_that_turns_the_tool_is_not_negligible_where_angles_are_asked() -> None:
    highest = np.array([[90.0, 1e-6], [1.0, 8e-4], [1.0, 1e-7]])
    found = comparison.verdict(highest, BOTH, Accuracy(1e3, 1e-3))
    assert found == ["dominant", "relevant", "negligible"]
    assert comparison.verdict(highest, BOTH, Accuracy(1e3, None))[1] == "negligible"
