"""`[family]`: rows that follow from a few parameters, and what stands beside it in the file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from machine_texts import edited, line_of, load_text
from truepose.errors import MachineFileError, Problem, RequestError

DELTA = """\
schema = 1
[machine]
name = "printer"
[units]
length = "mm"
angle = "deg"
[family]
kind = "linear_delta"
radius = 138
effector_radius = 33
rod = 217
spacing = 45
[each.drive]
travel = [0, 400]
[workspace]
grid = { x = [-50, 50, 3], y = [-50, 50, 3], z = [0, 100, 3] }
"""

HEXAPOD = """\
schema = 1
[machine]
name = "hexapod"
[units]
length = "mm"
angle = "deg"
[family]
kind = "hexapod"
base_radius = 300
platform_radius = 120
base_angle = 15
platform_angle = 45
height = 600
[each.drive]
travel = [500, 800]
[workspace]
grid = { x = [-50, 50, 3], y = [-50, 50, 3] }
"""


def problems(folder: Path, text: str, *settings: str) -> list[Problem]:
    with pytest.raises(MachineFileError) as raised:
        load_text(folder, text, *settings)
    return list(raised.value.problems)


def value(machine, name: str) -> float:
    return float(machine.nominal[machine.parameters.index(name)])


def test_a_delta_is_all_there(tmp_path: Path) -> None:
    machine = load_text(tmp_path, DELTA)
    assert machine.joints == ("a", "b", "c")
    assert [strut.name for strut in machine.struts] == ["a1", "a2", "b1", "b2", "c1", "c2"]
    assert machine.dof == ("x", "y", "z", "a", "b", "c")
    assert machine.commanded == ("x", "y", "z")
    assert [drive.working_mode for drive in machine.drives] == ["+", "+", "+"]
    # Two rods of a pair are parallel: one rod from tower to nozzle, Pythagoras.
    towers = np.radians([210.0, 330.0, 90.0])
    pose = np.array([0.02, -0.01, 0.03])
    for joint, angle in zip(machine.inverse(pose), towers, strict=True):
        across = 0.105 * np.array([np.cos(angle), np.sin(angle)]) - pose[:2]
        assert joint == pytest.approx(0.03 + np.sqrt(0.217**2 - across @ across), abs=1e-12)


def test_a_hexapod_stands_at_its_height(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HEXAPOD)
    assert machine.home.tolist() == [0.0, 0.0, 0.6, 0.0, 0.0, 0.0]
    assert machine.poses()[0, 2] == 0.6
    named = edited(HEXAPOD, ("[workspace]", "[workspace]\nhome = { z = 550 }"))
    assert load_text(tmp_path, named).home[2] == 0.55


def test_quantities_carry_their_unit(tmp_path: Path) -> None:
    plain = load_text(tmp_path, DELTA)
    for old, new in (
        ("radius = 138", 'radius = "138 mm"'),
        ("rod = 217", 'rod = ["21.7 cm", 217, "0.217 m"]'),
        ("spacing = 45", 'spacing = 45\nangle = [210, 330, "90 deg"]'),
    ):
        other = load_text(tmp_path, edited(DELTA, (old, new)))
        np.testing.assert_allclose(other.nominal, plain.nominal, rtol=0, atol=1e-16)


def test_each_tower_may_have_its_own(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(DELTA, ("radius = 138", "radius = [138, 139, 140]")))
    radii = [np.hypot(value(machine, f"drive.{tower}.origin.x"),
                      value(machine, f"drive.{tower}.origin.y")) for tower in "abc"]  # fmt: skip
    np.testing.assert_allclose(radii, [0.138, 0.139, 0.14], rtol=0, atol=1e-15)


def test_settings_of_the_family_go_first_and_others_after(tmp_path: Path) -> None:
    # In any order: the joint centre is set after the family gave it.
    machine = load_text(tmp_path, DELTA, "strut.a1.length=218", "family.rod=220")
    lengths = [value(machine, f"strut.{name}.length") for name in ("a1", "a2", "c2")]
    assert lengths == [0.218, 0.22, 0.22]
    assert load_text(tmp_path, DELTA, "drive.b.travel=[0, 300]").drives[1].travel == (0.0, 0.3)


def test_rows_add_what_is_no_geometry(tmp_path: Path) -> None:
    rows = """
