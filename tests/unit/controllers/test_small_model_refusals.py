"""What the adapters of small models refuse, and what they say besides their numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from exported_blocks import (
    exported,
    loaded,
    turned,
)
from truepose.controllers import controller
from truepose.controllers._export import options_of
from truepose.controllers._fit import fit
from truepose.controllers.klipper import Klipper
from truepose.controllers.klipper.linear import Linear
from truepose.controllers.linuxcnc_genhexkins import LinuxCncGenhexkins
from truepose.controllers.linuxcnc_lineardelta import LinuxCncLinearDelta
from truepose.controllers.marlin import Marlin
from truepose.controllers.pose_map import PoseMap
from truepose.controllers.reprap import RepRap
from truepose.errors import RequestError

Array = NDArray[np.float64]


@pytest.mark.parametrize(
    ("adapter", "name", "words"),
    [
        (Klipper, "hexapod", "commanded freedoms"),
        (Klipper, "planar_two_slider", "commanded freedoms"),
        (Klipper, "linapod", "controller-cannot"),
        (Klipper, "orthoglide", "not upright"),
        (Klipper, "tricept", "drives of kind telescopic"),
        (Marlin, "rotary_delta", "drives of kind crank"),
        (RepRap, "rotary_delta", "drives of kind crank"),
        (LinuxCncLinearDelta, "rotary_delta", "drives of kind crank"),
        (LinuxCncGenhexkins, "linear_delta", "drives of kind slider"),
        (LinuxCncGenhexkins, "hexapod_all_sources", "slider, telescopic"),
        (LinuxCncGenhexkins, "pentapod", "controller-cannot"),
        (LinuxCncGenhexkins, "hexaglide", "drives of kind slider"),
    ],
)
def test_a_machine_of_another_kind_is_refused(adapter, name: str, words: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    with pytest.raises(RequestError, match=words) as failure:
        exported(adapter, machine)
    (problem,) = failure.value.problems
    assert problem.code == "controller-cannot"
    assert problem.file == f"{name}.toml"
    assert problem.found
    assert problem.expected
    assert problem.hint


def refused(adapter, machine: tp.Machine, *options: str) -> str:
    with pytest.raises(RequestError) as failure:
        exported(adapter, machine, *options)
    (problem,) = failure.value.problems
    return f"{problem.code}: {problem.message}, {problem.found}"


def test_a_delta_that_is_none_is_refused(tmp_path: Path) -> None:
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    leaning = text.replace("axis = [0, 0, 1]", "axis = [0.2, 0, 1]", 1)
    assert "not upright" in refused(Klipper, loaded(tmp_path, leaning))
    below = text.replace('working_mode = "+"', 'working_mode = "-"').replace(
        "travel = [0, 580]", "travel = [-580, 580]"
    )
    assert "below the platform" in refused(Klipper, loaded(tmp_path, below))
    apart = text.replace(
        "platform = [-13.480741644, -36.6506426237, 0]",
        "platform = [16.519258356, -36.6506426237, 0]",
    )
    assert "not parallel" in refused(Marlin, loaded(tmp_path, apart))


def test_turned_towers_are_refused_where_there_is_no_number_for_them(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    assert "towers at" in refused(LinuxCncLinearDelta, turned(machine, 45))


@pytest.mark.parametrize(
    ("adapter", "option", "words"),
    [
        (Klipper, "switches=here", "switches of klipper"),
        (Klipper, "switches=1, 2", "2 quantities"),
        (Klipper, "switches=1 kg", "switches of klipper"),
        (LinuxCncGenhexkins, "units=cm", "no such choice"),
        (Marlin, "probe_offset=1 K", "probe_offset"),
        (Marlin, "least=-1", "least"),
    ],
)
def test_bad_options(adapter, option: str, words: str) -> None:
    name = "hexapod" if adapter is LinuxCncGenhexkins else "linear_delta"
    said = refused(adapter, tp.load(MACHINES / f"{name}.toml"), option)
    assert said.startswith("bad-option")
    assert words in said


def test_a_workspace_out_of_reach_is_refused() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml", ["workspace.grid.x=[500, 600, 3]"])
    assert refused(Klipper, machine).startswith("no-pose-left")


def test_poses_that_cannot_be_used_are_counted() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml", ["workspace.grid.z=[0, 400, 5]"])
    export = exported(Klipper, machine)
    _, _, status = machine.kernel.place(machine.poses())
    out = int((status != 0).sum())
    assert 0 < out < len(status)
    assert any(
        line.startswith(f"{out} poses of the workspace cannot be used") for line in export.statement
    )


@pytest.mark.parametrize("adapter", [Klipper, Marlin, RepRap, LinuxCncLinearDelta])
def test_blocks_are_ascii_and_name_their_machine(adapter) -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    for name, text in exported(adapter, machine).files.items():
        assert name.startswith("linear_delta_")
        assert text.isascii()
        assert text.endswith("\n")
        assert machine.file_hash in text
        assert "'Linear delta'" in text


def test_a_fit_that_does_not_settle_says_so() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    model = Linear(machine, options_of(Klipper, machine))
    assert fit(machine, model).settled
    cut = fit(machine, model, most_evaluations=2)
    assert not cut.settled
    assert any("has not converged" in line for line in cut.statement(machine))


def test_the_cli_knows_every_adapter() -> None:
    for adapter in (Klipper, Marlin, RepRap, LinuxCncLinearDelta, LinuxCncGenhexkins, PoseMap):
        assert controller(adapter.name) is adapter
        assert adapter.doc
        assert all(option.doc for option in adapter.options.values())
