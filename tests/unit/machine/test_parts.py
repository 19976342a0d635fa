"""Joints, drives, bodies and mounting as a file says them, and keys that rows share."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import pytest

from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, RequestError
from truepose.machine import Joint
from truepose.machine.parts import in_series

FULL = edited(
    PLANAR,
    (
        'name = "d1"\n',
        'name = "d1"\nfeedback = "direct"\nfixed_at = 100\nmaterial = "steel"\nmass = "12 kg"\n'
        'stiffness = { screw = "100 N/um", nut = "100 N/um", bearing = "50 N/um" }\n',
    ),
    ('name = "d2"\n', 'name = "d2"\nexpansion = "9e-6 1/K"\nstiffness = "80 N/um"\n'),
    (
        "length_tolerance = [-0.3, 0.3]\n",
        'length_tolerance = [-0.3, 0.3]\nmass = "3 kg"\ncentre_of_mass = 0.4\n'
        'base_joint = { kind = "universal", stiffness = "200 N/um", clearance = 0.02 }\n'
        'platform_joint = { kind = "revolute", axis = [0, 0, 2], axial_clearance = 0.1 }\n'
        'base_stiffness = ["50 N/um", inf, "60 N/um"]\n',
    ),
    (
        "[condition]\n",
        '[platform]\nmass = "40 kg"\ncentre_of_mass = [0, 0, 30]\nmaterial = "aluminium"\n'
        'anchor = [1, 2, 3]\n[frame]\nmaterial = "cast iron"\nexpansion = "1e-5 1/K"\n'
        "[tool]\nanchor = [0, 0, -5]\n[mounting]\na = 180\n[condition]\n",
    ),
)


def test_what_a_file_says_of_its_parts(tmp_path: Path) -> None:
    machine = load_text(tmp_path, FULL)
    first, second = machine.drives
    assert (first.feedback, first.fixed_at, first.material, first.mass) == (
        "direct",
        0.1,
        "steel",
        12.0,
    )
    assert first.expansion == 12e-6
    assert first.stiffness == pytest.approx(25e6)
    assert first.held_stiffness is None, "a direct scale sees what gives way before it"
    assert (second.feedback, second.expansion, second.held_stiffness) == ("motor", 9e-6, 80e6)
    strut, plain = machine.struts
    assert (strut.mass, strut.centre_of_mass) == (3.0, 0.4)
    assert strut.base_joint == Joint("universal", 200e6, clearance=2e-5)
    assert strut.platform_joint == Joint("revolute", axial_clearance=1e-4, axis=(0.0, 0.0, 1.0))
    assert strut.base_stiffness == (50e6, math.inf, 60e6)
    assert strut.base_compliance == pytest.approx((2e-8, 0.0, 1 / 60e6))
    assert (plain.base_joint, plain.mass, plain.base_compliance) == (Joint(), 0.0, (0.0, 0.0, 0.0))
    platform = machine.platform
    assert (platform.mass, platform.centre_of_mass) == (40.0, (0.0, 0.0, 0.03))
    assert (platform.expansion, platform.anchor) == (23e-6, (0.001, 0.002, 0.003))
    assert (machine.frame.expansion, machine.tool.expansion) == (1e-5, None)
    assert machine.tool.anchor == (0.0, 0.0, -0.005)
    assert machine.mounting == pytest.approx((math.pi, 0.0, 0.0))
    assert machine.parts == (
        *("drive.d1", "drive.d2", "strut.1", "strut.2", "carriage.d1", "carriage.d2"),
        *("platform", "frame", "tool"),
    )
    again = pickle.loads(pickle.dumps(machine))  # noqa: S301
    assert (again.drives, again.struts, again.platform) == (
        machine.drives,
        machine.struts,
        platform,
    )


def test_a_crank_gives_way_in_torsion(tmp_path: Path) -> None:
    crank = PLANAR.replace('kind = "slider"', 'kind = "crank"').replace(
        "travel = [0, 900]", 'travel = [-90, 90]\nstiffness = "12 kN m/rad"'
    )
    text = crank.replace("axis = [0, 1, 0]", "axis = [0, 0, 1]").replace(
        "base = [0, 0, 0]", "base = [200, 0, 0]"
    )
    assert load_text(tmp_path, text).drives[0].stiffness == pytest.approx(12e3)


def test_springs_in_series() -> None:
    assert in_series(2.0, None, 2.0, math.inf) == 1.0
    assert in_series(None, math.inf) is None


@pytest.mark.parametrize(
    ("angles", "down"),
    [
        ("a = 0", (0, 0, -1)),
        ("a = 180", (0, 0, 1)),
        ("a = 90", (0, -1, 0)),
        ("b = 90", (1, 0, 0)),
        ("a = 90\nc = 35", (0, -1, 0)),
        ("a = 30\nb = 20\nc = 70", None),
    ],
)
def test_gravity_in_the_axes_of_a_machine_that_is_turned(
    tmp_path: Path, angles: str, down: tuple[float, ...] | None
) -> None:
    machine = load_text(
        tmp_path, edited(PLANAR, ("[condition]", f"[mounting]\n{angles}\n[condition]"))
    )
    if down is None:
        (sa, sb, sc), (ca, cb, cc) = np.sin(machine.mounting), np.cos(machine.mounting)
        about_x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
        about_y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
        about_z = np.array([[cc, -sc, 0], [sc, cc, 0], [0, 0, 1]])
        down = tuple((about_z @ about_y @ about_x).T @ [0, 0, -1])
    assert machine.down == pytest.approx(down, abs=1e-15)


EACH = edited(
    PLANAR,
    ('drive = "d2"\nbase = [0, 0, 0]\nplatform = [0, 0, 0]\nlength = 500\n', 'drive = "d2"\n'),
    (
        "[condition]",
        "[each.strut]\nbase = [0, 0, 0]\nplatform = [0, 0, 0]\nlength = 510\n"
        'base_joint = { stiffness = "9 N/um" }\n[condition]',
    ),
)


def test_rows_have_what_each_of_them_has(tmp_path: Path) -> None:
    machine = load_text(tmp_path, EACH)
    lengths = machine.nominal[machine.kernel.length_parameters]
    assert lengths == pytest.approx([0.5, 0.51]), "a row's own value goes first"
    assert [strut.base_joint.stiffness for strut in machine.struts] == [9e6, 9e6]


def test_settings_reach_shared_keys(tmp_path: Path) -> None:
    shared = load_text(tmp_path, EACH, "each.strut.length=520")
    assert shared.nominal[shared.kernel.length_parameters] == pytest.approx([0.5, 0.52])
    own = load_text(tmp_path, EACH, "strut.2.base_joint.stiffness=8 N/um")
    assert [strut.base_joint.stiffness for strut in own.struts] == [9e6, 8e6]
    rows = load_text(tmp_path, EACH, "strut.*.length=530", "each.strut.length=520")
    assert rows.nominal[rows.kernel.length_parameters] == pytest.approx([0.53, 0.53])


def test_a_problem_of_a_shared_key_is_said_once_and_where_it_is_written(tmp_path: Path) -> None:
    text = edited(HEXAPOD, ("[workspace]", '[each.strut]\nstiffness = "0 N/um"\n[workspace]'))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.path) == ("not-positive", "each.strut.stiffness")
    assert problem.line == line_of(text, "stiffness")
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, HEXAPOD, "each.strut.stiffness=0 N/um")
    (problem,) = caught.value.problems
    assert "given by --set each.strut.stiffness=0 N/um" in problem.message


def test_a_setting_of_a_row_is_named_though_the_key_is_shared(tmp_path: Path) -> None:
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, EACH, "strut.2.length=-1")
    (problem,) = caught.value.problems
    assert (problem.path, problem.line) == ("strut.2.length", None)


def test_a_condition_names_parts_that_the_machine_has(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    condition = machine.condition.replace(
        temperature={"strut.3": 300.0, "frame": 300.0}, gradient={"plattform": (0, 0, 1)}
    )
    with pytest.raises(RequestError) as caught:
        machine.with_condition(condition)
    assert [problem.code for problem in caught.value.problems] == ["unknown-part"] * 2
    assert 'did you mean "platform"?' in str(caught.value)
