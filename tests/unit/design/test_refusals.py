"""What an allocation refuses: each with a code, and what would be right."""

from __future__ import annotations

import builtins
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import truepose as tp
from command_line import call
from designs import file_with, row
from truepose.errors import ArgumentError, MachineFileError, Problem, RequestError, TrueposeError

Capture = pytest.CaptureFixture[str]
ROWS = (row("strut.*.length"),)


def refused(path: Path, *settings: str, **options: Any) -> Problem:
    with pytest.raises(TrueposeError) as caught:
        tp.allocate(tp.load(path, settings), **options)
    assert isinstance(caught.value, RequestError | MachineFileError | ArgumentError)
    return caught.value.problems[0]


def choice(options: str, *, tie: bool = True) -> str:
    word = "true" if tie else "false"
    return f'[[cost.choice]]\nname = "rods"\nof = "strut.*"\ntie = {word}\noptions = [{options}]\n'


def test_nothing_says_what_may_be_chosen(tmp_path: Path) -> None:
    problem = refused(file_with(tmp_path, "planar_two_slider", rows=()))
    assert problem.code == "no-cost"
    assert problem.hint is not None
    assert "docs/allocation.md" in problem.hint


def test_no_cost_for_what_could_be_chosen(tmp_path: Path) -> None:
    bare = '[[cost.tolerance]]\nof = "strut.*.length"\nbands = ["20 um", "50 um"]\n'
    problem = refused(file_with(tmp_path, "planar_two_slider", rows=(bare,)))
    assert problem.code == "missing-key"
    assert problem.found == "no at and no cost"


def test_a_cost_that_falls_with_a_tighter_tolerance(tmp_path: Path) -> None:
    (tmp_path / "cost.csv").write_text("band (um), cost\n20, 3\n50, 8\n")
    table = '[[cost.tolerance]]\nof = "strut.*.length"\ntable = "cost.csv"\n'
    assert refused(file_with(tmp_path, "planar_two_slider", rows=(table,))).code == "cost-falls"


def test_two_costs_for_one_thing(tmp_path: Path) -> None:
    rows = (row("strut.*.length"), row("strut.1.length"))
    assert refused(file_with(tmp_path, "planar_two_slider", rows=rows)).code == "cost-twice"


def test_ties_over_unlike_dimensions(tmp_path: Path) -> None:
    rows = (row("drive.d1.*", tie="joint"),)
    problem = refused(file_with(tmp_path, "planar_two_slider", rows=rows))
    assert problem.code == "tolerance-mixes-kinds"


def test_a_target_that_no_choice_meets(tmp_path: Path) -> None:
    """The pose, and what is left, are those of everything at its finest."""
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    problem = refused(path, "accuracy.target=0.2 mm")
    assert problem.code == "target-out-of-reach"
    finest = tp.load(path, ["strut.*.length_tolerance=0.002"])
    x, y = np.meshgrid(np.linspace(0.2, 0.4, 201), np.linspace(0.1, 0.3, 21))
    poses = np.stack([x.ravel(), y.ravel()], axis=-1)
    errors = tp.budget(finest, poses)["linear_maximum"].values[:, 0]
    largest = 1e6 * errors.max()
    assert problem.found is not None
    assert float(problem.found.split()[0]) == pytest.approx(largest, rel=1e-3)
    at = re.search(r"at x ([\d.]+) mm, y ([\d.]+) mm", problem.message)
    assert at is not None
    there = np.array([[1e-3 * float(at[1]), 1e-3 * float(at[2])]])
    assert 1e6 * tp.budget(finest, there)["linear_maximum"].values.max() == pytest.approx(
        largest, rel=1e-3
    )
    assert problem.expected is not None
    assert problem.expected.startswith("at most 198 µm")


