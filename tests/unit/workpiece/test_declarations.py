"""What is said of a part, in a file and in comments, and what is wrong with it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from made_features import KINDS
from truepose.errors import PartError, Problem, RequestError
from truepose.workpiece.read import Part, read_part

PROGRAM = """G21 G90 G94 F900
G0 X-20 Y-20 Z20
(rough)
T1 M6
N10 G1 Z10
N20 G1 X20
N30 G1 Y20
G0 Z20
(finish the walls)
T2 M6
G0 X-20 Y-20
N100 G1 Z9
N110 G1 X20
N120 G1 Y20
N130 G1 X-20
N140 G1 Y-20
G0 Z20
G0 X10 Y0
G1 Z5 (into the bore)
G3 X10 Y0 I-10 J0
G0 Z20
M2
"""


@pytest.fixture(scope="module")
def delta() -> tp.Machine:
    return tp.load(MACHINES / "linear_delta.toml")


class Read:
    """Reads a program and a features file in a folder."""

    def __init__(self, machine: tp.Machine, folder: Path) -> None:
        self.machine, self.folder = machine, folder

    def __call__(self, features: str | None = None, program: str = PROGRAM, **more: Any) -> Part:
        (self.folder / "part.ngc").write_text(program)
        file = None
        if features is not None:
            file = self.folder / "features.toml"
            file.write_text(features)
        return read_part(self.machine, self.folder / "part.ngc", file, kinds=KINDS, **more)

    def problems(self, features: str | None = None, program: str = PROGRAM) -> list[Problem]:
        with pytest.raises(PartError) as refused:
            self(features, program)
        for problem in refused.value.problems:
            assert problem.file is not None
            assert problem.found
            assert problem.expected
        return list(refused.value.problems)


@pytest.fixture
def read(delta: tp.Machine, tmp_path: Path) -> Read:
    return Read(delta, tmp_path)


def wall(place: str) -> str:
    return f'[[feature]]\nname = "wall"\nkind = "straightness"\nzone = 0.02\n{place}\n'


@pytest.mark.parametrize(
    ("place", "lines"),
    [
        ('lines = "13-14"', {13, 14}),
        ("lines = 13", {13}),
        ('lines = "16, 13"', {13, 16}),
        ('n = "N110"', {13}),
        ('n = "N110-N130"', {13, 14, 15}),
        ('tool = "T1"', {5, 6, 7}),
        ('comment = "Rough"', {5, 6, 7}),
        ('comment = "finish"', {12, 13, 14, 15, 16, 19, 20}),
        ('comment = "into the bore"', {19}),
        ('tool = "T2"\nlines = "1-13"', {12, 13}),
        ('tool = "T2"\nn = "N110-N140"\nlines = "14-30"', None),
    ],
)
def test_an_element_is_on_the_lines_that_are_said(
    place: str, lines: set[int] | None, read: Read
) -> None:
    if lines is None:
        (problem,) = read.problems(wall(place))
        assert (problem.code, problem.line) == ("part-not-there", 1)
        assert problem.found == 'lines = "14-30", n = "N110-N140", tool = "T2"'
        return
    (feature,) = read(wall(place)).features
    assert set(feature.elements[0].lines.tolist()) == lines


def test_only_operations_that_count_have_elements(read: Read) -> None:
    part = read('[part]\noperations = { tool = "T2" }\n' + wall('lines = "6-13"'))
    assert set(part.features[0].elements[0].lines.tolist()) == {12, 13}
    (problem,) = read.problems('[part]\noperations = { comment = "rough" }\n' + wall("lines = 13"))
    assert (problem.code, problem.line) == ("part-not-there", 3)


def test_a_program_without_tool_changes_has_the_tool_that_it_selects(read: Read) -> None:
    program = PROGRAM.replace(" M6", "")
    (feature,) = read(wall('tool = "T1"'), program).features
    assert set(feature.elements[0].lines.tolist()) == {5, 6, 7}


def test_file_and_comments_build_the_same(read: Read) -> None:
    file = """
