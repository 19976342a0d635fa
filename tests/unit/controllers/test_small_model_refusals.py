"""What the adapters of small models refuse, and what they say besides their numbers."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import firmware
import truepose as tp
from build_machine import MACHINES
from exported_blocks import (
    AFTER,
    BEFORE,
    cold,
    exported,
    loaded,
    only,
    random_shifts,
    text_of,
    turned,
)
from truepose.controllers import controller
from truepose.controllers._export import options_of
from truepose.controllers._fit import fit
from truepose.controllers.klipper import Klipper
from truepose.controllers.klipper.linear import KlipperLinear
from truepose.controllers.linuxcnc_genhexkins import LinuxCncGenhexkins
from truepose.controllers.linuxcnc_genhexkins import _Model as genhexkins
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
        (Klipper, "switches=nan", "not finite"),
        (Klipper, "switches=5 deg", "a length"),
        (Klipper, "switches=-300 mm", "out of the drive's reach"),
        (Klipper, "switches=580, 580, 5000", "drive c"),
        (Marlin, "least=900 mm", "less than the highest pose"),
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


def problem_of(adapter, machine: tp.Machine, *options: str):
    with pytest.raises(RequestError) as failure:
        exported(adapter, machine, *options)
    (problem,) = failure.value.problems
    return problem


def moved(text: str, x: float) -> str:
    """The shipped delta with its towers and its workspace farther along x, mm."""

    def of(found: re.Match[str]) -> str:
        return f"origin = [{float(found[1]) + x!r},"

    text = re.sub(r"^origin = \[([-.\d]+),", of, text, flags=re.MULTILINE)
    return text.replace("x = [-80, 80, 5]", f"x = [{x - 80}, {x + 80}, 5]")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(("x", "words"), [(500.0, "towers at"), (200.0, "off the z axis")])
@pytest.mark.parametrize("adapter", [Klipper, Marlin, RepRap, LinuxCncLinearDelta])
def test_a_delta_beside_the_axis_is_refused(adapter, x: float, words: str, tmp_path: Path) -> None:
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    problem = problem_of(adapter, loaded(tmp_path, moved(text, x)))
    assert problem.code == "controller-cannot"
    if adapter is not LinuxCncLinearDelta:
        assert words in problem.found or "towers at" in problem.found
    assert "z axis" in problem.hint


def test_a_rod_that_does_not_reach_the_axis_is_refused(tmp_path: Path) -> None:
    # Rods of 170 mm at a tower 175 mm off: the workspace lies towards it.
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    text = text.replace("length = 332.999811", "length = 170")
    text = text.replace("x = [-80, 80, 5], y = [-80, 80, 5]", "x = [40, 60, 5], y = [-40, -20, 5]")
    problem = problem_of(Klipper, loaded(tmp_path, text))
    assert problem.code == "controller-cannot"
    assert "off the z axis" in problem.found


def test_a_machine_without_errors_has_nothing_to_fit(tmp_path: Path) -> None:
    machine = loaded(tmp_path, cold(text_of("hexapod", {})))
    model = genhexkins(machine, options_of(LinuxCncGenhexkins, machine))
    found = fit(machine, model, most_evaluations=1)
    assert found.settled
    assert np.abs(found.values - [each.start for each in model.parameters]).max() < 1e-9


def test_a_machine_that_is_not_the_model_is_refused(tmp_path: Path) -> None:
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    leaning = text.replace("axis = [0, 0, 1]", "axis = [0.06, 0, 1]", 1)
    beside = moved(text, 60.0)
    for other, words in ((leaning, "without any error"), (beside, "cannot be computed")):
        for adapter in (LinuxCncLinearDelta, Klipper):
            problem = problem_of(adapter, loaded(tmp_path, other))
            assert problem.code == "controller-cannot"
            assert words in problem.found
            assert "z axis" in problem.hint
    # A little so: what is left of the machine as designed is said.
    little = loaded(tmp_path, text.replace("axis = [0, 0, 1]", "axis = [0.003, 0, 1]", 1))
    (line,) = (each for each in exported(Klipper, little).statement if "as designed: of" in each)
    found = float(line.split("at most ")[1].split(" ")[0])
    shipped = exported(Klipper, tp.load(MACHINES / "linear_delta.toml"))
    assert 20.0 < found < 1000.0
    assert not any("as designed: of" in each for each in shipped.statement)


def test_a_workspace_on_the_axis_has_a_radius_above_zero() -> None:
    line = [f"workspace.grid.{axis}=[0, 0, 1]" for axis in "xy"]
    machine = tp.load(MACHINES / "linear_delta.toml", line)
    assert "print_radius: 0.1" in only(exported(Klipper, machine))
    assert " B0.1 " in only(exported(RepRap, machine))


def test_blocks_say_their_condition_and_options() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    hot = machine.with_condition(machine.condition.replace(temperature=400.0))
    text = only(exported(Marlin, hot, "switches=570, 571, 572", "probe_offset=-1.5"))
    assert "temperature 126.85 degC; reference 20 degC; force 3 N, 2 N, 4 N" in text
    assert "switches trip at a 570 mm, b 571 mm, c 572 mm" in text
    assert "probe_offset -1.5 mm, least 0.2 mm" in text
    assert "in this condition" in text
    moon = machine.with_condition(machine.condition.replace(gravity=1.62))
    assert "; gravity 1.62 m/s^2" in only(exported(Klipper, moon))
    replaced = machine.replace({"strut.a1.base.x": -0.0125})
    assert "changed: strut.a1.base.x = -0.0125 m\n" in only(exported(Klipper, replaced))


def test_rods_that_differ_turn_the_platform_beyond_its_own() -> None:
    # By design: the cold machine turns as it is meant to, and no error turns it more.
    machine = tp.load(MACHINES / "linear_delta.toml", ["condition.temperature=20"])
    longer = machine.nominal[machine.parameters.index("strut.a1.length")] + 1e-3
    export = exported(Klipper, machine.replace({"strut.a1.length": float(longer)}))
    line = next(line for line in export.statement if "the platform turns" in line)
    assert "more than as designed" in line


def test_one_pose_leads_with_what_it_does_not_tell() -> None:
    one = [f"workspace.grid.{axis}=[{at}, {at}, 1]" for axis, at in zip("xyz", "123", strict=True)]
    first = exported(Klipper, tp.load(MACHINES / "linear_delta.toml", one)).statement[0]
    assert "hardly tells 10 of the numbers" in first
    assert "mixtures of these" in first


def small(text: str, unit: str = "um") -> str:
    """The same machine a thousandth of its size, or less, deviations with it."""
    return text.replace('length = "mm"', f'length = "{unit}"')


def test_a_small_machine_is_told_in_decimals_of_its_own(tmp_path: Path) -> None:
    # Shifts of geometry only, so that everything is alike but for the size.
    text = cold(text_of("linear_delta", random_shifts("linear_delta", 2, 0.3)))
    text = re.sub(r"^section_area.*\n|^target = .*\n|^material = .*\n", "", text, flags=re.M)
    large = exported(Klipper, loaded(tmp_path, text))
    for unit, times in (("um", 1e-3), ("nm", 1e-6)):
        little = exported(Klipper, loaded(tmp_path, small(text, unit)))
        for what in (AFTER, BEFORE):
            one, other = (firmware.stated(only(each), what)["um"] for each in (large, little))
            assert other == pytest.approx(np.array(one) * times, abs=0.1 * times)
            assert other[0] > 0.0
    assert "highest pose" in refused(Marlin, loaded(tmp_path, small(text)))
    exported(Marlin, loaded(tmp_path, small(text)), "least=0")


def test_a_joint_driven_a_little_out_of_travel_is_counted(tmp_path: Path) -> None:
    # Carriages off by 0.3 mm, where the travel ends just above the workspace.
    text = cold(text_of("linear_delta", {f"drive.{drive}.offset": -0.3 for drive in "abc"}))
    machine = loaded(tmp_path, text)
    top = machine.inverse(machine.poses()).max() / 1e-3 + 0.1
    machine = loaded(tmp_path, text.replace("travel = [0, 580]", f"travel = [0, {float(top)!r}]"))
    model = KlipperLinear(machine, options_of(Klipper, machine))
    found = fit(machine, model)
    joints = model.joints(found.values, machine.poses())
    out = int((joints > top * 1e-3).any(axis=1).sum())
    assert 0 < out == found.n_out < len(joints)
    assert any(line.startswith(f"at {out} poses these") for line in found.statement(machine))


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
    model = KlipperLinear(machine, options_of(Klipper, machine))
    assert fit(machine, model).settled
    cut = fit(machine, model, most_evaluations=2)
    assert not cut.settled
    assert any("has not converged" in line for line in cut.statement(machine))


def test_the_cli_knows_every_adapter() -> None:
    for adapter in (Klipper, Marlin, RepRap, LinuxCncLinearDelta, LinuxCncGenhexkins, PoseMap):
        assert controller(adapter.name) is adapter
        assert adapter.doc
        assert all(option.doc for option in adapter.options.values())
