"""Dimensions that make the spread: those that cannot be told apart are one."""

from __future__ import annotations

import numpy as np
import pytest

from truepose.reporting.alike import alike, first_text, rest_text
from truepose.reporting.variance_shares import Blame

NAMES = ("strut.1.length", "strut.2.length", "drive.a.offset", "strut.3.length", "tool.x", "tool.y")


def blame_of(*shares: float, half: float = 0.0) -> Blame:
    values = np.array(shares)
    return Blame(NAMES[: len(shares)], {"total": values}, {"total": np.full(len(values), half)})


def test_equal_shares_are_one_and_small_ones_are_left_out() -> None:
    who = blame_of(0.3, 0.3, 0.2, 0.1, 0.009, 0.001)
    groups = alike(who)
    assert [group.names for group in groups] == [NAMES[:2], NAMES[2:3], NAMES[3:4]]
    assert [group.share for group in groups] == pytest.approx([0.3, 0.2, 0.1])
    assert groups[0].label == "strut.1.length + 1 alike"
    assert rest_text(who) == "2 others make less than 1 % each, 1.0 % together."
    assert rest_text(blame_of(0.5, 0.5)) == ""


def test_shares_whose_intervals_overlap_are_alike_but_not_through_a_third() -> None:
    groups = alike(blame_of(0.30, 0.27, 0.24, half=0.02))
    assert [group.names for group in groups] == [NAMES[:2], NAMES[2:3]]
    assert (groups[0].low, groups[0].high) == pytest.approx((0.25, 0.32))
    assert len(alike(blame_of(0.30, 0.27, 0.24, half=0.0))) == 3


def test_what_to_tighten_first_names_a_tie_and_the_kind() -> None:
    tie = first_text(blame_of(0.3, 0.3, 0.2, 0.1), "position", "x 0 mm")
    assert tie.startswith("strut.1.length and 1 other, which are alike, make the largest share")
    assert "30.0 % each, at x 0 mm." in tie
    assert tie.endswith("All 3 of this kind, strut.*.length, make 70.0 % together.")
    alone = first_text(blame_of(0.5, 0.3), "orientation", "x 0 mm")
    assert alone.startswith("strut.1.length makes the largest share of the orientation's variance")
    assert "80.0 % together" in alone
    assert first_text(blame_of(0.005), "position", "x 0 mm").startswith("No dimension makes")