[[strut]]
name = "b2"
material = "steel"
[[drive]]
name = "c"
travel = [0, 380]
working_mode = "+"
[each.strut]
material = "carbon fibre"
"""
    machine = load_text(tmp_path, DELTA + rows)
    # In the family's order, whichever rows stand in the file.
    assert machine.joints == ("a", "b", "c")
    assert [strut.material for strut in machine.struts] == [
        "carbon fibre", "carbon fibre", "carbon fibre", "steel", "carbon fibre", "carbon fibre"
    ]  # fmt: skip
    assert [drive.travel[1] for drive in machine.drives] == [0.4, 0.4, 0.38]


def test_lines_of_rows_stay_those_of_the_file(tmp_path: Path) -> None:
    text = (
        DELTA
        + '[[strut]]\nname = "b2"\ncentre_of_mass = -1\n'
        + '[[strut]]\nname = "a1"\ncentre_of_mass = -2\n'
    )
    found = problems(tmp_path, text)
    assert [(problem.path, problem.line) for problem in found] == [
        ("strut.b2.centre_of_mass", line_of(text, "centre_of_mass = -1")),
        ("strut.a1.centre_of_mass", line_of(text, "centre_of_mass = -2")),
    ]


def test_what_the_family_gave_is_at_its_line(tmp_path: Path) -> None:
    text = edited(DELTA, ("[each.drive]\ntravel = [0, 400]\n", ""))
    found = problems(tmp_path, text)
    assert [problem.path for problem in found] == [f"drive.{name}.travel" for name in "abc"]
    assert {(problem.code, problem.line) for problem in found} == {
        ("missing-key", line_of(text, "[family]"))
    }


BAD = [
    ("missing-key", ("rod = 217\n", ""), "[family]", "family.rod", "Length of the rods"),
    ("unknown-key", ("rod = 217", "rodd = 217"), "rodd", "family.rodd", 'did you mean "rod"?'),
    ("not-positive", ("radius = 138", "radius = -138"), "radius", "family.radius", "-138"),
    ("wrong-type", ("rod = 217", "rod = [217, 218]"), "rod =", "family.rod", "list of 2"),
    ("wrong-type", ("spacing = 45", "spacing = 45\nangle = 90"), "angle = 90", "family.angle",
     "a list of 3, one for each limb"),
    ("wrong-dimension", ("rod = 217", 'rod = "217 N"'), "rod =", "family.rod", "force"),
    ("no-unit", ('length = "mm"\n', ""), "radius", "family.radius", "unit declared"),
    ("missing-key", ('kind = "linear_delta"\n', ""), "[family]", "family.kind", "The kind"),
    ("unknown-choice", ('"linear_delta"', '"lineardelta"'), "kind", "family.kind",
     'did you mean "linear_delta"?'),
    ("wrong-type", ("[family]", "[[family]]"), "[[family]]", "family", "only one [family]"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("code", "edit", "at", "path", "words"), BAD, ids=lambda value: str(value)[:30]
)
def test_a_bad_parameter_is_told_once(
    tmp_path: Path, code: str, edit: tuple[str, str], at: str, path: str, words: str
) -> None:
    text = edited(DELTA, edit)
    (problem,) = problems(tmp_path, text)
    assert (problem.code, problem.line, problem.path) == (code, line_of(text, at), path)
    assert words in str(problem)


def test_a_bad_family_hides_no_other_mistake(tmp_path: Path) -> None:
    text = edited(DELTA, ("rod = 217", "rod = 0"), ("[0, 100, 3] }", "[0, 100, 0] }"))
    found = problems(tmp_path, text)
    assert [problem.path for problem in found] == ["family.rod", "workspace.grid.z"]


CONTRADICTIONS = [
    ('[[strut]]\nname = "a1"\nlength = 218\n', "length = 218", "strut.a1.length", "218 mm", "1 mm"),
    ('[[drive]]\nname = "c"\norigin = [0, 138.001, 0]\n', "origin", "drive.c.origin",
     "[0, 138.001, 0] mm", "0.001 mm"),
    ('[[drive]]\nname = "c"\naxis = [0, 0.6, 0.8]\n', "axis", "drive.c.axis",
     "[0, 0.6, 0.8]", "0.6"),
    ('[[drive]]\nname = "c"\nkind = "crank"\n', 'kind = "crank"', "drive.c.kind", '"crank"', ""),
    ('[[strut]]\nname = "a1"\ndrive = "b"\n', 'drive = "b"', "strut.a1.drive", '"b"', ""),
    ("[each.strut]\nlength = 218\n", "length = 218", "each.strut.length", "218 mm", "1 mm"),
]  # fmt: skip


@pytest.mark.parametrize(("rows", "at", "path", "found", "by"), CONTRADICTIONS)
def test_geometry_against_the_family_is_refused(
    tmp_path: Path, rows: str, at: str, path: str, found: str, by: str
) -> None:
    text = DELTA + rows
    told = [p for p in problems(tmp_path, text) if p.code == "family-contradiction"]
    assert {(p.line, p.path, p.found) for p in told} == {(line_of(text, at), path, found)}
    assert all(f"by up to {by}" in p.message for p in told) if by else True


def test_equal_geometry_is_welcome(tmp_path: Path) -> None:
    rows = """
[[strut]]
name = "a1"
drive = "a"
base = [-11.25, 19.485571585, 0]
length = "21.7 cm"
"""
    machine = load_text(tmp_path, DELTA + rows)
    assert value(machine, "strut.a1.base.y") == 0.019485571585


def test_a_row_that_the_family_has_not_is_refused(tmp_path: Path) -> None:
    text = DELTA + '[[strut]]\nname = "a11"\nlength = 3\n'
    told = problems(tmp_path, text)
    assert [p.code for p in told if p.path == "strut.a11.name"] == ["unknown-part"]
    assert 'did you mean "a1"?' in str(next(p for p in told if p.code == "unknown-part"))


def test_a_setting_that_leads_nowhere_is_told(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as raised:
        load_text(tmp_path, DELTA, "family.radius.x.y=3")
    assert raised.value.problems[0].code == "bad-setting"
    (problem,) = problems(tmp_path, DELTA, "family.rod=-1")
    assert problem.line is None
    assert "given by --set family.rod=-1" in problem.message
