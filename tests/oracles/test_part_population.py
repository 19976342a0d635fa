"""Populations of machines that the simulator draws, against what is stated of parts.

The stated interval holds the share of machines that it says; no machine is beyond what is proven;
and a machine goes to every point: drawn anew at each, parts would be far worse.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom  # type: ignore[import-untyped]

from part_simulator.errors import (
    Error,
    Force,
    Play,
    Repeatability,
    Resolution,
    Ripple,
    Scale,
    Table,
    Tolerances,
    written,
)
from part_simulator.part_under_test import MACHINES, PartUnderTest, without_errors
from part_simulator.questions import QUESTIONS
from sweeps import long_member, sweep, thinned
from truepose.cluster.evaluator import Here
from truepose.workpiece import evaluate
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.evaluation import PartEvaluation
from truepose.workpiece.samples import CHECKED, SampledState, sampled
from truepose.workpiece.states import BEFORE, PartState, part_states

Floats = NDArray[np.float64]

TOLERANCES = Tolerances({"strut.*.base.*": 20.0, "strut.*.platform.*": 15.0})
BOUNDED = (TOLERANCES, Scale(-15.0, 35.0), Ripple(3.0, 4.0), Resolution(2.0), Play(8.0))
MIXED = (*BOUNDED, Force(80.0, 20.0), Repeatability(1.0))
TABLED = (Table(3),)

BY_NAME = {question.name: question for question in QUESTIONS}
SAMPLES = 10_000
SEED = 11
BEYOND = 0.00135
"""Of a coverage, to either side: three standard deviations."""


def on(name: str, errors: tuple[Error, ...], folder: Path, *asked: str) -> PartUnderTest:
    file = written(errors, without_errors(MACHINES / f"{name}.toml"), folder)
    return PartUnderTest(name, file, folder, [BY_NAME[one] for one in asked])


def as_commanded(*given: Any) -> tuple[tuple[PartState, ...], NDArray[np.intp]]:
    """The states of a part without the one after compensation, at which nothing here looks."""
    (before, _), status = part_states(*given)
    assert before.name == BEFORE
    return (before,), status


def evaluated(under_test: PartUnderTest, samples: int = SAMPLES) -> PartEvaluation:
    machine, read = under_test.machine, under_test.read
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluate, "part_states", as_commanded)
        return evaluate_part(machine, read, machine.condition, samples=samples, seed=SEED)


# --- coverage

EVERY = "TRUEPOSE_COVERAGE" in os.environ
"""Every question on both machines with either errors: half an hour. Else each question once."""

COVERED = [
    (name, machine, errors)
    for machine in ("linear_delta", "hexapod")
    for errors in ("mixed", "tabled")
    for at, name in enumerate(BY_NAME)
    if EVERY
    or (machine, errors) == (("linear_delta", "hexapod")[at % 2], ("mixed", "tabled")[at % 3 == 2])
]
QUICK = [(name, "linear_delta", "mixed", "200") for name in ("width", "flatness of face")]
OFTEN = [(*case, "300") for case in COVERED]
LONG = [long_member((*case, "1000")) for case in COVERED]


@pytest.mark.parametrize("case", [*thinned([*QUICK, *OFTEN], QUICK), *LONG], ids=" ".join)
def test_the_interval_holds_95_of_100_machines(
    case: tuple[str, str, str, str], tmp_path: Path
) -> None:
    """Of a form, and where a reversal has two ends, no fewer; it may be more."""
    label, machine, kind, machines = case
    count = int(machines)
    errors: tuple[Error, ...] = MIXED if kind == "mixed" else TABLED
    under_test = on(machine, errors, tmp_path, label)
    evaluation = evaluated(under_test)
    random = np.random.default_rng([SEED, count, *label.encode()])
    values = np.array(
        [
            under_test.measured(points)[label]
            for first in range(0, count, 100)
            for points in under_test.made_by(errors, random, min(100, count - first))
        ]
    )
    least, most = binom.ppf([BEYOND, 1.0 - BEYOND], count, 0.95) / count
    for column, (of, answer) in enumerate(
        zip(evaluation.characteristics, evaluation.before().answers, strict=True)
    ):
        low, high = answer.interval
        own = values[:, column]
        if of.quantity.is_form:
            share = float(np.mean(own <= high))
        else:
            share = float(np.mean((own >= low) & (own <= high)))
        assert share >= least, of.label
        if kind == "mixed" and not of.quantity.is_form:
            assert share <= most, of.label


# --- worst cases


class Corners:
    """Draws at the ends of what is uniform, either as likely."""

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng(seed)

    def uniform(
        self, low: float = 0.0, high: float = 1.0, size: tuple[int, ...] | int = 1
    ) -> Floats:
        return np.where(self._random.random(size) < 0.5, low, high)

    def normal(self, size: tuple[int, ...]) -> Floats:
        return self._random.normal(size=size)


NARROW = (
    Tolerances({"strut.*.base.*": 2.0, "strut.*.platform.*": 1.5}),
    *BOUNDED[1:],
    Force(80.0, 20.0),
)
"""Bands for which the second order of every shape is known."""
WORST = ("width", "bore", "straightness of chamfer", "flatness of face", "chamfer")
ORIENTED = ("perpendicularity of east to A", "position of hole to AB", "contour")
MANY = 10_000 if EVERY else 2000
SOME = 300
BOUND_MACHINES = ("linear_delta", "hexapod", "planar_two_slider", "rotary_delta")


# The first 200 of the other machines are among their first 300.
@pytest.mark.parametrize(
    ("machine", "count"),
    [
        ("linear_delta", 200),
        *(pytest.param(machine, SOME, marks=sweep) for machine in BOUND_MACHINES),
        *(long_member(machine, MANY) for machine in BOUND_MACHINES),
    ],
)
def test_no_machine_is_beyond_the_bounds(machine: str, count: int, tmp_path: Path) -> None:
    asked = (*WORST, *ORIENTED) if count > 200 else ("width", "bore")
    under_test = on(machine, NARROW, tmp_path, *asked)
    evaluation = evaluated(under_test, 500)
    answers = evaluation.before().answers
    for of, answer in zip(evaluation.characteristics, answers, strict=True):
        above, search = answer.above, answer.search
        proven = above.proven or of.quantity.name.split(",")[0] not in ("size", "diameter")
        assert proven, f"{of.label}: {above.why}"
        assert above.lower <= search.lower.value <= search.upper.value <= above.upper, of.label
    for random in (np.random.default_rng(SEED), Corners(SEED)):
        for first in range(0, count, 200):
            points = under_test.made_by(NARROW, random, min(200, count - first))
            found = under_test.evaluated(points)
            values = np.concatenate([found[f.name] for f in evaluation.features], axis=1)
            for column, (of, answer) in enumerate(
                zip(evaluation.characteristics, answers, strict=True)
            ):
                assert values[:, column].min() >= answer.above.lower, of.label
                assert values[:, column].max() <= answer.above.upper, of.label


# --- one machine a part


def test_a_machine_goes_to_every_point(tmp_path: Path) -> None:
    """A point is uncertain by much that the whole part shares."""
    under_test = on("linear_delta", (TOLERANCES,), tmp_path, "width", "bore")
    state, count = under_test.states[0], 600
    random = np.random.default_rng(SEED)
    points = under_test.made_by((TOLERANCES,), random, count)
    n = points.shape[1]
    anew = points[random.integers(count, size=(count, n)), np.arange(n)]
    width = float(under_test.evaluated(state.points[np.newaxis])["width"][0, 0])

    def farthest(parts: Floats) -> float:
        """Of 95 of 100 widths no place is farther off."""
        off = np.abs(under_test.evaluated(parts)["width"] - width).max(axis=1)
        return float(np.quantile(off, 0.95))

    assert farthest(anew) > 2.0 * farthest(points)
    roundness = [np.median(under_test.evaluated(one)["bore"][:, 2]) for one in (points, anew)]
    assert roundness[1] > 4.0 * roundness[0]
    # truepose's own samples are of the first kind.
    errors, _ = state.exact_errors(state.varying(SEED), 0, count)
    assert farthest(state.points + errors) == pytest.approx(farthest(points), rel=0.15)


# --- first order, exactly, one at a time


@pytest.mark.parametrize("machine", ["linear_delta", "hexapod"])
def test_first_order_is_off_by_what_it_says(machine: str, tmp_path: Path) -> None:
    under_test = on(machine, MIXED, tmp_path, "width", "bore", "perpendicularity of east to A")
    state, count = under_test.states[0], 4 * CHECKED

    def values(points: Floats) -> Floats:
        return np.concatenate(list(under_test.evaluated(points).values()), axis=1)

    drawn = SampledState(state, values, SEED)
    linear = sampled(drawn, count, Here(), exact=False)
    exact = sampled(drawn, count, Here(), exact=True)
    assert not linear.exact
    assert exact.exact
    off = np.abs(linear.values - exact.values)
    assert off[:CHECKED].max(axis=0) == pytest.approx(linear.off, rel=1e-6, abs=1e-14)
    assert (linear.off > 0.0).all()
    assert (off.max(axis=0) <= 3.0 * linear.off).all()


def test_many_parts_at_once_are_each_as_alone(tmp_path: Path) -> None:
    under_test = on("linear_delta", MIXED, tmp_path, *BY_NAME)
    state = under_test.states[0]
    errors, _ = state.exact_errors(state.varying(SEED), 0, 40)
    together = under_test.evaluated(state.points + errors)
    for sample in range(0, 40, 7):
        alone = under_test.evaluated(state.points + errors[sample : sample + 1])
        for label, values in alone.items():
            assert together[label][sample] == pytest.approx(values[0], rel=1e-9, abs=1e-12)
    some, _ = state.exact_errors(state.varying(SEED), 30, 3)
    assert np.abs(some - errors[30:33]).max() < 1e-15
