"""The clearance source: play taken up along loaded struts, a band along the others."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from reference_kinematics import rotation_of, turned_about
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import UNIFORM, Deviation
from two_slider import Floats, directions, displaced, tensions

FORCE = (1200.0, -1500.0)
NO_FORCE = ("force = { x = 1200, y = -1500 }\n", "")
PUSH = (30.0, -20.0, -500.0)

JOINTS = {
    "1": 'base_joint = { clearance = "20 um" }\n'
    'platform_joint = { kind = "revolute", axis = [0, 0, 1], clearance = "10 um" }',
    "2": 'base_joint = { kind = "universal", clearance = "16 um" }',
}
# Half the play at base and platform, of strut 1, and at the base of strut 2, m.
REACHES = np.array([10e-6, 5e-6, 8e-6])
OF_STRUT = np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]])


def with_clearance(*edits: tuple[str, str], text: str = PLANAR) -> str:
    for name, joints in JOINTS.items():
        row = f'[[strut]]\nname = "{name}"\n'
        text = edited(text, (row, f"{row}{joints}\n"))
    return edited(text.replace("length_tolerance = [-0.3, 0.3]\n", ""), *edits)


def deviation_of(machine: Machine, condition: tp.Condition | None = None) -> Deviation:
    (source,) = (each for each in machine.sources if each.name == "clearance")
    given = machine.condition if condition is None else condition
    (block,) = PoseRun(machine, machine.poses(), given)
    found: Deviation = source.deviation(machine, given, block)  # type: ignore[attr-defined]
    return found


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_strut_in_tension_grows_by_the_play_at_both_ends(tmp_path: Path, sign: float) -> None:
    force = (sign * FORCE[0], sign * FORCE[1])
    text = with_clearance(("x = 1200, y = -1500", f"x = {force[0]}, y = {force[1]}"))
    machine = load_text(tmp_path, text)
    side = np.sign(tensions(machine, machine.poses(), force))
    assert (side != side[0]).any()
    expected = displaced(machine, machine.poses(), lengths=side * (REACHES @ OF_STRUT))
    found = tp.budget(machine)
    assert np.abs(found.error.sel(source="clearance") - expected).max() < 1e-14
    assert not found.uncertainty.sel(source="clearance").values.any()


def test_a_load_the_other_way_turns_every_joint_round(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_clearance())
    turned = machine.condition.replace(force=(-FORCE[0], -FORCE[1], 0.0))
    assert np.array_equal(deviation_of(machine, turned).shift, -deviation_of(machine).shift)


def test_the_play_is_taken_up_above_the_threshold_only(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_clearance())
    pull = np.abs(tensions(machine, machine.poses(), FORCE)) @ OF_STRUT.T
    threshold = float(np.sort(pull.ravel())[pull.size // 2])
    for factor in (1.0 - 1e-6, 1.0 + 1e-6):
        table = f'[clearance]\nthreshold = "{threshold * factor!r} N"\n[workspace]'
        machine = load_text(tmp_path, with_clearance(("[workspace]", table)))
        found = deviation_of(machine)
        over = pull > threshold * factor
        assert 0 < over.sum() < over.size
        assert np.allclose(np.abs(found.shift), np.where(over, REACHES, 0.0), rtol=1e-14, atol=0)
        assert np.allclose(found.half, np.where(over, 0.0, REACHES), rtol=1e-14, atol=0)


def test_a_force_of_unknown_direction_leaves_open_what_it_could_turn_round(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_clearance())
    poses = machine.poses()
    known = np.abs(tensions(machine, poses, FORCE))
    # The most that 400 N of any direction do to a strut, by trying them in the plane.
    tried = [
        np.abs(tensions(machine, poses, (400 * math.cos(at), 400 * math.sin(at))))
        for at in np.linspace(0.0, math.pi, 721)
    ]
    sure = ((known - np.max(tried, axis=0)) @ OF_STRUT.T) > 0.0
    assert 0 < sure.sum() < sure.size
    before = deviation_of(machine)
    found = deviation_of(machine, machine.condition.replace(envelope=400.0))
    assert np.array_equal(found.shift, np.where(sure, before.shift, 0.0))
    assert np.array_equal(found.half, np.where(sure, 0.0, np.abs(before.shift)))


@pytest.mark.parametrize(
    "force",
    [NO_FORCE, ("{ x = 1200, y = -1500 }", "{ z = 1000 }")],
    ids=["no load", "a load that the frame holds"],
)
def test_the_joints_of_an_unloaded_strut_vary_each_by_itself(
    tmp_path: Path, force: tuple[str, str]
) -> None:
    machine = load_text(tmp_path, with_clearance(force))
    found = deviation_of(machine)
    assert not found.shift.any()
    assert np.allclose(found.half, REACHES, rtol=1e-14)
    assert len(set(found.variables.tolist())) == 3
    assert set(found.distribution) == {UNIFORM}
    budget = tp.budget(machine)
    assert not budget.error.sel(source="clearance").values.any()
    # By hand: u_i . dx = dL_i.
    per_length = np.linalg.inv(directions(machine, machine.poses()))
    each = (per_length @ OF_STRUT.T) * REACHES
    worst = np.abs(each).sum(axis=2)
    assert np.abs(budget.worst.sel(source="clearance") - worst).max() < 1e-15
    spread = np.sqrt(np.square(each).sum(axis=2) / 3.0)
    assert np.abs(budget.uncertainty.sel(source="clearance") - spread).max() < 1e-15


def in_the_hole(axis: Floats, radial: float, axial: float) -> Floats:
    """(n, 3) m: the places on the rim of what a pin's play allows it, about its middle."""
    across = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    across /= np.linalg.norm(across)
    around = np.linspace(0.0, math.tau, 20000)
    rim = np.outer(np.cos(around), across) + np.outer(np.sin(around), np.cross(axis, across))
    return np.concatenate([radial * rim + side * axial * axis for side in (-1.0, 1.0)])


