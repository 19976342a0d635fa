"""The points of a program's path: which there are, where, in which order, and what is refused."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from truepose._kernel import GcodeReader
from truepose.controllers.gcode.program import ProgramOptions
from truepose.errors import RequestError
from truepose.workpiece.stretches import Interval, Stretches
from truepose.workpiece.walk import MOST_POINTS, PathBatch, ProgramWalk

HEAD = "G21 G90 G94 F900\n"


@pytest.fixture(scope="module")
def delta() -> tp.Machine:
    return tp.load(MACHINES / "linear_delta.toml")


@pytest.fixture(scope="module")
def planar() -> tp.Machine:
    return tp.load(MACHINES / "planar_two_slider.toml")


def walk_of(
    machine: tp.Machine,
    folder: Path,
    text: str,
    chosen: Sequence[Sequence[Interval]] = (),
    most: Sequence[int] | None = None,
    **options: object,
) -> ProgramWalk:
    file = folder / "part.ngc"
    file.write_text(text)
    return ProgramWalk(machine, file, ProgramOptions(**options), Stretches(chosen), most)  # type: ignore[arg-type]


def together(batches: Sequence[PathBatch], name: str) -> np.ndarray:
    return np.concatenate([getattr(batch, name) for batch in batches])


SQUARE = HEAD + (
    "G0 X-20 Y-20 Z20\n"  # line 2
    "G1 Z10\n"
    "G1 X20\n"
    "G1 Y20\n"
    "G1 X-20\n"
    "G1 Y-20\n"
    "G0 Z20\n"
)


def test_the_end_of_every_move_is_a_point_and_none_is_farther_than_the_division_looks(
    delta: tp.Machine, tmp_path: Path
) -> None:
    batches = list(walk_of(delta, tmp_path, SQUARE).path())
    points, lines = together(batches, "points"), together(batches, "line")
    corners = {3: (-20, -20, 10), 4: (20, -20, 10), 5: (20, 20, 10), 6: (-20, 20, 10)}
    for line, corner in corners.items():
        np.testing.assert_allclose(points[lines == line][-1], np.array(corner) / 1e3, atol=1e-15)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    feeds = together(batches, "is_feed")[1:]
    length = delta.characteristic_length
    assert steps[feeds].max() <= length / 64.0 * (1.0 + 1e-9)
    assert steps.max() <= length / 16.0 * (1.0 + 1e-9)
    # Each stands for the way to it.
    weight = together(batches, "weight")
    np.testing.assert_allclose(weight[1:][feeds], steps[feeds], rtol=1e-9)
    assert weight.sum() == pytest.approx(0.170, rel=1e-12)
    assert (together(batches, "element") == -1).all()


def test_it_begins_where_the_machine_stands(delta: tp.Machine, tmp_path: Path) -> None:
    first = next(walk_of(delta, tmp_path, SQUARE, start={"x": 0.01, "z": 0.1}).path())
    np.testing.assert_allclose(first.poses[0][[0, 2]], [0.01, 0.1])
    assert first.weight[0] == 0.0
    np.testing.assert_array_equal(first.joints, delta.inverse(first.poses))


def test_walls_have_evenly_spaced_points_with_both_ends(delta: tp.Machine, tmp_path: Path) -> None:
    walk = walk_of(delta, tmp_path, SQUARE, [[(4, 4)], [(5, 5)]], [180, 180])
    bottom, right = walk.elements()
    for (points, lines, _), line, begin, end in (
        (bottom, 4, (-20, -20, 10), (20, -20, 10)),
        (right, 5, (20, -20, 10), (20, 20, 10)),
    ):
        assert (lines == line).all()
        assert 100 < len(points) <= 180
        np.testing.assert_allclose(points[0], np.array(begin) / 1e3, atol=1e-15)
        np.testing.assert_allclose(points[-1], np.array(end) / 1e3, atol=1e-15)
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        np.testing.assert_allclose(steps, 0.04 / (len(points) - 1), rtol=1e-9)


def test_moves_that_follow_each_other_share_their_joint(delta: tp.Machine, tmp_path: Path) -> None:
    """Two walls of one element: the corner is one point, and the path passes it once."""
    points, lines, _ = walk_of(delta, tmp_path, SQUARE, [[(4, 5)]]).elements()[0]
    corner = np.abs(points - [0.02, -0.02, 0.01]).max(axis=1) < 1e-12
    assert corner.sum() == 1
    assert lines[corner] == 4


def test_places_count_the_points_of_elements_in_the_order_of_the_path(
    delta: tp.Machine, tmp_path: Path
) -> None:
    walk = walk_of(delta, tmp_path, SQUARE, [[(6, 6)], [(4, 4), (7, 7)]])
    batches = list(walk.path())
    element = together(batches, "element")
    kept = together(batches, "points")[element >= 0]
    for number, (points, lines, place) in enumerate(walk.elements()):
        np.testing.assert_array_equal(kept[place], points)
        np.testing.assert_array_equal(element[element >= 0][place], number)
        np.testing.assert_array_equal(together(batches, "line")[element >= 0][place], lines)
    # And again, as often as one likes.
    again = list(walk.path())
    np.testing.assert_array_equal(together(again, "poses"), together(batches, "poses"))


CIRCLE = HEAD + "G0 X10 Y0 Z20\nG1 Z5\n"


@pytest.mark.parametrize(
    ("arcs", "lines"),
    [
        ("G3 X10 Y0 I-10 J0\n", (4, 4)),
        ("G2 X-10 Y0 I-10 J0\nG2 X10 Y0 I10 J0\n", (4, 5)),
        ("G3 X0 Y10 I-10 J0\nG3 X-10 Y0 I0 J-10\nG3 X0 Y-10 I10\nG3 X10 Y0 J10\n", (4, 7)),
    ],
)
def test_a_full_circle_has_a_point_each_degree_and_its_opposite(
    arcs: str, lines: Interval, delta: tp.Machine, tmp_path: Path
) -> None:
    points, _, _ = walk_of(delta, tmp_path, CIRCLE + arcs, [[lines]]).elements()[0]
    assert len(points) == MOST_POINTS
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1]), 0.01, rtol=1e-12)
    np.testing.assert_allclose(points[:180, :2], -points[180:, :2], atol=1e-14)
    angles = np.unwrap(np.arctan2(points[:, 1], points[:, 0]))
    np.testing.assert_allclose(np.abs(np.diff(angles)), np.radians(1.0), rtol=1e-9)


def test_a_spiral_of_turns_has_points_farther_apart(delta: tp.Machine, tmp_path: Path) -> None:
    """Three turns: no more than all may have, and still each with its opposite."""
    turns = "G3 X10 Y0 Z2 I-10 J0 P3\n"
    points, _, _ = walk_of(delta, tmp_path, CIRCLE + turns, [[(4, 4)]]).elements()[0]
    assert len(points) == 271  # every 4 degrees, with the beginning, which is not the end
    np.testing.assert_allclose(points[:45, :2], -points[45:90, :2], atol=1e-14)


def test_an_element_of_many_short_moves_has_points_evenly_along_it(
    delta: tp.Machine, tmp_path: Path
) -> None:
    xs = np.linspace(-40.0, 40.0, 1001)
    text = HEAD + "G0 X-40 Y0 Z20\nG1 Z10\n" + "".join(f"G1 X{x:.3f}\n" for x in xs[1:])
    walk = walk_of(delta, tmp_path, text, [[(4, 2000)]], [100])
    points, lines, place = walk.elements()[0]
    assert 95 <= len(points) <= 100
    np.testing.assert_allclose(np.diff(points[:, 0]), 0.0008, atol=9e-5)
    np.testing.assert_array_equal(lines, 3 + np.round((points[:, 0] + 0.04) / 8e-5))
    batches = list(walk.path())
    kept = together(batches, "points")[together(batches, "element") >= 0]
    np.testing.assert_array_equal(kept[place], points)
    assert len(together(batches, "line")) > 1000  # the path has the ends of the others all the same


def test_more_moves_than_a_batch_are_one_path(planar: tp.Machine, tmp_path: Path) -> None:
    """Points, runs and lengths go on where a batch ends."""
    angle = np.linspace(0.0, 3.0 * np.pi, 20001)
    xs, ys = 300.0 + 30.0 * np.cos(angle), 200.0 + 30.0 * np.sin(angle)
    moves = "".join(f"G1 X{x:.6f} Y{y:.6f}\n" for x, y in zip(xs[1:], ys[1:], strict=True))
    text = HEAD + "G0 X330 Y200\n" + moves
    walk = walk_of(planar, tmp_path, text, [[(3, 30000)]])
    assert walk.extents[0].moves == 20000
    assert walk.extents[0].runs == 1
    points, _, place = walk.elements()[0]
    assert 355 <= len(points) <= MOST_POINTS
    np.testing.assert_array_equal(place, np.arange(len(points)))
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    np.testing.assert_allclose(steps, 0.09 * np.pi / MOST_POINTS, rtol=0.03)
    batches = list(walk.path())
    assert len(batches) > 2
    np.testing.assert_array_equal(together(batches, "line")[-20000:], np.arange(3, 20003))
    assert (points[:, 2] == 0.0).all()


def test_a_parasitic_platform_has_its_tool_point(tmp_path: Path) -> None:
    """What is not commanded is where the nominal machine takes it."""
    machine = tp.load(MACHINES / "3prs.toml")
    home = machine.home[[machine.dof.index(name) for name in machine.commanded]]
    z = 1e3 * float(home[list(machine.commanded).index("z")])
    text = HEAD + f"G1 Z{z + 1:.3f} A1 B-1\n"
    batch = next(walk_of(machine, tmp_path, text, [[(2, 2)]]).path())
    np.testing.assert_allclose(batch.points, batch.placements[:, :3], atol=1e-15)
    assert np.abs(batch.points[-1, :2]).max() > 0.0


@pytest.mark.parametrize(
    ("moves", "code", "line"),
    [
        ("G1 X300 Y210\nG1 X300 Y2000\n", "gcode-pose", 4),
        ("G1 X300 Z5\n", None, None),  # an axis of its own
        ("G1 X300 Q5\n", "gcode-unused-word", 3),
    ],
)
def test_a_path_that_the_machine_cannot_go_is_refused_with_its_line(
    moves: str, code: str | None, line: int | None, planar: tp.Machine, tmp_path: Path
) -> None:
    text = HEAD + "G0 X300 Y200\n" + moves
    if code is None:
        list(walk_of(planar, tmp_path, text).path())
        return
    with pytest.raises(RequestError) as refused:
        list(walk_of(planar, tmp_path, text).path())
    (problem,) = refused.value.problems
    assert (problem.code, problem.line) == (code, line)
    assert problem.file == str(tmp_path / "part.ngc")


def test_a_start_at_which_the_machine_cannot_be_is_refused(
    planar: tp.Machine, tmp_path: Path
) -> None:
    walk = walk_of(planar, tmp_path, HEAD + "G0 X300 Y200\n", start={"y": 5.0})
    with pytest.raises(RequestError, match="gcode-start"):
        list(walk.path())
    with pytest.raises(RequestError, match="bad-correction"):
        walk_of(planar, tmp_path, HEAD, units="furlong")


def test_a_way_through_a_singularity_is_refused_where_the_correction_refuses_it(
    tmp_path: Path,
) -> None:
    machine = tp.load(MACHINES / "3rrr.toml")
    text = "G21 G90 G94\nG0 X0 Y0 C0\nG1 F900\n" + "".join(
        f"G1 C{angle}\n" for angle in range(5, 170, 15)
    )
    with pytest.raises(RequestError) as refused:
        list(walk_of(machine, tmp_path, text).path())
    with pytest.raises(RequestError) as of_correction:
        tp.correct_program(machine, tmp_path / "part.ngc", None, interpolation="pose")
    found, expected = refused.value.problems[0], of_correction.value.problems[0]
    assert (found.code, found.line) == ("gcode-singularity", expected.line)
    assert expected.code == "gcode-singularity"


@pytest.mark.parametrize("seed", range(5))
def test_the_points_of_any_program_are_on_its_moves_and_stand_for_all_of_it(
    seed: int, planar: tp.Machine, tmp_path: Path
) -> None:
    """Lines, arcs of any angle, rapids and rests, some of them elements, against the moves read."""
    rng = np.random.default_rng(seed)
    text, x, y = HEAD + "G0 X300 Y200\n", 300.0, 200.0
    for _ in range(60):
        to = rng.uniform((270, 170), (330, 230)).round(3)
        i, j = 0.5 * (to[0] - x), 0.5 * (to[1] - y)
        text += str(
            rng.choice(
                [
                    f"G1 X{to[0]} Y{to[1]}",
                    f"G0 X{to[0]} Y{to[1]}",
                    f"G{rng.integers(2, 4)} X{to[0]} Y{to[1]} I{i:.6f} J{j:.6f}",
                    f"G1 X{to[0]} Y{to[1]}\nG4 P0.1\nG1 X{to[0]} Y{to[1]}",
                ]
            )
        )
        text += "\n"
        x, y = to
    chosen = [[(5, 9), (20, 22)], [(30, 60)]]
    most = [90, 60]
    try:
        walk = walk_of(planar, tmp_path, text, chosen, most)
        batches = list(walk.path())
    except RequestError as refused:  # the half circles may leave the workspace
        assert refused.problems[0].code in ("gcode-pose", "gcode-singularity")  # noqa: PT017
        pytest.skip("this program leaves the workspace")
    moves = GcodeReader(tmp_path / "part.ngc", axes="XY").read(1000)
    feed = moves.kind != 0
    assert together(batches, "weight").sum() == pytest.approx(
        1e-3 * moves.length[feed].sum(), rel=1e-9
    )
    # Every end is a point, in order.
    poses, position = together(batches, "poses"), 0
    for end in moves.end[:, :2] / 1e3:
        near = np.flatnonzero(np.abs(poses[position:] - end).max(axis=1) < 1e-12)
        position += int(near[0])
    # Every point of an element is on a move of its line, and the path has exactly those.
    fine = np.linspace(0.0, 1.0, 20001)
    element = together(batches, "element")
    for number, (points, lines, place) in enumerate(walk.elements()):
        assert 0 < len(points) <= most[number]
        np.testing.assert_array_equal(together(batches, "points")[element >= 0][place], points)
        for line in np.unique(lines):
            assert any(first <= line <= last for first, last in chosen[number])
            way = np.concatenate(
                [
                    moves.points(np.full(fine.size, move), fine)[:, :2]
                    for move in np.flatnonzero(moves.line == line)
                ]
            )
            for point in points[lines == line]:
                assert np.abs(way / 1e3 - point[:2]).sum(axis=1).min() < 2e-5
