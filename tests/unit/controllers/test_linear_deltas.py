"""Linear deltas: every block, read back and simulated, leaves what is stated, to 0.1 µm."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import optimize

import firmware
import truepose as tp
from build_machine import MACHINES
from exported_blocks import (
    AFTER,
    BEFORE,
    MM,
    UM,
    agree,
    at_stated_place,
    cold,
    errors,
    exported,
    homed,
    loaded,
    only,
    random_shifts,
    text_of,
    turned,
    two,
    with_scales,
)
from truepose.compensation.commands import actual_of_joints
from truepose.controllers._export import Export
from truepose.controllers.klipper import Klipper
from truepose.controllers.linuxcnc_lineardelta import LinuxCncLinearDelta
from truepose.controllers.marlin import Marlin
from truepose.controllers.reprap import RepRap

Array = NDArray[np.float64]

LINEAR_ORDER, LINUXCNC_ORDER = [0, 1, 2], [2, 0, 1]
"""Drives of machines/linear_delta.toml, a b c, in the order of towers 210, 330, 90 degrees, and in
that of joints 0 1 2 at 90, 210, 330 degrees."""


@dataclass(frozen=True)
class Printer:
    """An adapter of linear deltas, its reader, and the drives in its order."""

    adapter: type
    read: Callable[[Export], firmware.Towers]
    order: list[int]

    def joints(self, machine: tp.Machine, export: Export) -> Array:
        towers = self.read(export)
        poses = machine.poses() / MM
        heights = np.array([towers.heights(position) for position in poses])
        return homed(machine, towers.home, heights, self.order)


PRINTERS = {
    "klipper": Printer(Klipper, lambda e: firmware.klipper_linear(only(e)), LINEAR_ORDER),
    "marlin": Printer(Marlin, lambda e: firmware.marlin(only(e)), LINEAR_ORDER),
    "reprap": Printer(RepRap, lambda e: firmware.reprap(only(e)), LINEAR_ORDER),
    "linuxcnc-lineardelta": Printer(
        LinuxCncLinearDelta, lambda e: firmware.lineardeltakins(*two(e)), LINUXCNC_ORDER
    ),
}
FREE = ["klipper", "marlin", "reprap"]


@pytest.mark.parametrize("name", PRINTERS)
def test_the_shipped_delta_is_left_as_stated(name: str) -> None:
    machine, printer = tp.load(MACHINES / "linear_delta.toml"), PRINTERS[name]
    export = exported(printer.adapter, machine)
    found, _ = errors(machine, printer.joints(machine, export))
    for text in export.files.values():
        agree(text, AFTER, found, "um")
        at_stated_place(machine, text, found)
    assert any(line.startswith(AFTER) for line in export.statement)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", PRINTERS)
def test_a_delta_off_everywhere_is_left_as_stated(name: str, seed: int, tmp_path: Path) -> None:
    text = text_of("linear_delta", random_shifts("linear_delta", seed, 0.3))
    machine, printer = loaded(tmp_path, text), PRINTERS[name]
    export = exported(printer.adapter, machine)
    found, _ = errors(machine, printer.joints(machine, export))
    block = next(iter(export.files.values()))
    agree(block, AFTER, found, "um")
    at_stated_place(machine, block, found)
    # Unequal rods turn the platform: no small model takes all of it away, but most.
    before = firmware.stated(block, BEFORE)["um"]
    assert found.max() > 1.0 * UM
    few = name == "linuxcnc-lineardelta"  # five numbers do less than ten
    assert np.sqrt(np.mean(found**2)) / UM < (0.8 if few else 0.5) * before[1]


def test_the_error_before_is_the_budgets() -> None:
    # The shipped delta's nominal geometry is Klipper's model but for 4e-6 mm in its radius.
    machine = tp.load(MACHINES / "linear_delta.toml")
    export = exported(Klipper, machine)
    budget = tp.budget(machine)["overall_error"].sel(component=["x", "y", "z"])
    agree(only(export), BEFORE, np.linalg.norm(budget.values, axis=1), "um")
    turned = np.linalg.norm(
        tp.budget(machine)["overall_error"].sel(component=["rx", "ry", "rz"]).values, axis=1
    )
    line = next(line for line in export.statement if "the platform turns" in line)
    assert f"(before: {np.degrees(turned.max()) * 1e3:.3f} mdeg)" in line


def towers_of(angles: Sequence[float], radius: float) -> Array:
    return radius * np.column_stack([np.cos(np.radians(angles)), np.sin(np.radians(angles))])


def in_model(
    radius: float, turns: Sequence[float], rods: Sequence[float], endstops: Sequence[float]
) -> dict[str, float]:
    """Shifts, mm, that leave a linear delta in the controllers' model.

    Of the towers' radius, mm, and angles, degrees; of both rods of each limb; of the carriages.
    """
    shifts: dict[str, float] = {}
    nominal = towers_of([210.000032, 329.999997, 90.0], 174.750004)
    angles = np.array([210.000032, 329.999997, 90.0]) + turns
    moved = towers_of(angles, 174.750004 + radius) - nominal
    for at, drive in enumerate("abc"):
        shifts[f"drive.{drive}.origin.x"], shifts[f"drive.{drive}.origin.y"] = moved[at].tolist()
        shifts[f"drive.{drive}.offset"] = endstops[at]
        for rod in "12":
            shifts[f"strut.{drive}{rod}.length"] = rods[at]
    return shifts


@pytest.mark.parametrize("name", FREE)
def test_a_delta_within_the_model_is_recovered(name: str, tmp_path: Path) -> None:
    turns, rods, endstops = (0.11, -0.07, 0.2), (0.31, -0.22, 0.05), (0.4, -0.13, 0.27)
    shifts = in_model(0.83, turns, rods, endstops)
    machine = loaded(tmp_path, cold(text_of("linear_delta", shifts)))
    printer = PRINTERS[name]
    export = exported(printer.adapter, machine)
    found, _ = errors(machine, printer.joints(machine, export))
    assert found.max() < 0.1 * UM
    block = next(iter(export.files.values()))
    assert firmware.stated(block, AFTER)["um"][0] <= 0.1
    assert firmware.stated(block, BEFORE)["um"][0] > 500.0
    # And the numbers are the machine's own.
    towers = printer.read(export)
    expected = towers_of(np.array([210.000032, 329.999997, 90.0]) + turns, 174.750004 + 0.83)
    assert np.abs(towers.centres - expected).max() < 1e-3
    assert np.abs(towers.rods - np.array([333.000032, 332.999811, 333.000181]) - rods).max() < 1e-3
    # The endstops trip at the end of travel, 580 mm.
    assert np.abs(towers.home - 580.0 - np.array(endstops)).max() < 1e-3


def test_a_delta_within_lineardeltakins_is_recovered(tmp_path: Path) -> None:
    # One rod length and exact angles: the nominal differences are shifted away.
    rods = 333.2 - np.array([333.000032, 332.999811, 333.000181])
    turns = np.array([210.0, 330.0, 90.0]) - [210.000032, 329.999997, 90.0]
    shifts = in_model(-0.6, turns.tolist(), rods.tolist(), (0.4, -0.13, 0.27))
    machine = loaded(tmp_path, cold(text_of("linear_delta", shifts)))
    printer = PRINTERS["linuxcnc-lineardelta"]
    export = exported(printer.adapter, machine)
    found, _ = errors(machine, printer.joints(machine, export))
    assert found.max() < 0.1 * UM
    pins = firmware.read_hal(two(export)[0])
    assert pins["lineardeltakins.R"] == pytest.approx(174.150004, abs=1e-3)
    assert pins["lineardeltakins.L"] == pytest.approx(333.2, abs=1e-3)


def test_a_bed_out_of_level_is_a_tilt_to_reprap(tmp_path: Path) -> None:
    # Shear of the frame: carriages of towers farther along +x stand higher by 0.2 %.
    shifts = {
        f"drive.{drive}.offset": 0.002 * x
        for drive, x in zip("abc", (-177.318647712, 177.3186995286, 0.0), strict=True)
    }
    machine = loaded(tmp_path, cold(text_of("linear_delta", shifts)))
    tilted = exported(RepRap, machine)
    plain = exported(Klipper, machine)
    found, _ = errors(machine, PRINTERS["reprap"].joints(machine, tilted))
    agree(only(tilted), AFTER, found, "um")
    assert found.max() < 0.2 * firmware.stated(only(plain), BEFORE)["um"][0] * UM


def test_a_delta_that_stands_turned(tmp_path: Path) -> None:
    # The whole machine by 12 degrees: trims say so, and their sign is counter-clockwise.
    cold_machine = tp.load(MACHINES / "linear_delta.toml", ["condition.temperature=20"])
    machine = turned(cold_machine, 12)
    for name in FREE:
        export = exported(PRINTERS[name].adapter, machine)
        found, _ = errors(machine, PRINTERS[name].joints(machine, export))
        agree(only(export), AFTER, found, "um")
        assert found.max() < 1.0 * UM
        assert any("changed: strut.a1.base.x" in line for line in only(export).splitlines())
    words = dict(firmware.read_gcode(only(exported(Marlin, machine))))["M665"]
    assert [words[axis][0] for axis in "XYZ"] == pytest.approx([12.0] * 3, abs=1e-3)


def test_towers_are_found_by_where_they_stand(tmp_path: Path) -> None:
    # The same machine with its drives in another order in the file.
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    head, *tables = re.split(r"(?=^\[\[drive\]\])", text, flags=re.MULTILINE)
    last, rest = re.split(r"(?=^\[\[strut\]\])", tables[2], maxsplit=1, flags=re.MULTILINE)
    machine = loaded(tmp_path, head + last + tables[0] + tables[1] + rest)
    assert machine.joints == ("c", "a", "b")
    for name, order in (("marlin", [1, 2, 0]), ("linuxcnc-lineardelta", [0, 1, 2])):
        printer = Printer(PRINTERS[name].adapter, PRINTERS[name].read, order)
        export = exported(printer.adapter, machine)
        found, _ = errors(machine, printer.joints(machine, export))
        agree(next(iter(export.files.values())), AFTER, found, "um")
    assert "; towers: X a, Y b, Z c" in only(exported(Marlin, machine))
    # Switches are told in the order of the drives, c a b, and go with their towers, a b c.
    plain = firmware.marlin(only(exported(Marlin, machine)))
    moved = firmware.marlin(only(exported(Marlin, machine, "switches=570, 571, 572")))
    assert plain.home - moved.home == pytest.approx([9.0, 8.0, 10.0], abs=5e-5)


SCALES = (1.01, 0.98, 1.03)


@pytest.mark.parametrize("name", PRINTERS)
def test_scales_are_what_the_controllers_steps_are_of(name: str, tmp_path: Path) -> None:
    text = text_of("linear_delta", random_shifts("linear_delta", 4, 0.1))
    machine, printer = loaded(tmp_path, with_scales(text, "slider", SCALES)), PRINTERS[name]
    export = exported(printer.adapter, machine)
    found, _ = errors(machine, printer.joints(machine, export))
    block = next(iter(export.files.values()))
    agree(block, AFTER, found, "um")
    assert 1.0 * UM < found.max() < 500.0 * UM
    line = next(line for line in export.statement if "true travel" in line)
    assert line.endswith("a 1.01, b 0.98, c 1.03")
    # By design it is in the model: nothing is left but for lineardeltakins' one rod length.
    machine = loaded(tmp_path, cold(with_scales(text_of("linear_delta", {}), "slider", SCALES)))
    export = exported(printer.adapter, machine)
    found, _ = errors(machine, printer.joints(machine, export))
    assert found.max() < (1.0 if name == "linuxcnc-lineardelta" else 0.1) * UM


def test_limits_of_joints_with_a_scale(tmp_path: Path) -> None:
    text = with_scales((MACHINES / "linear_delta.toml").read_text("utf-8"), "slider", SCALES)
    sections = firmware.read_ini(two(exported(LinuxCncLinearDelta, loaded(tmp_path, text)))[1])
    for joint, drive in enumerate(LINUXCNC_ORDER):
        section = {key: float(value) for key, value in sections[f"JOINT_{joint}"].items()}
        span = section["MAX_LIMIT"] - section["MIN_LIMIT"]
        assert span == pytest.approx(580.0 * SCALES[drive], abs=3e-6)
        assert 0.0 <= section["HOME_OFFSET"] - section["MAX_LIMIT"] < 2e-6


def test_drives_that_count_downwards(tmp_path: Path) -> None:
    text = (MACHINES / "linear_delta.toml").read_text(encoding="utf-8")
    down = text.replace("axis = [0, 0, 1]", "axis = [0, 0, -1]").replace(
        "travel = [0, 580]", "travel = [-580, 0]"
    )
    down = down.replace('working_mode = "+"', 'working_mode = "-"')
    same = [firmware.read_cfg(only(exported(Klipper, loaded(tmp_path, t)))) for t in (text, down)]
    for section, values in same[0].items():
        for key, value in values.items():
            if key != "kinematics":
                assert float(same[1][section][key]) == pytest.approx(float(value), abs=2e-6)


def test_one_rod_a_drive(tmp_path: Path) -> None:
    # The same delta written with three struts and a platform that cannot turn.
    text = cold((MACHINES / "linear_delta.toml").read_text(encoding="utf-8"))
    text = text.replace('dof = ["x", "y", "z", "a", "b", "c"]', 'dof = ["x", "y", "z"]')
    text = re.sub(r"^angle_target.*\n", "", text, flags=re.MULTILINE)
    parts = re.split(r"(?=^\[)", text, flags=re.MULTILINE)
    single = "".join(part for part in parts if not re.search(r'^name = "[abc]2"', part, re.M))
    single = single.replace(
        "= [-12.500012092, 21.6506281133, 0]", "= [-12.500012092, 21.6506281133, 0]"
    )
    machine = loaded(tmp_path, single)
    assert len(machine.struts) == 3
    export = exported(Klipper, machine)
    printer = PRINTERS["klipper"]
    found, _ = errors(machine, printer.joints(machine, export))
    agree(only(export), AFTER, found, "um")
    assert not any("the platform turns" in line for line in export.statement)
    assert float(firmware.read_cfg(only(export))["printer"]["delta_radius"]) == pytest.approx(
        174.750004, abs=1e-3
    )


def test_switches_move_the_endstops_only() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    plain = firmware.klipper_linear(only(exported(Klipper, machine)))
    moved = firmware.klipper_linear(
        only(exported(Klipper, machine, "switches=570, 571 mm, 22.5 in"))
    )
    assert np.abs(moved.centres - plain.centres).max() < 1e-5
    lower = plain.home - moved.home
    assert lower == pytest.approx([10.0, 9.0, 580.0 - 571.5], abs=1e-5)
    every = firmware.klipper_linear(only(exported(Klipper, machine, "switches=57 cm")))
    assert plain.home - every.home == pytest.approx([10.0] * 3, abs=1e-5)


def test_marlin_with_a_probe_and_its_gauge() -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    text = only(exported(Marlin, machine, "probe_offset=-1.5", "least=0.5 mm"))
    plain = firmware.marlin(only(exported(Marlin, machine)))
    assert np.abs(firmware.marlin(text, probe_offset=-1.5).home - plain.home).max() < 2e-5
    commands = dict(firmware.read_gcode(text))
    trims = [commands["M665"][word][0] for word in "ABC"]
    assert abs(sum(trims)) < 2e-5  # the mean rod is L
    assert max(commands["M666"][word][0] for word in "XYZ") == -0.5
    assert [code for code, _ in firmware.read_gcode(text)] == ["M665", "M666"]  # nothing that moves


def test_reprap_adjustments_have_mean_zero(tmp_path: Path) -> None:
    text = text_of("linear_delta", random_shifts("linear_delta", 7, 0.3))
    commands = dict(firmware.read_gcode(only(exported(RepRap, loaded(tmp_path, text)))))
    assert abs(sum(commands["M666"][word][0] for word in "XYZ")) < 2e-5


@pytest.mark.parametrize("name", ["klipper", "linuxcnc-lineardelta"])
def test_no_other_numbers_leave_less(name: str, tmp_path: Path) -> None:
    # SciPy, from the block that was found and from the nominal numbers, on the simulation.
    text = text_of("linear_delta", random_shifts("linear_delta", 11, 0.5))
    text = text.replace(
        "x = [-80, 80, 5], y = [-80, 80, 5], z = [0, 200, 5]",
        "x = [-80, 80, 3], y = [-80, 80, 3], z = [0, 200, 2]",
    )
    machine, printer = loaded(tmp_path, text), PRINTERS[name]
    towers = printer.read(exported(printer.adapter, machine))
    poses = machine.poses()
    common = name == "linuxcnc-lineardelta"
    angles = np.arctan2(towers.centres[:, 1], towers.centres[:, 0])
    start = np.concatenate([[np.hypot(*towers.centres[0])], towers.home])
    start = np.concatenate([start, towers.rods[:1] if common else [*towers.rods, *angles]])

    def residual(values: Array) -> Array:
        turned = angles if common else values[7:]
        rods = np.full(3, values[4]) if common else values[4:7]
        centres = values[0] * np.column_stack([np.cos(turned), np.sin(turned)])
        rise = rods**2 - ((poses[:, np.newaxis, :2] / MM - centres) ** 2).sum(axis=2)
        joints = homed(machine, values[1:4], poses[:, 2:] / MM + np.sqrt(rise), printer.order)
        reached, _ = actual_of_joints(machine, joints, near=poses)
        return ((reached - poses) / UM).ravel()

    here = residual(start)
    for off in (0.0, 0.3):
        other = optimize.least_squares(
            residual,
            start + off * np.r_[1, -1, 1, 0.5, np.zeros(start.size - 4)],
            x_scale="jac",
            xtol=1e-12,
            ftol=1e-12,
        )
        assert np.sum(here**2) <= np.sum(other.fun**2) * (1.0 + 1e-6)


def test_all_poses_of_a_large_workspace_are_judged() -> None:
    # More than are fitted to.
    grid = [f"workspace.grid.{axis}=[-80, 80, 14]" for axis in "xy"]
    machine = tp.load(MACHINES / "linear_delta.toml", [*grid, "workspace.grid.z=[0, 200, 12]"])
    export = exported(Klipper, machine)
    assert any(line.startswith("over 2352 poses") for line in export.statement)
    found, _ = errors(machine, PRINTERS["klipper"].joints(machine, export))
    agree(only(export), AFTER, found, "um")
    at_stated_place(machine, only(export), found)
