"""`[cost]`: what may be chosen for a machine and what it costs."""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import pytest

import truepose as tp
from family_machines import family_file
from machine_file import text_of
from truepose.errors import MachineFileError, Problem
from truepose.machine.costs import CostLaw, tie_of

MACHINES = Path(__file__).parents[3] / "machines"
BANDS = 'bands = ["5 um", "2 um", 0.01]\nat = "10 um"\ncost = 4\n'


def loaded(folder: Path, cost: str, kind: str = "planar_two_slider") -> tp.Machine:
    path = folder / "m.toml"
    path.write_text((MACHINES / f"{kind}.toml").read_text() + "\n" + cost)
    return tp.load(path)


def row(of: str, *lines: str) -> str:
    return "\n".join(["[[cost.tolerance]]", f'of = "{of}"', *lines, ""])


def refused(folder: Path, cost: str) -> tuple[Problem, ...]:
    with pytest.raises(MachineFileError) as caught:
        loaded(folder, cost)
    return caught.value.problems


def test_a_machine_without_costs() -> None:
    assert tp.load(MACHINES / "hexapod.toml").costs is None


def test_bands_from_the_finest_with_what_they_cost(tmp_path: Path) -> None:
    machine = loaded(tmp_path, '[cost]\nunit = "EUR"\n' + row("strut.*.length", BANDS))
    costs = machine.costs
    assert costs is not None
    assert costs.unit == "EUR"
    (one,) = costs.tolerances
    assert one.features == ("strut.1.length", "strut.2.length")
    assert one.grades == ("2 um", "5 um", "0.01 mm")
    assert one.halves == ((2e-6,) * 2, (5e-6,) * 2, (1e-5,) * 2)
    assert one.ties == ((0,), (1,))
    assert [costs[0] for costs in one.costs] == pytest.approx([20.0, 8.0, 4.0])
    again = pickle.loads(pickle.dumps(machine))  # noqa: S301
    assert again == machine
    assert "2 to choose, of 3 grades each" in repr(costs)


@pytest.mark.parametrize(
    ("model", "costs"),
    [
        ('model = "reciprocal"', [20.0, 8.0, 4.0]),
        ('model = "reciprocal-square"', [100.0, 16.0, 4.0]),
        ('model = "exponential"\nscale = "5 um"', [4 * math.exp(1.6), 4 * math.e, 4.0]),
    ],
)
def test_models(tmp_path: Path, model: str, costs: list[float]) -> None:
    machine = loaded(tmp_path, row("strut.1.length", BANDS, model))
    assert machine.costs is not None
    (one,) = machine.costs.tolerances
    assert [of_grade[0] for of_grade in one.costs] == pytest.approx(costs)
    # Between two grades the law itself holds.
    (half,), (cost,) = one.between(0.5)
    assert half == pytest.approx(math.sqrt(10.0) * 1e-6)
    assert one.law is not None
    assert cost == pytest.approx(one.law.of(half))
    assert one.between(7.0) == ((1e-5,), (pytest.approx(4.0),))


def test_grades_by_the_size_of_each(tmp_path: Path) -> None:
    cost = row("strut.*.length", 'grades = "IT9:IT7"\nat = "10 um"\ncost = 1\ntie = "kind"')
    machine = loaded(tmp_path, cost)
    assert machine.costs is not None
    (one,) = machine.costs.tolerances
    assert one.grades == ("IT7", "IT8", "IT9")
    # ISO 286-1, over 400 mm up to 500 mm: 63, 97 and 155 um, half of it each way.
    assert [halves[0] for halves in one.halves] == pytest.approx([31.5e-6, 48.5e-6, 77.5e-6])
    assert one.tie_names == ("strut.*.length",)
    assert one.ties == ((0, 1),)