[part]
evaluate = "least-squares"
[[datum]]
name = "A"
lines = 14
[[feature]]
name = "width"
kind = "size"
nominal = 40
tolerance = "+-0.05"
lines = ["13", "15"]
datums = ["A"]
tool_radius = "3 mm"
[[feature]]
name = "bore"
kind = "circle"
diameter = 20
tolerance = "+0.025 0"
roundness = "0.01 mm"
lines = 20
"""
    lines = PROGRAM.splitlines()
    for number, comment in (
        (20, "(feature: bore, diameter 20 +0.025 0, roundness 0.01 mm, evaluate least-squares)"),
        (17, "(end feature)"),
        (15, "(Feature: width)"),
        (14, "(datum: A)"),
        (
            13,
            "; feature: width, size 40 +-0.05, datums A, tool_radius 3, evaluate least-squares",
        ),
    ):
        lines.insert(number - 1, comment)
    said = read(file), read(None, "\n".join(lines))
    for part, moved in zip(said, (0, 1), strict=True):
        assert {feature.name for feature in part.features} == {"width", "bore"}
        by_name = {feature.name: feature for feature in part.features}
        width, bore = by_name["width"], by_name["bore"]
        assert [element.name for element in width.elements] == ["width, wall 1", "width, wall 2"]
        assert [element.tool_radius for element in width.elements] == [0.003, 0.003]
        assert [element.name for element in width.datums] == ["A"]
        assert width.method == bore.method == "least-squares"  # type: ignore[attr-defined]
        assert bore.row.diameter == 0.02  # type: ignore[attr-defined]
        assert bore.row.tolerance == "+0.025 0"  # type: ignore[attr-defined]
        assert width.row.tolerance == "+-0.05"  # type: ignore[attr-defined]
        assert bore.row.roundness == 1e-5  # type: ignore[attr-defined]
        assert width.elements[0].lines[0] == 13 + moved
    for ours, theirs in zip(*(sorted(part.elements, key=_name) for part in said), strict=True):
        assert ours.name == theirs.name
        if ours.name != "width, wall 2":  # whose stretch has the last wall in it too
            np.testing.assert_array_equal(ours.points, theirs.points)


def _name(element: Any) -> str:
    return str(element.name)


def test_a_feature_of_the_file_may_be_placed_by_comments(read: Read) -> None:
    program = PROGRAM.replace("N110", "(feature: wall)\nN110").replace(
        "N120", "(end feature)\nN120"
    )
    (feature,) = read(wall(""), program).features
    assert set(feature.elements[0].lines.tolist()) == {14}


def test_bare_numbers_of_a_comment_are_in_the_units_of_the_program(read: Read) -> None:
    program = "G20 G90 G94 F30\nG0 X0.4 Y0 Z0.8\n(feature: b, diameter 0.8 +-0.001)\nG3 I-0.4\n"
    (feature,) = read(None, program).features
    assert feature.row.diameter == pytest.approx(0.02032, rel=1e-14)


def test_the_working_plane_is_that_of_the_program_unless_the_file_says_it(read: Read) -> None:
    program = PROGRAM.replace("N110 G1", "N110 G18 G1").replace("N140 G1", "N140 G17 G1")
    planes = []
    for line in (12, 13, 14, 16):
        (feature,) = read(wall(f"lines = {line}"), program).features
        planes.append(feature.elements[0].plane.tolist())
    assert planes == [[0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 0, 1]]
    (feature,) = read('[part]\nplane = "yz"\n' + wall("lines = 14"), program).features
    assert feature.elements[0].plane.tolist() == [1, 0, 0]


def test_units_are_those_of_the_machine_file_unless_the_file_has_its_own(read: Read) -> None:
    (feature,) = read(wall("lines = 13")).features
    assert feature.row.zone == 2e-5  # type: ignore[attr-defined]
    (feature,) = read('[units]\nlength = "um"\n' + wall("lines = 13")).features
    assert feature.row.zone == pytest.approx(2e-8)  # type: ignore[attr-defined]


def test_one_wall_may_have_features_of_several_kinds(read: Read) -> None:
    width = '[[feature]]\nname = "w"\nkind = "size"\nnominal = 40\ntolerance = "+-0.1"\n'
    width += 'lines = ["13", "15"]\n'
    part = read(width + wall("lines = 13") + '[[datum]]\nname = "A"\nlines = 13\n')
    first, straight = part.features[0].elements[0], part.features[1].elements[0]
    np.testing.assert_array_equal(first.place, straight.place)
    np.testing.assert_array_equal(first.points, straight.points)
    assert len(first.points) + len(part.features[0].elements[1].points) <= 360


def test_all_problems_come_at_once_each_in_its_line(read: Read) -> None:
    file = """schema = 2
