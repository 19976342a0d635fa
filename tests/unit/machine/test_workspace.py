"""Every way to give the poses of a workspace: grid, box, cylinder, list, CSV file, path."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, Problem
from truepose.machine import Machine
from truepose.machine.workspace import along, disc, disc_size, steps

PLANAR_GRID = "grid = { x = [200, 400, 5], y = [100, 300, 3] }"
HEXAPOD_HOME = "home = { z = 650 }\n"
HEXAPOD_GRID = "grid = { x = [-50, 50, 3], z = [600, 700, 2], c = [-5, 5, 2] }"


def planar(folder: Path, workspace: str) -> Machine:
    return load_text(folder, edited(PLANAR, (PLANAR_GRID, workspace)))


def hexapod(folder: Path, workspace: str, *, home: str = HEXAPOD_HOME) -> Machine:
    return load_text(folder, edited(HEXAPOD, (HEXAPOD_GRID, workspace), (HEXAPOD_HOME, home)))


def in_mm(machine: Machine) -> NDArray[np.float64]:
    return machine.poses() * 1e3


def nearest(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) distance of each point from its nearest neighbour."""
    distances = np.linalg.norm(points[:, np.newaxis] - points, axis=2)
    np.fill_diagonal(distances, np.inf)
    return np.asarray(distances.min(axis=1))


def test_a_box_is_a_grid_of_at_most_a_step(tmp_path: Path) -> None:
    machine = planar(tmp_path, 'box = { x = [200, 400], y = [100, 110], step = "7 cm" }')
    grid = planar(tmp_path, "grid = { x = [200, 400, 4], y = [100, 110, 2] }")
    assert machine.workspace is not None
    assert machine.workspace.shape == (4, 2)
    assert np.array_equal(machine.poses(), grid.poses())
    assert np.array_equal(machine.home, grid.home)


def test_a_box_of_a_whole_number_of_steps_has_no_step_more(tmp_path: Path) -> None:
    machine = planar(tmp_path, 'box = { x = ["0 m", "0.3 m"], y = [100, 100], step = "0.1 m" }')
    assert machine.workspace is not None
    assert machine.workspace.shape == (4, 1)
    assert [steps(0.3, 0.1), steps(0.3, 0.0999), steps(-0.3, 0.3), steps(0.0, 1.0)] == [3, 4, 1, 0]


def test_a_box_turns_and_leaves_at_home_what_it_does_not_name(tmp_path: Path) -> None:
    machine = hexapod(tmp_path, "box = { x = [-20, 20], c = [-5, 5], step = 20, angle_step = 4 }")
    assert machine.workspace is not None
    assert machine.workspace.shape == (3, 1, 1, 1, 1, 4)
    assert np.allclose(machine.poses()[:, 2], 0.65)


def test_a_disc_is_filled_to_its_rim() -> None:
    points = disc(0.1, 0.03)
    radii = np.linalg.norm(points, axis=1)
    assert np.allclose(np.unique(radii.round(9)), np.linspace(0.0, 0.1, 5))
    for direction in ([1, 0], [0, 1], [-1, 0], [0, -1]):
        assert (np.abs(points - 0.1 * np.array(direction)).max(axis=1) < 1e-12).sum() == 1
    assert nearest(points).max() <= 0.03
    # Nowhere in the disc is a pose farther than half a cell's diagonal.
    random = np.random.default_rng(5)
    radius, angle = 0.1 * np.sqrt(random.uniform(size=300)), random.uniform(0, 2 * np.pi, 300)
    inside = radius[:, np.newaxis] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    away = np.linalg.norm(inside[:, np.newaxis] - points, axis=2).min(axis=1)
    assert away.max() <= 0.03 / np.sqrt(2)


@pytest.mark.parametrize("step", [0.3, 0.1, 0.011, 0.0037])
def test_the_size_of_a_disc_is_bounded_without_making_it(step: float) -> None:
    size = len(disc(0.1, step))
    assert size <= disc_size(0.1, step) <= 4 * size + 40


