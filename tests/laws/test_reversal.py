"""All deviations negated negate the linear answer.

In the file every band [-a, b] becomes [-b, a], warm becomes cold, and every load acts the other
way. Shifts are then negated and half bands the same, so spreads are too; exact errors are negated
but for their even part, which is of second order: a quarter where deviations are halved.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

import truepose as tp
from machine_file import loaded
from machine_file_units import bare
from machine_under_test import MachineUnderTest
from random_machines import DrawnMachine
from reversed_machine import reversed_file
from truepose.machine import Machine
from truepose.runs import displacement
from truepose.runs.poses import PoseRun
from truepose.sources import Deviation, PoseBlock

Floats = NDArray[np.float64]

ROUNDING = 2e-13
"""m or rad: of a difference of two positions of a metre or two, and twice that in a sum."""
RELATIVE = 1e-9
SLOPES = 1e-2
"""Of the largest: what slopes at opposite shifts differ by, deviations being below a hundredth."""
FOURTH_ORDER = 1e-2
"""Of the even part: what comes after the second order, deviations being below a hundredth."""


@dataclass
class BothWays:
    """A machine, and the one whose every deviation is negated."""

    machine: MachineUnderTest

    def __post_init__(self) -> None:
        file = bare(self.machine.file, self.machine.parameter_units)
        self.poses = self.machine.three_poses
        self.one, self.other = loaded(file), loaded(reversed_file(file))

    @cached_property
    def block(self) -> PoseBlock:
        (block,) = PoseRun(self.one, self.poses, self.one.condition)
        return block

    def deviations(self, machine: Machine) -> dict[str, Deviation]:
        (block,) = PoseRun(machine, self.poses, machine.condition)
        return {
            source.name: source.deviation(machine, machine.condition, block)
            for source in machine.sources
            if source.acts(machine.condition)
        }

    def even(self, deviation: Deviation, side: float, share: float = 1.0) -> Floats:
        """(3, n_component) errors of a share of the deviation and of its negative, added."""
        values = share * deviation.at_edge(side)
        total = 0.0
        for sign in (1.0, -1.0):
            moved = displacement.sum_deviations([(deviation.parameters, sign * values)])
            error, status = displacement.displacement(
                self.one, self.block.joints, self.block.placements, moved
            )
            assert not status.any()
            total = total + error
        return np.asarray(total)


def deviations_are_negated(machine: MachineUnderTest) -> None:
    case = BothWays(machine)
    before, after = case.deviations(case.one), case.deviations(case.other)
    assert list(before) == list(after)
    for name, one in before.items():
        other = after[name]
        assert np.array_equal(one.parameters, other.parameters), name
        for found, expected in ((-other.shift, one.shift), (other.half, one.half)):
            # A temperature rise is a difference of numbers of some 300 K.
            assert np.allclose(found, expected, rtol=1e-11, atol=1e-16), name


def exact_errors_are_negated_but_for_an_even_part(machine: MachineUnderTest) -> None:
    case = BothWays(machine)
    first, second = (tp.budget(each, case.poses) for each in (case.one, case.other))
    ends = (("error", "error", 0.0), ("error_upper", "error_lower", 1.0))
    for name, deviation in case.deviations(case.one).items():
        for before, after, side in ends:
            total = first[before].sel(source=name) + second[after].sel(source=name)
            whole = case.even(deviation, side)
            assert np.abs(total.values - whole).max() <= ROUNDING + RELATIVE * np.abs(whole).max()
            half = case.even(deviation, side, 0.5)
            size = np.abs(whole).max()
            # Of over-constrained machines forces share the even part: their minimum is flat.
            assert np.abs(half - whole / 4).max() <= ROUNDING + FOURTH_ORDER * size, name


def spreads_are_the_same(machine: MachineUnderTest) -> None:
    """Of each source, and of what compensation leaves, but for the slopes at opposite shifts."""
    case = BothWays(machine)
    first, second = (tp.budget(each, case.poses) for each in (case.one, case.other))
    assert_same("uncertainty", first.uncertainty.values, second.uncertainty.values, SLOPES)
    # The largest of error and band together moves by no more than the exact error does.
    even = abs(first.error + second.error)
    allowed = even + ROUNDING + SLOPES * float(first.worst.max())
    assert (abs(first.worst - second.worst) <= allowed).all()
    bounds = [tp.compensate(each, case.poses).bound.values for each in (case.one, case.other)]
    assert_same("bound of what remains", *bounds, SLOPES)


def assert_same(name: str, one: Floats, other: Floats, relative: float = RELATIVE) -> None:
    gap = np.abs(one - other).max(initial=0.0)
    size = np.abs(one).max(initial=0.0)
    assert gap <= ROUNDING + relative * size, f"{name}: {gap:.3g} of {size:.3g}"


def test_deviations_of_a_reversed_shipped_machine_are_negated(shipped: MachineUnderTest) -> None:
    deviations_are_negated(shipped)


def test_deviations_of_a_reversed_drawn_machine_are_negated(drawn: DrawnMachine) -> None:
    deviations_are_negated(drawn)


def test_errors_of_a_reversed_shipped_machine_are_negated(shipped: MachineUnderTest) -> None:
    exact_errors_are_negated_but_for_an_even_part(shipped)


def test_errors_of_a_reversed_drawn_machine_are_negated(drawn: DrawnMachine) -> None:
    exact_errors_are_negated_but_for_an_even_part(drawn)


def test_a_reversed_shipped_machine_spreads_as_before(shipped: MachineUnderTest) -> None:
    spreads_are_the_same(shipped)


def test_a_reversed_drawn_machine_spreads_as_before(drawn: DrawnMachine) -> None:
    spreads_are_the_same(drawn)
