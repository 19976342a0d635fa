"""Klipper's printer.cfg: how it is read, line by line, and what of it is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

import truepose as tp
from truepose.controllers import ControllerFile
from truepose.controllers.klipper.config import read_config
from truepose.errors import MachineFileError, Problem

SAVED = """
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# DO NOT EDIT THIS BLOCK OR BELOW. The contents are auto-generated.
#*#
"""

DELTA = """\
[printer]
kinematics: delta
delta_radius: 174.75
[stepper_a]
position_endstop: 297.05
arm_length: 333.0
"""


ROTARY = """\
[printer]
kinematics: rotary_delta
shoulder_radius: 60
shoulder_height: 400
[stepper_a]
position_endstop: 180
upper_arm_length: 150
lower_arm_length: 320
"""


def options(folder: Path, text: str) -> dict[str, str]:
    """Every option of a file with that text."""
    path = folder / "printer.cfg"
    path.write_text(text, "utf-8")
    config = read_config(ControllerFile.at(path))
    return {f"{section}.{name}": option.text for (section, name), option in config.options.items()}


def problems(folder: Path, text: str) -> list[Problem]:
    path = folder / "printer.cfg"
    path.write_text(text, "utf-8")
    with pytest.raises(MachineFileError) as refused:
        tp.import_machine(path, "klipper")
    return list(refused.value.problems)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("[a]\nx: 1\ny = 2\nz:3\n", {"a.x": "1", "a.y": "2", "a.z": "3"}),
        ("[a]\nx: 1 # why\ny: 2 ; why\nz: 2;3\n", {"a.x": "1", "a.y": "2", "a.z": "2;3"}),
        ("# a\n; b\n[a] # c\n  # d\nX: 1\n", {"a.x": "1"}),
        ("[a]\nx: 1\n[b]\nx: 2\n[a]\nx: 3\n", {"a.x": "3", "b.x": "2"}),
        ("[a]\nx:\n  1\n  # between\n\n  2\ny: 3\n", {"a.x": "1\n2", "a.y": "3"}),
        ("[gcode_macro A]\ngcode:\n  G28\n  [b]\n", {"gcode_macro A.gcode": "G28\n[b]"}),
        ("[a]\nx: y: z = 1\n", {"a.x": "y: z = 1"}),
        ("[a]\r\nx: 1\r\n", {"a.x": "1"}),
    ],
)
def test_a_file_is_read_as_klipper_reads_it(
    text: str, found: dict[str, str], tmp_path: Path
) -> None:
    assert options(tmp_path, text) == found


def test_what_is_included_stands_where_the_include_does(tmp_path: Path) -> None:
    (tmp_path / "more.cfg").write_text("[a]\nx: 2\n", "utf-8")
    assert options(tmp_path, "[a]\nx: 1\n[include more.cfg]\n") == {"a.x": "2"}
    assert options(tmp_path, "[include more.cfg]\n[a]\nx: 1\n") == {"a.x": "1"}


def test_what_was_saved_counts_where_nothing_stands_above(tmp_path: Path) -> None:
    saved = SAVED + "#*# [a]\n#*# x = 2\n#*# y = 3\n#*#\n#*# [b]\n#*# z = 4\n"
    found = options(tmp_path, "[a]\nx: 1\n#y: 1\n" + saved)
    assert found == {"a.x": "1", "a.y": "3", "b.z": "4"}


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("[a]\n#x: 1" + SAVED + "#*# [a]\n#*# x = 2\ny: 3\n", 8),
        ("[a]\n#x: 1" + SAVED + "#*# [a]\n#*#x = 2\n", 7),
        ("[a]\n#x: 1\n#*# [a]\n#*# x = 2\n", 3),
        ("[a]\n#*# x = 2" + SAVED + "#*# [a]\n", 2),
    ],
)
def test_a_block_that_was_changed_is_not_read(text: str, line: int, tmp_path: Path) -> None:
    """Klipper then reads nothing of it; where a number is missing for that, it is said."""
    assert "a.x" not in options(tmp_path, text)
    told = problems(tmp_path, text)
    assert [problem.code for problem in told] == ["missing-key"]
    assert f"line {line} " in (told[0].hint or "")


def test_a_misspelt_option_is_pointed_at(tmp_path: Path) -> None:
    text = DELTA.replace("delta_radius: 174.75", "delta_raduis: 174.75")
    (problem,) = problems(tmp_path, text)
    number = text.splitlines().index("delta_raduis: 174.75") + 1
    assert problem.hint == f'line {number} has "delta_raduis": is it meant?'


@pytest.mark.parametrize(
    ("text", "code", "line"),
    [
        ("x: 1\n" + DELTA, "import-syntax", 1),
        (DELTA + "arm_length 333\n", "import-syntax", 7),
        (DELTA + ": 333\n", "import-syntax", 7),
        (DELTA.replace("delta\n", "corexy\n"), "import-declined", 2),
        (DELTA.replace("kinematics: delta\n", ""), "missing-key", 1),
        (DELTA.replace("delta_radius: 174.75\n", ""), "missing-key", 1),
        (DELTA.replace("333.0", "100"), "import-value", 6),
        (DELTA.replace("174.75", "-174.75"), "not-positive", 3),
        (DELTA.replace("297.05", "nan"), "not-a-number", 5),
        (DELTA.replace("297.05", "-1"), "negative", 5),
        (DELTA.replace("[stepper_a]", "minimum_z_position: 300\n[stepper_a]"), "import-value", 4),
        (ROTARY.replace("60", "0"), "not-positive", 3),
        (ROTARY.replace("180", "1000"), "import-value", 6),
        (DELTA.replace("297.05", "1 2"), "not-a-number", 5),
        (DELTA.partition("[stepper_a]")[0], "missing-key", None),
        (DELTA + "[include none.cfg]\n", "import-include", 7),
    ],
)
def test_what_is_wrong_has_its_line(text: str, code: str, line: int | None, tmp_path: Path) -> None:
    told = problems(tmp_path, text)
    assert {(problem.code, problem.line) for problem in told} == {(code, line)}
    assert all(problem.found and problem.expected for problem in told)


def test_everything_wrong_is_told_at_once(tmp_path: Path) -> None:
    text = DELTA.replace("297.05", "x") + "[stepper_b]\narm_length: 1\n[stepper_c]\nangle: y\n"
    assert [problem.line for problem in problems(tmp_path, text)] == [5, 8, 10]
