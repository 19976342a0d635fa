"""Exported printer.cfg in Klipper's own code: it reads them, and leaves over what they state."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from klipper_host import klipper
from numpy.typing import NDArray

import firmware
import truepose as tp
from build_machine import MACHINES
from exported_blocks import (
    AFTER,
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
)
from sweeps import thinned
from truepose.compensation.commands import ActualMachine
from truepose.controllers._export import options_of
from truepose.controllers.klipper import Klipper
from truepose.controllers.klipper.linear import KlipperLinear
from truepose.controllers.klipper.rotary import Rotary
from truepose.errors import RequestError

Array = NDArray[np.float64]

LIBRARY = sorted(path.stem for path in MACHINES.glob("*.toml"))
ALONG = {"linear_delta": MM, "rotary_delta": 1.0}
"""What a stepper's unit is in the machine's, m or rad."""
DELTAS = sorted(ALONG)
SEEDS = range(4)


@dataclass
class Case:
    """A machine and its block."""

    stem: str
    machine: tp.Machine
    text: str

    @property
    def poses(self) -> Array:
        """(n, 3) mm of the workspace."""
        return self.machine.poses() / MM


def case(stem: str, machine: tp.Machine) -> Case:
    return Case(stem, machine, only(exported(Klipper, machine)))


def shipped(stem: str, _: Path) -> Case:
    return case(stem, tp.load(MACHINES / f"{stem}.toml"))


def off_everywhere(seed: int) -> Callable[[str, Path], Case]:
    def made(stem: str, folder: Path) -> Case:
        return case(stem, loaded(folder, text_of(stem, random_shifts(stem, seed, 0.3))))

    return made


def of_single_rods(stem: str, folder: Path) -> Case:
    """Every length of its own, cold and without a force: all of it is in Klipper's model."""
    rods = {"a": 0.3, "b": -0.25, "c": 0.1}
    shifts = {f"strut.{d}{n}.length": rod for d, rod in rods.items() for n in "12"}
    return case(stem, loaded(folder, cold(text_of(stem, shifts))))


MADE = {
    "shipped": shipped,
    "single-rods": of_single_rods,
    **{f"off-everywhere-{seed}": off_everywhere(seed) for seed in SEEDS},
}


def test_the_library_has_no_other_delta() -> None:
    """A machine of another kind is refused; one that is not has to be in these tests."""
    taken = []
    for stem in LIBRARY:
        try:
            exported(Klipper, tp.load(MACHINES / f"{stem}.toml"))
        except RequestError:
            continue
        taken.append(stem)
    assert taken == DELTAS


@pytest.mark.parametrize("made", thinned(list(MADE), {"shipped", "off-everywhere-0"}))
@pytest.mark.parametrize("stem", DELTAS)
def test_what_is_left_over_in_klippers_own_code(stem: str, made: str, tmp_path: Path) -> None:
    made_case = MADE[made](stem, tmp_path)
    machine, text = made_case.machine, made_case.text
    answer = klipper(text, made_case.poses)
    joints = homed(machine, answer.home_joints, answer.joints, [0, 1, 2], unit=ALONG[stem])
    found, _ = errors(machine, joints)
    agree(text, AFTER, found, "um")
    at_stated_place(machine, text, found)

    # Pose by pose, and not the largest and the rms alone.
    options = options_of(Klipper, machine)
    model = (KlipperLinear if stem == "linear_delta" else Rotary)(machine, options)
    ours = model.joints(model.parse(printed(text)), machine.poses())
    left, _ = errors(machine, ours)
    assert np.abs(found - left).max() < 0.1 * UM
    assert np.abs(joints - ours).max() < 1e-12


def printed(text: str) -> dict[str, str]:
    """The block's numbers by section and key."""
    sections = firmware.read_cfg(text)
    return {
        f"{name}.{key}": value for name, keys in sections.items() for key, value in keys.items()
    }


@pytest.mark.parametrize("stem", DELTAS)
def test_klipper_goes_to_every_pose_and_knows_where_it_is(stem: str, tmp_path: Path) -> None:
    made_case = shipped(stem, tmp_path)
    answer = klipper(made_case.text, made_case.poses)
    assert not answer.refused
    assert np.abs(answer.back - made_case.poses).max() < 1e-6
    # Once homed the steppers stand at their switches, whence the machine counts.
    simulated = getattr(firmware, f"klipper_{stem.partition('_')[0]}")(made_case.text)
    assert np.abs(answer.home_joints - simulated.home).max() < 1e-8


