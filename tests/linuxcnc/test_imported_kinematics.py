"""Imported machines beside LinuxCNC's own genhexkins and lineardeltakins, as they are installed.

The HAL file that is imported is given to the module as it stands; both are asked for the joints of
the same random poses, far more tilted than a milling machine is.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from benchmarks.kinematics_host import NEEDED, PACKAGED, Host, Module, available, the_host
from build_machine import MACHINES
from controllers_exported import written
from kinematics_module import kinematics_of
from system_package import missing
from truepose.machine import Machine

Array = NDArray[np.float64]
FILES = Path(__file__).parents[1] / "controller_files" / "linuxcnc"
UNIT = {"mm": 1e-3, "in": 0.0254}
POSES = 100_000


@pytest.fixture(scope="module")
def host() -> Host:
    if not (available() and PACKAGED.is_dir()):
        missing(f"no LinuxCNC: apt-get install --no-install-recommends {NEEDED}")
    return the_host()


def largest_difference(machine: Machine, kinematics: Module, poses: Array, unit: float) -> float:
    """The largest of all joints, m, of poses (n, 6) in the unit and degrees."""
    own = poses.copy()
    own[:, :3] *= unit
    own[:, 3:] = np.radians(own[:, 3:])
    commanded = own[:, [machine.dof.index(name) for name in machine.commanded]]
    # Beyond its travel a joint is what it is.
    imported, _ = machine.inverse(commanded, status=True)
    theirs = np.array([kinematics.inverse(pose.tolist()) for pose in poses])
    return float(np.abs(imported - theirs * unit).max())


@pytest.mark.parametrize("shift", [0.0, 40.0])
def test_genhexkins_at_1e5_tilted_poses(host: Host, shift: float, tmp_path: Path) -> None:
    hal = (FILES / "hexapod.hal").read_text("utf-8")
    if shift:
        hal = hal.replace("net tool-offset", "# net") + (
            f"setp genhexkins.tool-offset {shift}\nsetp genhexkins.spindle-offset -7.25\n"
        )
    shutil.copy(FILES / "hexapod.ini", tmp_path / "hexapod.ini")
    (tmp_path / "hexapod.hal").write_text(hal, "utf-8")
    machine = tp.import_machine(tmp_path / "hexapod.ini").machine
    kinematics = kinematics_of(host, tmp_path, "genhexkins", 6, hal)
    numbers = np.random.default_rng(3)
    least, most = [-150, -150, 400, -35, -35, -60], [150, 150, 650, 35, 35, 60]
    poses = numbers.uniform(least, most, (POSES, 6))
    assert largest_difference(machine, kinematics, poses, 1e-3) < 1e-12


@pytest.mark.parametrize("name", ["hexapod", "hexapod_telescope"])
def test_exported_hexapods_come_back_as_the_module_has_them(
    host: Host, name: str, tmp_path: Path
) -> None:
    machine = tp.load(MACHINES / f"{name}.toml")
    hal = written(machine, "linuxcnc-genhexkins", tmp_path, ".hal")
    imported = tp.import_machine(hal).machine
    unit = imported.file_units["length"].scale
    kinematics = kinematics_of(host, tmp_path, "genhexkins", 6, hal.read_text("utf-8"))
    poses = machine.poses().copy()
    poses[:, :3] /= unit
    poses[:, 3:] = np.degrees(poses[:, 3:])
    assert largest_difference(imported, kinematics, poses, unit) < 1e-12


@pytest.mark.parametrize("unit", ["mm", "in"])
def test_lineardeltakins_at_1e5_positions(host: Host, unit: str, tmp_path: Path) -> None:
    size = 1.0 if unit == "mm" else 1.0 / 25.4
    hal = (
        f"setp lineardeltakins.R {131.234 * size:.9f}\nsetp lineardeltakins.L {268.75 * size:.9f}\n"
    )
    path = tmp_path / "delta.hal"
    path.write_text(hal, "utf-8")
    machine = tp.import_machine(path, settings={"units.length": unit}).machine
    kinematics = kinematics_of(host, tmp_path, "lineardeltakins", 3, hal)
    numbers = np.random.default_rng(4)
    poses = np.zeros((POSES, 6))
    least, most = np.array([-90.0, -90.0, 0.0]) * size, np.array([90.0, 90.0, 300.0]) * size
    poses[:, :3] = numbers.uniform(least, most, (POSES, 3))
    assert largest_difference(machine, kinematics, poses, UNIT[unit]) < 1e-12
