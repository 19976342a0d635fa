"""What a file is told whose closures are too few, too stiff to share a misfit, or hold nothing."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from build_machine import MACHINES, description_of
from guided_machines import guided
from machine_texts import edited, line_of, load_text
from reference_kinematics import Reference
from truepose.errors import MachineFileError, Problem
from truepose.machine import Machine

STIFF = 'stiffness = "50 N/um"\n'
FITS = "as many closures as freedoms where there are guides"


def text_of(name: str) -> str:
    return (MACHINES / f"{name}.toml").read_text("utf-8")


def problems_of(folder: Path, text: str) -> tuple[Problem, ...]:
    with pytest.raises(MachineFileError) as caught:
        load_text(folder, text)
    for problem in caught.value.problems:
        assert problem.file == str(folder / "machine.toml")
        assert problem.found
        assert problem.expected
        assert problem.hint
    return caught.value.problems


def guide(name: str, kind: str, *keys: str) -> str:
    return "\n".join(["[[guide]]", f'name = "{name}"', f'kind = "{kind}"', *keys, "", ""])


# --- rigid limbs ----------------------------------------------------------------------------------


def test_every_rigid_strut_of_an_overconstrained_machine_is_named(tmp_path: Path) -> None:
    text = edited(text_of("overconstrained"), (STIFF, ""))
    problems = problems_of(tmp_path, text)
    names = ["l1", "l2", "r1", "r2"]
    assert [problem.code for problem in problems] == ["no-stiffness"] * 4
    assert [problem.path for problem in problems] == [f"strut.{name}" for name in names]
    rows = [text.index(f'[[strut]]\nname = "{name}"') for name in names]
    assert [problem.line for problem in problems] == [text[:at].count("\n") + 1 for at in rows]
    for name, problem in zip(names, problems, strict=True):
        assert problem.message == (
            f"strut.{name}: the machine has more closures than freedoms, but nothing says how "
            f"stiff strut {name} is"
        )
        assert problem.found == "a rigid limb"
        assert "section_area and modulus" in str(problem.expected)
        assert "share the misfit by their stiffness" in str(problem.hint)


def test_only_those_without_a_stiffness_are_named(tmp_path: Path) -> None:
    text = edited(text_of("overconstrained"), (STIFF, ""))
    for name in ("l1", "r1", "r2"):
        text = edited(text, (f'name = "{name}"\n', f'name = "{name}"\n{STIFF}'))
    (problem,) = problems_of(tmp_path, text)
    assert (problem.code, problem.path) == ("no-stiffness", "strut.l2")


@pytest.mark.parametrize(
    ("where", "key"),
    [
        ("[each.strut]", 'section_area = "100 mm^2"'),
        ("[each.strut]", 'base_joint = { stiffness = "80 N/um" }'),
        ("[each.strut]", 'platform_joint = { stiffness = "80 N/um" }'),
        ("[each.strut]", 'base_stiffness = ["80 N/um", inf, inf]'),
        ("[each.drive]", 'stiffness = "80 N/um"'),
    ],
)
def test_whatever_gives_way_along_a_limb_will_do(where: str, key: str, tmp_path: Path) -> None:
    """A drive alone lets both its rods give way together, which leaves a misfit within a pair."""
    text = edited(text_of("overconstrained"), (STIFF, ""))
    named = re.sub(rf"^{re.escape(where)}.*$", f"{where}\n{key}", text, flags=re.MULTILINE)
    assert load_text(tmp_path, named).kernel.overconstrained


def test_a_guide_is_rigid_and_cannot_strain(tmp_path: Path) -> None:
    """All rigid limbs are named at once, struts and guides."""
    more = guide("level", "plane", "normal = [0, 1, 0]", "platform = [0, 0, 0]")
    text = edited(text_of("overconstrained"), ("[tolerance]", f"{more}[tolerance]"))
    (problem,) = problems_of(tmp_path, text)
    assert (problem.code, problem.path) == ("no-stiffness", "guide.level")
    assert problem.line == line_of(text, "[[guide]]")
    assert problem.expected == FITS
    assert "leave a guide or a strut away" in str(problem.hint)
    rigid = problems_of(tmp_path, edited(text, (STIFF, "")))
    assert [each.path for each in rigid] == [
        "strut.l1",
        "strut.l2",
        "strut.r1",
        "strut.r2",
        "guide.level",
    ]


def test_one_guide_too_many_beside_telescopic_struts(tmp_path: Path) -> None:
    more = guide("more", "plane", "normal = [1, 0, 0]", "platform = [0, 0, 0]")
    text = edited(guided("tricept").read_text("utf-8"), ("[tolerance]", f"{more}[tolerance]"))
    problems = problems_of(tmp_path, text)
    assert [problem.path for problem in problems] == ["guide.tube", "guide.joint", "guide.more"]
    assert {problem.code for problem in problems} == {"no-stiffness"}
    assert [problem.line for problem in problems] == [
        text[: match.start()].count("\n") + 1 for match in re.finditer(r"^\[\[guide]]", text, re.M)
    ]


# --- counts ---------------------------------------------------------------------------------------


def tricept_with(own: str = "") -> str:
    """The Tricept's file with other guides in the place of its universal joint."""
    text = text_of("tricept")
    start, end = text.index("[[guide]] # and does not spin"), text.index("[tolerance]")
    text = text[:start] + own + text[end:]
    return re.sub(r'^"guide\.joint.*\n', "", text, flags=re.MULTILINE)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (tricept_with(), "3 struts and 1 guide (5 closures) for 6 freedoms (x y z a b c)"),
        (
            re.sub(r"\[\[guide]] # limb 3.*?(?=\[tolerance])", "", text_of("3prs"), flags=re.S),
            "3 struts and 2 guides (5 closures) for 6 freedoms (x y z a b c)",
        ),
    ],
    ids=["tricept", "3prs"],
)
def test_too_few_closures_count_the_guides(text: str, found: str, tmp_path: Path) -> None:
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == "closure-count"
    assert (problem.path, problem.line) == ("machine.dof", line_of(text, "dof ="))
    assert problem.message == "machine.dof: too few closures for the platform's freedoms"
    assert problem.found == found
    assert problem.expected == "6 closures"
    assert "each strut is one closure" in str(problem.hint)
    assert "guides take the others" in str(problem.hint)


