"""Homing again without switches, in the real LinuxCNC: the zero of no joint shifts.

LinuxCNC then calls HOME where the joint stands; `joint.N.motor-offset` is the zero that it found.
"""

from __future__ import annotations

import re

import numpy as np
import pytest
from module_under_test import exported
from real_linuxcnc import Run, Step, required, run

import truepose as tp
from command_line import MACHINES
from truepose.controllers._export import options_of
from truepose.controllers.linuxcnc import LinuxCNC

MACHINE = "planar_two_slider"
JOINTS = 2
TIMES = 5
ZERO = 1e-9
"""mm that a zero may shift by."""
WARM = 45.0
"""Degrees Celsius of the first strut."""
DENIED = "Homing denied by motion.homing-inhibit"

OFFSETS = [f"joint.{number}.motor-offset" for number in range(JOINTS)]
MOTORS = [f"joint.{number}.motor-pos-cmd" for number in range(JOINTS)]


def steps(home: str) -> list[Step]:
    """Homing while compensated, faded in joint mode, faded at home, and where nothing refuses."""

    def read(label: str) -> Step:
        return {"do": "read", "label": label, "pins": [*OFFSETS, *MOTORS, "truepose.faded"]}

    def fade(value: int) -> list[Step]:
        return [
            {"do": "set", "name": "truepose.fade", "value": value},
            {"do": "until_pin", "pin": "truepose.faded", "value": bool(value)},
            {"do": "settle"},
        ]

    settle: Step = {"do": "settle"}
    go: Step = {"do": "mdi", "text": home}
    world: Step = {"do": "world_mode"}
    plan: list[Step] = [
        {"do": "home"},
        {"do": "set", "name": "truepose.enable", "value": 1},
        {"do": "signal", "name": "t0", "value": WARM},
        settle,
        go,
        read("warm"),
        {"do": "rehome", "label": "compensated"},
        read("after compensated"),
        *fade(1),
        {"do": "rehome", "label": "faded in joint mode"},
        read("after faded in joint mode"),
        world,
        *fade(0),
    ]
    for number in range(TIMES):
        plan += [
            *fade(1),
            go,
            {"do": "rehome", "label": f"home {number}"},
            world,
            *fade(0),
            read(f"after home {number}"),
        ]
    plan += [{"do": "unlink", "pin": "motion.homing-inhibit"}]
    plan += [{"do": "set", "name": "motion.homing-inhibit", "value": 0}]
    for number in range(2):
        plan += [
            {"do": "rehome", "label": f"not refused {number}"},
            world,
            go,
            settle,
            read(f"after not refused {number}"),
        ]
    return plan


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Run:
    required()
    machine = tp.load(MACHINES / f"{MACHINE}.toml")
    files = LinuxCNC.export(machine, options_of(LinuxCNC, machine, ["clamp=1 mm"])).files
    pins = re.findall(r"=> (truepose\.\S+-temperature)", exported(machine)["hal"])
    x, y = machine.home[:2] * 1e3
    return run(
        tmp_path_factory.mktemp("run"),
        files,
        steps(f"G0 X{x:.6f} Y{y:.6f}"),
        axes="XY",
        joints=JOINTS,
        hal="".join(f"net t{number} {pin}\n" for number, pin in enumerate(pins)),
    )


def pins_of(run: Run, label: str, names: list[str]) -> np.ndarray:
    return np.array([run[label]["pins"][name] for name in names])


@pytest.mark.parametrize("state", ["compensated", "faded in joint mode"])
def test_homing_beside_the_nominal_home_is_refused(done: Run, state: str) -> None:
    assert any(DENIED in error for error in done[state]["refused"])
    shift = pins_of(done, f"after {state}", OFFSETS) - pins_of(done, "warm", OFFSETS)
    assert np.array_equal(shift, [0.0, 0.0])
    assert done[f"after {state}"]["pins"]["truepose.faded"] == (state != "compensated")


def test_the_zero_does_not_shift_when_homed_again_faded_out(done: Run) -> None:
    warm = pins_of(done, "warm", OFFSETS)
    for number in range(TIMES):
        assert done[f"home {number}"]["refused"] == []
        after = f"after home {number}"
        assert np.abs(pins_of(done, after, OFFSETS) - warm).max() < ZERO
        # And with the compensation in again the motors stand where they stood.
        moved = pins_of(done, after, MOTORS) - pins_of(done, "warm", MOTORS)
        assert np.abs(moved).max() < ZERO
        assert not done[after]["pins"]["truepose.faded"]


def test_what_is_refused_would_shift_the_zero(done: Run) -> None:
    """By the whole compensation, each time anew."""
    machine = tp.load(MACHINES / f"{MACHINE}.toml")
    reference = machine.condition.reference_temperature
    condition = machine.condition.replace(
        temperature={"default": reference, machine.struts[0].part: WARM + 273.15},
        force=(0.0, 0.0, 0.0),
        moment=(0.0, 0.0, 0.0),
    )
    result = tp.compensate(machine, machine.home[:2], condition)
    added = (result["joint_corrected"].values[0] - result["joint_nominal"].values[0]) * 1e3
    assert np.abs(added).max() > 0.1
    warm = pins_of(done, "warm", OFFSETS)
    for number in range(2):
        shift = pins_of(done, f"after not refused {number}", OFFSETS) - warm
        assert np.abs(shift - (number + 1) * added).max() < 1e-6
