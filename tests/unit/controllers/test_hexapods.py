"""Hexapods for genhexkins: the block, read back and simulated, leaves what is stated."""

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
    UM,
    agree,
    at_stated_place,
    cold,
    errors,
    exported,
    loaded,
    random_shifts,
    scales_of,
    text_of,
    two,
    with_scales,
)
from truepose.controllers._export import Export
from truepose.controllers.linuxcnc_genhexkins import LinuxCncGenhexkins
from truepose.controllers.linuxcnc_lineardelta import LinuxCncLinearDelta

Array = NDArray[np.float64]


def hexapod_joints(machine: tp.Machine, export: Export) -> Array:
    model = firmware.genhexkins(*two(export))
    starts = np.array([drive.travel[0] for drive in machine.drives])
    return (model.lengths(machine.poses()) - model.home) / scales_of(machine) + starts


@pytest.mark.parametrize("name", ["hexapod", "hexapod_telescope"])
def test_a_shipped_hexapod_is_left_as_stated(name: str) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    export = exported(LinuxCncGenhexkins, machine)
    position, orientation = errors(machine, hexapod_joints(machine, export))
    for text in export.files.values():
        agree(text, AFTER, position, "um")
        agree(text, AFTER, orientation, "urad")
        at_stated_place(machine, text, position)
    assert ("inch" if name == "hexapod" else "mm") in two(export)[0]


@pytest.mark.parametrize("units", ["mm", "inch"])
@pytest.mark.parametrize("name", ["hexapod", "hexapod_telescope"])
def test_a_hexapod_off_everywhere_is_recovered(name: str, units: str, tmp_path: Path) -> None:
    # All 36 coordinates and 6 offsets are in the model: nothing but rounding is left.
    size = 0.02 if name == "hexapod" else 0.5  # in, mm
    text = cold(text_of(name, random_shifts(name, 3, size, scale=0.0)))
    machine = loaded(tmp_path, text)
    export = exported(LinuxCncGenhexkins, machine, f"units={units}")
    position, orientation = errors(machine, hexapod_joints(machine, export))
    assert position.max() < 0.1 * UM
    assert orientation.max() < 0.1 * UM
    hal = two(export)[0]
    assert firmware.stated(hal, BEFORE)["um"][0] > 100.0
    agree(hal, AFTER, position, "um")


SCALES = (1.01, 0.98, 1.0, 1.03, 0.99, 1.005)


def test_leads_that_are_not_what_they_are_called(tmp_path: Path) -> None:
    # By design: nothing is left over; and off by a little: as stated.
    text = cold(with_scales(text_of("hexapod", {}), "telescopic", SCALES))
    machine = loaded(tmp_path, text)
    export = exported(LinuxCncGenhexkins, machine)
    position, _ = errors(machine, hexapod_joints(machine, export))
    assert position.max() < 0.1 * UM
    line = next(line for line in export.statement if "true travel" in line)
    named = [f"{drive.name} {s:g}" for drive, s in zip(machine.drives, SCALES, strict=True)]
    assert line.endswith(", ".join(each for each in named if not each.endswith(" 1")))
    # The limits of the joints are their lengths at the ends of travel.
    sections = firmware.read_ini(two(export)[1])
    for joint, (drive, scale) in enumerate(zip(machine.drives, SCALES, strict=True)):
        section = {key: float(value) for key, value in sections[f"JOINT_{joint}"].items()}
        span = (drive.travel[1] - drive.travel[0]) * scale / 0.0254
        assert section["MAX_LIMIT"] - section["MIN_LIMIT"] == pytest.approx(span, abs=3e-8)
        assert 0.0 <= section["MIN_LIMIT"] - section["HOME_OFFSET"] < 2e-8
    off = with_scales(text_of("hexapod", random_shifts("hexapod", 5, 0.02)), "telescopic", SCALES)
    machine = loaded(tmp_path, off)
    export = exported(LinuxCncGenhexkins, machine)
    position, _ = errors(machine, hexapod_joints(machine, export))
    agree(two(export)[0], AFTER, position, "um")
    assert position.max() > 1.0 * UM


def test_pins_that_must_be_zero_are_set() -> None:
    pins = firmware.read_hal(
        two(exported(LinuxCncGenhexkins, tp.load(MACHINES / "hexapod.toml")))[0]
    )
    for pin in ("screw-lead", "spindle-offset", "tool-offset"):
        assert pins[f"genhexkins.{pin}"] == 0.0


def test_a_small_workspace_leaves_numbers_where_they_were(tmp_path: Path) -> None:
    # One height, no angles: most of the 42 numbers do not show, and must not wander off.
    text = cold(text_of("hexapod", random_shifts("hexapod", 3, 0.02, scale=0.0)))
    text = re.sub(
        r"^grid = .*$",
        "grid = { x = [-4, 4, 5], y = [-4, 4, 5], z = [20, 20, 1] }",
        text,
        flags=re.MULTILINE,
    )
    machine = loaded(tmp_path, text)
    export = exported(LinuxCncGenhexkins, machine)
    model = firmware.genhexkins(*two(export))
    position, orientation = errors(machine, hexapod_joints(machine, export))
    assert position.max() < 0.1 * UM
    assert orientation.max() < 0.1 * UM
    nominal = tp.load(MACHINES / "hexapod.toml").nominal
    for strut in range(6):
        off = np.r_[model.base[strut], model.platform[strut]] - nominal[6 * strut : 6 * strut + 6]
        assert np.abs(off).max() < 3 * 0.02 * 0.0254
    assert "of the numbers" in export.statement[0]
    assert "hardly tells" in export.statement[0]


def test_home_and_limits_of_linuxcnc_joints() -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    hal, ini = two(exported(LinuxCncGenhexkins, machine))
    model, sections = firmware.genhexkins(hal, ini), firmware.read_ini(ini)
    home = model.lengths(machine.home[np.newaxis])[0] / 0.0254
    for joint, (drive, wanted) in enumerate(zip(machine.drives, home, strict=True)):
        section = {key: float(value) for key, value in sections[f"JOINT_{joint}"].items()}
        assert section["HOME"] == pytest.approx(wanted, abs=1e-8)
        # The joint's value at its switch, where travel starts, is HOME_OFFSET.
        assert 0.0 <= section["MIN_LIMIT"] - section["HOME_OFFSET"] < 2e-8
        span = (drive.travel[1] - drive.travel[0]) / 0.0254
        assert section["MAX_LIMIT"] - section["MIN_LIMIT"] == pytest.approx(span, abs=3e-8)
    linear = tp.load(MACHINES / "linear_delta.toml")
    sections = firmware.read_ini(two(exported(LinuxCncLinearDelta, linear))[1])
    for joint in range(3):
        section = {key: float(value) for key, value in sections[f"JOINT_{joint}"].items()}
        assert 0.0 <= section["HOME_OFFSET"] - section["MAX_LIMIT"] < 2e-6
        assert section["MAX_LIMIT"] - section["MIN_LIMIT"] == pytest.approx(580.0, abs=3e-6)
