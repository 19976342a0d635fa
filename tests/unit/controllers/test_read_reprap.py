"""RepRapFirmware's files read: config.g with what it takes in, logs, three kinds of height maps."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import tower_heights
import truepose as tp
from truepose.errors import MachineFileError

FILES = Path(__file__).parents[2] / "controller_files" / "reprap"
MM = 1e-3
Array = NDArray[np.float64]

TRUTH = json.loads((FILES / "truth.json").read_text("utf-8"))
LINEAR = "M569 P0\nM665 L250:250.1:249.9 R124 H300 B100 X0.1 Y-0.2 Z0\nM666 X0 Y0.2 Z-0.2 A0 B0\n"


def delta_of(text: str) -> tower_heights.Delta:
    return tower_heights.reprap(
        tower_heights.words_of(text, "M665"), tower_heights.words_of(text, "M666")
    )


def in_guideways(delta: tower_heights.Delta, commanded: Array) -> Array:
    """Poses, m, of the imported machine, whose z is that of the guideways."""
    raised = commanded.copy()
    raised[:, 2] += delta.tilt[0] * commanded[:, 0] + delta.tilt[1] * commanded[:, 1]
    return raised * MM


def imported(folder: Path, text: str, **settings: str) -> tp.controllers.Import:
    (folder / "config.g").write_text(text, "utf-8")
    return tp.import_machine(folder / "config.g", settings=settings)


def refusal(folder: Path, text: str, name: str = "config.g") -> str:
    (folder / name).write_text(text, "utf-8")
    with pytest.raises(MachineFileError) as failure:
        tp.import_machine(folder / name)
    return str(failure.value)


@pytest.mark.parametrize("text", [(FILES / "config.g").read_text("utf-8"), LINEAR])
def test_config_g_is_the_controllers_machine_at_1e5_positions(text: str, tmp_path: Path) -> None:
    read = imported(tmp_path, text)
    delta = delta_of(text)
    commanded = tower_heights.positions(100.0, 150.0, 100_000, 1)
    heights = read.machine.inverse(in_guideways(delta, commanded)) / MM
    assert np.abs(heights - delta.heights(commanded)).max() < 1e-9
    tops = [drive.travel[1] / MM for drive in read.machine.drives]
    np.testing.assert_allclose(tops, delta.at_endstops(), rtol=0, atol=1e-9)


def test_the_tilt_is_told_and_not_in_the_machine() -> None:
    read = tp.import_machine(FILES / "config.g")
    (told,) = [lost for lost in read.lost if "tilt" in lost]
    assert "A0.06 B-0.11" in told
    held = TRUTH["held"]
    tops = [drive.travel[1] / MM for drive in read.machine.drives]
    np.testing.assert_allclose(tops, held["carriage_height_at_switch"], atol=1e-9)
    centres = np.array([drive.fields["origin"] for drive in read.machine.drives])[:, :2]
    np.testing.assert_allclose(centres / MM, np.array(held["rail_foot"])[:, :2], atol=1e-9)


def test_one_rod_is_three_and_an_override_counts_after_m501(tmp_path: Path) -> None:
    text = 'M98 P"more.g"\nM569 P0\nM665 L250 R124 H300 B100\nM501\n'
    (tmp_path / "more.g").write_text("M666 X0.3\n", "utf-8")
    (tmp_path / "config-override.g").write_text("M665 L251.000 R125.000\n", "utf-8")
    read = imported(tmp_path, text)
    assert read.holds["M665 R"] == "125.000"
    assert read.holds["M666 X"] == "0.3"
    lengths = [read.machine.parameters.index(f"strut.{name}.length") for name in "abc"]
    np.testing.assert_allclose(read.machine.nominal[lengths], 0.251)
    (tmp_path / "config-override.g").unlink()
    without = imported(tmp_path, text)
    assert without.holds["M665 R"] == "124"
    assert any("config-override.g" in lost for lost in without.lost)


def test_logs_and_map_are_measurements() -> None:
    read = tp.import_machine(FILES / "config.g", settings={"logs": "bed.g, g32.log"})
    assert read.measurements is not None
    commanded = np.array(TRUTH["g32_points"])
    heights = np.array(TRUTH["g32_heights"])
    delta = delta_of((FILES / "config.g").read_text("utf-8"))
    whole = np.column_stack([commanded, heights])
    expected = in_guideways(delta, whole)
    np.testing.assert_allclose(read.measurements.placements[:, :3], expected, atol=6e-6)
    stopped = tp.import_machine(FILES / "config.g", settings={"logs": "g30_s-1.log"}).measurements
    assert stopped is not None
    assert stopped.n_row == 5
    np.testing.assert_allclose(stopped.placements[1, :2] / MM, [90.0, 0.0], atol=1e-9)


def test_a_session_in_one_file(tmp_path: Path) -> None:
    whole = "".join((FILES / name).read_text("utf-8") for name in ("config.g", "bed.g", "g32.log"))
    read = imported(tmp_path, whole)
    assert read.measurements is not None
    assert read.measurements.n_row == 10


@pytest.mark.parametrize("name", ["missing.log", "../outside.log"])
def test_a_log_that_is_not_beside_the_file(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "sys"
    folder.mkdir()
    (tmp_path / "outside.log").write_text("", "utf-8")
    with pytest.raises(MachineFileError) as failure:
        imported(folder, LINEAR, logs=name)
    assert "import-include" in str(failure.value)


def test_heights_without_their_places_are_told() -> None:
    read = tp.import_machine(FILES / "config.g", settings={"logs": "g32.log"})
    assert read.measurements is None
    assert any("bed.g" in lost for lost in read.lost)


@pytest.mark.parametrize(
    ("labels", "grid"),
    [
        ("xmin,xmax,ymin,ymax,radius,spacing,xnum,ynum", "-10,10,-20,20,30,10,3,2"),
        ("xmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum", "-10,10,-20,20,30,10,10,3,2"),
        (
            "axis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1",
            "X,Y,-10,10,-20,20,30,10,10,3,2",
        ),
    ],
)
def test_three_versions_of_a_height_map(labels: str, grid: str, tmp_path: Path) -> None:
    text = (
        f"RepRapFirmware height map file v2 generated at 2026-11-22 10:00\n{labels}\n{grid}\n"
        "      0,  0.100,  0.000\n  -0.2, 0, 0.3\n"
    )
    (tmp_path / "heightmap.csv").write_text(text, "utf-8")
    read = imported(tmp_path, LINEAR + "G31 X5 Y-3 Z1\n", logs="heightmap.csv")
    assert read.measurements is not None
    assert read.measurements_text is not None
    places = read.measurements.placements[:, :3] / MM
    # A 0 without a point was not probed; the nozzle stands where the probe's offset leaves it.
    expected = [[-5, -17, 0.1], [5, -17, 0.0], [-15, -7, -0.2], [5, -7, 0.3]]
    np.testing.assert_allclose(places, expected, atol=1e-9)
    assert 'target = ["5 mm", "-3 mm", "0 mm"]' in read.measurements_text


def test_the_map_of_the_sample_has_its_61_points(tmp_path: Path) -> None:
    for name in ("config.g", "heightmap.csv"):
        shutil.copy(FILES / name, tmp_path / name)
    read = tp.import_machine(tmp_path / "config.g", settings={"logs": "heightmap.csv"})
    assert read.measurements is not None
    assert read.measurements.n_row == 61


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("M569 P0\nM669 K1\n", 2, "CoreXY"),
        ('M569 P0\nM669 K"rotaryDelta"\n', 2, "rotarydelta"),
        ("M569 P0\nM669 K10\n", 2, "rotary delta"),
        ("M569 P0\nM667 S1\n", 2, "CoreXY"),
        ("M569 P0\nM665 L250:250:250:250 R124 H300\n", 2, "three towers"),
        ("M569 P0\nM665 L250:250 R124 H300\n", 2, "two rods"),
        ("M569 P0\nM665 L100 R124 H300\n", 2, "does not reach"),
        ("M569 P0\nM665 L250 R{var.r} H300\n", 2, "braces"),
        ("M569 P0\nM665 L250 R0 H300\n", 2, "not above zero"),
    ],
)
def test_what_is_refused_has_its_line(text: str, line: int, said: str, tmp_path: Path) -> None:
    told = refusal(tmp_path, text)
    assert f"config.g:{line}:" in told
    assert said in told


def test_a_cartesian_printer_a_log_and_a_map_are_told_apart(tmp_path: Path) -> None:
    assert "Cartesian" in refusal(tmp_path, 'M569 P0\nM98 P"x.g"\nM584 X0\n')
    for name in ("heightmap.csv", "g32.log", "bed.g"):
        told = refusal(tmp_path, (FILES / name).read_text("utf-8"), name)
        assert f"--set logs={name}" in told


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("RepRapFirmware height map file v9\na,b\n1,2\n", "labels are not known"),
        (
            "RepRapFirmware height map file v1\nxmin,xmax,ymin,ymax,radius,spacing,xnum,ynum\n"
            "0,1,0,1,9,1,2,2\n0.1,0.2\n",
            "not as many",
        ),
        (
            "RepRapFirmware height map file v1\nxmin,xmax,ymin,ymax,radius,spacing,xnum,ynum\n"
            "0,1,0,1,9,1,2e9,2\n0.1,0.2\n",
            "cannot be read",
        ),
    ],
)
def test_height_maps_that_are_none(text: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "heightmap.csv").write_text(text, "utf-8")
    (tmp_path / "config.g").write_text(LINEAR, "utf-8")
    with pytest.raises(MachineFileError) as failure:
        tp.import_machine(tmp_path / "config.g", settings={"logs": "heightmap.csv"})
    assert said in str(failure.value)
    assert "heightmap.csv:" in str(failure.value)
