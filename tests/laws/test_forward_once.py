"""A single forward call takes a quick road: it agrees with the general one, and gives way to it."""

from __future__ import annotations

import numpy as np
import pytest

from machine_under_test import OK, MachineUnderTest
from truepose import _kernel
from truepose.errors import ArgumentError, PoseError

AGREES = 1e-13
"""Of the coordinates' size; both iterations end within rounding of the root."""


def test_both_roads_agree(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    joints, placements = machine.placed
    starts = kernel.pose_of(placements)
    for row, start in zip(joints + 1e-4, starts, strict=True):
        # A status that is asked for, a list, a leading dimension: the general road.
        expected, status = kernel.forward(row, start, status=True)
        if status != OK:
            with pytest.raises(PoseError):
                kernel.forward(row, start)
            continue
        size = max(1.0, float(np.abs(expected).max()))
        found = kernel.forward(row, start)
        assert found.shape == expected.shape
        assert np.abs(found - expected).max() <= AGREES * size
        assert np.abs(kernel.forward(row.tolist(), start) - expected).max() <= AGREES * size
        assert np.array_equal(kernel.forward(row[None], start)[0], expected)


def test_far_joints_have_the_same_end_on_both_roads(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    random = np.random.default_rng(machine.seed + 31)
    joints, _ = machine.placed
    spread = 0.3 * np.maximum(np.ptp(joints, axis=0), 0.1)
    ends = set()
    for row in joints + spread * random.normal(size=joints.shape):
        expected, status = kernel.forward(row, status=True)
        ends.add(int(status))
        if status == OK:
            size = max(1.0, float(np.abs(expected).max()))
            # Near singular poses the last digits are the conditioning's.
            assert np.abs(kernel.forward(row) - expected).max() <= 1e-9 * size
        else:
            with pytest.raises(PoseError) as raised:
                kernel.forward(row)
            assert raised.value.status == _kernel.STATUS[int(status)]
    assert ends


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_is_told_as_ever(machine: MachineUnderTest, bad: float) -> None:
    kernel = machine.kernel
    row = machine.placed[0][0].copy()
    row[-1] = bad
    _, status = kernel.forward(row, status=True)
    assert status != OK
    with pytest.raises(PoseError) as raised:
        kernel.forward(row)
    assert raised.value.status == _kernel.STATUS[int(status)]


def test_a_vector_of_another_length_is_refused(machine: MachineUnderTest) -> None:
    kernel = machine.kernel
    row = machine.placed[0][0]
    with pytest.raises(ArgumentError):
        kernel.forward(row[:-1])
    with pytest.raises(ArgumentError):
        kernel.forward(np.append(row, 0.0))
    with pytest.raises(ArgumentError):
        kernel.forward(row, np.zeros(7))
    start = kernel.home
    strided = np.repeat(row, 2)[::2]
    assert np.array_equal(kernel.forward(strided, start), kernel.forward(row, start))
