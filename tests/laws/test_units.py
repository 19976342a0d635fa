"""Other units in the file, the same machine: nothing changes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import truepose as tp
from compared_results import assert_same
from machine_file import loaded
from machine_file_units import CUSTOMARY, bare
from machine_texts import PLANAR, edited, load_text
from machine_under_test import MachineUnderTest
from random_machines import DrawnMachine


def in_other_units(text: str) -> str:
    """PLANAR in inches, radians, kilonewtons and fahrenheit."""

    def inches(match: re.Match[str]) -> str:
        numbers = re.sub(r"-?\d+(\.\d+)?", lambda n: repr(float(n[0]) / 25.4), match[2])
        return match[1] + numbers

    lines = []
    for line in text.splitlines():
        if line.startswith(("origin", "travel", "length", "base", "platform")) and '"' not in line:
            line = re.sub(r"^(\w+ = )(.*)$", inches, line)
        lines.append(line)
    return edited(
        "\n".join(lines) + "\n",
        ('length = "mm"', 'length = "in"'),
        ('angle = "deg"', 'angle = "rad"'),
        ('force = "N"', 'force = "kN"'),
        ('temperature = "degC"', 'temperature = "degF"'),
        ("reference_temperature = 20", "reference_temperature = 68"),
        ("temperature = 35", "temperature = 95"),
        ("x = 1200, y = -1500", "x = 1.2, y = -1.5"),
        ("x = [200, 400, 5]", 'x = ["200 mm", "400 mm", 5]'),
        ("y = [100, 300, 3]", 'y = ["0.1 m", "0.3 m", 3]'),
    )


def test_unit_changes_change_nothing(tmp_path: Path) -> None:
    text = edited(PLANAR, ("[-0.3, 0.3]", "[-0.15, 0.45]"))
    one, other = load_text(tmp_path, text), load_text(tmp_path, in_other_units(text))
    assert other.unit_labels["length"] == "in"
    for run in (tp.budget, tp.compensate):
        first, second = run(one), run(other)
        assert list(first.source.values if "source" in first.dims else []) == list(
            second.source.values if "source" in second.dims else []
        )
        for name in first.data_vars:
            if first[name].dtype.kind == "f":
                scale = np.maximum(np.abs(first[name]), 1.0 if first[name].units == "N" else 0.0)
                assert (np.abs(first[name] - second[name]) <= 1e-12 + 1e-9 * scale).all(), name
            else:
                assert (first[name] == second[name]).all(), name


def in_inches_and_pounds_nothing_changes(machine: MachineUnderTest) -> None:
    """Every quantity of the file in inch, rad, lbf, lb and degF, or in units made of these."""
    other = loaded(bare(machine.file, machine.parameter_units, CUSTOMARY))
    assert other.unit_labels["length"] == "in"
    for run in (tp.budget, tp.compensate, tp.uncertainty, tp.worst_case):
        # Searching vertices takes its time.
        poses = machine.three_poses[: 1 if run is tp.worst_case else 3]
        first, second = (run(each, poses) for each in (machine.loaded, other))
        # How many vertices a search looks at is decided by which of two equal ones is larger.
        assert_same(first, second, but=("vertices",))


def test_a_shipped_machine_in_inches_and_pounds_is_the_same(shipped: MachineUnderTest) -> None:
    in_inches_and_pounds_nothing_changes(shipped)


def test_a_drawn_machine_in_inches_and_pounds_is_the_same(drawn: DrawnMachine) -> None:
    in_inches_and_pounds_nothing_changes(drawn)