def test_a_cylinder_stands_upright_at_its_centre_layer_on_layer(tmp_path: Path) -> None:
    machine = hexapod(
        tmp_path,
        "cylinder = { centre = [10, -5], radius = 40, z = [620, 680], step = 25, c = [0, 4], "
        "angle_step = 5 }",
    )
    poses = in_mm(machine)
    size = len(disc(40.0, 25.0))
    assert len(poses) == size * 4 * 2
    from_axis = np.hypot(poses[:, 0] - 10, poses[:, 1] + 5)
    assert from_axis.max() == pytest.approx(40)
    assert np.allclose(np.unique(poses[:, 2]), [620, 640, 660, 680])
    assert np.allclose(np.unique(np.degrees(machine.poses()[:, 5])), [0, 4])
    assert len(np.unique(poses.round(6), axis=0)) == len(poses)


def test_a_cylinder_stands_about_home_and_without_z_is_a_disc(tmp_path: Path) -> None:
    disc_only = hexapod(tmp_path, "cylinder = { radius = 40, step = 40 }")
    assert np.allclose(in_mm(disc_only)[:, :3].mean(axis=0), [0, 0, 650])
    moved = planar(tmp_path, "home = { x = 300, y = 200 }\ncylinder = { radius = 40, step = 40 }")
    assert np.allclose(in_mm(moved).mean(axis=0), [300, 200])
    free = hexapod(tmp_path, "cylinder = { radius = 40, z = [600, 700], step = 40 }", home="")
    assert np.allclose(free.home, [0, 0, 0.65, 0, 0, 0], atol=1e-12)


