"""Features that are found in a program, and the file of them, which is valid as it stands."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import pytest

import truepose as tp
from build_machine import MACHINES
from made_features import KINDS
from truepose.errors import RequestError
from truepose.workpiece.propose import propose_features
from truepose.workpiece.read import Part, read_part

HEAD = "G21 G90 G94 F900\nG0 X0 Y0 Z20\n"


@pytest.fixture(scope="module")
def delta() -> tp.Machine:
    return tp.load(MACHINES / "linear_delta.toml")


def proposed(
    machine: tp.Machine, folder: Path, moves: str
) -> tuple[list[dict[str, Any]], Part, str]:
    """The features found, and the part that is read with them."""
    program, file = folder / "part.ngc", folder / "found.toml"
    program.write_text(HEAD + moves)
    text = propose_features(machine, program)
    file.write_text(text)
    part = read_part(machine, program, file, kinds=KINDS)
    rows = tomllib.loads(text)["feature"]
    assert [feature.name for feature in part.features] == [row["name"] for row in rows]
    return rows, part, text


TURN = "G3 X10 Y0 I-10 J0\n"


@pytest.mark.parametrize(
    ("arcs", "lines"),
    [
        (TURN, "5"),
        ("G2 X-10 Y0 I-10 J0\nG2 X10 Y0 I10 J0\n", "5-6"),
        ("G3 X0 Y10 I-10\nG3 X-10 Y0 J-10\nG3 X0 Y-10 I10\nG3 X10 Y0 J10\n", "5-8"),
        ("G3 X0 Y10 I-10\nG1 X0 Y10\nG3 X-10 Y0 J-10\nG3 X0 Y-10 I10\nG3 X10 Y0 J10\n", "5-9"),
    ],
)
def test_a_full_circle_is_found(arcs: str, lines: str, delta: tp.Machine, tmp_path: Path) -> None:
    (row,), part, _ = proposed(delta, tmp_path, f"G0 X10 Y0\nG1 Z5\n{arcs}G0 Z20\n")
    assert (row["kind"], row["lines"], row["diameter"]) == ("circle", lines, "20 mm")
    assert (row["tolerance"], row["roundness"]) == ("+-0.2 mm", "0.2 mm")  # the file's accuracy
    assert len(part.features[0].elements[0].points) == 360


def test_what_is_no_full_circle_at_one_height_is_none(delta: tp.Machine, tmp_path: Path) -> None:
    """Three quarters; two halves of other radii; a helix; there and back."""
    moves = (
        "G0 X10 Y0\nG1 Z5\nG3 X0 Y-10 I-10 J0\nG1 X0 Y-12\n"
        "G3 X0 Y12 J12\nG3 X0 Y-8 J-10\n"
        "G0 X10 Y0\nG3 X10 Y0 Z1 I-10 J0\n"
        "G3 X-10 Y0 I-10\nG2 X10 Y0 I10\n"
    )
    with pytest.raises(RequestError, match="nothing-found"):
        proposed(delta, tmp_path, moves)


def test_of_circles_about_one_centre_the_last_is_proposed(
    delta: tp.Machine, tmp_path: Path
) -> None:
    moves = "".join(f"G0 X{x} Y0\nG1 Z{z}\nG3 X{x} Y0 I{-x}\n" for x, z in ((4, 9), (8, 9), (9, 8)))
    rows, _, text = proposed(delta, tmp_path, moves + "G0 X40\nG1 Z5\nG2 I-5\n")
    assert [(row["lines"], row["diameter"]) for row in rows] == [("11", "18 mm"), ("14", "10 mm")]
    assert "the last of 3 about this centre" in text


@pytest.mark.parametrize("rounded", [False, True])
def test_opposite_walls_of_a_contour_are_found(
    rounded: bool, delta: tp.Machine, tmp_path: Path
) -> None:
    contour = (
        "G1 X25 Y-20\nG3 X30 Y-15 J5\nG1 Y15\nG3 X25 Y20 I-5\nG1 X-25\nG3 X-30 Y15 J-5\nG1 Y-15\n"
        "G3 X-25 Y-20 I5\n"
        if rounded
        else "G1 X0\nG1 X30 Y-20\nG1 Y20\nG1 X-30\nG1 Y-20\n"
    )
    depths = "".join(f"G0 X{-25 if rounded else -30} Y-20\nG1 Z{z}\n{contour}" for z in (9, 8))
    rows, part, _ = proposed(delta, tmp_path, depths + "G0 Z20\n")
    assert {(row["kind"], row["nominal"]) for row in rows} == {("size", "60 mm"), ("size", "40 mm")}
    # Of the last depth, the walls in the order of the path.
    expected = {("15", "19"), ("17", "21")} if rounded else {("12-13", "15"), ("14", "16")}
    assert {tuple(row["lines"]) for row in rows} == expected
    assert all(element.points[0, 2] == 0.008 for element in part.elements)


def test_two_slots_in_a_row_are_two(delta: tp.Machine, tmp_path: Path) -> None:
    slot = "G0 X{0} Y-5\nG1 Z9\nG1 X{1}\nG1 Y5\nG1 X{0}\nG1 Y-5\nG0 Z20\n"
    rows, _, _ = proposed(delta, tmp_path, slot.format(-40, -10) + slot.format(10, 40))
    assert sorted(row["nominal"] for row in rows) == ["10 mm", "10 mm", "30 mm", "30 mm"]


ZIGZAG = "".join(f"G1 X{-30 if row % 2 else 30}\nG1 Y{5 * row - 10}\n" for row in range(6))
ONE_WAY = "".join(f"G0 X-30 Y{5 * row - 15} Z20\nG1 Z9\nG1 X30\n" for row in range(6))


@pytest.mark.parametrize(
    ("moves", "lines"), [("G0 X-30 Y-15\nG1 Z9\n" + ZIGZAG, "5-15"), (ONE_WAY, "5-20")]
)
def test_a_face_of_parallel_passes_is_found_and_its_passes_are_no_walls(
    moves: str, lines: str, delta: tp.Machine, tmp_path: Path
) -> None:
    (row,), part, _ = proposed(delta, tmp_path, moves)
    assert (row["kind"], row["lines"], row["zone"]) == ("flatness", lines, "0.2 mm")
    points = part.elements[0].points
    assert len(points) <= 360
    assert (points[:, 0].min(), points[:, 0].max()) == (-0.03, 0.03)
    assert (points[:, 1].min(), points[:, 1].max()) == (-0.015, 0.01)


def test_a_pocket_cleared_in_rings_is_no_face(delta: tp.Machine, tmp_path: Path) -> None:
    rings = "".join(
        f"G1 X{-r} Y{-r}\nG1 X{r}\nG1 Y{r}\nG1 X{-r}\nG1 Y{-r}\n" for r in (10, 14, 18, 22, 26, 30)
    )
    rows, _, _ = proposed(delta, tmp_path, f"G0 X-10 Y-10\nG1 Z9\n{rings}G0 Z20\n")
    assert [(row["kind"], row["nominal"]) for row in rows] == [("size", "60 mm")] * 2


def test_units_are_those_of_the_machine_file(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    moves = "G0 X10 Y0 Z500\nG3 X10 Y0 I-10 J0\n"
    (row,), _, _ = proposed(machine, tmp_path, moves.replace("Z20", "Z500"))
    assert row["diameter"] == "0.787401575 in"


def test_a_machine_in_a_plane_has_circles_and_walls(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "planar_two_slider.toml")
    (tmp_path / "part.ngc").write_text(
        "G21 G90 G94 F900\nG0 X300 Y200\nG3 I-20\nG1 X340\nG1 Y230\nG1 X300\nG1 Y200\n"
    )
    text = propose_features(machine, tmp_path / "part.ngc")
    rows = tomllib.loads(text)["feature"]
    assert [row["kind"] for row in rows] == ["circle", "size", "size"]
