"""What a band does at a pose, in one call of the kernel and from the effects of each variable."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from instruction_sets import SETS, computing_or_skipped
from machine_under_test import OK, MachineUnderTest
from truepose.error_budget import propagation
from truepose.error_budget.largest import largest
from truepose.probability.domain import Domain
from truepose.runs.quantities import quantities

Array = NDArray[np.float64]

AGREES = 1e-11
"""Relative; the largest length of the other road is from above, by up to 1e-12 of rounding."""
CLOSE = 5e-4
"""What that road may be too large by where all directions are nearly alike."""
HALF = 1e-4
"""Half width of a band and standard deviation of a shift, of the parameter's unit."""


def by_effects(
    machine: MachineUnderTest, moved: tuple[Array, Array], drawn: dict[str, Array], centre: Array
) -> tuple[Array, Array, Array, Array]:
    """Reach, uncertainty, largest lengths and status from sensitivities."""
    joints, placements = machine.placed
    columns, variables = drawn["columns"], drawn["variables"]
    slopes, status = machine.kernel.sensitivity_moved(joints, placements, columns, *moved)
    effects = np.zeros((*slopes.shape[:2], variables.max() + 1))
    for at, variable in enumerate(variables):
        effects[..., variable] += slopes[..., at] * drawn["half"][:, at, np.newaxis]
    reach = np.abs(effects).sum(axis=2)
    uncertainty = propagation.standard_uncertainty(effects, drawn["sigmas"])
    ends = np.ones(effects.shape[2])
    kinds = list(quantities(machine.kernel.components).values())
    far = largest(centre, effects, Domain(-ends, ends), kinds).length
    return reach, uncertainty, far, status


def draw(machine: MachineUnderTest, grouped: bool, rows: int) -> dict[str, Array]:
    """A band on every parameter; of `grouped` ones three by three of one variable."""
    random = np.random.default_rng(machine.seed + 7)
    columns = random.permutation(machine.all_columns)
    count = len(columns)
    variables = np.arange(count) // (3 if grouped else 1)
    half = HALF * machine.unit_of_parameter[columns] * random.uniform(-1.0, 1.0, (rows, count))
    # What has no band at some pose has none there.
    half[random.uniform(size=half.shape) < 0.1] = 0.0
    sigmas = random.uniform(1.0, 3.0, variables.max() + 1)
    return {"columns": columns, "variables": variables, "half": half, "sigmas": sigmas}


def both(
    machine: MachineUnderTest, grouped: bool, of_pose: bool, shifted: bool
) -> Iterator[tuple[str, Array, Array]]:
    """What each road says, and at which poses it may be asked."""
    joints, placements = machine.placed
    random = np.random.default_rng(machine.seed + 8)
    count, width = len(joints), len(machine.kernel.components)
    drawn = draw(machine, grouped, count if of_pose else 1)
    centre = HALF * random.normal(size=(count, width)) * machine.unit_of_component
    parameters = machine.all_columns if shifted else machine.all_columns[:0]
    shape = (count if of_pose else 1, parameters.size)
    values = HALF * random.normal(size=shape) * machine.unit_of_parameter[parameters]
    kinds = [kind.tolist() for kind in quantities(machine.kernel.components).values()]
    numbers, status = machine.kernel.band_at(
        joints,
        placements,
        centre,
        parameters,
        values,
        drawn["columns"],
        drawn["variables"].tolist(),
        drawn["half"],
        drawn["sigmas"].tolist(),
        kinds,
    )
    reach, uncertainty, far, expected = by_effects(machine, (parameters, values), drawn, centre)
    ok = (status == OK) & (expected == OK)
    assert ok.sum() > 0.8 * ok.size
    if not shifted:
        assert (status == expected).all()
    yield "reach", numbers[ok, :width], reach[ok]
    yield "uncertainty", numbers[ok, width : 2 * width], uncertainty[ok]
    yield "largest", numbers[ok, 2 * width :], far[ok]


@pytest.mark.parametrize("grouped", [False, True], ids=["single", "grouped"])
@pytest.mark.parametrize("of_pose", [False, True], ids=["one row", "a row a pose"])
@pytest.mark.parametrize("shifted", [False, True], ids=["nominal", "moved"])
def test_one_call_says_what_the_effects_say(
    machine: MachineUnderTest, grouped: bool, of_pose: bool, shifted: bool
) -> None:
    for name, found, expected in both(machine, grouped, of_pose, shifted):
        scale = np.abs(expected).max(axis=0)
        if name == "largest":
            # Every end is tried: never above cones, and below by what they leave open.
            assert (found <= expected + AGREES * scale).all(), name
            assert (found >= expected * (1.0 - CLOSE) - AGREES * scale).all(), name
            assert np.median(np.abs(found - expected)) <= AGREES * scale.max(), name
        else:
            assert (np.abs(found - expected) <= AGREES * scale).all(), name


@pytest.mark.parametrize("name", SETS)
def test_instruction_sets_agree(shipped: MachineUnderTest, name: str) -> None:
    best = {what: found for what, found, _ in both(shipped, True, True, True)}
    with computing_or_skipped(name):
        again = list(both(shipped, True, True, True))
    for what, found, _ in again:
        assert np.abs(found - best[what]).max() <= AGREES * np.abs(best[what]).max(), what


def test_what_is_no_number_leaves_its_neighbours_alone(shipped: MachineUnderTest) -> None:
    joints, placements = shipped.placed
    columns = shipped.all_columns
    half = HALF * shipped.unit_of_parameter[np.newaxis, columns]
    kinds = [kind.tolist() for kind in quantities(shipped.kernel.components).values()]
    width = len(shipped.kernel.components)

    def band(joints: Array, placements: Array) -> tuple[Array, Array]:
        centre = np.zeros((len(joints), width))
        nothing = (columns[:0], np.empty((1, 0)))
        variables, sigmas = list(range(columns.size)), [1.0] * columns.size
        return shipped.kernel.band_at(
            joints, placements, centre, *nothing, columns, variables, half, sigmas, kinds
        )

    expected, fine = band(joints, placements)
    spoilt = joints.copy()
    spoilt[::2] = np.nan
    found, status = band(spoilt, placements)
    assert (status[::2] != OK).all()
    assert np.isnan(found[::2]).all()
    assert (status[1::2] == fine[1::2]).all()
    kept = fine[1::2] == OK
    good = expected[1::2][kept]
    assert np.abs(found[1::2][kept] - good).max() <= AGREES * np.abs(good).max()
