"""The one band to be made tighter, against the verdict on a machine file that says it so."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from truepose.verdict.accuracy import answers
from truepose.verdict.answer import AFTER, BEFORE, met
from truepose.verdict.states import Population
from truepose.verdict.tightening import LEAST, ToleranceBand, band_of

TWO_SLIDER = MACHINES / "planar_two_slider.toml"
HALF = 0.3
"""Of the tolerance of a strut of that machine, mm."""


def tightened(share: float) -> tp.Machine:
    """The machine with struts whose tolerance is a share of what it is."""
    half = f"{share * HALF:.12g}"
    return tp.load(TWO_SLIDER, settings=[f"strut.*.length_tolerance=[-{half}, {half}]"])


def test_a_band_is_of_parts_that_differ_in_their_name_alone() -> None:
    assert band_of("strut.1.length", "tolerance") == ToleranceBand("strut.*.length", "tolerance")
    assert band_of("strut.b2.platform.y", "tolerance") == ToleranceBand(
        "strut.*.platform", "tolerance"
    )
    assert band_of("strut.1.length", "thermal") != band_of("strut.1.length", "tolerance")
    named = ("drive.d1.offset", "clearance: drive.d2.offset", "clearance: drive.d3.offset (2)")
    assert {band_of(name, "clearance") for name in named} == {
        ToleranceBand("drive.*.offset", "clearance")
    }
    assert band_of("drive.d1.offset", "clearance").shown == "clearance: drive.*.offset"
    assert band_of("drive.d1.offset", "tolerance").shown == "drive.*.offset"
    assert band_of("joint 1, x", "tolerance") == ToleranceBand("joint 1, x", "tolerance")


@pytest.mark.parametrize("state", [BEFORE, AFTER])
def test_a_machine_file_that_says_the_share_meets_and_one_percent_more_does_not(state: str) -> None:
    advised = tp.tightening(tp.load(TWO_SLIDER), state=state)
    assert advised is not None
    assert advised.enough
    assert advised.band == ToleranceBand("strut.*.length", "tolerance")
    assert advised.parts == 2
    assert advised.width == pytest.approx(2e-3 * HALF)
    there = tp.accuracy(tightened(advised.share), states=(state,))
    assert met(there, state)
    assert [a.bound.value for a in there] == pytest.approx(
        [a.bound.value for a in advised.answers], rel=1e-12
    )
    target = tp.load(TWO_SLIDER).accuracy.target
    assert target is not None
    wider = tp.accuracy(tightened(advised.share + 0.01), states=(state,))
    assert wider[0].linear.value > target * (1.0 - 1e-4)


def test_where_no_band_is_enough_it_is_the_one_that_reaches_most() -> None:
    machine = tp.load(MACHINES / "3prs.toml")
    advised = tp.tightening(machine)
    assert advised is not None
    assert advised.share == LEAST
    assert not advised.enough

    def reached(answers: Sequence[tp.Answer]) -> float:
        return max(a.linear.value / a.asked for a in answers if a.asked is not None)

    state = next(iter(Population(machine).states(AFTER)))
    variables = state.variables
    bands = set(map(band_of, variables.names, variables.sources))
    assert len(bands) > 3
    for band in bands:
        change = partial(ToleranceBand.tightened, band, share=LEAST)
        other = answers(Population(machine, changed=change), AFTER)
        # Bands are compared to the 0.05 % of the linear maximum.
        assert reached(other) >= reached(advised.answers) * (1.0 - 1e-3)


def test_nothing_is_advised_where_all_is_met_or_nothing_is_asked() -> None:
    assert tp.tightening(tp.load(MACHINES / "tripod.toml")) is None
    assert tp.tightening(tp.load(TWO_SLIDER, settings=["accuracy.target=5 mm"])) is None


def test_at_a_coverage_the_share_keeps_it_and_the_whole_does_not() -> None:
    asked = ["accuracy.target=0.3 mm", "accuracy.at=0.95"]
    advised = tp.tightening(tp.load(TWO_SLIDER, settings=asked))
    assert advised is not None
    assert LEAST < advised.share < 1.0
    (answer,) = advised.answers
    assert answer.coverage is not None
    # Drawn anew and exactly: to the sampling error of a quantile of some thousand machines.
    assert answer.linear.value == pytest.approx(0.3e-3, rel=0.05)
    assert np.isfinite(advised.width)
