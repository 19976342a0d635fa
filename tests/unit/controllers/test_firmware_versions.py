"""Blocks of M665 and M666: the firmware that they are for, and what an older one makes of them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import firmware
from exported_blocks import (
    AFTER,
    MM,
    UM,
    agree,
    errors,
    exported,
    homed,
    loaded,
    only,
    random_shifts,
    text_of,
)
from truepose.controllers import Controller
from truepose.controllers.marlin import Marlin
from truepose.controllers.reprap import RepRap
from truepose.machine import Machine

Array = NDArray[np.float64]


def off_everywhere(folder: Path) -> Machine:
    return loaded(folder, text_of("linear_delta", random_shifts("linear_delta", 5, 0.3)))


def joints(machine: Machine, towers: firmware.Towers) -> Array:
    """Joint coordinates to which the controller drives, m, for the poses of the workspace."""
    heights = np.array([towers.heights(position) for position in machine.poses() / MM])
    return homed(machine, towers.home, heights, [0, 1, 2])


def left_over(machine: Machine, towers: firmware.Towers) -> Array:
    """How far from where it is wanted the actual machine goes, m, at each pose."""
    found, _ = errors(machine, joints(machine, towers))
    return found


def comments(text: str) -> str:
    return "\n".join(line for line in text.splitlines() if line.startswith(";"))


@pytest.mark.parametrize(
    ("adapter", "version", "off"),
    [
        (
            Marlin,
            "for Marlin 2.0.6 or newer",
            ("DELTA_RADIUS_TRIM_TOWER", "M218", "M852", "M420 S0", "G33"),
        ),
        (
            RepRap,
            "for RepRapFirmware 2.03 or newer",
            ("M556", "G29 S2", "G10", "M290 R0 S0", "M500", "M501", "G30"),
        ),
    ],
)
def test_block_and_statement_say_what_they_are_for(
    adapter: type[Controller], version: str, off: tuple[str, ...], tmp_path: Path
) -> None:
    export = exported(adapter, off_everywhere(tmp_path))
    for said in (comments(only(export)), "\n".join(export.statement)):
        assert version in said
        for word in off:
            assert re.search(rf"\b{word}\b", said), word


def test_a_marlin_before_the_rod_trims_leaves_more(tmp_path: Path) -> None:
    machine = off_everywhere(tmp_path)
    text = only(exported(Marlin, machine))
    trims = dict(firmware.read_gcode(text))["M665"]
    assert np.ptp([trims[word][0] for word in "ABC"]) > 0.01
    found = left_over(machine, firmware.marlin(text))
    agree(text, AFTER, found, "um")
    older = re.sub(r"(^M665.*) A\S+ B\S+ C\S+$", r"\1 A0 B0 C0", text, flags=re.MULTILINE)
    assert left_over(machine, firmware.marlin(older)).max() > found.max() + 10.0 * UM


def test_a_reprap_before_single_rods_leaves_more(tmp_path: Path) -> None:
    machine = off_everywhere(tmp_path)
    text = only(exported(RepRap, machine))
    found = left_over(machine, firmware.reprap(text))
    agree(text, AFTER, found, "um")
    older = re.sub(r"L([^: ]+):[^ ]+", r"L\1:\1:\1", text)
    assert left_over(machine, firmware.reprap(older)).max() > found.max() + 10.0 * UM


def test_what_m500_of_reprap_keeps_is_another_machine(tmp_path: Path) -> None:
    machine = off_everywhere(tmp_path)
    text = only(exported(RepRap, machine))

    def rounded(line: re.Match[str]) -> str:
        decimals = {"A": 2, "B": 2 if line[0].startswith("M666") else 1}
        return re.sub(
            r"(?<= )([A-Z])([-.\d:]+)",
            lambda word: (
                word[1]
                + ":".join(f"{float(v):.{decimals.get(word[1], 3)}f}" for v in word[2].split(":"))
            ),
            line[0],
        )

    kept = re.sub(r"^M66[56].*$", rounded, text, flags=re.MULTILINE)
    assert len(re.findall(r"^M66[56]", kept, re.MULTILINE)) == 2
    moved = joints(machine, firmware.reprap(kept)) - joints(machine, firmware.reprap(text))
    # The tilt's last place is a hundredth of a percent: half of it, over 80 mm, in x and in y.
    assert 1.0 * UM < np.abs(moved).max() < 11.0 * UM
