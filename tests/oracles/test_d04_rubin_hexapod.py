"""D04, hexapods of the Rubin Observatory: small strokes about a pivot far away (m, rad, um)."""

from __future__ import annotations

import numpy as np

from build_machine import MACHINES, description_of, hexapod
from oracle_cases import Published, case, pose_in_order
from reference_kinematics import rotation_of
from truepose import _kernel

CASE = case("d04_rubin_hexapod")
UM = 1e-6


def machine_about(
    pivot: list[float], moving: np.ndarray, fixed: np.ndarray
) -> tuple[_kernel.Machine, np.ndarray]:
    """The machine, its tool at the pivot and its strokes counted from the pose zero, and that pose.

    The end that the source names base is the one that moves.
    """
    offset = np.linalg.norm(moving - fixed, axis=1)
    home = dict(zip("xyz", pivot, strict=True))
    machine = _kernel.Machine(hexapod(fixed, moving, offset=offset, tool=pivot, home=home))
    return machine, np.r_[pivot, 0.0, 0.0, 0.0]


def test_strokes_about_the_pivot(published: Published) -> None:
    data = CASE["case_a"]
    machine, zero = machine_about(
        data["pivot"], np.array(data["base_points"]), np.array(data["mirror_points"])
    )
    pose = zero + pose_in_order("xyz", data["pose"][:3], data["pose"][3:])

    strokes = machine.inverse(pose)
    published("strokes about a pivot", data["delta_lengths"], strokes, within=6e-6, unit="m")

    # From the five published decimals back to the pose, to four.
    found = machine.forward(data["delta_lengths"])
    assert np.abs(found[:3] - pose[:3]).max() < 1e-4
    assert np.abs(rotation_of(found[3:]) - rotation_of(pose[3:])).max() < 1e-4


def ring(radius: float, degrees: list[float], z: float) -> np.ndarray:
    angles = np.radians(degrees)
    return np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(6, z)])


def test_strokes_of_a_zigzag_hexapod(published: Published) -> None:
    data = CASE["case_b"]
    moving = ring(1.2, [10, 130, 130, 250, 250, 10], 0.0)
    fixed = ring(2.3, [70, 70, 190, 190, 310, 310], 0.81)
    machine, zero = machine_about([0.0, 0.0, 0.0], moving, fixed)
    strokes = machine.inverse(zero + np.r_[data["translation_um"], 0, 0, 0] * UM)
    published("strokes of a zigzag", data["delta_um"], strokes / UM, within=0.006, unit="um")


def test_load_paths_of_the_m2_hexapod_are_separate() -> None:
    # Three struts stand along z, three lie in a plane: a force along z loads the first three only.
    extra = CASE["extra_geometry_um"]
    pivot, moving, fixed = (
        np.array(extra[key], float) * UM for key in ("pivot_m2", "m2_base", "m2_mirror")
    )
    machine, zero = machine_about(pivot.tolist(), moving, fixed)
    tension = machine.forces(zero, [0.0, 0.0, 1000.0, 0.0, 0.0, 0.0])
    # The struts hang the moving part from above, so a push upwards presses them.
    assert np.isclose(tension[:3].sum(), -1000.0, rtol=1e-12)
    assert np.abs(tension[3:]).max() < 1e-9


def test_the_shipped_machine_is_this_one() -> None:
    extra = CASE["extra_geometry_um"]
    pivot = np.array(extra["pivot_camera"], float)
    shipped = description_of(MACHINES / "hexapod_telescope.toml")
    for key, points in (("base", "camera_mirror"), ("platform", "camera_base")):
        told = np.array([strut[key] for strut in shipped["struts"]])
        assert np.abs(told - (np.array(extra[points]) - pivot) * UM).max() < 1e-12
    assert shipped["tool"] == [0.0, 0.0, 0.0]
    machine = _kernel.Machine(shipped)
    assert np.abs(machine.inverse(np.zeros(6))).max() < 1e-12
