"""The HAL blocks in LinuxCNC's own genhexkins and lineardeltakins, as they are installed.

The modules are loaded into this process, given the block as it stands and asked for the joints of
the workspace; these, counted from HOME_OFFSET, drive the actual machine.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import firmware
import truepose as tp
from benchmarks.kinematics_host import NEEDED, PACKAGED, Host, available, the_host
from build_machine import MACHINES
from kinematics_module import kinematics_of
from system_package import missing
from truepose.compensation.commands import actual_of_joints
from truepose.controllers._export import options_of
from truepose.controllers.linuxcnc_genhexkins import LinuxCncGenhexkins
from truepose.controllers.linuxcnc_lineardelta import LinuxCncLinearDelta

Array = NDArray[np.float64]
UM = 1e-6


@pytest.fixture(scope="module")
def host() -> Host:
    if not (available() and PACKAGED.is_dir()):
        missing(f"no LinuxCNC: apt-get install --no-install-recommends {NEEDED}")
    return the_host()


def joints_of(host: Host, folder: Path, module: str, count: int, hal: str, poses: Array) -> Array:
    """(n, count) the module's inverse for poses (n, 6), in the block's units and degrees."""
    kinematics = kinematics_of(host, folder, module, count, hal)
    joints = [kinematics.inverse(pose.tolist()) for pose in poses]
    assert all(row is not None for row in joints)
    return np.array(joints)


def check(machine: tp.Machine, hal: str, joints: Array) -> None:
    """Position errors of the actual machine are as the block's comment says."""
    poses = machine.poses()
    reached, status = actual_of_joints(machine, joints, near=poses)
    assert not status.any()
    found = np.linalg.norm((reached - poses)[:, :3], axis=1)
    highest, rms = firmware.stated(hal, "left over with these numbers")["um"]
    assert abs(found.max() / UM - highest) <= 0.05 + 1e-3
    assert abs(np.sqrt(np.mean(found**2)) / UM - rms) <= 0.05 + 1e-3


@pytest.mark.parametrize(("name", "unit"), [("hexapod", 0.0254), ("hexapod_telescope", 1e-3)])
def test_genhexkins(host: Host, name: str, unit: float, tmp_path: Path) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    files = LinuxCncGenhexkins.export(machine, options_of(LinuxCncGenhexkins, machine)).files
    hal, ini = (next(t for n, t in files.items() if n.endswith(end)) for end in (".hal", ".ini"))
    poses = machine.poses().copy()
    poses[:, :3] /= unit
    poses[:, 3:] = np.degrees(poses[:, 3:])
    joints = joints_of(host, tmp_path, "genhexkins", 6, hal, poses)
    sections = firmware.read_ini(ini)
    home = [float(sections[f"JOINT_{joint}"]["HOME_OFFSET"]) for joint in range(6)]
    starts = np.array([drive.travel[0] for drive in machine.drives])
    check(machine, hal, (joints - home) * unit + starts)


def test_lineardeltakins(host: Host, tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    files = LinuxCncLinearDelta.export(machine, options_of(LinuxCncLinearDelta, machine)).files
    hal, ini = (next(t for n, t in files.items() if n.endswith(end)) for end in (".hal", ".ini"))
    poses = np.zeros((len(machine.poses()), 6))
    poses[:, :3] = machine.poses() / 1e-3
    joints = joints_of(host, tmp_path, "lineardeltakins", 3, hal, poses)
    sections = firmware.read_ini(ini)
    home = [float(sections[f"JOINT_{joint}"]["HOME_OFFSET"]) for joint in range(3)]
    drives = [2, 0, 1]  # joints 0 1 2 are drives c a b
    found = np.empty_like(joints)
    for joint, drive in enumerate(drives):
        end = machine.drives[drive].travel[1]
        found[:, drive] = end + (joints[:, joint] - home[joint]) * 1e-3
    check(machine, hal, found)
