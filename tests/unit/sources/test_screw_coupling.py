"""The screw_coupling source: a non-captive screw's turn, against the joints multiplied out."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from reference_kinematics import Vector, rotation_of, turned_about, vector_of
from truepose.errors import MachineFileError, TrueposeError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import Deviation
from truepose.sources.screw_coupling import PARALLEL

# A vertical strut under the tool, whose screw turns as the platform does, and one that turns it.
TURNTABLE = """\
schema = 1
[machine]
name = "turntable"
dof = ["z", "c"]
[units]
length = "mm"
angle = "deg"
[[drive]]
name = "lift"
kind = "telescopic"
travel = [100, 900]
[[drive]]
name = "turn"
kind = "telescopic"
travel = [100, 900]
[[strut]]
name = "lift"
drive = "lift"
base = [0, 0, 0]
platform = [0, 0, 0]
screw = { lead = 5, base_axis = [1, 0, 0], platform_axis = [1, 0, 0] }
[[strut]]
name = "turn"
drive = "turn"
base = [300, 0, 0]
platform = [0, 100, 50]
[workspace]
home = { z = 400 }
grid = { z = [350, 450, 3], c = [-60, 60, 9] }
"""

AXES = {
    "1": ([1, 0, 0], [0, 1, 0]),
    "3": ([0.2, -0.9, 0.4], [0.5, 0.1, -0.3]),
    "4": ([0, 1, 0], [0, 1, 0]),
}
LEADS = {"1": 5.0, "3": -10.0, "4": 4.0}


def with_screws(text: str) -> str:
    for name, (base, platform) in AXES.items():
        row = f'[[strut]]\nname = "{name}"\n'
        screw = (
            f"screw = {{ lead = {LEADS[name]}, base_axis = {base}, platform_axis = {platform} }}"
        )
        text = edited(text, (row, f"{row}{screw}\n"))
    return text


def deviation_of(machine: Machine, poses: Vector | None = None) -> Deviation:
    (source,) = (each for each in machine.sources if each.name == "screw_coupling")
    at = machine.poses() if poses is None else poses
    (block,) = PoseRun(machine, at, machine.condition)
    found: Deviation = source.deviation(machine, machine.condition, block)  # type: ignore[attr-defined]
    assert not found.half.any()
    return found


def end_of_strut(body: Vector, axis: Vector, along: Vector) -> tuple[Vector, Vector]:
    """(3, 3) orientation of a strut's end on a universal joint, and its own axis there (3,).

    Two revolute joints multiplied out: the body turned by `body` (3, 3), the first joint about
    `axis`, body axes, the second about an axis across it, so that the end lies `along`.
    """
    cross = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    cross /= np.linalg.norm(cross)
    straight = np.cross(axis, cross)
    wanted = body.T @ along
    first = math.atan2(-(wanted @ cross), wanted @ straight)
    second = math.asin(wanted @ axis)
    end = body @ turned_about(axis, first) @ turned_about(cross, second)
    assert np.abs(end @ straight - along).max() < 1e-12
    return end, straight


def twist(machine: Machine, strut: str, pose: Vector) -> float:
    """rad: how far a strut's platform end is turned against its base end, against home."""
    number = [each.name for each in machine.struts].index(strut)
    base_axis, platform_axis = (np.array(axis) / np.linalg.norm(axis) for axis in AXES[strut])
    nominal = dict(zip(machine.parameters, machine.nominal.tolist(), strict=True))
    base, platform = (
        np.array([nominal[f"strut.{machine.struts[number].name}.{end}.{axis}"] for axis in "xyz"])
        for end in ("base", "platform")
    )

    def relative(at: Vector) -> tuple[Vector, Vector]:
        body = rotation_of(at[3:])
        span = at[:3] + body @ platform - base
        along = span / np.linalg.norm(span)
        lower, straight = end_of_strut(np.eye(3), base_axis, along)
        upper, _ = end_of_strut(body, platform_axis, along)
        return lower.T @ upper, straight

    now, straight = relative(pose)
    home, _ = relative(machine.home)
    return float(vector_of(now @ home.T) @ straight)


def test_the_turn_is_that_of_the_joints_multiplied_out(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_screws(HEXAPOD))
    random = np.random.default_rng(3)
    poses = machine.home + random.uniform(-1, 1, (40, 6)) * [0.08, 0.08, 0.08, 0.3, 0.3, 0.6]
    found = deviation_of(machine, poses)
    names = [machine.parameters[column] for column in found.parameters]
    assert names == [f"drive.d{strut}.offset" for strut in AXES]
    turns = np.array([[twist(machine, strut, pose) for strut in AXES] for pose in poses])
    assert np.abs(turns).max(axis=0).min() > 0.3
    leads = np.array([LEADS[strut] for strut in AXES]) * 1e-3
    assert np.abs(found.shift - leads * turns / math.tau).max() < 1e-15


def test_the_tool_goes_where_the_changed_struts_take_it(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_screws(HEXAPOD))
    shift = np.zeros((len(machine.poses()), 6))
    shift[:, [0, 2, 3]] = deviation_of(machine).shift
    moved = machine.forward(machine.inverse(machine.poses()) + shift, machine.poses())
    error = tp.budget(machine).error.sel(source="screw_coupling").values
    assert np.abs(error[:, :3]).max() > 1e-4
    assert np.abs(error[:, :3] - (moved - machine.poses())[:, :3]).max() < 1e-12


