"""LinuxCNC's configurations read: genhexkins and lineardeltakins, by INI and by HAL file."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from truepose.errors import MachineFileError

FILES = Path(__file__).parents[2] / "controller_files" / "linuxcnc"
MM = 1e-3
Array = NDArray[np.float64]

TRUTH = json.loads((FILES / "truth.json").read_text("utf-8"))
HAL = (FILES / "hexapod.hal").read_text("utf-8")
INI = (FILES / "hexapod.ini").read_text("utf-8")

DELTA_INI = """\
[KINS]
KINEMATICS = lineardeltakins
JOINTS = 3
[TRAJ]
LINEAR_UNITS = inch
[HAL]
HALCMD = setp lineardeltakins.R [DELTA]R
HALCMD = lineardeltakins.L = 10.5
[DELTA]
R = 5.25
[AXIS_X]
MIN_LIMIT = -3
MAX_LIMIT = 3
[AXIS_Y]
MIN_LIMIT = -2.5
MAX_LIMIT = 3
[AXIS_Z]
MIN_LIMIT = 0
MAX_LIMIT = 8
[JOINT_0]
MIN_LIMIT = 1
MAX_LIMIT = 22
[JOINT_1]
MIN_LIMIT = 1
MAX_LIMIT = 22
[JOINT_2]
MIN_LIMIT = 1
MAX_LIMIT = 22.5
"""


def of_poses(rows: list[dict[str, list[float]]]) -> tuple[Array, Array]:
    """Poses (n, 6), m and rad, and joints (n, 6), m."""
    poses = np.array([row["pose"] for row in rows], np.float64)
    poses[:, :3] *= MM
    poses[:, 3:] = np.radians(poses[:, 3:])
    return poses, np.array([row["held_joints"] for row in rows]) * MM


def folder_of(folder: Path, hal: str = HAL, ini: str | None = INI) -> Path:
    (folder / "hexapod.hal").write_text(hal, "utf-8")
    if ini is not None:
        (folder / "hexapod.ini").write_text(ini, "utf-8")
    return folder / ("hexapod.hal" if ini is None else "hexapod.ini")


def refusal(path: Path, **settings: str) -> str:
    with pytest.raises(MachineFileError) as failure:
        tp.import_machine(path, settings=settings)
    return str(failure.value)


@pytest.mark.parametrize("name", ["hexapod.ini", "hexapod.hal"])
def test_genhexkins_from_either_file(name: str) -> None:
    read = tp.import_machine(FILES / name)
    assert read.kind == "linuxcnc-genhexkins"
    poses, joints = of_poses(TRUTH["poses"])
    assert np.abs(read.machine.inverse(poses) - joints).max() < 1e-12
    assert read.machine.joints == tuple(f"joint_{joint}" for joint in range(6))
    np.testing.assert_allclose(read.machine.home, [0, 0, 0.52, 0, 0, 0])
    assert read.machine.drives[0].travel == pytest.approx((0.43, 0.7))
    highest = read.machine.poses().max(axis=0)
    np.testing.assert_allclose(highest[:3], [0.12, 0.12, 0.6])
    np.testing.assert_allclose(np.degrees(highest[3:]), [20, 20, 25])


def test_offsets_shift_all_joints(tmp_path: Path) -> None:
    hal = HAL.replace("net tool-offset", "# net") + "setp genhexkins.tool-offset 15\n"
    read = tp.import_machine(folder_of(tmp_path, hal + "setp genhexkins.spindle-offset 25\n"))
    poses, joints = of_poses(TRUTH["with_tool_offset_40"])
    assert np.abs(read.machine.inverse(poses) - joints).max() < 1e-12
    live = tp.import_machine(FILES / "hexapod.ini")
    assert any("G43" in assumed.sentence for assumed in live.assumptions)


def test_home_from_the_joints(tmp_path: Path) -> None:
    ini = INI.replace("HOME = 0 0 520 0 0 0\n", "")
    read = tp.import_machine(folder_of(tmp_path, ini=ini))
    np.testing.assert_allclose(read.machine.home, [0, 0, 0.52, 0, 0, 0], atol=1e-8)
    poses, joints = of_poses(TRUTH["poses"])
    for pose, lengths in zip(poses[[1, 2, 3]], joints[[1, 2, 3]], strict=True):
        tilted = ini
        for joint, length in enumerate(lengths / MM):
            before, section, after = tilted.partition(f"[JOINT_{joint}]")
            head, _, rest = after.partition("HOME = ")
            tilted = f"{before}{section}{head}HOME = {length:.12f}\n{rest.partition(chr(10))[2]}"
        home = tp.import_machine(folder_of(tmp_path, ini=tilted)).machine.home
        np.testing.assert_allclose(home, pose, atol=1e-7)


def test_what_a_hal_file_alone_lacks_is_asked_for(tmp_path: Path) -> None:
    path = folder_of(tmp_path, ini=None)
    assert "import-incomplete" in refusal(path)
    assert "--set units.length=mm" in refusal(path)
    assert "--set workspace.home.z" in refusal(path, **{"units.length": "mm"})
    said = {"units.length": "inch", "workspace.home.z": "520 in"}
    machine = tp.import_machine(path, settings=said).machine
    poses, joints = of_poses(TRUTH["poses"])
    poses[:, :3] *= 25.4
    assert np.abs(machine.inverse(poses) - joints * 25.4).max() < 1e-12
    assert "travel" in {
        assumed.key.split(".")[-1] for assumed in tp.import_machine(path, settings=said).assumptions
    }


def test_a_screw_that_turns_is_told(tmp_path: Path) -> None:
    hal = HAL.replace("genhexkins.screw-lead 0", "genhexkins.screw-lead 5")
    read = tp.import_machine(folder_of(tmp_path, hal))
    assert any("screw-lead 5" in lost for lost in read.lost)
    assert not any("screw-lead" in lost for lost in tp.import_machine(FILES / "hexapod.ini").lost)


def test_lineardeltakins_in_inches(tmp_path: Path) -> None:
    (tmp_path / "delta.ini").write_text(DELTA_INI, "utf-8")
    read = tp.import_machine(tmp_path / "delta.ini")
    assert read.kind == "linuxcnc-lineardelta"
    numbers = np.random.default_rng(1)
    position = numbers.uniform([-1.5, -1.5, 0], [1.5, 1.5, 8], (1000, 3))
    angle = np.radians([90.0, 210.0, 330.0])
    towers = 5.25 * np.column_stack([np.cos(angle), np.sin(angle)])
    sideways = np.linalg.norm(position[:, np.newaxis, :2] - towers, axis=2)
    heights = position[:, 2:] + np.sqrt(10.5**2 - sideways**2)
    inch = 0.0254
    assert np.abs(read.machine.inverse(position * inch) - heights * inch).max() < 1e-12
    assert read.machine.drives[2].travel == pytest.approx((inch, 22.5 * inch))
    assert np.hypot(*read.machine.poses()[:, :2].T).max() == pytest.approx(2.5 * inch)


@pytest.mark.parametrize(
    ("change", "line", "said"),
    [
        (("genhexkins.base.2.x -212.132", "genhexkins.base.2.x -212,132"), 13, "cannot be read"),
        (("setp genhexkins.base.2.x -212.132", ""), None, "genhexkins.base.2.x"),
        (("setp genhexkins.base.2.x -212.132", "net g genhexkins.base.2.x"), None, "signal"),
    ],
)
def test_pins_that_cannot_be_read(
    change: tuple[str, str], line: int | None, said: str, tmp_path: Path
) -> None:
    told = refusal(folder_of(tmp_path, HAL.replace(*change)))
    assert said in told
    if line is not None:
        assert f"hexapod.hal:{line}:" in told


def test_files_that_are_not_beside_it_are_told(tmp_path: Path) -> None:
    path = folder_of(tmp_path)
    (tmp_path / "hexapod.hal").rename(tmp_path / "other.hal")
    assert "hexapod.hal cannot be read here" in refusal(path)
    path.write_text(INI.replace("HALFILE = hexapod.hal", "HALFILE = ../other.hal"), "utf-8")
    shutil.copy(tmp_path / "other.hal", tmp_path.parent / "other.hal")
    assert "../other.hal cannot be read here" in refusal(path)


def test_an_ini_includes_and_a_hal_file_sources(tmp_path: Path) -> None:
    head, _, joints = INI.partition("[JOINT_0]")
    path = folder_of(tmp_path, ini=f"{head}#INCLUDE joints.inc\n")
    (tmp_path / "joints.inc").write_text(f"[JOINT_0]{joints}", "utf-8")
    pins = [line for line in HAL.splitlines() if "genhexkins.platform" in line]
    (tmp_path / "platform.hal").write_text("\n".join([*pins, ""]), "utf-8")
    rest = "\n".join(line for line in HAL.splitlines() if line not in pins)
    (tmp_path / "hexapod.hal").write_text(f"{rest}\nsource platform.hal\n", "utf-8")
    machine = tp.import_machine(path).machine
    assert machine.drives[0].travel == pytest.approx((0.43, 0.7))
    poses, joints_found = of_poses(TRUTH["poses"])
    assert np.abs(machine.inverse(poses) - joints_found).max() < 1e-12


def test_units_and_limits_that_are_none(tmp_path: Path) -> None:
    path = folder_of(tmp_path, ini=INI.replace("LINEAR_UNITS = mm", "LINEAR_UNITS = cubit"))
    assert "hexapod.ini:27:" in refusal(path)
    ini = INI.replace("MAX_LIMIT = 700", "MAX_LIMIT = 1e99").replace("MIN_LIMIT = -120", "")
    read = tp.import_machine(folder_of(tmp_path, ini=ini))
    said = " ".join(assumed.sentence for assumed in read.assumptions)
    assert "half to one and a half" in said
    assert "workspace in x y is" in said


@pytest.mark.parametrize(
    ("kinematics", "said"),
    [
        ("rotarydeltakins", "truepose init rotary_delta"),
        ("pentakins", "rings"),
        ("tripodkins", "tripod"),
        ("trivkins coordinates=xyz", "no parallel machine"),
        ("corexykins", "no parallel machine"),
    ],
)
def test_other_kinematics_are_declined_by_name(kinematics: str, said: str, tmp_path: Path) -> None:
    path = folder_of(tmp_path, ini=INI.replace("genhexkins", kinematics))
    told = refusal(path)
    assert "import-declined" in told
    assert kinematics.split()[0] in told
    assert said in told


def test_smoothieware_and_grbl_are_declined_by_name(tmp_path: Path) -> None:
    (tmp_path / "config").write_text("arm_solution linear_delta\narm_length 250.0\n", "utf-8")
    assert "Smoothieware" in refusal(tmp_path / "config")
    (tmp_path / "grbl.txt").write_text("$100=250.000\n$101=250.000\n", "utf-8")
    assert "Grbl" in refusal(tmp_path / "grbl.txt")