# --- loose platforms ------------------------------------------------------------------------------


def stands(normals: tuple[str, str, str]) -> str:
    """The 3-PRS with these normals, each plane through its joint on the platform at home."""
    text = text_of("3prs")
    for number, normal in enumerate(normals, start=1):
        at = text.index(f'name = "g{number}"')
        row, rest = text[at:], text[:at]
        point = re.search(r"platform = (\[.*?])", row)
        assert point is not None
        row = re.sub(r"normal = \[.*?]", f"origin = {point[1]}\nnormal = {normal}", row, count=1)
        text = rest + row
    return text


def test_planes_that_are_parallel_leave_the_platform_loose(tmp_path: Path) -> None:
    """Three equal normals hold x and the turn about z; y and what it takes along are free."""
    text = stands(("[1, 0, 0]",) * 3)
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == "loose-platform"
    assert (problem.path, problem.line) == ("guide.g1", line_of(text, "[[guide]]"))
    assert problem.message == "guide.g1: the struts leave motions free that the guides do not hold"
    assert "look at where g1, g2, g3 point and stand" in str(problem.hint)
    assert problem.expected == "closures that hold every freedom of the platform"
    assert is_free(text, str(problem.found), tmp_path)


def is_free(text: str, found: str, folder: Path) -> bool:
    """Whether no closure at home, in NumPy, resists the turn that the message names."""
    match = re.fullmatch(
        r"at home the platform can still move: about ([xyz]), (\S+), (\S+), (\S+) mm from the "
        r"tool point",
        found,
    )
    assert match is not None, found
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    reference = Reference(description_of(path))
    names = [name for name in reference.dof if name in reference.commanded]
    point, rotation = reference.placement(names, [reference.home[name] for name in names])
    joints = [
        reference.roots(drive, point, rotation)[0 if drive["working_mode"] == "-" else -1]
        for drive in reference.drives
    ]
    rows = reference.rows(np.array(joints), point, rotation)
    turn = np.eye(3)["xyz".index(match[1])]
    centre = 1e-3 * np.array([float(value) for value in match.groups()[1:]])
    twist = np.concatenate([np.cross(centre, turn), turn])
    assert np.linalg.matrix_rank(rows, tol=1e-6) == 5
    return bool(np.abs(rows @ twist).max() < 1e-3 * np.abs(rows).max())


@pytest.mark.parametrize(
    "instead",
    [
        guide("joint", "plane", "normal = [1, 0, 0]", "platform = [0, 0, 0]"),
        guide("joint", "universal", "base_axis = [0, 0, 1]", "platform_axis = [0, 1, 0]"),
    ],
    ids=["plane", "universal across the tube"],
)
def test_a_tube_that_may_spin_leaves_the_platform_loose(instead: str, tmp_path: Path) -> None:
    """Six closures, but what should hold the spin holds once more what the tube holds."""
    text = tricept_with(instead)
    (problem,) = problems_of(tmp_path, text)
    assert problem.code == "loose-platform"
    assert (problem.path, problem.line) == ("guide.tube", line_of(text, "[[guide]]"))
    assert problem.found == (
        "at home the platform can still move: about z, 0, 0, 0 mm from the tool point"
    )
    assert "look at where tube, joint point and stand" in str(problem.hint)


def test_the_shipped_machines_with_guides_hold_their_platforms(tmp_path: Path) -> None:
    for name in ("tricept", "3prs"):
        machine: Machine = load_text(tmp_path, text_of(name))
        assert not machine.kernel.overconstrained
        assert len(machine.closures) == len(machine.dof)
