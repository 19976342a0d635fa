"""Every bad input: one clear problem with code, file, line, found, expected and hint."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import load
from truepose.machine.workspace import LARGEST_GRID
from truepose.sources import REGISTRY

Edit = tuple[str, str]


@dataclass(frozen=True)
class Bad:
    """A good file edited until it is bad: exactly one problem, at the line of `at`."""

    code: str
    edits: tuple[Edit, ...]
    at: str
    words: tuple[str, ...]
    text: str = PLANAR

    def __str__(self) -> str:
        return f"{self.code}: {self.at}"


def bad(code: str, old: str, new: str, at: str, *words: str, text: str = PLANAR) -> Bad:
    return Bad(code, ((old, new),), at, words, text)


GRID = "grid = { x = [200, 400, 5], y = [100, 300, 3] }"
FORCE = "force = { x = 1200, y = -1500 }"
CUTTING = (
    'cutting = { specific_force = "3000 N/mm^2", chip_thickness = 0.2, depth = 2, width = 2.5, '
    "depth_direction = [1, 0, 0], width_direction = [0, -1, 0] }"
)

KIENZLE = (
    'kienzle = { specific_force = "1500 N/mm^2", exponent = 0.25, chip_thickness = 0.2, width = 3, '
    "direction = [1, 0, 0] }"
)
STRUT = "length_tolerance = [-0.3, 0.3]"
DRIVE = "working_mode"
CONTROLLER = "[controller]\n"
ASKED = 'target = "0.5 mm"'


def said(key: str, value: str, where: str = STRUT) -> tuple[str, str]:
    """An edit that writes one more key."""
    return where, f"{key} = {value}\n{where}"


CASES = [
    # keys
    bad("unknown-key", "length = 500", "lenght = 500", "lenght", 'did you mean "length"?'),
    bad("unknown-key", "[accuracy]", "[acuracy]", "[acuracy]", 'did you mean "accuracy"?'),
    bad("unknown-key", "force = { x", "force = { u", "force = {", "condition.force.u", "x, y, z"),
    bad("unknown-key", 'axis = [0, 1, 0]', "axis = [0, 1, 0]\nofset = 3", "ofset", '"offset"'),
    bad("unknown-key", "length_tolerance", "length_tolerence", "length_tolerence", "length_tol"),
    bad("unknown-key", 'angle = "deg"', 'angel = "deg"', "angel", '"angle"'),
    bad("unknown-key", "[accuracy]", CONTROLLER + 'hold = "drawing"\n[accuracy]', "hold = ",
        "controller.hold", 'did you mean "holds"?'),
    bad("missing-key", "[accuracy]", CONTROLLER + "[accuracy]", "[controller]", "controller.holds",
        "in a controller that was not touched"),
    bad("unknown-choice", "[accuracy]", CONTROLLER + 'holds = "drawings"\n[accuracy]', "holds = ",
        "controller.holds", "found:    \"drawings\"", "'drawing' or 'calibrated'"),
    bad("unknown-choice", "[accuracy]", CONTROLLER + "holds = true\n[accuracy]", "holds = ",
        "controller.holds", "found:    true", "'drawing' or 'calibrated'"),
    bad("wrong-type", "schema = 1", 'schema = 1\ncontroller = "drawing"', "controller = ",
        "expected a table, found text", "[controller]"),
    bad("missing-key", 'name = "planar"\n', "", "[machine]", "machine.name", "Name of the mach"),
    bad("missing-key", "axis = [0, 1, 0]\n", "", "[[drive]]", "drive.d1.axis", "missing"),
    bad("missing-key", "length = 500\nlength_t", "length_t", "[[strut]]", "strut.1.length"),
    bad("missing-key", 'kind = "slider"\n', "", "[[drive]]", "drive.d1.kind"),
    bad("missing-key", 'modulus = "210 GPa"\n', "", "[[strut]]", "modulus", "material"),
    bad("missing-key", f"{GRID}\n", "", "[workspace]", "grid, box, cylinder, poses or path"),
    bad("missing-key", GRID, "poses = []", "poses", "at least one pose"),
    # types
    bad("wrong-type", "length = 500", "length = [500]", "length = [", "a length, found a list"),
    bad("wrong-type", "length = 500", "length = true", "length = true", "true or false"),
    bad("wrong-type", "length = 500", "length = 2020-01-01", "length = 2020", "a date"),
    bad("wrong-type", 'name = "1"', "name = 1", "name = 1", "expected text, found a number"),
    bad("wrong-type", "base = [0, 0, 0]", "base = [0, 0]", "base = [0, 0]", "found:    [0, 0]"),
    bad("wrong-type", "base = [0, 0, 0]", "base = 0", "base = 0", "a list of 3, found a number"),
    bad("wrong-type", "[0, 0, 0]\nlength", "[0, 0, 0, 0]\nlength", "0, 0, 0, 0]", "a list of 3"),
    bad("wrong-type", 'dof = ["x", "y"]', 'dof = "xy"', "dof", "expected a list, found text"),
    bad("wrong-type", 'length = "mm"', "length = 1", "length = 1", "the name of a unit"),
    bad("wrong-type", "axis = [0, 1, 0]", 'axis = "y"', 'axis = "y"', "expected a direction"),
    bad("wrong-type", GRID, "grid = { x = 200 }", "grid", "[from, to, count]"),
    bad("wrong-type", GRID, "grid = { x = [200, 400] }", "grid", "found a list of 2"),
    bad("wrong-type", GRID, "poses = [[200, 100], [1]]", "poses", "a pose of 1", "2 numbers: x, y"),
    bad("wrong-type", "[-0.3, 0.3]", "[-0.3]", "length_tolerance", "found a list of 1"),
    bad("wrong-type", "[-0.3, 0.3]", "true", "length_tolerance", "found true or false"),
    bad("wrong-type", "[accuracy]", "[[accuracy]]", "[[accuracy]]", "only one [accuracy]"),
    bad("unknown-choice", '"slider"', '"slyder"', "slyder", 'did you mean "slider"?'),
    bad("unknown-choice", '"+"', '"@"', "@", "'+' or '-'"),
    bad("unknown-choice", 'dof = ["x", "y"]', 'dof = ["x", "w"]', "dof", "'x', 'y', 'z'"),
    # quantities
    bad("wrong-dimension", "length = 500", 'length = "3 N"', "3 N", "a length, found a force"),
    bad("wrong-dimension", '"210 GPa"', '"210 N"', "210 N", "expected a stress, found a force"),
    bad("wrong-dimension", "temperature = 35", 'temperature = "15 delta_degC"', "15 delta",
        "expected a temperature, found a temperature difference"),
    bad("wrong-dimension", "temperature = 35", 'temperature = "35 C"', "35 C", '"degC"'),
    bad("wrong-dimension", 'length = "mm"', 'length = "N"', 'length = "N"', "found a force"),
    bad("no-unit", 'section_area = "28 mm^2"', "section_area = 28", "section_area = 28",
        "no unit declared for an area", '"28.3 mm^2"'),
    bad("no-unit", 'modulus = "210 GPa"', "modulus = 2.1e11", "modulus = 2.1e11", "a stress"),
    bad("unknown-unit", "length = 500", 'length = "500 mmm"', "mmm", 'unknown unit "mmm"'),
    bad("unknown-unit", "length = 500", 'length = "long"', "long", "not a number with a unit"),
    bad("unknown-unit", "length = 500", 'length = "1,5 mm"', "1,5", "a decimal point is a point"),
    bad("unknown-unit", 'length = "mm"', 'length = "mmm"', "mmm", 'unknown unit "mmm"'),
    bad("not-finite", "length = 500", "length = nan", "nan", "not finite"),
    bad("not-finite", "length = 500", "length = inf", "inf", "not finite"),
    bad("not-finite", "length = 500", 'length = "1e999 mm"', "1e999", "not finite"),
    bad("not-finite", "base = [0, 0, 0]", "base = [0, nan, 0]", "nan", "strut.1.base[1]"),
    bad("not-finite", "travel = [0, 900]", "travel = [0, inf]", "inf", "drive.d1.travel[1]"),
    bad("not-finite", "[200, 400, 5]", "[200, nan, 5]", GRID[:4], "workspace.grid.x[1]"),
    bad("not-positive", "length = 500", "length = -500", "-500", "above zero, found -500"),
    bad("not-positive", "length = 500", "length = 0", "length = 0", "above zero"),
    bad("not-positive", "travel = [0, 900]", "travel = [0, 900]\nscale = 0", "scale", "above zero"),
    bad("not-positive", "28 mm^2", "-28 mm^2", "-28", "an area above zero"),
    bad("not-positive", "210 GPa", "0 GPa", "0 GPa", "a stress above zero"),
    bad("not-positive", "temperature = 35", "temperature = -300", "-300", "above absolute zero"),
    bad("not-positive", '"0.5 mm"', '"0 mm"', '"0 mm"', "accuracy.target",
        "leave the key out where nothing is asked"),
    bad("not-positive", *said("angle_target", '"0 deg"', ASKED), "0 deg", "without error"),
    bad("negative", "[-0.3, 0.3]", "-0.3", "length_tolerance", "a half band is zero or more"),
    bad("zero-direction", "axis = [0, 1, 0]", "axis = [0, 0, 0]", "axis = [0, 0", "not zero"),
    # structure
    bad("bad-name", 'name = "1"', 'name = "1.a"', "1.a", "point"),
    bad("bad-name", 'name = "planar"', 'name = " "', 'name = " "', "not empty"),
    bad("duplicate-name", 'name = "d2"\nkind', 'name = "d1"\nkind',
        'name = "d1"\nkind = "slider"\norigin',
        "two drives are named", "line 11", text=PLANAR.replace('drive = "d2"', 'drive = "d1"')),
    bad("duplicate-name", 'name = "2"', 'name = "1"', 'name = "1"\ndrive = "d2"', "two struts"),
    bad("duplicate-name", 'dof = ["x", "y"]', 'dof = ["x", "x"]', "dof", "x appears more than"),
    bad("freedom-order", 'dof = ["x", "y"]', 'dof = ["y", "x"]', "dof", "x y z a b c"),
    bad("unknown-drive", 'drive = "d2"', 'drive = "d22"', "d22", 'no drive "d22"', 'mean "d2"'),
    bad("unused-drive", 'drive = "d2"', 'drive = "d1"', '[[drive]]\nname = "d2"', "no strut"),
    bad("unwanted-length", 'drive = "d1"\nbase', 'drive = "d1"\nlength = 600\nbase', "length = 600",
        "telescopic", "offset", text=HEXAPOD),
    bad("unwanted-carriage", "offset = 600", 'offset = 600\ncarriage = { material = "steel" }',
        "carriage =", "a telescopic drive moves no carriage", "no carriage", text=HEXAPOD),
    bad("not-positive", "travel = [-200, 400]", "travel = [-700, 400]", "-700",
        "from -100 to 1000 mm", text=HEXAPOD),
    bad("closure-count", 'dof = ["x", "y"]', 'dof = ["x", "y", "c"]\ncommanded = ["x", "y"]', "dof",
        "too few closures", "2 struts (2 closures) for 3 freedoms"),
    bad("drive-count", 'dof = ["x", "y", "z", "a", "b", "c"]',
        'dof = ["x", "y", "z"]', "dof", "6 drives for 3 commanded",
        text=HEXAPOD),
    bad("drive-count", 'dof = ["x", "y"]', 'dof = ["x", "y"]\ncommanded = ["x"]', "commanded",
        "too many drives", "2 drives for 1 commanded"),
    bad("unknown-freedom", 'dof = ["x", "y"]', 'dof = ["x", "y"]\ncommanded = ["x", "z"]',
        "commanded", "z"),
    bad("unknown-freedom", GRID, "grid = { x = [200, 400, 5], z = [0, 0, 1] }", "grid",
        "z is not commanded"),
    bad("unknown-freedom", GRID, f"home = {{ z = 3 }}\n{GRID}", "home", "no freedom of the plat"),
    bad("unknown-part", "temperature = 35", 'temperature = { "strut.3" = 40 }', "strut.3",
        'there is no part "strut.3"'),
    bad("travel-reversed", "travel = [0, 900]", "travel = [900, 0]", "[900, 0]", "swap the two",
        "found:    [900, 0]"),
    bad("travel-reversed", "travel = [0, 900]", "travel = [9, 9]", "[9, 9]", "to above from"),
    bad("excluding-keys", FORCE, f"{FORCE}\n{CUTTING}", "[condition]", "force and cutting"),
    bad("excluding-keys", GRID, f"{GRID}\nposes = [[200, 100]]", "[workspace]", "grid and poses"),
    # materials and tolerances
    bad("unknown-material", '"steel"', '"steal"', "steal", 'did you mean "steel"?'),
    bad("unknown-material", '"steel"', '"wood"', "wood", "give modulus and exp"),
    bad("unknown-tolerance-class", "[-0.3, 0.3]", '"IT19"', "IT19", 'did you mean "IT9"?'),
    bad("unknown-tolerance-class", "[-0.3, 0.3]", '"ISO 2768-x"', "2768-x", '"ISO 2768-'),
    bad("tolerance-reversed", "[-0.3, 0.3]", "[0.3, -0.3]", "[0.3, -0.3]", "upper limit is below"),
    bad("tolerance-out-of-range", "length = 500\nlength_tolerance = [-0.3, 0.3]",
        'length = 600\nlength_tolerance = "IT0"', "length_tolerance", "600 mm", "up to 500 mm"),
    # the workspace
    bad("grid-count", "[200, 400, 5]", "[200, 400, 0]", "grid", "one or more", "found:    0"),
    bad("grid-count", "[200, 400, 5]", "[200, 400, -1]", "grid", "one or more"),
    bad("grid-count", "[200, 400, 5]", "[200, 400, 2.5]", "grid", "one or more"),
    bad("grid-ends", "[200, 400, 5]", "[200, 400, 1]", "grid", "different ends",
        "found:    [200, 400, 1]"),
    bad("grid-too-large", "[200, 400, 5], y = [100, 300, 3]",
        "[200, 400, 1000000], y = [100, 300, 1000000]", "grid", "1e+12 poses", "at most 1e10"),
    bad("wrong-dimension", GRID, 'poses = [[200, "100 N"]]', "poses", "poses[0][1]"),
    bad("missing-key", GRID, "grid = {}", "grid", "names no freedom"),
    # stiffnesses, joints and masses
    bad("not-positive", *said("stiffness", '"0 N/um"'), "stiffness", "cannot carry a load",
        "leave the key out"),
    bad("not-positive", *said("stiffness", '"-3 N/um"'), "stiffness", "a stiffness above zero"),
    bad("not-positive", *said("stiffness", '{ nut = "9 N/um", screw = "0 N/um" }', DRIVE),
        "stiffness", "screw: a stiffness of zero cannot carry a load"),
    bad("missing-key", *said("stiffness", "{}", DRIVE), "stiffness", "no stiffness in the table"),
    bad("wrong-dimension", *said("stiffness", '"12 N m/rad"', DRIVE), "stiffness", "a stiffness"),
    bad("not-positive", *said("base_joint", '{ stiffness = "0 N/um" }'), "base_joint",
        "strut.1.base_joint.stiffness", "cannot carry a load"),
    bad("unknown-choice", *said("base_joint", '{ kind = "ball" }'), "base_joint", "'spherical'"),
    bad("unknown-key", *said("platform_joint", "{ clearence = 1 }"), "platform_joint",
        'did you mean "clearance"?'),
    bad("unwanted-clearance", *said("base_joint", '{ kind = "flexure", clearance = 0.1 }'),
        "base_joint", "has no play"),
    bad("unwanted-clearance", *said("base_joint", "{ axis = [0, 0, 1], axial_clearance = 0.1 }"),
        "base_joint", "a spherical joint has no axis"),
    bad("missing-key", *said("base_joint", "{ angle_limit = 30 }"), "base_joint", "no axis"),
    bad("not-positive", *said("base_stiffness", '["9 N/um", "0 N/um", inf]'), "base_stiffness",
        "cannot carry a load"),
    bad("wrong-type", *said("base_stiffness", '["9 N/um", "9 N/um"]'), "base_stiffness",
        "found a list of 2", "inf is a rigid one"),
    bad("not-finite", *said("stiffness", "inf"), "stiffness", "not finite"),
    bad("negative", *said("mass", '"-1 kg"'), "mass", "a mass of zero or more"),
    bad("not-a-fraction", *said("centre_of_mass", "1.2"), "centre_of_mass", "from 0 to 1"),
    bad("unknown-choice", *said("feedback", '"encoder"', DRIVE), "feedback", "'motor' or 'direct'"),
    bad("missing-key", *said("ring_axis", "[0, 0, 1]"), "ring_axis", "no ring_radius"),
    bad("missing-key", *said("ring_radius", "80"), "ring_radius", "no ring_axis", "[0, 0, 1]"),
    # rows that share
    bad("unknown-key", "[condition]", "[each.struts]\nlength = 500\n[condition]", "[each",
        "no [[struts]]", 'did you mean "strut"?'),
    bad("unknown-key", "[condition]", '[each.guide]\nkindd = "plane"\n[condition]', "[each",
        "no [[guide]]", "a [[guide]] too"),
    bad("unknown-key", "[condition]", "[each.strut]\nlenght = 500\n[condition]", "lenght",
        "each.strut.lenght", 'did you mean "length"?'),
    bad("unknown-key", "[condition]", '[each.drive]\nname = "d"\n[condition]', '"d"\n',
        "cannot share a name"),
    bad("wrong-type", "[condition]", "[each]\nstrut = 3\n[condition]", "strut = 3", "each.strut"),
    # conditions
    bad("excluding-keys", FORCE, f"{FORCE}\n{KIENZLE}", "[condition]", "force and kienzle"),
    bad("excluding-keys", FORCE, f"{FORCE}\n{CUTTING}\n{KIENZLE}", "[condition]", "thrice"),
    bad("not-a-fraction", FORCE, KIENZLE.replace("0.25", "1"), "kienzle", "exponent", "below 1"),
    bad("not-positive", FORCE, 'envelope = { force = "0 N" }', "envelope", "a force above zero"),
    bad("unknown-part", *said("gradient", '{ "strut.3" = "2 K/m" }', FORCE), "gradient",
        'no part "strut.3"'),
    bad("unknown-part", *said("gradient", '{ tool = ["2 K/m", "0 K/m", "0 K/m"] }', FORCE),
        "gradient", "along the tool is not known"),
    bad("unknown-part", "temperature = 35", "temperature = { fraem = 40 }", "fraem", '"frame"?'),
    bad("wrong-type", *said("gradient", '{ frame = "2 K/m" }', FORCE), "gradient",
        "along each of its axes", "[x, y, z]"),
    bad("wrong-type", *said("gradient", '{ "strut.1" = ["2 K/m", "0 K/m", "0 K/m"] }', FORCE),
        "gradient", "one gradient, along itself"),
    bad("wrong-type", *said("gradient", '{ "carriage.d1" = "2 K/m" }', FORCE), "gradient",
        "along each of its axes", "[x, y, z]"),
    bad("unknown-part", "temperature = 35", 'temperature = { "carriage.d3" = 40 }', "carriage.d3",
        "carriage.d1"),
    bad("missing-key", *said("time", '"60 s"', FORCE), "[condition]", "no temperature_log"),
    bad("no-mass", *said("gravity", '"9.81 m/s^2"', FORCE), "gravity", "nothing has a mass"),
    bad("no-mass", *said("acceleration", '{ x = "5 m/s^2" }', FORCE), "acceleration",
        "a mass of [platform]"),
    bad("negative", *said("gravity", '"-9.81 m/s^2"', FORCE), "gravity", "zero or more"),
    bad("unknown-freedom", 'target = "0.5 mm"', 'target = "0.5 mm"\nangle_target = 1',
        "angle_target", "cannot turn"),
    bad("unknown-choice", *said("at", '"wurst"', ASKED), "wurst", 'did you mean "worst"?'),
    bad("unknown-choice", *said("at", '"2 sigma"', ASKED), "2 sigma", '"95 %" or 0.95'),
    bad("unknown-choice", *said("at", '"95 %%"', ASKED), "95 %%", '"worst", or a coverage'),
    bad("unknown-choice", *said("at", '"95 mm"', ASKED), "95 mm", '"worst", or a coverage'),
    bad("wrong-type", *said("at", "[0.95]", ASKED), "[0.95]", "accuracy.at", "found a list"),
    bad("wrong-type", *said("at", "true", ASKED), "at = true", "found true or false"),
    bad("bad-probability", *said("at", "95", ASKED), "at = 95", '95 % is written "95 %" or 0.95'),
    bad("bad-probability", *said("at", "0", ASKED), "at = 0", "both excluded", "the share of"),
    bad("bad-probability", *said("at", '"-5 %"', ASKED), "-5 %", "both excluded"),
    bad("bad-probability", *said("at", "1.0", ASKED), "at = 1.0", 'at = "worst" asks it of every'),
    bad("bad-probability", *said("at", '"100 %"', ASKED), "100 %", 'at = "worst"'),
    bad("bad-probability", *said("at", '"180 %"', ASKED), "180 %", 'at = "worst"'),
    bad("not-finite", *said("at", "nan", ASKED), "nan", "not finite"),
]  # fmt: skip


def problems_of(folder: Path, text: str) -> tuple:
    with pytest.raises(MachineFileError) as caught:
        load_text(folder, text)
    return caught.value.problems


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_bad_file_gives_one_problem(case: Bad, tmp_path: Path) -> None:
    text = edited(case.text, *case.edits)
    problems = problems_of(tmp_path, text)
    assert [problem.code for problem in problems] == [case.code], problems
    (problem,) = problems
    assert problem.line == line_of(text, case.at)
    assert problem.file == str(tmp_path / "machine.toml")
    assert problem.found
    assert problem.expected
    assert str(problem).startswith(f"{problem.file}:{problem.line}: error[{case.code}]: ")
    for word in case.words:
        assert word in str(problem)


@pytest.mark.parametrize("text", [PLANAR, HEXAPOD])
def test_the_files_that_the_cases_edit_are_good(text: str, tmp_path: Path) -> None:
    assert load_text(tmp_path, text).sources


def test_all_problems_of_a_file_at_once(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        ('name = "planar"', 'nam = "planar"'),
        ("travel = [0, 900]", "travel = [900, 0]"),
        ('drive = "d2"', 'drive = "d3"'),
        ("length = 500", 'length = "3 N"'),
        ('"steel"', '"steal"'),
        ("[200, 400, 5]", "[200, 400, 0]"),
        ("temperature = 35", 'temperature = { "strut.9" = 3 }'),
        ("[accuracy]", "[nonsense]"),
    )
    problems = problems_of(tmp_path, text)
    assert [problem.code for problem in problems] == [
        "unknown-key",
        "travel-reversed",
        "wrong-dimension",
        "unknown-drive",
        "unknown-material",
        "unknown-part",
        "grid-count",
        "unknown-key",
    ]
    lines = [problem.line for problem in problems]
    assert lines == sorted(lines)


def test_counts_are_checked_though_the_table_has_another_problem(tmp_path: Path) -> None:
    text = edited(PLANAR, ('name = "planar"', 'nam = "planar"'), ('"y"]', '"y", "c"]'))
    problems = problems_of(tmp_path, text)
    assert [problem.code for problem in problems] == ["unknown-key", "closure-count"]


def test_a_bad_unit_is_reported_once_and_not_for_every_number(tmp_path: Path) -> None:
    problems = problems_of(tmp_path, edited(PLANAR, ('length = "mm"', 'length = "mmm"')))
    assert [problem.code for problem in problems] == ["unknown-unit"]


def test_a_platform_without_freedom(tmp_path: Path) -> None:
    problems = problems_of(tmp_path, edited(PLANAR, ('dof = ["x", "y"]', "dof = []")))
    assert [(each.path, each.expected) for each in problems] == [
        ("machine.dof", "a list of 1 or more")
    ]


def test_a_unit_that_is_not_declared_is_reported_once(tmp_path: Path) -> None:
    text = edited(PLANAR, ('force = "N"\n', ""), ('temperature = "degC"\n', ""))
    problems = problems_of(tmp_path, text)
    assert [(problem.code, problem.line) for problem in problems] == [
        ("no-unit", line_of(text, "reference_temperature")),
        ("no-unit", line_of(text, FORCE)),
    ]
    assert "no unit declared for a force, as for 1 more in the file" in problems[1].message
    assert "force =" in str(problems[1].hint)


@pytest.mark.parametrize("table", ["drive", "strut"])
def test_a_single_table_where_several_are_wanted(table: str, tmp_path: Path) -> None:
    text = f"schema = 1\n[machine]\nname = 'm'\ndof = ['x']\n[{table}]\nname = 'a'\n"
    problems = [each for each in problems_of(tmp_path, text) if each.path == table]
    assert [problem.code for problem in problems] == ["wrong-type"]
    assert f"write [[{table}]]" in str(problems[0])


def test_a_file_without_its_tables(tmp_path: Path) -> None:
    problems = problems_of(tmp_path, "schema = 1\n")
    assert [(problem.code, problem.path) for problem in problems] == [
        ("missing-key", "machine"),
        ("missing-key", "drive"),
        ("missing-key", "strut"),
    ]


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("schema = 2\n", "unsupported-schema", "a newer version"),
        ("schema = true\n", "unsupported-schema", "expected: 1"),
        ('schema = "1"\n', "unsupported-schema", "expected: 1"),
        ("", "missing-key", "schema = 1"),
    ],
)
def test_another_schema_is_the_only_problem(
    line: str, code: str, words: str, tmp_path: Path
) -> None:
    text = edited(PLANAR, ("schema = 1\n", line), ("length = 500", "lenght = 500"))
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == code
    assert words in str(problem)


def test_what_only_the_kernel_can_refuse(tmp_path: Path) -> None:
    text = edited(
        HEXAPOD,
        ('dof = ["x", "y", "z", "a", "b", "c"]', 'dof = ["x", "y", "z", "a", "b"]'),
        (", c = [-5, 5, 2]", ""),
    )
    text = (
        text[: text.index('[[drive]]\nname = "d6"')] + text[text.index('[[strut]]\nname = "1"') :]
    )
    text = text[: text.index('[[strut]]\nname = "6"')]
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == "not-buildable"
    assert problem.line == line_of(text, "dof")
    assert "rotation" in problem.message


def test_problems_that_sources_find_come_together(tmp_path: Path) -> None:
    text = PLANAR + '[tolerance]\n"strut.*.nothing" = 0.1\n"strut.1.base.x" = "3 N"\n'
    problems = problems_of(tmp_path, text)
    assert [(problem.code, problem.line) for problem in problems] == [
        ("tolerance-matches-nothing", line_of(text, "nothing")),
        ("wrong-dimension", line_of(text, "3 N")),
    ]


def only_problem(path: Path) -> tuple:
    with pytest.raises(MachineFileError) as caught:
        load(path, registry=REGISTRY)
    (problem,) = caught.value.problems
    return problem


def test_a_missing_file(tmp_path: Path) -> None:
    (tmp_path / "hexapod.toml").write_text(PLANAR)
    problem = only_problem(tmp_path / "hexpod.toml")
    assert problem.code == "file-missing"
    assert "hexapod.toml" in problem.hint
    assert only_problem(tmp_path / "planar.toml").hint is None, "a like ending is no likeness"
    assert only_problem(tmp_path / "no" / "where.toml").code == "file-missing"
    assert only_problem(tmp_path / "hexapod.toml" / "below").code == "file-missing"


def test_a_directory(tmp_path: Path) -> None:
    (tmp_path / "hexapod.toml").write_text(PLANAR)
    problem = only_problem(tmp_path)
    assert problem.code == "file-is-directory"
    assert "hexapod.toml" in problem.hint


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    assert only_problem(Path(str(tmp_path / "a\0b"))).code == "file-unreadable"
    assert only_problem(tmp_path / ("x" * 300)).code == "file-unreadable"


@pytest.mark.parametrize(
    ("content", "line", "found"),
    [
        (b'schema = 1\nname = "\xe4"\n', 2, "0xe4"),
        ("schema = 1\n".encode("utf-16"), 1, "UTF-16"),
        (b"\x7fELF\xff", 1, "0xff"),
    ],
)
def test_a_file_that_is_not_utf8(content: bytes, line: int, found: str, tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_bytes(content)
    problem = only_problem(path)
    assert (problem.code, problem.line) == ("not-utf8", line)
    assert found in problem.found


@pytest.mark.parametrize(
    ("text", "line", "found"),
    [
        ("schema = 1\nlength = = 3\n", 2, "length = = 3"),
        ("schema = 1\nschema = 2\n", 2, "schema = 2"),
        ("schema = 1\n[machine\n", 2, "[machine"),
        ('schema = "1', 1, 'schema = "1'),
        ("{}", 1, "{}"),
        ("x = " + "[" * 5000, 1, "x = " + "[" * 76),
    ],
)
def test_a_file_that_is_not_toml(
    text: str, line: int | None, found: str | None, tmp_path: Path
) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(text, encoding="utf-8")
    problem = only_problem(path)
    assert (problem.code, problem.line, problem.found) == ("not-toml", line, found)


@pytest.mark.parametrize(
    ("line", "hint"),
    [
        ("length = 250,5", "decimal point"),
        ("length = -250,5 # mm", "decimal point"),
        ("length = 0.2mm", "quotation marks"),
        ("length = .2 mm", "quotation marks"),
        ("length = = 3", None),
        ("length = [1, 2", None),
    ],
)
def test_what_people_write_for_a_number_is_told(
    line: str, hint: str | None, tmp_path: Path
) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(f"schema = 1\n{line}\n[machine]\n", encoding="utf-8")
    problem = only_problem(path)
    assert problem.code == "not-toml"
    assert (hint in problem.hint) if hint else problem.hint is None


def test_a_byte_order_mark_and_windows_lines_do_no_harm(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_bytes(b"\xef\xbb\xbf" + PLANAR.replace("\n", "\r\n").encode())
    assert load(path, registry=REGISTRY).name == "planar"


def test_a_grid_of_the_largest_size_is_refused_only_beyond_it(tmp_path: Path) -> None:
    old = "[200, 400, 5], y = [100, 300, 3]"
    just = edited(PLANAR, (old, f"[200, 400, {LARGEST_GRID}], y = [100, 100, 1]"))
    assert load_text(tmp_path, just).workspace.n_pose == LARGEST_GRID
    beyond = edited(PLANAR, (old, f"[200, 400, {LARGEST_GRID + 1}], y = [100, 100, 1]"))
    assert [problem.code for problem in problems_of(tmp_path, beyond)] == ["grid-too-large"]
    huge = edited(PLANAR, (old, "[200, 400, 9223372036854775807], y = [1, 2, 9]"))
    assert [problem.code for problem in problems_of(tmp_path, huge)] == ["grid-too-large"]


ODD = ("nan", '"3 N"', "[]", "{}", "true", "-1", "[0, 0, 0]", '"x"', "1e400")


@pytest.mark.parametrize("text", [PLANAR, HEXAPOD], ids=["planar", "hexapod"])
def test_a_file_with_a_line_removed_loads_or_is_refused(text: str, tmp_path: Path) -> None:
    lines = text.splitlines()
    refused = 0
    for index in range(len(lines)):
        try:
            load_text(tmp_path, "\n".join(lines[:index] + lines[index + 1 :]))
        except MachineFileError:
            refused += 1
    assert refused > len(lines) / 2


@pytest.mark.parametrize("odd", ODD)
def test_a_file_with_an_odd_value_loads_or_is_refused(odd: str, tmp_path: Path) -> None:
    lines = PLANAR.splitlines()
    at = [index for index, line in enumerate(lines) if " = " in line]
    refused = 0
    for index in at:
        key = lines[index].split(" = ", 1)[0]
        try:
            load_text(tmp_path, "\n".join([*lines[:index], f"{key} = {odd}", *lines[index + 1 :]]))
        except MachineFileError:
            refused += 1
    assert refused > len(at) / 2
