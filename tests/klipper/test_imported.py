"""Machines that were imported from printer.cfg, against Klipper's own code."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from klipper_host import BUILT, Klipper, klipper
from numpy.typing import NDArray
from printed_config import kinematics_of

import truepose as tp
from build_machine import MACHINES
from sweeps import long_member, sweep
from truepose.controllers import export
from truepose.errors import RequestError

Array = NDArray[np.float64]
MM = 1e-3

SHIPPED = BUILT / "source" / "klippy" / "config"
"""Configurations that come with Klipper."""
LINEAR = (
    "example-delta", "printer-anet-a4-2018", "printer-anycubic-kossel-2016",
    "printer-anycubic-kossel-plus-2017", "printer-flsun-q5-2020", "printer-flsun-qqs-2020",
    "printer-geeetech-301-2019", "printer-micromake-d1-2016", "printer-monoprice-mini-delta-2017",
    "printer-seemecnc-rostock-max-v2-2015", "printer-velleman-k8800-2017",
)  # fmt: skip
ROTARY = ("example-rotary-delta",)
QUICK = (LINEAR[0], ROTARY[0])
OTHERS = LINEAR[1:]
RODS = {"family.effector_radius": "28", "family.spacing": "45"}

POSES = 100_000
TAKEN = ("linear_delta", "rotary_delta")
"""Machines of the library that Klipper takes: `test_klipper` says that it takes no other."""
LIBRARY = sorted(path.stem for path in MACHINES.glob("*.toml"))


def config(name: str) -> str:
    """The text of a configuration, after Klipper is known to be there."""
    klipper("[printer]\nkinematics: delta\ndelta_radius: 1\n[stepper_a]\narm_length: 2\n"
            "position_endstop: 1\n[stepper_b]\n[stepper_c]\n", [])  # fmt: skip
    return (SHIPPED / f"{name}.cfg").read_text("utf-8")


def test_no_delta_of_klippers_is_left_out() -> None:
    config(LINEAR[0])
    kinds = {"kinematics: delta\n": LINEAR, "kinematics: rotary_delta\n": ROTARY}
    for kind, names in kinds.items():
        found = [path.stem for path in SHIPPED.glob("*.cfg") if kind in path.read_text("utf-8")]
        assert sorted(found) == sorted(names)


def random_positions(machine: tp.Machine, count: int) -> Array:
    """(count, 3) mm, all over the cylinder that Klipper may go to, and beyond its cone."""
    random = np.random.default_rng(1)
    poses = machine.poses() / MM
    radius = np.hypot(poses[:, 0], poses[:, 1]).max()
    low, high = poses[:, 2].min(), machine_top(machine)
    away, turn = radius * np.sqrt(random.random(count)), 2.0 * np.pi * random.random(count)
    up = low + (high - low) * random.random(count)
    return np.column_stack([away * np.cos(turn), away * np.sin(turn), up])


def machine_top(machine: tp.Machine) -> float:
    """mm, the highest z of the workspace and some more."""
    poses = machine.poses() / MM
    return float(poses[:, 2].max() + 0.1 * np.ptp(poses[:, 2]))


@lru_cache(maxsize=1)
def joints_of(text: str, positions: bytes) -> Klipper:
    """Klipper's answer; it is the same whatever rods the import takes the printer to have."""
    return klipper(kinematics_of(text), np.frombuffer(positions).reshape(-1, 3))


@pytest.mark.parametrize("settings", [{}, RODS], ids=["one-rod", "two-rods"])
@pytest.mark.parametrize(
    ("name", "poses"),
    [
        *((name, POSES) for name in QUICK),
        *(pytest.param(name, POSES // 10, marks=sweep) for name in OTHERS),
        *(long_member(name, POSES) for name in OTHERS),
    ],
)
def test_joints_are_klippers(
    name: str, poses: int, settings: dict[str, str], tmp_path: Path
) -> None:
    """At `poses` to which Klipper moves, to 1e-12 m."""
    text = config(name)
    path = tmp_path / "printer.cfg"
    path.write_text(text, "utf-8")
    machine = tp.import_machine(path, settings=settings).machine
    positions = random_positions(machine, int(1.2 * poses))
    answer = joints_of(text, positions.tobytes())
    taken = np.ones(len(positions), bool)
    taken[list(answer.refused)] = False
    assert taken.sum() >= poses
    turning = name in ROTARY
    arm = 0.17 if turning else 1.0
    wanted = answer.joints[taken][:poses] * (1.0 if turning else MM)
    joints = machine.inverse(positions[taken][:poses] * MM)
    assert np.abs(joints - wanted).max() * arm < 1e-12
    ends = np.array([drive.travel[1] for drive in machine.drives])
    assert np.abs(ends - answer.home_joints * (1.0 if turning else MM)).max() * arm < 1e-12


@pytest.mark.parametrize("machine_name", LIBRARY)
def test_what_was_printed_and_imported_is_printed_again(machine_name: str, tmp_path: Path) -> None:
    """Every machine of the library that Klipper takes: the same numbers, digit by digit."""
    try:
        ((name, text),) = export(
            tp.load(MACHINES / f"{machine_name}.toml"), "klipper"
        ).files.items()
    except RequestError:
        assert machine_name not in TAKEN
        return
    (tmp_path / name).write_text(text, "utf-8")
    for settings in ({}, RODS):
        machine = tp.import_machine(tmp_path / name, settings=settings).machine
        (again,) = export(machine, "klipper").files.values()
        assert numbers(again) == numbers(text)


def numbers(text: str) -> list[str]:
    """What is no comment."""
    return [line for line in text.splitlines() if not line.startswith("#")]


@pytest.mark.parametrize(
    "text",
    [
        "microsteps: 16\nrotation_distance: 40",
        "microsteps: 256\nrotation_distance: 31.5\nfull_steps_per_rotation: 400",
        "microsteps: 32\nrotation_distance: 60\ngear_ratio: 80:16, 57:11",
    ],
)
def test_a_step_is_as_long_as_klippers(text: str, tmp_path: Path) -> None:
    steppers = "".join(f"[stepper_{s}]\nposition_endstop: 297\narm_length: 333\n{text}\n"
                       for s in "abc")  # fmt: skip
    whole = f"[printer]\nkinematics: delta\ndelta_radius: 174.75\n{steppers}"
    (step, *_) = klipper(whole, []).steps
    path = tmp_path / "printer.cfg"
    row = "height0: 0.0\nheight0_pos: 1000,1000,1000\n"
    path.write_text(f"{whole}[delta_calibrate]\n{row}", "utf-8")
    found = tp.import_machine(path)
    assert found.measurements is not None
    ends = np.array([drive.travel[1] for drive in found.machine.drives])
    assert np.abs(ends - found.measurements.joints[0] - 1000 * step * MM).max() < 1e-15