def test_no_target(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    text = path.read_text()
    path.write_text(text.replace('target = "0.5 mm"', ""))
    assert refused(path).code == "no-accuracy"


@pytest.mark.parametrize(
    "keys",
    ['{ material = "wood" }', '{ colour = "red" }', '{ stiffness = "3 kg" }'],
)
def test_an_option_that_the_file_cannot_set(tmp_path: Path, keys: str) -> None:
    option = f'{{ name = "odd", set = {keys}, cost = 1 }}'
    for tie in (True, False):
        path = file_with(tmp_path, "planar_two_slider", choice(option, tie=tie), rows=ROWS)
        problem = refused(path)
        assert problem.code == "option-not-set"
        assert "'odd' of 'rods'" in problem.message
        assert problem.line is not None
        assert path.read_text().splitlines()[problem.line - 1].startswith("options")


def test_an_option_that_changes_what_grades_mean(tmp_path: Path) -> None:
    """A rail 100 mm farther off is in another range of sizes of ISO 286-1."""
    graded = 'of = "drive.d2.origin.x"\ngrades = "IT7:IT9"\nat = "30 um"\ncost = 1\n'
    options = '{ name = "wide", set = { origin = [700, 0, 0] }, cost = 1 }'
    rails = f'[[cost.choice]]\nname = "rails"\nof = "drive.d2"\noptions = [{options}]\n'
    path = file_with(
        tmp_path, "planar_two_slider", rails, rows=(f"[[cost.tolerance]]\n{graded}\n",)
    )
    problem = refused(path, "accuracy.target=2 mm")
    assert problem.code == "option-not-set"
    assert "which tolerances are chosen" in problem.message


def test_more_combinations_than_are_gone_through(tmp_path: Path) -> None:
    many = ", ".join(
        f'{{ name = "{n}", set = {{ modulus = "{n} GPa" }}, cost = {n} }}' for n in range(70, 95)
    )
    path = file_with(tmp_path, "planar_two_slider", choice(many, tie=False), rows=ROWS)
    problem = refused(path)
    assert problem.code == "bad-allocation"
    assert problem.found == "625 combinations of 2 choices"


def test_a_share_of_all_machines(tmp_path: Path, capsys: Capture) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    assert tp.allocate(tp.load(path, ["accuracy.at=95 %"])).share == 0.95
    option = '{ name = "as drawn", set = {}, cost = 0 }'
    path = file_with(tmp_path, "planar_two_slider", choice(option), rows=ROWS)
    done = call(capsys, "allocate", path, "--set", "accuracy.at=95 %", "--worst")
    assert done.code == 0
    found = tp.allocate(tp.load(path, ["accuracy.at=95 %"]), worst=True)
    assert found.cost == pytest.approx(tp.allocate(tp.load(path)).cost)
    assert found.proven == "these poses"


def test_a_group_in_part(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    group = '{ band = 0.1, group = "jig" }'
    path.write_text(
        path.read_text().replace(
            "[frame]", f'[tolerance]\n"strut.1.base.x" = {group}\n\n[frame]', 1
        ).replace("length_tolerance = [-0.3, 0.3]", f"length_tolerance = {group}")
    )  # fmt: skip
    problem = refused(path)
    assert problem.code == "bad-allocation"
    assert problem.found == "2 of 3 members, in 2 ties"


def test_listed_values(tmp_path: Path) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    listed = '{ distribution = "empirical", values = [-0.1, 0.0, 0.2] }'
    problem = refused(path, f"strut.1.length_tolerance={listed}")
    assert problem.code == "bad-allocation"
    assert problem.expected == "a band of some width"


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"reserve": 1.0}, "bad-allocation"),
        ({"reserve": -0.1}, "bad-allocation"),
        ({"reserve": float("nan")}, "bad-allocation"),
        ({"gap": 1.0}, "bad-gap"),
        ({"gap": float("nan")}, "bad-gap"),
        ({"gap": "much"}, "bad-gap"),
        ({"state": "during"}, "unknown-choice"),
        ({"worst": "yes"}, "bad-argument"),
    ],
)
def test_bad_arguments(tmp_path: Path, options: dict[str, Any], code: str) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    assert refused(path, **options).code == code


@pytest.mark.parametrize("option", ["--reserve", "--gap"])
def test_shares_on_the_command_line(tmp_path: Path, capsys: Capture, option: str) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    assert call(capsys, "allocate", path, option, "some").codes == ["bad-allocation"]
    done = call(capsys, "allocate", path, option, "2 %")
    assert done.code == 0
    if option == "--reserve":
        assert "target less 2 %" in done.out


def test_a_design_of_another_ending(tmp_path: Path, capsys: Capture) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    assert call(capsys, "allocate", path, "-o", tmp_path / "d.json").codes == ["output-ending"]
    assert call(capsys, "allocate", path, "-o", path).codes == ["output-is-input"]


def test_without_the_solver(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = file_with(tmp_path, "planar_two_slider", rows=ROWS)
    original = builtins.__import__

    def without(name: str, *arguments: Any, **others: Any) -> Any:
        if name == "highspy":
            raise ImportError(name=name)
        return original(name, *arguments, **others)

    monkeypatch.setattr(builtins, "__import__", without)
    problem = refused(path)
    assert problem.code == "extra-missing"
    assert problem.hint == "pip install 'truepose[design]'"