def test_a_pin_gives_way_as_far_as_its_hole_lets_it_along_the_strut(tmp_path: Path) -> None:
    axes = np.array([[0.6, 0.0, 0.8], [0.0, 0.8, 0.6]])
    pins = [
        f'{end}_joint = {{ kind = "revolute", axis = {axis.tolist()}, '
        f'clearance = "{clearance} um", axial_clearance = "{axial} um" }}\n'
        for end, axis, clearance, axial in zip(
            ("base", "platform"), axes, (30, 40), (50, 20), strict=True
        )
    ]
    row = '[[strut]]\nname = "3"\n'
    text = edited(HEXAPOD, (row, row + "".join(pins)), ("c = [-5, 5, 2]", "c = [-5, 20, 2]"))
    machine = load_text(tmp_path, text)
    loaded = machine.condition.replace(force=PUSH)
    found = deviation_of(machine, loaded)
    assert [machine.parameters[column] for column in found.parameters] == ["drive.d3.offset"] * 2
    side = np.sign(machine.forces(machine.poses(), [*PUSH, 0, 0, 0])[:, 2])
    for number, pose in enumerate(machine.poses()):
        turned = rotation_of(pose[3:])
        span = pose[:3] + turned @ [-0.12, 0.05, 0.0] - [-0.25, 0.2, 0.0]
        along = span / np.linalg.norm(span)
        reach = [
            (in_the_hole(axis, radial, axial) @ along).max()
            for axis, radial, axial in (
                (axes[0], 15e-6, 25e-6),
                (turned @ axes[1], 20e-6, 10e-6),
            )
        ]
        # The rim in 20000 steps falls short by (2 pi / 20000)^2 / 8 of its radius at most.
        assert np.abs(found.shift[number] - side[number] * np.array(reach)).max() < 1e-12


