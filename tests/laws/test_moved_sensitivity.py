"""Sensitivities of a machine whose parameters are moved, by dual numbers and by differences."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from machine_under_test import OK, MachineUnderTest

Array = NDArray[np.float64]

# Of a unit (the characteristic length, or 1): the third derivative leaves about STEP squared, and
# rounding about 1e-15 / STEP.
STEP = 3e-6
AGREES = 1e-7
SHIFT = 1e-3
"""Standard deviation of a parameter's shift, of its unit."""
STRAINED = 20.0
"""Of the shift: by which it may be off where closures are strained.

Where there are more closures than freedoms their misfit, which the shift makes, is not driven to
zero; its part in the derivative is left out.
"""


def shifts(machine: MachineUnderTest, columns: Array, rows: int) -> Array:
    random = np.random.default_rng(machine.seed + 3)
    return SHIFT * random.normal(size=(rows, len(columns))) * machine.unit_of_parameter[columns]


def in_units(machine: MachineUnderTest, sensitivity: Array, columns: Array) -> Array:
    unit = machine.unit_of_component[:, None]
    found: Array = sensitivity / unit * machine.unit_of_parameter[columns]
    return found


@pytest.mark.parametrize("rows", ["each its own", "all the same"])
def test_it_is_the_central_difference_about_the_moved_machine(
    machine: MachineUnderTest, rows: str
) -> None:
    joints, placements = machine.placed
    every = machine.all_columns
    moved = np.random.default_rng(machine.seed).permutation(every)[: 2 * len(every) // 3 + 1]
    values = shifts(machine, moved, len(joints) if rows == "each its own" else 1)
    found, status = machine.kernel.sensitivity_moved(joints, placements, every, moved, values)
    ok = status == OK
    # At the borders some pose may be lost by the shift.
    assert ok.sum() > 0.8 * ok.size
    found = in_units(machine, found, every)
    centre = np.zeros((len(values), len(every)))
    centre[:, moved] = values
    for column, unit in enumerate(machine.unit_of_parameter):
        sides = []
        for step in (STEP, -STEP):
            about = centre.copy()
            about[:, column] += step * unit
            errors, at = machine.kernel.displacement(joints, placements, every, about)
            assert (at[ok] == OK).all()
            sides.append(errors / machine.unit_of_component)
        difference = (sides[0] - sides[1]) / (2 * STEP)
        size = max(1.0, np.abs(found[ok][:, :, column]).max())
        name = machine.kernel.parameters[column]
        slack = STRAINED * SHIFT if machine.kernel.overconstrained else AGREES
        assert np.abs(difference - found[:, :, column])[ok].max() < slack * size, name


def test_of_the_machine_not_moved_it_is_the_sensitivity(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    every = machine.all_columns
    expected, _ = machine.kernel.sensitivity_at(joints, placements, every)
    size = max(1.0, np.abs(expected).max())
    for moved in (every[:0], every):
        values = np.zeros((1, moved.size))
        found, status = machine.kernel.sensitivity_moved(joints, placements, every, moved, values)
        assert (status == OK).all()
        assert np.abs(found - expected).max() < 1e-11 * size


def test_columns_asked_for_are_those_columns(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    every = machine.all_columns
    values = shifts(machine, every, 1)
    whole, status = machine.kernel.sensitivity_moved(joints, placements, every, every, values)
    columns = np.random.default_rng(machine.seed).permutation(every)[:5]
    found, _ = machine.kernel.sensitivity_moved(joints, placements, columns, every, values)
    ok = status == OK
    assert np.abs(found - whole[:, :, columns])[ok].max() < 1e-12 * max(
        1.0, np.abs(whole[ok]).max()
    )


def test_a_shift_out_of_reach_is_told(machine: MachineUnderTest) -> None:
    joints, placements = machine.placed
    lengths = machine.kernel.length_parameters
    values = np.full((1, len(lengths)), -0.95 * machine.kernel.characteristic_length)
    _, status = machine.kernel.sensitivity_moved(
        joints, placements, machine.all_columns, lengths, values
    )
    _, expected = machine.kernel.displacement(joints, placements, lengths, values)
    assert ((status == OK) <= (expected == OK)).all()