def test_a_table(tmp_path: Path) -> None:
    (tmp_path / "cost.csv").write_text("band (um), cost\n20, 3\n5, 8\n10, 3\n")
    machine = loaded(tmp_path, row("strut.*.base.*", 'table = "cost.csv"\ntie = "joint"'))
    assert machine.costs is not None
    (one,) = machine.costs.tolerances
    assert one.grades == ("5 um", "10 um", "20 um")
    assert one.costs == ((8.0, 8.0), (3.0, 3.0), (3.0, 3.0))
    assert one.tie_names == ("strut.1.base", "strut.2.base")
    assert [len(tie) for tie in one.ties] == [3, 3]
    assert one.law is None
    assert one.between(0.5)[1] == pytest.approx((math.sqrt(24.0),) * 2)
    assert "cost.csv" in machine.data_files


def test_the_parameters_of_a_family(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    text = text_of(family_file("linear_delta"))
    path.write_text(text + row("family.rod.*", BANDS, 'tie = "kind"'))
    costs = tp.load(path).costs
    assert costs is not None
    assert costs.tolerances[0].features == ("family.rod.a", "family.rod.b", "family.rod.c")
    assert costs.tolerances[0].tie_names == ("family.rod",)


def test_names_of_ties() -> None:
    names = ["strut.1.base.x", "drive.d1.axis.u", "strut.1.length", "tool.x", "family.rod.a"]
    assert [tie_of(name, "feature") for name in names] == names
    assert [tie_of(name, "joint") for name in names] == [
        "strut.1.base", "drive.d1.axis", "strut.1.length", "tool", "family.rod.a",
    ]  # fmt: skip
    assert [tie_of(name, "kind") for name in names] == [
        "strut.*.base.x", "drive.*.axis.u", "strut.*.length", "tool.x", "family.rod",
    ]  # fmt: skip


def test_a_law_beyond_all_numbers_is_infinite() -> None:
    assert CostLaw(1.0, 1.0, 1, 1e-6).of(1e-6) == math.inf


STIFF = '{{ stiffness = "30 N/um", base_joint = {{ stiffness = "9 N/um" }} }}'
CHOICE = f"""
[[cost.choice]]
name = "rods"
of = "strut.*"
tie = {{tie}}
options = [
  {{{{ name = "as it is", set = {{{{}}}}, cost = 0 }}}},
  {{{{ name = "stiff", set = {STIFF}, cost = 5 }}}},
]
"""


def test_a_choice(tmp_path: Path) -> None:
    machine = loaded(tmp_path, CHOICE.format(tie="false"))
    assert machine.costs is not None
    (choice,) = machine.costs.choices
    assert choice.parts == ("strut.1", "strut.2")
    assert not choice.tied
    assert choice.options[0].settings == ()
    assert choice.options[1].settings == (
        ("stiffness", '"30 N/um"'),
        ("base_joint", '{ stiffness = "9 N/um" }'),
    )


BAD: dict[str, tuple[str, str]] = {
    "no such parameter": (row("strut.*.lenght", BANDS), "cost-matches-nothing"),
    "no such part": (CHOICE.format(tie="true").replace("strut.*", "rod.*"), "cost-matches-nothing"),
    "m and rad": (row("drive.d1.*", BANDS), "tolerance-mixes-kinds"),
    "two costs": (row("strut.*.length", BANDS) + row("strut.1.length", BANDS), "cost-twice"),
    "two choices": (
        CHOICE.format(tie="true") + CHOICE.format(tie="true").replace('"rods"', '"bars"'),
        "cost-twice",
    ),
    "two of one name": (
        CHOICE.format(tie="true") + CHOICE.format(tie="true").replace("strut.*", "platform"),
        "duplicate-name",
    ),
    "two options of one name": (
        CHOICE.format(tie="true").replace("stiff", "as it is", 1), "duplicate-name",
    ),
    "an option without a cost": (
        CHOICE.format(tie="true").replace(", cost = 5", ""), "missing-key",
    ),
    "no option": ('[[cost.choice]]\nname = "a"\nof = "tool"\noptions = []\n', "wrong-type"),
    "no cost of the bands": (row("strut.*.length", 'bands = ["2 um"]'), "missing-key"),
    "no bands": (row("strut.*.length", "at = 1\ncost = 1"), "missing-key"),
    "bands and grades": (row("strut.*.length", BANDS, 'grades = "IT7"'), "excluding-keys"),
    "a table and a law": (row("strut.*.length", 'table = "c.csv"\nat = 1'), "excluding-keys"),
    "a scale of no exponential": (row("strut.*.length", BANDS, "scale = 1"), "excluding-keys"),
    "an exponential without a scale": (
        row("strut.*.length", BANDS, 'model = "exponential"'), "missing-key",
    ),
    "a model that is none": (row("strut.*.length", BANDS, 'model = "linear"'), "unknown-choice"),
    "a tie that is none": (row("strut.*.length", BANDS, 'tie = "part"'), "unknown-choice"),
    "a band of zero": (row("strut.*.length", "bands = [0]\nat = 1\ncost = 1"), "not-positive"),
    "a band twice": (
        row("strut.*.length", 'bands = ["10 um", 0.01]\nat = 1\ncost = 1'), "duplicate-name",
    ),
    "a band of an angle": (
        row("strut.*.length", 'bands = ["1 deg"]\nat = 1\ncost = 1'), "wrong-dimension",
    ),
    "no list of bands": (row("strut.*.length", "bands = 1\nat = 1\ncost = 1"), "wrong-type"),
    "a cost of zero": (row("strut.*.length", "bands = [1]\nat = 1\ncost = 0"), "not-positive"),
    "a negative cost": (CHOICE.format(tie="true").replace("cost = 5", "cost = -5"), "negative"),
    "a grade that is none": (
        row("strut.*.length", 'grades = "IT5:IT99"\nat = 1\ncost = 1'), "unknown-tolerance-class",
    ),
    "a class that is no grade": (
        row("strut.*.length", 'grades = "ISO 2768-m"\nat = 1\ncost = 1'), "unknown-tolerance-class",
    ),
    "grades of a size of zero": (
        row("strut.*.base.x", 'grades = "IT5:IT7"\nat = 1\ncost = 1'), "tolerance-out-of-range",
    ),
    "grades of a ratio": (
        row("drive.*.axis.u", 'grades = "IT5:IT7"\nat = 1\ncost = 1'), "unknown-tolerance-class",
    ),
    "a cost beyond numbers": (
        row("strut.*.length", BANDS, 'model = "exponential"\nscale = "1e-6 um"'), "not-finite",
    ),
    "a misspelt key": (row("strut.*.length", BANDS, 'tied = "kind"'), "unknown-key"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_costs(name: str, tmp_path: Path) -> None:
    cost, code = BAD[name]
    problems = refused(tmp_path, cost)
    assert [problem.code for problem in problems] == [code]
    (problem,) = problems
    first = (MACHINES / "planar_two_slider.toml").read_text().count("\n")
    assert problem.line is not None
    assert problem.line > first


def test_all_at_once(tmp_path: Path) -> None:
    cost = row("strut.*.lenght", BANDS) + row("strut.*.length", BANDS, "scale = 1") + "[case.a.b]\n"
    codes = {problem.code for problem in refused(tmp_path, cost)}
    assert codes == {"excluding-keys", "unknown-key"}
    cost = row("strut.*.lenght", BANDS) + row("drive.d1.*", BANDS)
    codes = {problem.code for problem in refused(tmp_path, cost)}
    assert codes == {"cost-matches-nothing", "tolerance-mixes-kinds"}


@pytest.mark.parametrize(
    ("rows", "code"),
    [
        ("20, 3\n50, 8\n", "cost-falls"),
        ("20, 3\n20, 3\n", "cost-twice"),
        ("0, 3\n20, 1\n", "not-positive"),
        ("10, 3\n20, -1\n", "negative"),
    ],
)
def test_a_table_that_cannot_be(tmp_path: Path, rows: str, code: str) -> None:
    (tmp_path / "cost.csv").write_text(f"band (um), cost\n{rows}")
    (problem,) = refused(tmp_path, row("strut.*.length", 'table = "cost.csv"'))
    assert problem.code == code
    assert problem.file is not None
    assert problem.file.endswith("cost.csv")