@pytest.mark.parametrize("stem", DELTAS)
def test_a_pose_beyond_the_workspace_is_refused(stem: str, tmp_path: Path) -> None:
    """That none was refused says something."""
    made_case = shipped(stem, tmp_path)
    poses = made_case.poses
    lowest = float(printed(made_case.text)["printer.minimum_z_position"])
    below = [[0.0, 0.0, lowest - 0.1]]
    assert klipper(made_case.text, np.vstack([poses, below])).refused == [len(poses)]


@pytest.mark.parametrize("key", ["arm_length", "lower_arm_length", "position_endstop"])
def test_a_number_that_is_another_is_seen(key: str, tmp_path: Path) -> None:
    """A micrometre in one number of the block is no longer what is stated."""
    stem = "rotary_delta" if key.startswith("lower") else "linear_delta"
    made_case = of_single_rods(stem, tmp_path)

    def longer(line: re.Match[str]) -> str:
        return f"{line[1]}{float(line[2]) + 0.001:.6f}"

    changed, count = re.subn(
        rf"^({key}: )(\S+)$", longer, made_case.text, count=1, flags=re.MULTILINE
    )
    assert count == 1
    answer = klipper(changed, made_case.poses)
    machine = made_case.machine
    joints = homed(machine, answer.home_joints, answer.joints, [0, 1, 2], unit=ALONG[stem])
    found, _ = errors(machine, joints)
    assert found.max() > 0.3 * UM
    with pytest.raises(AssertionError):
        agree(made_case.text, AFTER, found, "um")


def off_in_what_a_bed_tells(stem: str, folder: Path) -> tp.Machine:
    """Cold, with switches at places of their own, and a linear delta's towers farther out."""
    shifts: dict[str, float] = {}
    machine = tp.load(MACHINES / f"{stem}.toml")
    for drive, offset in zip(machine.drives, (0.3, -0.2, 0.1), strict=True):
        name = f"drive.{drive.name}"
        shifts[f"{name}.offset"] = offset
        if stem == "linear_delta":
            at = [machine.parameters.index(f"{name}.origin.{axis}") for axis in "xy"]
            outwards = 0.4 * machine.nominal[at] / np.linalg.norm(machine.nominal[at])
            shifts[f"{name}.origin.x"], shifts[f"{name}.origin.y"] = outwards.tolist()
    folder.mkdir()
    return loaded(folder, cold(text_of(stem, shifts)))


def bed() -> Array:
    """(25, 3) points, m, where a probe touches a level bed."""
    turns = np.radians(np.arange(0.0, 360.0, 30.0))
    rings = [[r * np.cos(t), r * np.sin(t), 0.0] for r in (0.03, 0.06) for t in turns]
    return np.array([[0.0] * 3, *rings])


@pytest.mark.parametrize("stem", DELTAS)
def test_klippers_calibration_finds_the_numbers_exported(stem: str, tmp_path: Path) -> None:
    """DELTA_CALIBRATE, from the drawing's numbers and where the actual machine touches its bed."""
    actual = off_in_what_a_bed_tells(stem, tmp_path / "actual")
    drawing = only(exported(Klipper, loaded(tmp_path, cold(text_of(stem, {})))))
    exact = ActualMachine(actual, actual.condition)
    command = exact.command(exact.deviations_at(bed()))
    assert not command.status.any()
    switches = np.array([drive.travel[1] for drive in actual.drives])
    started = klipper(drawing, bed() / MM)
    probed = started.home_joints + (command.joints - switches) / ALONG[stem]
    calibrated = klipper(drawing, bed() / MM, probed).calibrated

    keys = [f"stepper_{letter}.position_endstop" for letter in "abc"]
    keys += ["printer.delta_radius"] if stem == "linear_delta" else []
    wanted, start = printed(only(exported(Klipper, actual))), printed(drawing)
    off = np.array([float(start[key]) - float(wanted[key]) for key in keys])
    assert np.abs(off).max() > 0.2
    found = [float(calibrated[section][key]) for section, key in (k.split(".") for k in keys)]
    left = np.array(found) - [float(wanted[key]) for key in keys]
    if stem == "linear_delta":
        assert np.abs(left).max() < 1e-4
    else:
        # Of a rotary delta a bed hardly tells the shoulders' height and all endstops from each
        # other, and Klipper's search ends in between: the endstops differ as they should.
        assert np.ptp(off) > 0.2
        assert np.ptp(left) < 1e-3
