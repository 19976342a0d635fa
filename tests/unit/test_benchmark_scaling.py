"""Exponents of growth, and that each work that grows can be done."""

from __future__ import annotations

import pytest

import truepose
from benchmarks.scaled_work import MOST_PARAMETERS, Scaled, every_scaling, moved, shipped
from benchmarks.scaling import duration, exponent, exponent_row, least_seconds
from sweeps import thinned

SIZES = (10, 100, 1000)


def work(why: str = "") -> Scaled:
    return Scaled("budget", "poses", SIZES, lambda size: lambda: size, why)


@pytest.mark.parametrize("power", [0.0, 0.5, 1.0, 3.0])
def test_the_exponent_of_a_power_is_found(power: float) -> None:
    slope, deviation = exponent(SIZES, [3e-6 * size**power for size in SIZES])
    assert slope == pytest.approx(power, abs=1e-12)
    assert deviation == pytest.approx(0.0, abs=1e-12)


def test_the_deviation_is_that_of_the_worst_time() -> None:
    # In the logarithms 0, 1, 0 the fit is level, at a third.
    slope, deviation = exponent(SIZES, [1.0, 8.0, 1.0])
    assert slope == pytest.approx(0.0, abs=1e-12)
    assert deviation == pytest.approx(8.0 ** (2 / 3) - 1.0)


def test_growth_that_should_be_linear_is_judged() -> None:
    assert exponent_row(work(), [1.0, 10.0, 100.0]).cells()[1:4] == ("1", "at most 1.1", "met")
    assert not exponent_row(work(), [1.0, 100.0, 1e4]).met


def test_growth_that_is_not_linear_says_why() -> None:
    row = exponent_row(work("as it should"), [1.0, 100.0, 1e4])
    assert row.asked is None
    assert row.detail == (
        "10 to 1,000 poses: 1 s, 100 s, 1e+04 s; up to 0 % off the fit; at the end 2.00; "
        "as it should"
    )


def test_a_time_has_a_unit_that_suits_it() -> None:
    assert [duration(seconds) for seconds in (1.234, 0.0123, 4.5e-6)] == [
        "1.23 s",
        "12.3 ms",
        "4.5 us",
    ]


def test_the_least_time_of_a_call_is_of_one_call() -> None:
    now = [0.0]

    def call() -> None:
        now[0] += 0.004

    assert least_seconds(call, lambda: now[0]) == pytest.approx(0.004)


def test_no_shipped_machine_has_more_parameters() -> None:
    counts = {
        name: len(shipped(name).parameters) for name in ("hexapod", "linapod", MOST_PARAMETERS)
    }
    assert max(counts.values()) == counts[MOST_PARAMETERS] == 87


def test_as_many_parameters_are_moved_as_asked_for() -> None:
    some, more = (moved("hexapod", count).sources[0].bands for count in (5, 12))
    assert set(some.parameters) < set(more.parameters)
    assert (some.half > 0.0).all()
    known = moved("hexapod", 5, known=True).sources[0].bands
    assert (known.half == 0.0).all()
    assert (known.shift > 0.0).all()
    with pytest.raises(ValueError, match="52 parameters of 51"):
        moved("hexapod", 52)


@pytest.mark.parametrize("number", thinned(range(17)))
def test_each_work_can_be_done_in_its_least_and_largest_size(number: int) -> None:
    before = truepose.threads()
    with every_scaling(0.001) as every:
        assert len(every) == 17
        scaled = every[number]
        for size in (scaled.sizes[0], scaled.sizes[-1]):
            scaled.make(size)()
    assert truepose.threads() == before
