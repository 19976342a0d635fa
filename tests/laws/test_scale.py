"""A machine k times as large, with deviations k times as large, errs k times as much.

Lengths have the factor k wherever the file has one, its bands, plays and leads too; angles, ratios,
materials and temperatures stay. With areas, forces and weights k^2 times as large the parts give
way in the same proportion: nothing in a machine has a length of its own.
"""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

import truepose as tp
from compared_results import assert_same
from drawn_sweeps import spread
from machine_file import File, loaded, rows_of
from machine_file_units import resized
from machine_under_test import MachineUnderTest
from random_machines import DRAWN, DrawnMachine

SAMPLES = 64


@pytest.fixture(params=spread(DRAWN), ids=lambda machine: f"drawn-{machine.name}")
def drawn(request: pytest.FixtureRequest) -> DrawnMachine:
    """One of the 100 random machines, of which the CI takes one in five."""
    found: DrawnMachine = request.param
    return found


def without_classes(file: File) -> File:
    """Bands outright: a class of a standard takes its band from the size, not in proportion."""
    result = copy.deepcopy(file)
    for strut in rows_of(result, "strut"):
        band = strut.get("length_tolerance")
        if isinstance(band, str) and band.startswith("I"):
            strut["length_tolerance"] = "15 um"
    return result


class InProportion:
    """A machine and one that is so much larger, and the law for results of both."""

    def __init__(self, machine: MachineUnderTest) -> None:
        random = np.random.default_rng(machine.seed + 30)
        # A power of two, for the histograms that quantiles are read from have bins of such widths.
        self.factor = float(2.0 ** random.choice([-5, -2, 3, 6]))
        self.poses = machine.three_poses
        file = without_classes(machine.file)
        self.one, self.other = (
            loaded(resized(file, machine.parameter_units, k)) for k in (1.0, self.factor)
        )

    def assert_of(
        self,
        run: Any,
        *,
        poses: int = 3,
        but: tuple[str, ...] = (),
        **asked: Any,
    ) -> None:
        """What `run` says of the larger one is in proportion, at the first so many poses."""
        assert_same(*self.results(run, poses, asked), self.powers, but=but)

    def results(self, run: Any, poses: int, asked: dict[str, Any]) -> tuple[Any, Any]:
        """Of both, at the first so many poses."""
        k, at = self.factor, self.poses[:poses]
        by_freedom = [k if name in "xyz" else 1.0 for name in self.one.commanded]
        return run(self.one, at, **asked), run(self.other, at * by_freedom, **asked)

    @property
    def powers(self) -> dict[str, float]:
        """By how much a unit's numbers are larger."""
        return {"m": self.factor, "N": self.factor**2}


def first_order_and_samples(machine: MachineUnderTest) -> None:
    both = InProportion(machine)
    both.assert_of(tp.budget)
    both.assert_of(tp.compensate)
    both.assert_of(tp.uncertainty)
    # Of intervals that are equally short, rounding decides for one.
    ties = ("shortest_lower", "shortest_upper")
    both.assert_of(tp.monte_carlo, poses=1, but=ties, samples=SAMPLES, seed=machine.seed)


def worst_case_and_bounds(machine: MachineUnderTest) -> None:
    both = InProportion(machine)
    both.assert_of(tp.worst_case, poses=1, but=("vertices",))
    if not machine.kernel.overconstrained:
        # A magnitude's bound is refined until it is within 0.03 %, which rounding may end earlier.
        first, second = both.results(tp.bounds, 1, {"truncate": 3})
        assert_same(first, second, both.powers, but=("magnitude",))
        assert_same(first, second, both.powers, relative=3e-4)


def test_a_shipped_machine_made_larger_errs_in_proportion(shipped: MachineUnderTest) -> None:
    first_order_and_samples(shipped)


def test_a_drawn_machine_made_larger_errs_in_proportion(drawn: DrawnMachine) -> None:
    first_order_and_samples(drawn)


def test_a_shipped_machine_made_larger_is_bounded_in_proportion(shipped: MachineUnderTest) -> None:
    worst_case_and_bounds(shipped)


def test_a_drawn_machine_made_larger_is_bounded_in_proportion(drawn: DrawnMachine) -> None:
    worst_case_and_bounds(drawn)
