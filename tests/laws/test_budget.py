"""Laws of the budget: for every machine shipped, with sources that move anything at all."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from machine_under_test import MachineUnderTest
from made_source import MadeSource, random_deviation, sizes, with_sources
from truepose.machine import Machine
from truepose.sources import Deviation

ROUNDING = 1e-12
OVER_POSES_AND_SOURCES = ("pose", "source", "component")


@cache
def loaded(machine: MachineUnderTest) -> Machine:
    return tp.load(machine.path)


def three_sources(machine: MachineUnderTest) -> tuple[MadeSource, ...]:
    """Any parameters, some of them known, some in groups; and a band that goes to its edges."""
    return (
        MadeSource("wide", random_deviation(loaded(machine), machine.seed)),
        MadeSource("known", random_deviation(loaded(machine), machine.seed + 1, half=False)),
        MadeSource(
            "band",
            random_deviation(loaded(machine), machine.seed + 2, shift=False),
            sets_overall_edges=True,
        ),
    )


def rows(dataset: xr.Dataset, source: str) -> dict[str, np.ndarray]:
    return {
        name: variable.sel(source=source).values
        for name, variable in dataset.data_vars.items()
        if variable.dims == OVER_POSES_AND_SOURCES
    }


def test_a_source_of_zero_changes_nothing(machine: MachineUnderTest) -> None:
    sources = three_sources(machine)
    columns = machine.all_columns
    zero = MadeSource("zero", Deviation.of(columns), sets_overall_edges=True)
    with_zero = tp.budget(with_sources(loaded(machine), *sources, zero), machine.poses)
    without = tp.budget(with_sources(loaded(machine), *sources), machine.poses)
    for name in ("error", "error_lower", "error_upper", "worst", "uncertainty"):
        assert not with_zero[name].sel(source="zero").values.any()
    for name in ("overall_error", "overall_error_lower", "overall_error_upper"):
        assert np.abs(with_zero[name] - without[name]).max() < ROUNDING
    assert with_zero["share"].sel(source="zero") == 0.0
    assert with_zero["rank"].sel(source="zero") == 4
    assert with_zero["verdict"].sel(source="zero") == "negligible"


def test_each_source_removed_changes_only_its_own_rows(machine: MachineUnderTest) -> None:
    sources = three_sources(machine)
    everything = tp.budget(with_sources(loaded(machine), *sources), machine.poses)
    for removed in sources:
        kept = [source for source in sources if source is not removed]
        found = tp.budget(with_sources(loaded(machine), *kept), machine.poses)
        assert list(found.source.values) == [source.name for source in kept]
        for source in kept:
            for name, values in rows(everything, source.name).items():
                assert np.array_equal(rows(found, source.name)[name], values, equal_nan=True)


def test_the_overall_error_is_all_sources_at_once(machine: MachineUnderTest) -> None:
    sources = three_sources(machine)
    found = tp.budget(with_sources(loaded(machine), *sources), machine.poses)
    for side, name in ((0.0, "error"), (-1.0, "error_lower"), (1.0, "error_upper")):
        # Only the source that sets the overall edges leaves its shift.
        moved = np.zeros((1, machine.all_columns.size))
        for source in sources:
            assert source.given is not None
            at = source.given.at_edge(side) if source.sets_overall_edges else source.given.shift
            np.add.at(moved[0], source.given.parameters, at[0])
        joints, placements = machine.placed
        expected, _ = machine.kernel.displacement(joints, placements, machine.all_columns, moved)
        assert np.abs(found[f"overall_{name}"] - expected).max() < ROUNDING


def test_small_errors_are_the_linear_ones(machine: MachineUnderTest) -> None:
    deviation = random_deviation(loaded(machine), machine.seed + 3, half=False)
    small = 1e-4
    shrunk = Deviation.of(deviation.parameters, small * deviation.shift)
    found = tp.budget(with_sources(loaded(machine), MadeSource("s", shrunk)), machine.poses)
    sensitivity = loaded(machine).sensitivity(machine.poses)
    linear = sensitivity[:, :, deviation.parameters] @ shrunk.shift[0]
    errors = found["error"].values[:, 0] / machine.unit_of_component
    # What remains is of second order: at most about (1e-8)^2 times the curvature, and rounding.
    assert np.abs(errors - linear / machine.unit_of_component).max() < 1e-12
    assert np.abs(errors).max() > 1e-9


def test_the_linear_parts_of_all_sources_add_up(machine: MachineUnderTest) -> None:
    small = 1e-4
    sources = [
        MadeSource(s.name, Deviation.of(s.given.parameters, small * s.given.shift))
        for s in three_sources(machine)
        if s.given is not None
    ]
    found = tp.budget(with_sources(loaded(machine), *sources), machine.poses)
    gap = (found.error.sum("source") - found.overall_error).values / machine.unit_of_component
    assert np.abs(gap).max() < 1e-12


def test_worst_is_reached_at_a_corner_of_the_groups(machine: MachineUnderTest) -> None:
    # Five groups over all parameters: every corner, through the exact machine.
    random = np.random.default_rng(machine.seed + 4)
    columns = machine.all_columns
    scale = 1e-4
    deviation = Deviation.of(
        columns,
        half=scale * sizes(loaded(machine)) * random.uniform(size=columns.size),
        groups=random.permutation(columns.size) % 5,
        sign=random.choice([-1.0, 1.0], columns.size),
    )
    found = tp.budget(with_sources(loaded(machine), MadeSource("s", deviation)), machine.poses)
    highest = np.zeros(found.worst.values[:, 0].shape)
    for corner in product([-1.0, 1.0], repeat=5):
        values = deviation.signed_half * np.array(corner)[deviation.groups]
        moved, _ = machine.kernel.displacement(*machine.placed, columns, values)
        highest = np.maximum(highest, np.abs(moved))
    gap = (found.worst.values[:, 0] - highest) / machine.unit_of_component
    assert np.abs(gap).max() < 1e-12
    assert (highest / machine.unit_of_component).max() > 1e-9


def test_blocks_give_what_single_poses_give(
    machine: MachineUnderTest, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = three_sources(machine)
    whole = tp.budget(with_sources(loaded(machine), *sources), machine.poses)
    monkeypatch.setattr("truepose.runs.poses.BLOCK", 5)
    parts = tp.budget(with_sources(loaded(machine), *sources), machine.poses)
    assert sources[0].asked == [37] + 7 * [5] + [2]
    for name, variable in whole.data_vars.items():
        if variable.dtype.kind != "f":
            assert (parts[name] == variable).all()
            continue
        assert np.array_equal(np.isnan(parts[name]), np.isnan(variable))
        if variable.units != "%":  # of a small coordinate rounding is many percent
            scale = np.maximum(1.0, np.abs(variable))
            assert (np.abs(parts[name] - variable) <= ROUNDING * scale).all()
