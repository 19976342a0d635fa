"""Proven bounds of machines shipped and drawn: nothing sampled or found at a vertex lies beyond."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from machine_under_test import OK, MachineUnderTest
from truepose.errors import RequestError
from truepose.machine import Machine
from truepose.runs.first_order import ExactError
from truepose.runs.poses import PoseRun, required_sources
from truepose.runs.quantities import quantities
from truepose.runs.variables import variables_at
from truepose.uncertainty_analysis.truncation import Ends

Array = NDArray[np.float64]

SAMPLES = 300

ROUNDING = 1e-13
"""Of the machine's size."""


def sampled(machine: Machine, poses: Array) -> tuple[Array, Array]:
    """Largest |error| (n, m) and length (n, n_quantity) of machines drawn anywhere in the bands."""
    (block,) = PoseRun(machine, poses, machine.condition)
    moves = Ends(None).truncated(
        variables_at(machine, block, required_sources(machine, machine.condition))
    )
    random = np.random.default_rng(5)
    count, n = SAMPLES, len(poses)
    t = random.uniform(-1.0, 1.0, (count * n, len(moves.names)))
    for members in moves.directions:
        t[:, members] /= np.linalg.norm(t[:, members], axis=1, keepdims=True)
    errors, status = ExactError(machine, block, moves)(np.repeat(np.arange(n), count), t)
    assert (status == OK).all()
    kinds = quantities(machine.components).values()
    sizes = np.stack([np.linalg.norm(errors[:, kind], axis=1) for kind in kinds], axis=1)
    return (
        np.abs(errors).reshape(n, count, -1).max(axis=1),
        sizes.reshape(n, count, -1).max(axis=1),
    )


def bounds_hold(machine: MachineUnderTest) -> None:
    loaded = tp.load(machine.path)
    poses = machine.three_poses
    try:
        found = tp.bounds(loaded, poses)
    except RequestError as refusal:
        if refusal.problems[0].code in ("no-proof", "no-source"):
            pytest.skip(refusal.problems[0].code)
        raise
    proven = found.isel(pose=np.flatnonzero(found.status.values == "proven"))
    slack = ROUNDING * loaded.characteristic_length
    assert (proven.reached_upper <= proven.upper + slack).all()
    assert (proven.reached_lower >= proven.lower - slack).all()
    assert (proven.reached_magnitude <= proven.magnitude + slack).all()
    kept = np.asarray(poses)[proven.pose.values]
    if kept.size == 0:
        return
    largest = sampled(loaded, kept)
    assert (largest[0] <= np.maximum(-proven.lower.values, proven.upper.values) + slack).all()
    assert (largest[1] <= proven.magnitude.values + slack).all()
    worst = tp.worst_case(loaded, kept)
    assert (worst.exact_upper.values <= proven.upper.values + slack).all()
    assert (worst.exact_lower.values >= proven.lower.values - slack).all()
    assert (worst.magnitude_exact.values <= proven.magnitude.values + slack).all()
    # Where every bound of a component is met at a vertex, that of the magnitude is close.
    ends = np.stack([proven.upper - proven.reached_upper, proven.reached_lower - proven.lower])
    tight = (ends <= 1e-9 * np.abs(proven.upper.values)).all(axis=(0, 2))
    close = proven.magnitude.values <= 1.002 * proven.reached_magnitude.values
    assert close[tight].all()


def test_they_hold_for_machines_shipped(shipped: MachineUnderTest) -> None:
    bounds_hold(shipped)


def test_they_hold_for_machines_drawn(drawn: MachineUnderTest) -> None:
    bounds_hold(drawn)
