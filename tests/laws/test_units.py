"""Other units in the file, the same machine: nothing changes."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

import truepose as tp
from machine_texts import PLANAR, edited, load_text


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