[prt]
[part]
alignment = "datums"
[[datum]]
name = "A"
lines = "12-x"
[[feature]]
name = "w"
kind = "sise"
nominal = 40
lines = "13"
[[feature]]
name = "b"
kind = "circle"
diameter = "0.1 deg"
lines = 20
datums = ["Q"]
[[feature]]
name = "b"
kind = "circle"
diameter = true
roundnes = 1
lines = ["20", "21"]
n = ["N1", "N2", "N3"]
"""
    program = PROGRAM.replace("N110", "(feature: a b, c)\nN110").replace(
        "N120", "(feature: z, zizeof 3)\nN120"
    )
    problems = read.problems(file, program)
    found = {(Path(str(p.file)).name, p.line, p.code) for p in problems}
    assert found == {
        ("features.toml", 1, "unsupported-schema"),
        ("features.toml", 2, "unknown-key"),
        ("features.toml", 4, "missing-key"),
        ("features.toml", 7, "part-address"),
        ("features.toml", 10, "unknown-choice"),
        ("features.toml", 16, "wrong-dimension"),
        ("features.toml", 22, "wrong-type"),
        ("features.toml", 23, "unknown-key"),
        ("features.toml", 19, "part-address"),
        ("features.toml", 20, "duplicate-name"),
        ("part.ngc", 13, "part-comment"),
        ("part.ngc", 15, "part-comment"),
    }
    lines = [problem.line for problem in problems if str(problem.file).endswith("toml")]
    assert lines == sorted(lines)  # type: ignore[type-var]


@pytest.mark.parametrize(
    ("file", "code", "line", "found"),
    [
        (wall("lines = 99"), "part-not-there", 1, 'lines = "99"'),
        (wall('n = "N110-N999"'), "part-not-there", 1, 'n = "N110-N999"'),
        (wall('n = "N140-N110"'), "part-not-there", 1, 'n = "N140-N110"'),
        (wall('tool = "T7"'), "part-not-there", 1, 'tool = "T7"'),
        (wall('comment = "polish"'), "part-not-there", 1, 'comment = "polish"'),
        (wall('lines = "17-18"'), "part-no-motion", 1, "17 to 18"),
        (wall("lines = 22"), "part-no-motion", 1, "22 to 22"),
        (wall(""), "part-nowhere", 1, "no lines, n, tool or comment"),
        (wall("lines = 13") + wall("lines = 14"), "duplicate-name", 7, None),
        (
            wall("lines = 13") + wall("lines = 13").replace('"wall"', '"other"'),
            "part-shared",
            6,
            "line 13 in both",
        ),
        (
            wall('lines = "13-15"') + '[[datum]]\nname = "A"\nlines = "15-16"\n',
            "part-shared",
            6,
            "line 15 in both",
        ),
        (wall('lines = 13\ndatums = ["B"]'), "unknown-datum", 6, "B"),
        ('[part]\ndatums = ["B"]\n' + wall("lines = 13"), "unknown-datum", 2, "B"),
        (wall("lines = []"), "wrong-type", 5, "[]"),
        (wall("lines = 1.5"), "wrong-type", 5, "1.5"),
        (wall('comment = ""'), "part-address", 5, '""'),
        (wall("lines = 0"), "part-address", 5, '"0"'),
        (wall('lines = ["13", "15"]'), "part-no-motion", 1, "2"),  # what its kind says of it
        ("[units]\nlength = 3\n" + wall("lines = 13"), "wrong-type", 2, "3"),
        ("feature = 3\n", "wrong-type", 1, None),
        ("part = 3\n" + wall("lines = 13"), "wrong-type", 1, "3"),
        ("schema = 1\n", "no-feature", None, None),
        ('[[datum]]\nname = "A"\nlines = 13\n', "no-feature", None, None),
        ("[[feature]\n", "not-toml", 1, None),
    ],
)
def test_what_is_wrong_is_said_with_its_line(
    file: str, code: str, line: int | None, found: str | None, read: Read
) -> None:
    problems = read.problems(file)
    assert [(problem.code, problem.line) for problem in problems] == [(code, line)]
    if found is not None:
        assert problems[0].found == found
    assert str(problems[0].file).endswith("features.toml")


@pytest.mark.parametrize(
    ("comment", "code"),
    [
        ("(feature: , size 4 +-1)", "bad-name"),
        ("(feature: new)", "part-comment"),
        ("(feature: new, straightness)", "part-comment"),
        ("(feature: new, straightness 0.1, straightness 0.2)", "part-comment"),
        ("(feature: new, straightness 0.1, size 4 +-1)", "part-comment"),
        ("(feature: new, straightness 0.1 deg)", "wrong-dimension"),
        ("(feature: new, straightness 0.1, datums Q)", "unknown-datum"),
        ("(feature: new, kind cone, straightness 0.1)", "unknown-choice"),
        ("(datum: A, size 3)", "part-comment"),
        ("(feature: wall, straightness 0.1)", "duplicate-name"),
    ],
)
def test_a_comment_that_says_nothing_good_is_refused(comment: str, code: str, read: Read) -> None:
    program = PROGRAM.replace("N110", f"{comment}\nN110").replace("N140", "(end feature)\nN140")
    problems = read.problems(wall("lines = 6"), program)
    assert [(p.code, p.line, Path(str(p.file)).name) for p in problems] == [(code, 13, "part.ngc")]


def test_what_is_wrong_with_a_datum_is_not_said_of_what_refers_to_it(read: Read) -> None:
    bad = '[[datum]]\nname = "A"\nlines = "x"\n'
    assert [p.code for p in read.problems(bad + wall('lines = 13\ndatums = ["A"]'))] == [
        "part-address"
    ]
    program = PROGRAM.replace("N110", "(feature: wall)\nN110").replace(
        "N120", "(end feature)\nN120"
    )
    bad = wall("").replace("0.02", '"0.1 deg"')
    assert [p.code for p in read.problems(bad, program)] == ["wrong-dimension"]


def test_without_any_feature_it_says_how_to_find_some(read: Read) -> None:
    (problem,) = read.problems()
    assert problem.code == "no-feature"
    assert "--propose-features" in str(problem.hint)


def test_what_the_program_does_not_say_is_given(read: Read) -> None:
    program = PROGRAM.replace("G21 ", "")
    with pytest.raises(RequestError) as refused:
        read(wall("lines = 13"), program)
    assert [problem.code for problem in refused.value.problems] == ["gcode-no-units"]
    options = tp.controllers.gcode.program.ProgramOptions(units="mm")  # type: ignore[attr-defined]
    assert len(read(wall("lines = 13"), program, options=options).features) == 1


def test_a_comment_of_another_meaning_says_nothing(read: Read) -> None:
    program = PROGRAM.replace("N110", "(features of datum wall) (datum surface)\nN110")
    assert len(read(wall("lines = 14"), program).features) == 1


def test_comments_that_stand_together_hold_for_the_same_moves(read: Read) -> None:
    program = PROGRAM.replace(
        "N110",
        "(datum: A)\n\n(the front)\n(feature: width, size 40 +-0.1)\nN110",
    )
    program = program.replace("N120", "(feature: right, straightness 0.1, datums A)\nN120")
    program = program.replace("N130", "(feature: width)(feature: back, straightness 0.1)\nN130")
    part = read(None, program.replace("N140", "(end feature)\nN140"))
    width, right, back = (
        next(feature for feature in part.features if feature.name == name)
        for name in ("width", "right", "back")
    )
    np.testing.assert_array_equal(width.elements[0].place, right.datums[0].place)
    np.testing.assert_array_equal(width.elements[1].place, back.elements[0].place)
    assert set(right.elements[0].lines.tolist()) == {19}


def test_places_are_one_that_hold_the_same_moves(read: Read) -> None:
    """Of the file and of comments, with other lines about them that move nothing."""
    program = PROGRAM.replace("N110", "(feature: w, size 40 +-0.1)\nN110")
    program = program.replace("N120", "G4 P1\n(end feature)\nN120")
    program = program.replace("N130", "(feature: w)\nN130").replace("N140", "(end feature)\nN140")
    part = read(wall('lines = "14-15"') + '[[datum]]\nname = "A"\nn = "N110"\n', program)
    width, straight = sorted(part.features, key=_name)
    (datum,) = (element for element in part.elements if element.name == "A")
    for element in (*straight.elements, *width.elements[:1]):
        assert set(element.lines.tolist()) == {14}
        np.testing.assert_array_equal(element.place, datum.place)
    (problem,) = read.problems(wall('lines = "14-18"'), program)
    assert (problem.code, problem.found) == ("part-shared", "line 14 in both")
