"""Ratios between two commits: least times, ratios the right way round, and equality of results."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks import works
from benchmarks.ratios import Agreement, Side, agreement, difference, lines, ten_over_three
from benchmarks.works import WORKS, Task, Work

EQUAL = Agreement("equal to 0", kept=True)


def nothing(machines: Path, small: bool) -> Task:
    raise AssertionError


def side(*seconds: float, peak: float = 1e6) -> Side:
    made = Side()
    for value in seconds:
        made.take({"seconds": value, "peak": peak})
    return made


def missing(said: str = "AttributeError: no") -> Side:
    made = Side()
    made.take({"missing": said})
    return made


def test_the_ratio_is_of_least_times_before_over_after() -> None:
    work = Work("w", nothing, "ms", asked=4.0)
    ((cells, met),) = lines(work, side(0.9, 0.8), side(0.2, 0.25), EQUAL)
    assert cells == ("w", "800 ms", "200 ms", "4 x", "at least 4 x", "met", "equal to 0")
    assert met


def test_what_is_slower_is_missed() -> None:
    ((cells, met),) = lines(Work("w", nothing, asked=1.5), side(1.0), side(2.0), EQUAL)
    assert (cells[3], cells[5], met) == ("0.5 x", "**missed**", False)


def test_unequal_results_are_not_met_however_quick() -> None:
    other = Agreement("differ", kept=False)
    ((_, met),) = lines(Work("w", nothing, asked=1.5), side(2.0), side(1.0), other)
    assert not met


def test_peak_memory_is_a_line_of_its_own_that_may_not_grow() -> None:
    work = Work("w", nothing, memory=True)
    before, after = side(2.0, peak=2**20), side(1.0, peak=2**21)
    (_, met), (cells, memory_met) = lines(work, before, after, EQUAL)
    assert cells[:5] == ("w, peak memory", "1 MiB", "2 MiB", "0.5 x", "at least 0.98 x")
    assert (met, memory_met) == (True, False)


@pytest.mark.parametrize(
    ("before", "after", "said", "met"),
    [
        (missing(), side(1.0), "not there before: AttributeError: no", True),
        (side(1.0), missing(), "not there after: AttributeError: no", False),
    ],
)
def test_what_one_side_does_not_have_is_said(
    before: Side, after: Side, said: str, met: bool
) -> None:
    ((cells, is_met),) = lines(Work("w", nothing, asked=2.0), before, after, EQUAL)
    assert len(cells) == 7
    assert cells[3:] == ("", "", "", said)
    assert is_met is met


def test_ten_over_three_is_judged_after() -> None:
    ten, three = (side(3.0), side(1.9)), (side(1.0), side(1.0))
    ((cells, met),) = ten_over_three(ten, three)
    assert cells[1:4] == ("3 x", "1.9 x", "1.58 x")
    assert met
    ((_, met),) = ten_over_three((side(1.0), side(2.1)), three)
    assert not met
    assert ten_over_three((missing(), side(1.0)), three) == []


def test_differences_are_relative_to_the_largest_number() -> None:
    before = np.array([1e-5, -4e-5, np.nan, np.inf])
    assert difference(before, before) == 0.0
    assert difference(before + np.array([0.0, 4e-11, 0.0, 0.0]), before) == pytest.approx(1e-6)
    assert difference(np.array([1e-5, -4e-5, 0.0, np.inf]), before) == np.inf
    assert difference(np.array([np.nan, -4e-5, np.nan, np.inf]), before) == np.inf
    assert difference(before[:3], before) == np.inf
    assert difference(np.zeros(2), np.zeros(2)) == 0.0
    assert difference(np.ones(2), np.zeros(2)) == np.inf


def test_results_of_both_sides_are_compared() -> None:
    work = Work("w", nothing)
    before, after = {"a": np.ones(2), "old": np.ones(1)}, {"a": np.ones(2), "new": np.ones(1)}
    same = agreement(work, before, after)
    assert same == Agreement("equal to 0.0e+00; only before: old; only after: new", kept=True)
    other = agreement(work, before, {"a": np.array([1.0, 1.0 + 1e-9])})
    assert other.said.startswith("differ by 1.0e-09 (a)")
    assert not other.kept


def test_results_of_another_algorithm_may_differ_with_the_reason() -> None:
    work = Work("w", nothing, incomparable="another proof")
    other = agreement(work, {"a": np.ones(1)}, {"a": np.full(1, 1.5)})
    assert other == Agreement("differ by 5.0e-01 (a): another proof", kept=True)


@pytest.mark.parametrize(
    ("ratio", "kept"), [(1.0, True), (1.0002, True), (1.001, False), (0.9, True)]
)
def test_a_bound_may_be_closer_or_a_little_wider(ratio: float, kept: bool) -> None:
    work = Work("w", nothing, no_more={"size": 1.0003})
    found = agreement(work, {"size": np.ones(2)}, {"size": np.array([1.0, ratio])})
    assert found.kept is kept


@pytest.mark.parametrize("name", [name for name in WORKS if not name.startswith("command")])
def test_every_piece_of_work_can_be_done_with_this_package(name: str) -> None:
    machines = Path(works.__file__).parent.parent / "machines"
    task = WORKS[name].prepare(machines, True)
    task.call()
    assert task.results is not None
    assert all(np.isfinite(values).any() for values in task.results().values())