def test_a_list_in_a_csv_file(tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text("c (deg),x (in)\n5,1\n-5,2\n", encoding="utf-8")
    machine = hexapod(tmp_path, 'poses = "poses.csv"')
    assert np.allclose(machine.poses()[:, 0], [0.0254, 0.0508])
    assert np.allclose(np.degrees(machine.poses()[:, 5]), [5, -5])
    assert np.allclose(machine.poses()[:, 2], 0.65)
    assert machine.data_files.keys() == {"poses.csv"}
    assert machine.workspace is not None
    assert not machine.workspace.is_path


def test_a_path_is_divided_and_keeps_its_order(tmp_path: Path) -> None:
    machine = planar(
        tmp_path, "path = { points = [[200, 100], [210, 100], [210, 100], [210, 96]], step = 4 }"
    )
    assert machine.workspace is not None
    assert machine.workspace.is_path
    expected = [[200, 100], [200 + 10 / 3, 100], [200 + 20 / 3, 100], [210, 100], [210, 96]]
    assert np.allclose(in_mm(machine), expected)


def test_a_path_without_steps_is_its_points_as_they_were_given(tmp_path: Path) -> None:
    (tmp_path / "path.csv").write_text("x (mm),y (mm)\n200,100\n301,99\n", encoding="utf-8")
    machine = planar(tmp_path, 'path = { points = "path.csv" }')
    listed = planar(tmp_path, "poses = [[200, 100], [301, 99]]")
    assert np.array_equal(machine.poses(), listed.poses())


def test_a_path_turns_at_a_constant_rate(tmp_path: Path) -> None:
    points = "[[0, 0, 650, 0, 0, 0], [30, 40, 650, 0, 0, 9]]"
    machine = hexapod(tmp_path, f"path = {{ points = {points}, step = 30, angle_step = 2 }}")
    poses = machine.poses()
    assert len(poses) == 6  # 5 steps of 1.8 degrees, as two of 25 mm would turn too much
    assert np.allclose(np.diff(poses, axis=0), np.diff(poses, axis=0)[0])


def test_points_are_met_exactly() -> None:
    points = np.random.default_rng(3).uniform(size=(5, 3))
    poses = along(points, np.array([3, 0, 7, 1]))
    assert len(poses) == 12
    assert np.array_equal(poses[[0, 3, 10, 11]], points[[0, 1, 3, 4]])


@pytest.mark.parametrize(
    ("code", "workspace", "words"),
    [
        ("excluding-keys", f"{PLANAR_GRID}\nbox = {{ x = [0, 1], step = 1 }}", "grid and box"),
        ("missing-key", "box = { x = [200, 400], y = [1, 1] }", "x without step"),
        ("missing-key", "box = { step = 20 }", "the box names no freedom"),
        ("missing-key", "cylinder = { radius = 40 }", "workspace.cylinder.step"),
        ("missing-key", "path = { points = [[200, 100]] }", "at least two points"),
        ("missing-key", "path = { points = [] }", "no pose in the list"),
        ("missing-key", "path = { points = [[1, 2], [3, 4]], angle_step = 1 }", "without step"),
        ("unknown-freedom", "box = { z = [0, 1], step = 1 }", "z is not commanded"),
        ("unknown-freedom", "cylinder = { radius = 5, step = 5, z = [0, 1] }", "not commanded"),
        ("wrong-type", "box = { x = [200, 400, 5], step = 1 }", "a list of 3"),
        ("wrong-type", "poses = 5", "expected a list"),
        ("wrong-type", "path = { points = [[1, 2], [3]] }", "points[1]: a pose of 1 number"),
        ("wrong-dimension", 'path = { points = [[1, 2], [3, "4 N"]] }', "points[1][1]"),
        ("wrong-dimension", 'cylinder = { radius = 5, step = "5 deg" }', "found an angle"),
        ("not-positive", "box = { x = [200, 400], step = 0 }", "above zero"),
        ("grid-too-large", "box = { x = [200, 400], step = 1e-9 }", "at most 1e10 poses"),
        ("grid-too-large", "box = { x = [200, 400], step = 1e-307 }", "at most 1e10 poses"),
        ("grid-too-large", "cylinder = { radius = 5, step = 1e-4 }", "workspace.cylinder"),
        ("grid-too-large", "path = { points = [[1, 2], [3, 4]], step = 1e-8 }", "workspace.path"),
        ("file-missing", 'poses = "no.csv"', "no.csv"),
        ("file-missing", 'path = { points = "no.csv" }', "workspace.path.points"),
    ],
)
def test_a_bad_workspace(code: str, workspace: str, words: str, tmp_path: Path) -> None:
    text = edited(PLANAR, (PLANAR_GRID, workspace))
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == code
    first = line_of(text, workspace)
    assert problem.line in (first, first - 1)  # the key, or the table that lacks one
    assert words in str(problem)


def test_a_path_that_only_turns_needs_a_step_to_turn(tmp_path: Path) -> None:
    points = "[[0, 0, 650, 0, 0, 0], [30, 40, 650, 0, 0, 0], [30, 40, 650, 0, 0, 9]]"
    text = edited(HEXAPOD, (HEXAPOD_GRID, f"path = {{ points = {points}, step = 5 }}"))
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == "missing-key"
    assert "from point 2 to point 3 only turns, without angle_step" in str(problem)


def test_a_cylinder_needs_x_and_y(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ('dof = ["x", "y"]', 'dof = ["x", "z"]'),
        (PLANAR_GRID, "cylinder = { radius = 5, step = 5 }"),
    )
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == "unknown-freedom"
    assert "a cylinder needs x and y" in str(problem)


@pytest.mark.parametrize(
    ("csv", "code", "line"),
    [
        ("x (mm),z (mm)\n200,5\n", "unknown-column", 1),
        ("x,y (mm)\n200,5\n", "no-unit", 1),
        ("x (deg),y (mm)\n200,5\n", "wrong-dimension", 1),
        ("x (mm),y (mm)\n200,5\n200\n", "ragged-row", 3),
    ],
)
@pytest.mark.parametrize("way", ['poses = "poses.csv"', 'path = { points = "poses.csv" }'])
def test_a_bad_list(way: str, csv: str, code: str, line: int, tmp_path: Path) -> None:
    (tmp_path / "poses.csv").write_text(csv, encoding="utf-8")
    (problem,) = problems_of(tmp_path, edited(PLANAR, (PLANAR_GRID, way)))
    assert problem.code == code
    assert problem.file == str(tmp_path / "poses.csv")
    assert problem.line == line


def problems_of(folder: Path, text: str) -> tuple[Problem, ...]:
    with pytest.raises(MachineFileError) as caught:
        load_text(folder, text)
    return caught.value.problems
