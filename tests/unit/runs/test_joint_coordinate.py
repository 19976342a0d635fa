"""The joints' names choose along the dim joint in the result of every command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import truepose as tp
from build_machine import MACHINES
from truepose.calibration.planning.instruments import instruments_named

MACHINE = tp.load(MACHINES / "planar_two_slider.toml")
POSES = MACHINE.poses()[:4]
DATA = Path(__file__).parents[3] / "examples" / "data"


def results() -> dict[str, xr.Dataset]:
    overconstrained = tp.load(MACHINES / "overconstrained.toml")
    printer = tp.load(DATA / "delta_printer.toml")
    instruments = instruments_named(MACHINE, "position=10um")
    return {
        "budget": tp.budget(MACHINE, POSES),
        "compensate": tp.compensate(MACHINE, POSES),
        "monte_carlo": tp.monte_carlo(MACHINE, POSES, samples=50),
        "bounds": tp.bounds(MACHINE, POSES),
        "shares": tp.shares(MACHINE, POSES[:1], samples=200),
        "uncertainty": tp.uncertainty(MACHINE, POSES),
        "worst_case": tp.worst_case(MACHINE, POSES),
        "strain": tp.strain(overconstrained, overconstrained.poses()[:2]),
        "plan": tp.plan(MACHINE, instruments, 3, starts=1).dataset,
        "calibrate": tp.calibrate(printer, DATA / "delta_positions.csv").dataset,
    }


found = results()


@pytest.mark.parametrize("name", sorted(found))
def test_a_joint_is_chosen_by_its_name(name: str) -> None:
    dataset = found[name]
    if "joint" not in dataset.dims:
        assert not any("joint" in str(each) for each in dataset.data_vars)
        return
    names = [str(each) for each in dataset.indexes["joint"]]
    for index, joint in enumerate(names):
        chosen, numbered = dataset.sel(joint=joint), dataset.isel(joint=index)
        for variable in dataset.data_vars:
            assert np.array_equal(chosen[variable].values, numbered[variable].values, equal_nan=(
                dataset[variable].dtype.kind == "f"
            ))  # fmt: skip


def test_they_are_the_drives_names() -> None:
    assert list(found["compensate"].joint.values) == ["d1", "d2"]
    corrected = found["compensate"].sel(joint="d2").joint_corrected.values
    assert np.array_equal(corrected, found["compensate"].joint_corrected.values[:, 1])
