"""Parts of which everything is known by hand: scale, squareness, ripple, resolution and play.

The slides are two drives at right angles whose rods are ten kilometres long, so that the tool
moves as the drives do: what is known of the drives is known of the part.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import j1  # type: ignore[import-untyped]

from build_machine import described, file_text
from machine_file import File, file_of, loaded
from part_simulator.drawn_part import DrawnPart, Wall, drawn_part
from part_simulator.errors import Play, written
from part_simulator.part_under_test import MACHINES, PartUnderTest, without_errors
from part_simulator.questions import QUESTIONS, features_file
from truepose.workpiece.evaluate import evaluate_part
from truepose.workpiece.evaluation import PartEvaluation
from truepose.workpiece.read import read_part

Floats = NDArray[np.float64]

ROD = 1e4
"""m."""
MIDDLE, SIZE = np.array([0.1, 0.2, 0.0]), 0.08
BORE = 0.4 * 0.5 * SIZE
STRAIGHT = 1e-9
"""m: by how much the tool does not do what the drives do, 250 ppm of 0.3 m times 0.1 m / ROD."""
IN_95 = float(np.sin(0.475 * np.pi))
"""Half the 95 % interval of an arcsine distribution, in its amplitudes."""
SAMPLES = 4000

SQUARE = "perpendicularity of east to A"
EVERY = {question.name: question for question in QUESTIONS}


def slides() -> File:
    """The machine file of the two slides, nothing wrong with them."""
    drives = [
        {"kind": "slider", "origin": [0.0, 0.0, 0.0], "axis": axis, "travel": [-1.0, 1.0]}
        for axis in ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    ]
    struts = [
        {"drive": "d1", "base": [-ROD, 0.0, 0.0], "platform": [0.0, 0.0, 0.0], "length": ROD},
        {"drive": "d2", "base": [0.0, -ROD, 0.0], "platform": [0.0, 0.0, 0.0], "length": ROD},
    ]
    for drive in drives:
        drive["working_mode"] = "-"
    grid = "grid = { x = [0.0, 0.2, 3], y = [0.1, 0.3, 3] }"
    more = f'[workspace]\n{grid}\n[accuracy]\ntarget = "1 mm"'
    return file_of(file_text(described(["x", "y"], drives, struts), more=more))


def on_slides(file: File, folder: Path, *asked: str) -> PartEvaluation:
    """The part about `MIDDLE`, evaluated: the questions of these names."""
    drawn = drawn_part(MIDDLE, SIZE, True)
    machine = loaded(file, beside=folder)
    program, features = folder / "part.ngc", folder / "features.toml"
    program.write_text(drawn.text, encoding="utf-8")
    features.write_text(features_file(drawn, [EVERY[name] for name in asked]), encoding="utf-8")
    read = read_part(machine, program, features)
    return evaluate_part(machine, read, machine.condition, samples=SAMPLES, seed=5)


def known_of(evaluation: PartEvaluation) -> dict[str, float]:
    """The known value of every quantity as commanded, by its label."""
    before = evaluation.before()
    labels = [one.label for one in evaluation.characteristics]
    return dict(zip(labels, [answer.known for answer in before.answers], strict=True))


def interval_of(evaluation: PartEvaluation, label: str) -> tuple[float, float]:
    """Its 95 % interval as commanded."""
    labels = [one.label for one in evaluation.characteristics]
    return evaluation.before().answers[labels.index(label)].interval


def test_a_scale_error_of_all_drives_scales_the_part(tmp_path: Path) -> None:
    ratio = 250e-6
    file = slides()
    for drive in file["drive"]:
        drive["sensor"] = {"scale_error": f"{ratio * 1e6} ppm"}
    asked = ("width", "height", "bore", "straightness of chamfer", SQUARE)
    known = known_of(on_slides(file, tmp_path, *asked))
    longer = 1.0 + ratio
    for label, size in (("width", SIZE), ("height", SIZE)):
        for end in ("smallest", "largest"):
            assert known[f"{label}: size, {end}"] == pytest.approx(size * longer, abs=STRAIGHT)
    for end in ("smallest", "largest"):
        assert known[f"bore: diameter, {end}"] == pytest.approx(2 * BORE * longer, abs=STRAIGHT)
    assert known["bore: roundness"] < STRAIGHT
    assert known["straightness of chamfer: straightness"] < STRAIGHT
    assert known[f"{SQUARE}: perpendicularity"] < STRAIGHT
    # The bore is half the part's size from either wall, on a part that is larger.
    place = 2.0 * ratio * np.hypot(0.5 * SIZE, 0.5 * SIZE)
    assert known["bore: position"] == pytest.approx(place, abs=STRAIGHT)


def test_a_scale_error_of_one_drive_makes_an_ellipse(tmp_path: Path) -> None:
    ratio = 250e-6
    file = slides()
    file["drive"][0]["sensor"] = {"scale_error": f"{ratio * 1e6} ppm"}
    known = known_of(on_slides(file, tmp_path, "width", "height", "bore"))
    assert known["width: size, largest"] == pytest.approx(SIZE * (1.0 + ratio), abs=STRAIGHT)
    assert known["height: size, largest"] == pytest.approx(SIZE, abs=STRAIGHT)
    assert known["bore: roundness"] == pytest.approx(BORE * ratio, abs=STRAIGHT)
    assert known["bore: diameter, smallest"] == pytest.approx(2 * BORE, abs=STRAIGHT)
    largest = 2 * BORE * (1.0 + ratio)
    assert known["bore: diameter, largest"] == pytest.approx(largest, abs=STRAIGHT)


def test_a_machine_that_grows_as_one_makes_a_larger_part(tmp_path: Path) -> None:
    """Frame, screws, rods and platform of one material, 12 K warmer: nothing but larger."""
    expansion, warmer = 1.15e-5, 12.0
    file = without_errors(MACHINES / "linear_delta.toml")
    for row in (*file["drive"], *file["strut"]):
        row.pop("material", None)
        row["expansion"] = f"{expansion} 1/K"
    for drive in file["drive"]:
        drive["carriage"] = {"expansion": f"{expansion} 1/K"}
    for table in ("frame", "platform"):
        file[table] = {"expansion": f"{expansion} 1/K"}
    file["condition"] = {"reference_temperature": 20, "temperature": 20 + warmer}
    under_test = PartUnderTest("linear_delta", file, tmp_path)
    grown = 1.0 + expansion * warmer
    state = under_test.states[0]
    assert np.abs(state.points + state.known_error - grown * state.points).max() < 1e-14
    values = under_test.evaluated((state.points + state.known_error)[np.newaxis])
    wall = under_test.drawn.shapes["south"]
    assert isinstance(wall, Wall)
    size = float(np.linalg.norm(wall.end - wall.begin))
    assert values["width"][0] == pytest.approx([size * grown] * 2, abs=1e-13)
    for label in ("flatness of face", "flatness of rib", "straightness of chamfer"):
        assert values[label][0] == pytest.approx([0.0], abs=1e-13)
    assert values["bore"][0][2] == pytest.approx(0.0, abs=1e-13)


def test_a_turned_rod_makes_walls_that_are_not_square(tmp_path: Path) -> None:
    """The x drive pushes along a rod that is turned by an angle: x moves with y."""
    angle = 40e-6
    file = slides()
    file["tolerance"] = {"strut.1.base.y": [angle * ROD, angle * ROD]}
    known = known_of(on_slides(file, tmp_path, SQUARE, "parallelism of north to A", "bore"))
    label = f"{SQUARE}: perpendicularity"
    assert known[label] == pytest.approx(angle * SIZE, rel=1e-4)
    assert known["parallelism of north to A: parallelism"] < STRAIGHT
    # A square that leans is a rhombus: the bore is an ellipse at 45 degrees.
    assert known["bore: roundness"] == pytest.approx(angle * BORE, rel=1e-3)


def test_a_ripple_of_unknown_phase_is_felt_by_sizes_and_by_roundness(tmp_path: Path) -> None:
    amplitude, period = 5e-6, 40.0 * BORE
    file = slides()
    file["drive"][1]["actuator"] = {"periodic": {"amplitude": f"{amplitude} m", "period": period}}
    found = on_slides(file, tmp_path, "height", "width", "bore")
    # The height is between two places of the sine; the width is not driven by it at all.
    swing = 2.0 * amplitude * abs(np.sin(np.pi * SIZE / period))
    low, high = interval_of(found, "height: size, largest")
    assert high - SIZE == pytest.approx(IN_95 * swing, rel=0.01)
    assert low - SIZE == pytest.approx(-IN_95 * swing, rel=0.01)
    assert interval_of(found, "width: size, largest") == pytest.approx((SIZE, SIZE), abs=STRAIGHT)
    # sin(phi + b cos t) cos t has cos 2t with J1(b) cos phi, and little else where b is small.
    oval = 2.0 * amplitude * j1(2.0 * np.pi * BORE / period)
    low, high = interval_of(found, "bore: roundness")
    assert 0.0 <= low < 0.2 * oval
    assert high == pytest.approx(IN_95 * oval, rel=0.01)


def test_a_ripple_of_a_whole_number_of_periods_is_not_felt_by_a_size(tmp_path: Path) -> None:
    file = slides()
    file["drive"][1]["actuator"] = {"periodic": {"amplitude": "5e-6 m", "period": SIZE / 8.0}}
    found = on_slides(file, tmp_path, "height", "bore")
    assert interval_of(found, "height: size, largest") == pytest.approx((SIZE, SIZE), abs=1e-10)
    assert interval_of(found, "bore: roundness")[1] > 5e-6


def test_a_resolution_rounds_a_size_up_or_down(tmp_path: Path) -> None:
    """Two places on one grid: the size is one of two whole numbers of steps."""
    step = SIZE / 1000.3
    file = slides()
    file["drive"][1]["sensor"] = {"resolution": f"{step} m"}
    found = on_slides(file, tmp_path, "height")
    low, high = interval_of(found, "height: size, largest")
    assert low == pytest.approx(1000.0 * step, abs=STRAIGHT)
    assert high == pytest.approx(1001.0 * step, abs=STRAIGHT)
    labels = [one.label for one in found.characteristics]
    values = found.before().sampled.values[:, labels.index("height: size, largest")]
    up = float(np.mean(values > 1000.5 * step))
    assert up == pytest.approx(0.3, abs=5.0 * np.sqrt(0.3 * 0.7 / SAMPLES))


def test_a_bore_has_steps_where_each_drive_turns_round(tmp_path: Path) -> None:
    """Rods of 500 mm, the tool at (300, 200) mm: where the circle is along a rod's direction."""
    width = 10.0
    file = written([Play(width)], without_errors(MACHINES / "planar_two_slider.toml"), tmp_path)
    radius = 1e-3
    under_test = PartUnderTest("planar_two_slider", file, tmp_path)
    small = DrawnPart(
        "G21 G90 G17 F500\nG0 X301 Y200\nG3 X301 Y200 I-1 J0\n"
        "(feature: bore, kind circle, roundness 1)\nG3 X301 Y200 I-1 J0\nM2\n"
    )
    program = tmp_path / "small.ngc"
    program.write_text(small.text, encoding="utf-8")
    read = read_part(under_test.machine, program)
    evaluation = evaluate_part(
        under_test.machine, read, under_test.machine.condition, samples=100, seed=1
    )
    state = evaluation.before().state
    assert not state.variables.half_width.any()  # the first turn has told all flanks
    off = state.points - [0.3, 0.2, 0.0]
    angles = np.degrees(np.arctan2(off[:, 1], off[:, 0])) % 360.0
    assert np.hypot(off[:, 0], off[:, 1]) == pytest.approx(radius, abs=1e-9)
    jumps = np.linalg.norm(np.diff(state.known_error, axis=0, append=state.known_error[:1]), axis=1)
    at = np.flatnonzero(jumps > 0.1 * jumps.max())
    spacing = 360.0 / len(angles)
    steps = np.sort(angles[at] + 0.5 * spacing)
    turns = np.degrees(np.arctan([4.0 / 3.0, -4.0 / 3.0]))
    expected = np.sort([turns[0], turns[1] + 180.0, turns[0] + 180.0, turns[1] + 360.0])
    assert expected == pytest.approx([53.13, 126.87, 233.13, 306.87], abs=0.01)
    assert steps == pytest.approx(expected, abs=spacing)
    # Rods at (300, 400) and (-300, 400): a carriage that is off by w moves the tool along the
    # other rod's normal, by w times 500 / 600 of its length.
    assert jumps[at] == pytest.approx(width * 1e-6 * 400.0 / 500.0 / (24.0 / 25.0), rel=0.01)
