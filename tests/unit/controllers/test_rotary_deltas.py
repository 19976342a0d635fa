"""Rotary deltas for Klipper: the block, read back and simulated, leaves what is stated."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import firmware
import truepose as tp
from build_machine import MACHINES
from exported_blocks import (
    AFTER,
    BEFORE,
    DEG,
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
    with_scales,
)
from truepose.controllers.klipper import Klipper

Array = NDArray[np.float64]


def rotary_joints(machine: tp.Machine, text: str) -> Array:
    arms = firmware.klipper_rotary(text)
    angles = np.array([arms.angles_of(position / MM) for position in machine.poses()])
    return homed(machine, arms.home, angles, [0, 1, 2], unit=1.0)


def test_the_shipped_rotary_delta_is_left_as_stated() -> None:
    machine = tp.load(MACHINES / "rotary_delta.toml")
    text = only(exported(Klipper, machine))
    found, _ = errors(machine, rotary_joints(machine, text))
    agree(text, AFTER, found, "um")
    at_stated_place(machine, text, found)
    budget = tp.budget(machine)["overall_error"].sel(component=["x", "y", "z"])
    agree(text, BEFORE, np.linalg.norm(budget.values, axis=1), "um")


@pytest.mark.parametrize("seed", range(2))
def test_a_rotary_delta_off_everywhere_is_left_as_stated(seed: int, tmp_path: Path) -> None:
    text = text_of("rotary_delta", random_shifts("rotary_delta", seed, 0.3))
    machine = loaded(tmp_path, text)
    block = only(exported(Klipper, machine))
    found, _ = errors(machine, rotary_joints(machine, block))
    agree(block, AFTER, found, "um")
    assert found.max() > 1.0 * UM
    assert np.sqrt(np.mean(found**2)) / UM < 0.5 * firmware.stated(block, BEFORE)["um"][1]


def test_a_rotary_delta_within_the_model_is_recovered(tmp_path: Path) -> None:
    radius, height = 0.4, -0.7
    lower, zeros = (0.3, -0.25, 0.1), (0.05, 0.2, -0.1)
    shifts: dict[str, float] = {}
    for drive, at, rod, zero in zip("abc", (30, 150, 270), lower, zeros, strict=True):
        out = np.array([math.cos(at * DEG), math.sin(at * DEG)])
        shifts[f"drive.{drive}.origin.x"], shifts[f"drive.{drive}.origin.y"] = (
            radius * out
        ).tolist()
        shifts[f"drive.{drive}.origin.z"] = height
        shifts[f"drive.{drive}.offset"] = zero
        for number in "12":
            shifts[f"strut.{drive}{number}.length"] = rod
    machine = loaded(tmp_path, cold(text_of("rotary_delta", shifts)))
    text = only(exported(Klipper, machine))
    found, _ = errors(machine, rotary_joints(machine, text))
    assert found.max() < 0.1 * UM
    assert firmware.stated(text, BEFORE)["um"][0] > 500.0
    arms = firmware.klipper_rotary(text)
    assert arms.radius == pytest.approx(33.9 + radius, abs=2e-3)
    assert arms.height == pytest.approx(412.9 + height, abs=2e-3)
    assert np.abs(arms.lower - [320.000011, 320, 319.999985] - lower).max() < 2e-3
    # At the end of travel, 50 degrees, an arm stands at its zero's shift more.
    assert np.abs(np.degrees(arms.home) - 50.0 - zeros).max() < 1e-3


def test_a_rotary_delta_that_stands_turned(tmp_path: Path) -> None:
    turn = Rotation.from_euler("z", 25, degrees=True)

    def moved(line: re.Match[str]) -> str:
        vector = turn.apply([float(part) for part in line[2].split(",")])
        return f"{line[1]} = [{', '.join(repr(float(v)) for v in vector)}]"

    text = cold(text_of("rotary_delta", {}))
    text = re.sub(r"^(origin|axis|base|platform) = \[(.*)\]", moved, text, flags=re.MULTILINE)
    text = text.replace("[tolerance]", '[tolerance]\n"strut.a1.length" = [0.2, 0.2]', 1)
    machine = loaded(tmp_path, text)
    block = only(exported(Klipper, machine))
    found, _ = errors(machine, rotary_joints(machine, block))
    agree(block, AFTER, found, "um")
    angles = np.degrees(firmware.klipper_rotary(block).angles)
    assert np.abs(angles - [55.0, 175.0, 295.0]).max() < 0.05


def test_gears_that_are_not_what_they_are_called(tmp_path: Path) -> None:
    # Half a turn of the coordinate's for every turn of the arm: exact by design.
    text = with_scales(cold(text_of("rotary_delta", {})), "crank", (0.5, 0.51, 1.02))
    text = text.replace("travel = [-75, 50]", "travel = [-150, 45]")
    machine = loaded(tmp_path, text)
    block = only(exported(Klipper, machine))
    found, _ = errors(machine, rotary_joints(machine, block))
    agree(block, AFTER, found, "um")
    assert found.max() < 0.1 * UM
    assert "# the controller counts true travel: its steps per mm or degree" in block


def test_arms_that_the_controller_would_turn_too_far_are_refused(tmp_path: Path) -> None:
    # The switches half a turn beyond: Klipper, which counts arms from -180 to 180 degrees, would
    # come down to the workspace a whole turn off.
    text = (MACHINES / "rotary_delta.toml").read_text(encoding="utf-8")
    wide = loaded(tmp_path, text.replace("travel = [-75, 50]", "travel = [-75, 290]"))
    with pytest.raises(tp.errors.RequestError, match="leaves its travel") as failure:
        exported(Klipper, wide)
    (problem,) = failure.value.problems
    assert problem.code == "controller-cannot"
    assert "-75 deg to 290 deg" in str(problem.expected)
    assert "switches" in str(problem.hint)
    # At its switch of old it is the machine of old.
    near = only(exported(Klipper, wide, "switches=50"))
    old = only(exported(Klipper, loaded(tmp_path, text)))
    assert firmware.read_cfg(near) == firmware.read_cfg(old)


def test_a_switch_that_no_height_tells_is_refused(tmp_path: Path) -> None:
    # With the arms up at 150 degrees no rod reaches the axis.
    text = (MACHINES / "rotary_delta.toml").read_text(encoding="utf-8")
    wide = loaded(tmp_path, text.replace("travel = [-75, 50]", "travel = [-75, 150]"))
    with pytest.raises(tp.errors.RequestError, match="switch") as failure:
        exported(Klipper, wide)
    assert failure.value.problems[0].code == "controller-cannot"


def test_shoulders_beside_the_axis_are_refused(tmp_path: Path) -> None:
    # Drives and workspace half a metre along x.
    text = cold((MACHINES / "rotary_delta.toml").read_text(encoding="utf-8"))
    text = re.sub(
        r"^origin = \[([-.\d]+),", lambda m: f"origin = [{float(m[1]) + 500!r},", text, flags=re.M
    )
    text = text.replace("x = [-60, 60, 5]", "x = [440, 560, 5]")
    with pytest.raises(tp.errors.RequestError, match="z axis") as failure:
        exported(Klipper, loaded(tmp_path, text))
    assert failure.value.problems[0].code == "controller-cannot"


def test_cranks_that_count_the_other_way(tmp_path: Path) -> None:
    # Axes reversed, and with them angles, travel and the mode: the same numbers.
    text = (MACHINES / "rotary_delta.toml").read_text(encoding="utf-8")

    def reversed_(line: re.Match[str]) -> str:
        return f"axis = [{', '.join(repr(-float(part)) for part in line[1].split(','))}]"

    other = re.sub(r"^axis = \[(.*)\]", reversed_, text, flags=re.MULTILINE)
    other = other.replace("travel = [-75, 50]", "travel = [-50, 75]")
    other = other.replace('working_mode = "+"', 'working_mode = "-"')
    one, two = (
        firmware.klipper_rotary(only(exported(Klipper, loaded(tmp_path, each))))
        for each in (text, other)
    )
    assert np.abs(one.home - two.home).max() < 1e-7
    assert np.abs(one.angles - two.angles).max() < 1e-7
    assert np.abs(one.upper - two.upper).max() < 1e-4