ARM = """\
schema = 1
[machine]
name = "arm and rod"
dof = ["z"]
[units]
length = "mm"
angle = "deg"
force = "N"
[[drive]]
name = "arm"
kind = "crank"
axis = [0, 3, 4]
offset = 20
scale = 0.5
travel = [-400, 400]
working_mode = "+"
[[strut]]
name = "rod"
drive = "arm"
base = [100, 20, 30]
platform = [10, 20, 0]
length = 250
base_joint = { kind = "revolute", axis = [0, -0.6, 0.8], clearance = "20 um" }
[workspace]
home = { z = 250 }
grid = { z = [240, 280, 5] }
"""


def test_a_pin_on_an_arm_turns_with_it(tmp_path: Path) -> None:
    machine = load_text(tmp_path, ARM)
    found = deviation_of(machine, machine.condition.replace(force=(0.0, 0.0, 50.0)))
    axis = np.array([0.0, 0.6, 0.8])
    for number, (z, joint) in enumerate(
        zip(machine.poses()[:, 0], machine.inverse(machine.poses())[:, 0], strict=True)
    ):
        turned = turned_about(axis, 0.5 * joint + math.radians(20.0))
        span = np.array([0.01, 0.02, z]) - turned @ [0.1, 0.02, 0.03]
        assert abs(np.linalg.norm(span) - 0.25) < 1e-12
        along = span / 0.25
        pin = turned @ [0.0, -0.6, 0.8]
        across = float(np.linalg.norm(along - (along @ pin) * pin))
        assert across < 0.99
        assert abs(abs(found.shift[number, 0]) - 10e-6 * across) < 1e-17


def test_a_machine_of_more_closures_than_freedoms_has_it_by_each_strut_s_tension() -> None:
    machine = tp.load(
        MACHINES / "overconstrained.toml", settings={"each.strut.base_joint.clearance": "10 um"}
    )
    assert len(machine.struts) > len(machine.dof)
    found = deviation_of(machine)
    tension = machine.forces(machine.poses(), machine.condition.wrench)[:, : len(machine.struts)]
    # Where x is largest a strut carries nothing but rounding.
    side = np.where(np.abs(tension) > 1e-6, np.sign(tension), 0.0)
    assert (side == 0.0).any(axis=0).tolist() == [False, True, False, False]
    assert np.abs(found.shift - 5e-6 * side).max() < 1e-20
    assert np.abs(found.half - 5e-6 * (side == 0.0)).max() < 1e-20


def test_no_clearance_anywhere_is_no_source_and_a_table_alone_a_row_of_zeros(
    tmp_path: Path,
) -> None:
    machine = load_text(tmp_path, PLANAR)
    assert "clearance" not in {source.name for source in machine.sources}
    table = ("[workspace]", "[clearance]\nthreshold = 5\n[workspace]")
    found = tp.budget(load_text(tmp_path, edited(PLANAR, table)))
    assert not found.worst.sel(source="clearance").values.any()


@pytest.mark.parametrize(
    ("joint", "code"),
    [
        ('{ kind = "flexure", clearance = "10 um" }', "unwanted-clearance"),
        ('{ kind = "flexure", axial_clearance = "10 um" }', "unwanted-clearance"),
        ('{ kind = "spherical", axial_clearance = "10 um" }', "unwanted-clearance"),
        ('{ kind = "revolute", clearance = "10 um" }', "missing-key"),
        ('{ kind = "revolute", axial_clearance = "10 um" }', "missing-key"),
        ('{ clearance = "-10 um" }', "negative"),
        ('{ clearance = "10 N" }', "wrong-dimension"),
    ],
)
def test_what_is_no_clearance_is_refused(tmp_path: Path, joint: str, code: str) -> None:
    text = edited(PLANAR, ('name = "2"\n', f'name = "2"\nplatform_joint = {joint}\n'))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == (code, line_of(text, "platform_joint"))
    assert problem.found
    assert problem.expected


def test_a_threshold_below_zero_is_refused(tmp_path: Path) -> None:
    text = with_clearance(("[workspace]", "[clearance]\nthreshold = -5\n[workspace]"))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == ("negative", line_of(text, "threshold"))
