"""What carries a slider: the bearing of its screw on the frame, and the arm of its carriage.

The tool of the warm planar machine is where circles meet about its joint centres, which are put
here where their parts take them: the frame takes the bearing, the screw from there the carriage,
the carriage the joint on it.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from machine_texts import PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, RequestError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources.thermal import Thermal
from two_slider import LENGTH, RAILS, tool

ALPHA = 1.2e-5  # steel
REFERENCE = 293.15
ARM = (20.0, 30.0, 0.0)
STEEL = 'expansion = "1.2e-5 1/K"'
Floats = NDArray[np.float64]


def planar(folder: Path, drive: str = "", more: str = "", *, arm: bool = False) -> Machine:
    """Two sliders all of steel, whose drives say `drive` besides, without anything but heat."""
    both = f"axis = [0, 1, 0]\n{STEEL}\n{drive}"
    text = PLANAR.replace("axis = [0, 1, 0]\n", f"{both}\n")
    text = text.replace('expansion = "1.1e-5 1/K"', 'material = "steel"')
    text = edited(text, ("temperature = 35\n", ""), ("force = { x = 1200, y = -1500 }\n", ""))
    text = text.replace("travel = [0, 900]", "travel = [-3000, 3000]")
    if arm:
        text = text.replace("base = [0, 0, 0]", f"base = {list(ARM)}")
    return load_text(folder, f"{text}[frame]\n{STEEL}\n{more}")


def error(machine: Machine, rises: dict[str, float], pose: tuple[float, float]) -> Floats:
    """(2,) m, of the thermal source alone, and what compensation leaves of it below rounding."""
    warm = machine.condition.replace(
        temperature={part: REFERENCE + rise for part, rise in rises.items()}
    )
    found = tp.budget(machine, [pose], warm).error.sel(source="thermal").values[0]
    left = tp.compensate(machine, [pose], warm)["residual_middle"].values[0]
    assert np.abs(left).max() < 1e-14
    return np.asarray(found)


@pytest.mark.parametrize("scale", [1.0, 0.98])
@pytest.mark.parametrize("offset", [0.0, 40.0])
@pytest.mark.parametrize("fixed_at", [0.0, 900.0, -130.0])
def test_all_of_steel_is_larger_wherever_its_screws_are_fixed(
    tmp_path: Path, fixed_at: float, offset: float, scale: float
) -> None:
    drive = f"fixed_at = {fixed_at}\noffset = {offset}\nscale = {scale}"
    found = error(planar(tmp_path, drive), {"default": 10.0}, (0.3, 0.2))
    # 12e-6 of 300 mm and of 200 mm for each of 10 K: 36 um and 24 um.
    assert np.allclose(found, [36e-6, 24e-6], rtol=0, atol=1e-14)


@pytest.mark.parametrize(("screw", "frame"), [(12.0, 0.0), (0.0, 7.0), (12.0, 7.0)])
@pytest.mark.parametrize(
    ("fixed_at", "offset", "scale"), [(0, 0, 1), (900, 0, 1), (-130, 40, 0.98)]
)
def test_the_frame_takes_the_bearing_and_the_screw_the_carriage(
    tmp_path: Path, fixed_at: float, offset: float, scale: float, screw: float, frame: float
) -> None:
    anchor = np.array([0.11, -0.07])
    machine = planar(
        tmp_path,
        f"fixed_at = {fixed_at}\noffset = {offset}\nscale = {scale}",
        "anchor = [110, -70, 0]",
    )
    pose = np.array([0.31, 0.18])
    rises = {"drive.d1": screw, "drive.d2": screw, "frame": frame}
    found = error(machine, rises, (0.31, 0.18))
    away = pose[0] - np.array(RAILS)
    height = pose[1] + np.sqrt(LENGTH**2 - away**2)  # of the carriages, above the tool
    bearing = scale * fixed_at / 1e3 + offset / 1e3
    held = np.stack([np.array(RAILS), np.full(2, bearing)], axis=1)
    held += ALPHA * frame * (held - anchor)
    along = (1.0 + ALPHA * screw) * (height - bearing)
    centres = held + along[:, np.newaxis] * np.array([0.0, 1.0])
    expected = tool(centres[np.newaxis], np.full((1, 2), LENGTH), pose[np.newaxis])[0] - pose
    assert np.allclose(found, expected, rtol=0, atol=1e-14)
    assert np.abs(expected).max() > 1e-6


# ---- carriages


CARRIAGE = 'carriage = { expansion = "2.3e-5 1/K" }'


@pytest.mark.parametrize("rise", [15.0, -4.0])
def test_the_arm_of_a_carriage_grows_about_its_point(tmp_path: Path, rise: float) -> None:
    machine = planar(tmp_path, CARRIAGE, arm=True)
    pose = np.array([0.33, 0.22])
    found = error(machine, {"carriage.d1": rise}, (0.33, 0.22))
    arm = np.array(ARM[:2]) / 1e3
    away = pose[0] - (np.array(RAILS) + arm[0])
    joints = np.stack([np.array(RAILS) + arm[0], pose[1] + np.sqrt(LENGTH**2 - away**2)], axis=1)
    joints[0] += 2.3e-5 * rise * arm
    expected = tool(joints[np.newaxis], np.full((1, 2), LENGTH), pose[np.newaxis])[0] - pose
    assert np.allclose(found, expected, rtol=0, atol=1e-14)
    assert np.abs(expected).max() > 1e-7


def test_a_gradient_in_a_carriage_bends_its_arm(tmp_path: Path) -> None:
    machine = planar(tmp_path, CARRIAGE, arm=True)
    gradient = np.array([30.0, -50.0, 0.0])
    condition = machine.condition.replace(gradient={"carriage.d1": gradient.tolist()})
    (block,) = PoseRun(machine, np.array([[0.3, 0.2]]), condition)
    found = Thermal(requested=True).deviation(machine, condition, block)
    shift = {machine.parameters[k]: found.shift[0, i] for i, k in enumerate(found.parameters)}
    arm = np.array(ARM) / 1e3
    # Along the arm, temperature and turn grow in proportion to the way: half of both at its end.
    strain = 0.5 * 2.3e-5 * (gradient @ arm) * arm
    turn = np.cross(0.5 * 2.3e-5 * np.cross(gradient, arm), arm)
    for axis, wanted in zip("xy", (strain + turn)[:2], strict=True):
        assert shift[f"strut.1.base.{axis}"] == pytest.approx(wanted, rel=1e-12)


def test_a_carriage_without_a_material_takes_that_of_the_table(tmp_path: Path) -> None:
    machine = planar(tmp_path, 'carriage = { material = "aluminium" }', arm=True)
    first, second = machine.carriages
    assert (first.part, first.expansion, first.material) == ("carriage.d1", 23e-6, "aluminium")
    assert second.part == "carriage.d2"
    assert {"carriage.d1", "carriage.d2"} <= set(machine.parts)


def test_a_file_gives_carriages_their_temperature_and_gradient(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ("axis = [0, 1, 0]\n", f"axis = [0, 1, 0]\n{CARRIAGE}\n"),
        (
            "temperature = 35\n",
            'temperature = { "carriage.d1" = 30 }\n'
            'gradient = { "carriage.d1" = ["1 K/m", "2 K/m", "3 K/m"] }\n',
        ),
    )
    condition = load_text(tmp_path, text).condition
    assert condition.temperature("carriage.d1") == pytest.approx(REFERENCE + 10)
    assert condition.gradient("carriage.d1") == (1.0, 2.0, 3.0)


def test_a_named_carriage_says_how_it_expands(tmp_path: Path) -> None:
    text = edited(
        PLANAR, ("temperature = 35\n", 'temperature = { default = 20, "carriage.d2" = 30 }\n')
    )
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert problem.code == "no-expansion"
    assert problem.line == line_of(text, "carriage.d2")
    assert "the carriage of drive d2" in str(problem)
    assert "under [drive.carriage]" in str(problem)


def test_a_carriage_has_three_gradients(tmp_path: Path) -> None:
    machine = planar(tmp_path, CARRIAGE, arm=True)
    with pytest.raises(RequestError, match="three numbers"):
        machine.condition.replace(gradient={"carriage.d1": 4.0})


def test_a_region_is_bounded_whose_bearings_and_carriages_are_warm(tmp_path: Path) -> None:
    drive = f"fixed_at = 900\noffset = 40\ncarriage = {{ {STEEL} }}"
    machine = planar(tmp_path, drive, arm=True)
    warm = dataclasses.replace(
        machine,
        condition=machine.condition.replace(temperature=REFERENCE + 10),
        sources=(Thermal(requested=True),),
    )
    found = tp.bounds(warm, region={"x": (0.25, 0.35), "y": (0.15, 0.25)}, gap=0.05)
    assert found["status"] == "proven"
    # All of steel: 12e-6 times 10 K of the pose, from one end of the region to the other.
    ends = {"lower": (30e-6, 18e-6), "upper": (42e-6, 30e-6)}
    for name, (x, y) in ends.items():
        assert np.allclose(found[name], [x, y], rtol=0, atol=0.05 * 42e-6), name
    assert (found["lower"] <= ends["lower"]).all()
    assert (found["upper"] >= ends["upper"]).all()
