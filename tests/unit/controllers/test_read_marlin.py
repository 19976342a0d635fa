"""Marlin's files read: M503 of two dialects, inches, Configuration.h, and what logs hold."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import tower_heights
import truepose as tp
from truepose.errors import MachineFileError

FILES = Path(__file__).parents[2] / "controller_files" / "marlin"
MM = 1e-3
Array = NDArray[np.float64]

TRUTH = json.loads((FILES / "truth.json").read_text("utf-8"))


def joints(machine: tp.Machine, positions: Array) -> Array:
    found: Array = machine.inverse(positions * MM) / MM
    return found


def imported(folder: Path, text: str, name: str = "m503.txt", **settings: str) -> tp.Machine:
    (folder / name).write_text(text, "utf-8")
    return tp.import_machine(folder / name, settings=settings).machine


def refusal(folder: Path, text: str, settings: Mapping[str, str] | None = None) -> str:
    (folder / "m503.txt").write_text(text, "utf-8")
    with pytest.raises(MachineFileError) as failure:
        tp.import_machine(folder / "m503.txt", settings=settings or {})
    return str(failure.value)


def test_m503_is_the_controllers_machine_at_1e5_positions() -> None:
    text = (FILES / "m503.txt").read_text("utf-8")
    read = tp.import_machine(FILES / "m503.txt")
    delta = tower_heights.marlin(
        tower_heights.words_of(text, "M665"), tower_heights.words_of(text, "M666"), -0.15
    )
    positions = tower_heights.positions(90.0, 190.0, 100_000, 1)
    assert np.abs(joints(read.machine, positions) - delta.heights(positions)).max() < 1e-9
    tops = [drive.travel[1] / MM for drive in read.machine.drives]
    np.testing.assert_allclose(tops, delta.at_endstops(), rtol=0, atol=1e-9)
    assert read.kind == "marlin"
    assert read.holds["M665 L"] == "215.0000"
    held = TRUTH["held"]
    centres = np.array([drive.fields["origin"] for drive in read.machine.drives])[:, :2]
    np.testing.assert_allclose(centres / MM, np.array(held["rail_foot"])[:, :2], atol=1e-9)


def test_rods_that_are_known_are_a_family_with_the_same_joints() -> None:
    said = {"family.effector_radius": "33.3", "family.spacing": "45"}
    pairs = tp.import_machine(FILES / "m503.txt", settings=said)
    assert 'kind = "linear_delta"' in pairs.text
    assert len(pairs.machine.struts) == 6
    single = tp.import_machine(FILES / "m503.txt").machine
    positions = tower_heights.positions(90.0, 190.0, 1000, 5)
    away = joints(pairs.machine, positions) - joints(single, positions)
    assert np.abs(away).max() < 1e-9


def test_an_effector_that_configuration_h_knows(tmp_path: Path) -> None:
    text = (FILES / "Configuration.h").read_text("utf-8")
    text += "#define DELTA_EFFECTOR_OFFSET 33.3\n"
    (tmp_path / "Configuration.h").write_text(text, "utf-8")
    path = tmp_path / "Configuration.h"
    pairs = tp.import_machine(path, settings={"family.spacing": "45"})
    assert "effector_radius = 33.3\n" in pairs.text
    other = {"family.spacing": "45", "family.effector_radius": "30"}
    assert "effector_radius = 30.0\n" in tp.import_machine(path, settings=other).text
    assert len(tp.import_machine(path).machine.struts) == 3


def test_configuration_h_holds_the_same_machine() -> None:
    dumped = tp.import_machine(FILES / "m503.txt").machine
    defined = tp.import_machine(FILES / "Configuration.h").machine
    positions = tower_heights.positions(90.0, 190.0, 1000, 2)
    np.testing.assert_allclose(joints(defined, positions), joints(dumped, positions), atol=1e-10)
    # No probe is enabled there, so that its offset is none; its bed is known.
    tops = [drive.travel[1] / MM for drive in defined.drives]
    np.testing.assert_allclose(tops, TRUTH["held"]["carriage_height_at_switch"], atol=1e-9)
    assert np.hypot(*defined.poses()[:, :2].T).max() / MM == pytest.approx(90.0)


def test_b_alone_is_the_radius_of_g33(tmp_path: Path) -> None:
    old = tp.import_machine(FILES / "m503_old_dialect.txt")
    rods = [old.machine.nominal[old.machine.parameters.index(f"strut.{n}.length")] for n in "abc"]
    np.testing.assert_allclose(rods, 0.215, atol=1e-15)
    assert any("older than 2.0.6" in assumed.sentence for assumed in old.assumptions)
    log = (FILES / "g33_dry_run.log").read_text("utf-8").replace("G33 V0", "G33 P3 V0")
    whole = (FILES / "m503_old_dialect.txt").read_text("utf-8") + log
    (tmp_path / "session.log").write_text(whole, "utf-8")
    read = tp.import_machine(tmp_path / "session.log")
    assert read.measurements is not None
    assert read.measurements.n_row == 6  # P3 averages in the middle
    commanded = read.measurements.placements[:, :3] / MM
    np.testing.assert_allclose(np.hypot(*commanded[:, :2].T), 80.0, atol=1e-4)
    np.testing.assert_allclose(commanded[:3, 2], [0.54, 0.38, 0.60], atol=1e-9)


def test_inches_and_angles_that_are_scaled_with_them(tmp_path: Path) -> None:
    text = (FILES / "m503.txt").read_text("utf-8")
    numbers = {"L": 215.0, "R": 106.2, "H": 232.15, "A": 0.05, "B": -0.08, "C": 0.0}
    angles = {"X": 0.31, "Y": -0.22, "Z": 0.0}
    scaled = {key: value / 25.4 for key, value in (numbers | angles).items()}
    dump = [
        "echo:  G20 ; (in)",
        "echo:  M665 " + " ".join(f"{key}{value:.12f}" for key, value in scaled.items()),
        "echo:  M666 X-0.013385826772 Y0.0 Z-0.022440944882",
        "echo:  M851 X0 Y0 Z-0.005905511811",
    ]
    inches = imported(tmp_path, "\n".join(dump))
    metric = imported(tmp_path, text, "metric.txt")
    positions = tower_heights.positions(80.0, 150.0, 100, 3)
    np.testing.assert_allclose(joints(inches, positions), joints(metric, positions), atol=1e-8)
    typed = " ".join(f"{key}{value / 25.4:.12f}" for key, value in numbers.items())
    typed += "".join(f" {key}{value}" for key, value in angles.items())
    by_hand = imported(tmp_path, f"G20\nM665 {typed}\nM666 X0 Y0 Z0\n", "typed.gcode")
    np.testing.assert_allclose(joints(by_hand, positions), joints(metric, positions), atol=1e-8)


@pytest.mark.parametrize(
    ("body", "radius", "rods"),
    [
        (
            "#define DELTA_SMOOTH_ROD_OFFSET 175.0\n#define DELTA_EFFECTOR_OFFSET 33.0 // mm\n"
            "#define DELTA_CARRIAGE_OFFSET 18.0\n#define DELTA_RADIUS (DELTA_SMOOTH_ROD_OFFSET"
            "-(DELTA_EFFECTOR_OFFSET)-(DELTA_CARRIAGE_OFFSET))\n"
            "#define DELTA_DIAGONAL_ROD_TRIM_TOWER_1 0.2\n#define MANUAL_Z_HOME_POS 250\n",
            [124.0] * 3,
            [250.2, 250.0, 250.0],
        ),
        (
            "#define DELTA_RADIUS 124.0 /* of\nthree lines\n*/\n//#define DELTA_RADIUS 1.0\n"
            "#define DELTA_RADIUS_TRIM_TOWER { 0.1, -0.1, 0 }\n"
            "#ifdef NEVER\n#define DELTA_RADIUS 7\n#elif 1 && !ENABLED(NEVER)\n"
            "#define DELTA_DIAGONAL_ROD_TRIM_TOWER { 1, \\\n 2, 3 }\n#else\n"
            "#define DELTA_RADIUS 8\n#endif\n",
            [124.1, 123.9, 124.0],
            [251.0, 252.0, 253.0],
        ),
    ],
)
def test_names_of_configuration_h(
    body: str, radius: list[float], rods: list[float], tmp_path: Path
) -> None:
    text = f"#define DELTA\n#if ENABLED(DELTA)\n#define DELTA_DIAGONAL_ROD 250.0\n{body}#endif\n"
    machine = imported(tmp_path, text, "Configuration.h")
    origins = np.array([drive.fields["origin"] for drive in machine.drives])
    np.testing.assert_allclose(np.hypot(*origins[:, :2].T) / MM, radius, atol=1e-9)
    lengths = [machine.nominal[machine.parameters.index(f"strut.{n}.length")] for n in "abc"]
    np.testing.assert_allclose(np.array(lengths) / MM, rods, atol=1e-9)


def test_a_condition_that_is_not_understood_is_told_where_it_matters(tmp_path: Path) -> None:
    body = (
        "#define DELTA\n#if UNKNOWN_MACRO(3)\n#define OTHER 1\n#endif\n#define DELTA_RADIUS 124\n"
        "#define PRINTABLE_RADIUS 90\n#define DELTA_HEIGHT 250\n"
    )
    rod = "#define DELTA_DIAGONAL_ROD 250\n"
    path = tmp_path / "Configuration.h"
    path.write_text(body + rod, "utf-8")
    clear = tp.import_machine(path)
    assert not any("not understood" in assumed.sentence for assumed in clear.assumptions)
    assert np.hypot(*clear.machine.poses()[:, :2].T).max() / MM == pytest.approx(90.0)
    path.write_text(f"{body}#if UNKNOWN_MACRO(3)\n#ifndef X\n{rod}#endif\n#endif\n", "utf-8")
    told = [assumed.sentence for assumed in tp.import_machine(path).assumptions]
    assert any("DELTA_DIAGONAL_ROD, line 8" in sentence for sentence in told)


@pytest.mark.parametrize(
    "before", ["# RECV: echo:  ", "17:19:24.482 : echo:  ", "[12:00:01] Recv: echo:", "N12 ", "< "]
)
def test_what_hosts_write_before_a_line(before: str, tmp_path: Path) -> None:
    machine = imported(tmp_path, f"{before}M665 L215.0 R106.2 H232.15 A0.05 B-0.08 C0.0\n")
    assert machine.nominal[machine.parameters.index("strut.a.length")] == pytest.approx(0.21505)


def test_logs_are_measurements() -> None:
    read = tp.import_machine(FILES / "m503.txt", settings={"logs": "g30.log"})
    assert read.measurements is not None
    commanded = read.measurements.placements[:, :3] / MM
    expected = np.array(TRUTH["g30"])
    np.testing.assert_allclose(commanded[:, :2], expected[:, :2], atol=1e-9)
    np.testing.assert_allclose(commanded[:, 2], expected[:, 2], atol=0.5e-3)
    assert any("mesh" in lost or "grid" in lost for lost in read.lost) is False


def test_a_grid_has_places_where_they_are_said() -> None:
    without = tp.import_machine(FILES / "m503.txt", settings={"logs": "g29_bilinear.log"})
    assert without.measurements is None
    assert any("nothing says where it lies" in lost for lost in without.lost)
    read = tp.import_machine(
        FILES / "m503.txt", settings={"logs": "g29_bilinear.log", "g29.bounds": "-70,70,-70,70"}
    )
    assert read.measurements is not None
    points = {(round(x), round(y)): z for x, y, z in read.measurements.placements[:, :3] / MM}
    known = {(x, y): z for x, y, z in TRUTH["g29"].values() if z is not None}
    assert points.keys() == known.keys()
    for place, z in known.items():
        assert points[place] == pytest.approx(z, abs=0.5e-3)


def test_what_was_filled_in_is_left_out(tmp_path: Path) -> None:
    rows = "\n".join(f" {row} +0.1 +0.2 +0.3" for row in range(3))
    log = f"Send: G29 L-50 R50 F-50 B50\nRecv: Bilinear Leveling Grid:\n      0 1 2\n{rows}\n"
    (tmp_path / "all.log").write_text((FILES / "m503.txt").read_text("utf-8") + log, "utf-8")
    read = tp.import_machine(tmp_path / "all.log")
    assert read.measurements is not None
    assert read.measurements.n_row == 5  # the corners lie outside of the circle
    assert any("4 points" in lost for lost in read.lost)


@pytest.mark.parametrize(
    ("command", "reason"),
    [
        ("G33 V0", "means over several places"),
        ("G33 P2 V0", "on which radius"),
        ("G33 P2", "that calibrated"),
    ],
)
def test_heights_of_g33_that_say_too_little(command: str, reason: str, tmp_path: Path) -> None:
    log = (FILES / "g33_dry_run.log").read_text("utf-8").replace("G33 V0", command)
    (tmp_path / "g33.log").write_text(log, "utf-8")
    (tmp_path / "m503.txt").write_text((FILES / "m503.txt").read_text("utf-8"), "utf-8")
    read = tp.import_machine(tmp_path / "m503.txt", settings={"logs": "g33.log"})
    assert any(reason in lost for lost in read.lost)
    assert read.measurements is None


def test_numbers_that_change_within_a_session(tmp_path: Path) -> None:
    dump = (FILES / "m503.txt").read_text("utf-8")
    probed = (FILES / "g30.log").read_text("utf-8")
    after = dump.replace("R106.2000", "R106.3000")
    told = refusal(tmp_path, dump + probed + "Send: G33\nRecv: G33 Auto Calibrate\n")
    assert "G33 changed the numbers" in told
    (tmp_path / "all.log").write_text(dump + probed + "Send: G33\n" + after + probed, "utf-8")
    read = tp.import_machine(tmp_path / "all.log")
    assert read.holds["M665 R"] == "106.3000"
    assert read.measurements is not None
    assert read.measurements.n_row == 7  # those of the numbers that the machine file has
    assert any("7 heights from before line" in lost for lost in read.lost)
    (tmp_path / "all.log").write_text(dump + probed + dump + probed, "utf-8")
    unchanged = tp.import_machine(tmp_path / "all.log").measurements
    assert unchanged is not None
    assert unchanged.n_row == 14


@pytest.mark.parametrize(
    ("text", "line", "said"),
    [
        ("echo:  M665 L215 Rx H200", 1, "M665 R cannot be read"),
        ("\necho:  M665 L100 R106", 2, "does not reach"),
        ("echo:  M665 L215 R-1", 1, "not above zero"),
        (
            "#define DELTA\n#define DELTA_RADIUS 90\n#define DELTA_RADIUS_TRIM_TOWER {0, 20, 0}\n"
            "#define DELTA_DIAGONAL_ROD 100",
            4,
            "does not reach",
        ),
        ("echo:  M665 L215 R106\necho:  M666 X0.1 Y0 Z0", 2, "above zero"),
        ("echo:  M665 L215 R9999999999", 1, "M665 R cannot be read"),
        ("#define COREXY\n#define X_BED_SIZE 200", 1, "COREXY"),
        ("#define DELTA\n#define DELTA_RADIUS (A+B)\n#define DELTA_DIAGONAL_ROD 2", 2, "A is not"),
        ("#define DELTA\n#define DELTA_RADIUS 1/0.0\n#define DELTA_DIAGONAL_ROD 2", 2, "cannot"),
    ],
)
def test_what_is_refused_has_its_line(text: str, line: int, said: str, tmp_path: Path) -> None:
    told = refusal(tmp_path, text)
    assert f"m503.txt:{line}:" in told
    assert said in told


def test_a_machine_without_m665_is_asked_for_it(tmp_path: Path) -> None:
    told = refusal(tmp_path, "echo:  G21\necho:  M92 X80 Y80 Z80\n")
    assert "M665 L" in told
    assert "M503" in told


def test_names_that_lead_to_names_without_an_end(tmp_path: Path) -> None:
    doubling = "\n".join(f"#define N{n} (N{n + 1}+N{n + 1})" for n in range(60))
    text = f"#define DELTA\n{doubling}\n#define DELTA_RADIUS N0\n#define DELTA_DIAGONAL_ROD 250\n"
    assert "cannot be computed" in refusal(tmp_path, text)
    round_about = "#define DELTA\n#define DELTA_RADIUS B\n#define B DELTA_RADIUS\n"
    assert "cannot be computed" in refusal(tmp_path, round_about)