@pytest.mark.parametrize("lead", [5.0, -5.0])
def test_a_right_hand_screw_lengthens_as_its_platform_end_turns_with_the_right_hand(
    tmp_path: Path, lead: float
) -> None:
    machine = load_text(tmp_path, edited(TURNTABLE, ("lead = 5", f"lead = {lead}")))
    turn = machine.poses()[:, 1]
    shift = deviation_of(machine).shift[:, 0]
    assert np.abs(shift - lead * 1e-3 * turn / math.tau).max() < 1e-17
    height = tp.budget(machine).error.sel(source="screw_coupling", component="z")
    assert np.abs(height - shift).max() < 1e-12


def test_it_counts_from_home_and_goes_on_beyond_half_a_turn_of_the_crosses(tmp_path: Path) -> None:
    # With crosses a quarter turn apart at c = 0, and home at 60 deg, the cut of the angle between
    # the crosses, at half a turn, lies in the range.
    text = edited(
        TURNTABLE,
        ("platform_axis = [1, 0, 0]", "platform_axis = [0, 1, 0]"),
        ("home = { z = 400 }", "home = { z = 400, c = 60 }"),
        ("c = [-60, 60, 9]", "c = [0, 160, 9]"),
        ("[0, 100, 50]", "[86.6, 50, 50]"),
    )
    machine = load_text(tmp_path, text)
    turn = machine.poses()[:, 1] - math.radians(60.0)
    shift = deviation_of(machine).shift[:, 0]
    assert np.abs(shift - 5e-3 * turn / math.tau).max() < 1e-17


def test_a_platform_that_only_moves_along_leaves_joints_of_equal_axes_alone(tmp_path: Path) -> None:
    text = with_screws(edited(HEXAPOD, ("c = [-5, 5, 2]", "c = [0, 0, 1]")))
    shift = deviation_of(load_text(tmp_path, text)).shift
    assert np.abs(shift[:, 2]).max() < 1e-17  # strut 4
    assert np.abs(shift[:, 1]).max() > 1e-5


def test_a_lead_of_zero_does_nothing(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(TURNTABLE, ("lead = 5", "lead = 0")))
    assert not tp.budget(machine).error.sel(source="screw_coupling").values.any()
    assert not tp.budget(machine).worst.sel(source="screw_coupling").values.any()


def test_a_file_without_screws_has_no_such_source() -> None:
    machine = tp.load(MACHINES / "hexapod.toml")
    assert "screw_coupling" not in {source.name for source in machine.sources}


def refused(folder: Path, text: str) -> list[tuple[str, int | None]]:
    with pytest.raises(MachineFileError) as caught:
        load_text(folder, text)
    assert all(problem.expected for problem in caught.value.problems)
    return [(problem.code, problem.line) for problem in caught.value.problems]


def test_a_screw_on_a_strut_of_fixed_length_is_refused(tmp_path: Path) -> None:
    screw = "screw = { lead = 5, base_axis = [1, 0, 0], platform_axis = [0, 1, 0] }"
    text = edited(PLANAR, ("length = 500", f"length = 500\n{screw}"))
    assert refused(tmp_path, text) == [("screw-not-driven", line_of(text, "screw ="))]


def test_an_axis_along_the_strut_at_home_is_refused(tmp_path: Path) -> None:
    text = edited(TURNTABLE, ("base_axis = [1, 0, 0]", "base_axis = [0, 0, 2]"))
    assert refused(tmp_path, text) == [("screw-axis-parallel", line_of(text, "screw ="))]
    # Just beside it the turn is known.
    tilted = f"base_axis = [{2 * PARALLEL}, 0, 1]"
    machine = load_text(tmp_path, edited(TURNTABLE, ("base_axis = [1, 0, 0]", tilted)))
    assert np.isfinite(deviation_of(machine).shift).all()
    text = edited(TURNTABLE, ("base_axis = [1, 0, 0]", f"base_axis = [{PARALLEL / 2}, 0, 1]"))
    assert refused(tmp_path, text) == [("screw-axis-parallel", line_of(text, "screw ="))]


def test_an_axis_along_the_strut_at_a_pose_is_refused_with_the_pose(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path,
        edited(
            with_screws(HEXAPOD),
            ("base_axis = [1, 0, 0], platform", "base_axis = [-0.21, -0.02, 0.6], platform"),
        ),
    )
    with pytest.raises(TrueposeError) as caught:
        tp.budget(machine, [[0.05, 0, 0.6, 0, 0, 0], [0, 0, 0.6, 0, 0, 0]])
    (problem,) = caught.value.problems
    assert problem.code == "screw-axis-parallel"
    assert problem.path == "strut.1.screw.base_axis"
    assert problem.found is not None
    assert "x = 0 m, y = 0 m, z = 0.6 m" in problem.found


def test_a_home_out_of_reach_is_refused(tmp_path: Path) -> None:
    text = edited(
        with_screws(HEXAPOD),
        ('"d2"\nkind = "telescopic"\noffset = 600', '"d2"\nkind = "slider"\naxis = [0, 0, 1]'),
        ('drive = "d2"', 'drive = "d2"\nlength = 600'),
        ("home = { z = 650 }", "home = { x = 2000, z = 650 }"),
    )
    assert refused(tmp_path, text) == [("home-unreachable", line_of(text, "[workspace]"))]


def test_a_screw_says_all_that_is_needed(tmp_path: Path) -> None:
    text = edited(TURNTABLE, ("lead = 5, ", ""), ("platform_axis = [1, 0, 0]", "axis = [1, 0, 0]"))
    line = line_of(text, "screw =")
    assert sorted(refused(tmp_path, text)) == sorted(
        [("missing-key", line), ("missing-key", line), ("unknown-key", line)]
    )
