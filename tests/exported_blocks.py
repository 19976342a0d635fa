"""What the tests of small models share: machines with known shifts, blocks, and what is left over.

Deviations are put into machine files as tolerances without a band: known shifts. `firmware`
simulates the controllers, from their documentation; the actual machine is the package's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import firmware
import truepose as tp
from build_machine import MACHINES
from truepose.compensation.commands import actual_of_joints
from truepose.controllers._export import Export, options_of

Array = NDArray[np.float64]
MM, DEG = 1e-3, math.pi / 180.0
UM = 1e-6

AFTER, BEFORE = "left over with these numbers", "with the nominal machine's numbers"


def text_of(name: str, shifts: Mapping[str, float]) -> str:
    """A shipped machine with known shifts of parameters, file units, in place of its tolerances."""
    lines, table = [], ""
    for line in (MACHINES / f"{name}.toml").read_text(encoding="utf-8").splitlines():
        if line.startswith("["):
            table = line.strip()
        if line.startswith("length_tolerance") or (table == "[tolerance]" and line != table):
            continue
        lines.append(line)
        if line == "[tolerance]":
            lines += [f'"{key}" = [{value!r}, {value!r}]' for key, value in shifts.items()] + [""]
    return "\n".join(lines) + "\n"


def cold(text: str) -> str:
    """The same at its reference temperature and without a force."""
    text = re.sub(r"^temperature = .*$", "temperature = 20", text, flags=re.MULTILINE)
    # The first of the two is the unit of temperatures.
    text = text.replace("temperature = 20", 'temperature = "degC"', 1)
    return re.sub(r"^force = \{.*\n", "", text, flags=re.MULTILINE)


def loaded(folder: Path, text: str) -> tp.Machine:
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return tp.load(path)


def exported(adapter, machine: tp.Machine, *options: str) -> Export:
    return adapter.export(machine, options_of(adapter, machine, options))


def homed(
    machine: tp.Machine, home: Array, joints: Array, order: Sequence[int], unit: float = MM
) -> Array:
    """(n, n_joint) machine coordinates: the controller counts from its endstops, at travel's end.

    `joints` (n, n_joint) and `home` in the controller's order and unit; drive `order[k]` is its k.
    A coordinate is less than what the controller counts by the drive's scale.
    """
    found = np.empty_like(joints)
    for at, drive in enumerate(order):
        end, scale = machine.drives[drive].travel[1], scales_of(machine)[drive]
        found[:, drive] = end + (joints[:, at] - home[at]) * unit / scale
    return found


def scales_of(machine: tp.Machine) -> Array:
    names = machine.parameters
    return np.array([machine.nominal[names.index(f"drive.{d.name}.scale")] for d in machine.drives])


def with_scales(text: str, kind: str, scales: Sequence[float]) -> str:
    """A machine file whose drives of a kind, in the order of the file, have scales of their own."""
    left = iter(scales)
    line = f'kind = "{kind}"'
    return re.sub(re.escape(line), lambda found: f"{found[0]}\nscale = {next(left)!r}", text)


def errors(machine: tp.Machine, joints: Array) -> tuple[Array, Array]:
    """(n,) errors of the actual machine at its workspace: position, m, and orientation, rad."""
    poses = machine.poses()
    reached, status = actual_of_joints(machine, joints, near=poses)
    assert not status.any()
    linear = np.linalg.norm(reached[:, :3] - poses[:, :3], axis=1)
    if len(machine.commanded) == 3:
        return linear, np.zeros(len(poses))
    turns = [Rotation.from_euler("ZYX", p[:, [5, 4, 3]]) for p in (reached, poses)]
    return linear, (turns[0] * turns[1].inv()).magnitude()


def agree(text: str, what: str, found: Array, unit: str) -> None:
    """The highest and the rms of `found` are what the block's comment says, to 0.1 µm."""
    highest, rms = firmware.stated(text, what)[unit]
    assert abs(found.max() / UM - highest) <= 0.05 + 1e-3
    assert abs(np.sqrt(np.mean(found**2)) / UM - rms) <= 0.05 + 1e-3


def at_stated_place(machine: tp.Machine, text: str, found: Array) -> None:
    """The pose named is the one where the error is highest."""
    line = next(line for line in text.splitlines() if AFTER in line)
    place = re.search(r"at most [\d.]+ (?:um|uin) \(at ([^)]*)\)", line)
    assert place is not None
    named = [float(part.split("=")[1].split()[0]) for part in place[1].split(",")]
    scales = [
        machine.file_units["length" if name in "xyz" else "angle"].scale
        for name in machine.commanded
    ]
    away = np.abs(machine.poses() - np.array(named) * scales).max(axis=1)
    assert found[int(np.argmin(away))] > found.max() - 0.11 * UM


def only(export: Export) -> str:
    (text,) = export.files.values()
    return text


def two(export: Export) -> tuple[str, str]:
    hal, ini = sorted(export.files)
    assert hal.endswith(".hal")
    assert ini.endswith(".ini")
    return export.files[hal], export.files[ini]


def random_shifts(name: str, seed: int, size: float, *, scale: float = 2e-4) -> dict[str, float]:
    """Every joint centre and every drive's zero off by up to `size` mm, its scale by `scale`."""
    generator = np.random.default_rng(seed)
    machine = tp.load(MACHINES / f"{name}.toml")
    names = [
        each
        for each in machine.parameters
        if each.startswith(("strut.", "drive.")) and not each.endswith((".u", ".v", ".scale"))
    ]
    turning = [drive for drive in machine.drives if drive.coordinate == "angle"]
    angular = {f"drive.{drive.name}.offset" for drive in turning}
    shifts = {
        each: float(generator.uniform(-size, size)) * (0.1 if each in angular else 1.0)
        for each in names
    }
    scales = [f"drive.{drive.name}.scale" for drive in machine.drives]
    return shifts | {each: float(generator.uniform(-scale, scale)) for each in scales}


def turned(machine: tp.Machine, degrees: float) -> tp.Machine:
    """The whole machine, all joint centres and guideways, turned about z."""
    turn = Rotation.from_euler("z", degrees, degrees=True)
    values: dict[str, float] = {}
    names, nominal = machine.parameters, machine.nominal
    for name in {n[:-2] for n in names if n.endswith((".base.x", ".platform.x", ".origin.x"))}:
        own = [nominal[names.index(f"{name}.{axis}")] for axis in "xyz"]
        values |= {f"{name}.{a}": float(v) for a, v in zip("xyz", turn.apply(own), strict=True)}
    return machine.replace(values)
