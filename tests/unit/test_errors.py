"""The catalogue of codes, and how problems are shown."""

from __future__ import annotations

import ast
import json
import pickle
import re
from pathlib import Path

import pytest

from truepose import _kernel
from truepose.errors import (
    CATALOGUE,
    MachineFileError,
    PoseError,
    Problem,
    RequestError,
    TrueposeError,
)

ROOT = Path(__file__).parents[2]


def strings_in(folder: Path, without: Path) -> set[str]:
    """Every string constant of the Python files below a folder."""
    return {
        node.value
        for path in folder.rglob("*.py")
        if path != without
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    }


def test_every_code_is_used_and_tested() -> None:
    used = strings_in(ROOT / "python" / "truepose", ROOT / "python" / "truepose" / "errors.py")
    used |= _kernel.gcode_codes().keys()
    tested = strings_in(ROOT / "tests", Path(__file__))
    assert sorted(CATALOGUE.keys() - used) == [], "codes that nothing raises"
    assert sorted(CATALOGUE.keys() - tested) == [], "codes that no test names"


def test_the_interpreter_of_programs_has_the_same_codes() -> None:
    codes = _kernel.gcode_codes()
    assert {code: CATALOGUE[code] for code in codes} == codes


def test_codes_and_meanings_are_well_formed() -> None:
    for code, meaning in CATALOGUE.items():
        assert re.fullmatch(r"[a-z0-9]+(-[a-z0-9]+)*", code)
        assert meaning
        assert not meaning.endswith(".")


def test_a_code_that_is_not_in_the_catalogue() -> None:
    with pytest.raises(ValueError, match="CATALOGUE"):
        Problem("no-such-code", "message")


def test_a_problem_for_people() -> None:
    problem = Problem(
        "unknown-key", "strut.1.lenght: unknown key", "m.toml", 12, "strut.1.lenght",
        found="lenght", expected="one of base, length", hint='did you mean "length"?',
    )  # fmt: skip
    assert str(problem) == (
        "m.toml:12: error[unknown-key]: strut.1.lenght: unknown key\n"
        "  found:    lenght\n"
        "  expected: one of base, length\n"
        '  hint:     did you mean "length"?'
    )
    assert str(Problem("no-source", "none", "m.toml")) == "m.toml: error[no-source]: none"
    assert str(Problem("no-source", "none")) == "error[no-source]: none"


def test_a_problem_with_a_column() -> None:
    problem = Problem("gcode-arc", "no arc", "part.ngc", 3, column=7)
    assert str(problem) == "part.ngc:3:7: error[gcode-arc]: no arc"


def test_a_problem_for_programs() -> None:
    problem = Problem("no-source", "none", "m.toml", 3)
    assert json.loads(json.dumps(problem.to_dict())) == {
        "code": "no-source",
        "message": "none",
        "file": "m.toml",
        "line": 3,
        "path": None,
        "found": None,
        "expected": None,
        "hint": None,
        "column": None,
    }


@pytest.mark.parametrize("kind", [TrueposeError, MachineFileError, RequestError])
def test_an_error_carries_its_problems(kind: type[TrueposeError]) -> None:
    problems = (Problem("no-source", "one"), Problem("no-source", "two"))
    error = kind(*problems)
    assert error.problems == problems
    assert str(error) == "error[no-source]: one\nerror[no-source]: two"
    again = pickle.loads(pickle.dumps(error))  # noqa: S301
    assert type(again) is kind
    assert again.problems == problems


def test_a_pose_error() -> None:
    error = PoseError(3, 7, "unreachable", "strut 1 is 4 mm too short")
    again = pickle.loads(pickle.dumps(error))  # noqa: S301
    for each in (error, again):
        assert isinstance(each, ValueError)
        assert (each.count, each.index, each.status) == (3, 7, "unreachable")
        assert each.reason == "strut 1 is 4 mm too short"
        assert str(each) == (
            "3 poses cannot be used, the first is number 7: unreachable: strut 1 is 4 mm too short"
        )
