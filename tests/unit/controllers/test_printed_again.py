"""What an adapter printed, read back and printed once more: number by number the same.

For every adapter that has a reader, and every machine of the library that it takes. What a machine
file cannot keep is told as lost, and is what is said here once more.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from build_machine import MACHINES
from controllers_exported import written
from truepose.controllers import READERS, REGISTRY, Import
from truepose.errors import RequestError

ENDINGS = {
    "marlin": (".gcode",),
    "reprap": (".g",),
    "linuxcnc-genhexkins": (".hal", ".ini"),
    "linuxcnc-lineardelta": (".hal", ".ini"),
}
"""Adapter with a reader -> the endings of what it writes, that to be read first."""

NAMES = sorted(path.stem for path in MACHINES.glob("*.toml"))


def taken(folder: Path, adapter: str, name: str) -> list[Path]:
    """The files that an adapter writes for a machine; none where it does not take it."""
    machine = tp.load(MACHINES / f"{name}.toml")
    try:
        first = written(machine, adapter, folder, ENDINGS[adapter][0])
    except RequestError as refusal:
        if {problem.code for problem in refusal.problems} <= {"controller-cannot", "no-workspace"}:
            return []
        raise
    return [first.with_suffix(ending) for ending in ENDINGS[adapter]]


def numbers(path: Path) -> list[str]:
    """The lines of a file that are no comments."""
    return [line for line in path.read_text("utf-8").splitlines() if line[:1] not in "#;"]


def kept(lines: list[str], read: Import) -> list[str]:
    """Lines without the tilt of a bed, which a machine file does not have, where that was told."""
    if not any("tilt" in lost for lost in read.lost):
        return lines
    return [re.sub(r" A[-.\d]+ B[-.\d]+$", " A0.000000 B0.000000", line) for line in lines]


def options_of(read: Import) -> dict[str, str]:
    """What of the printed numbers the machine file does not keep: where the switches trip."""
    held = [value for key, value in read.holds.items() if key.endswith("HOME_OFFSET")]
    if not held:
        return {}
    assert any("HOME_OFFSET" in lost for lost in read.lost)
    unit = "in" if read.machine.file_units["length"].scale == 0.0254 else "mm"
    return {"switches": ", ".join(f"{value} {unit}" for value in held)}


RODS = {"family.effector_radius": "30", "family.spacing": "50"}
"""What makes two rods of one."""


@pytest.mark.parametrize(
    ("adapter", "rods"),
    [(adapter, {}) for adapter in ENDINGS]
    + [(adapter, RODS) for adapter in ENDINGS if adapter != "linuxcnc-genhexkins"],
)
def test_what_is_printed_comes_back(adapter: str, rods: dict[str, str], tmp_path: Path) -> None:
    machines = 0
    for name in NAMES:
        folder, again = tmp_path / name, tmp_path / f"{name}_again"
        folder.mkdir()
        again.mkdir()
        files = taken(folder, adapter, name)
        if not files:
            continue
        machines += 1
        read = tp.import_machine(files[0], settings=rods)
        assert read.kind == adapter
        first = written(read.machine, adapter, again, ENDINGS[adapter][0], options_of(read))
        for ending, before in zip(ENDINGS[adapter], files, strict=True):
            expected = kept(numbers(before), read)
            assert numbers(first.with_suffix(ending)) == expected, (name, ending)
    assert machines >= (2 if adapter == "linuxcnc-genhexkins" else 1)


def test_every_reader_beside_an_adapter_is_tried() -> None:
    assert READERS.keys() & REGISTRY.keys() == {*ENDINGS, "klipper"}


def test_numbers_with_all_they_may_have_come_back(tmp_path: Path) -> None:
    text = (
        "M665 L304.51234 R158.34500 H325.87100 X0.187000 Y-0.243000 Z0.100000 A0.05000 B-0.08000 "
        "C0.03000\nM666 X-0.20000 Y-0.41200 Z-0.32500\n"
    )
    (tmp_path / "m.gcode").write_text(text, "utf-8")
    read = tp.import_machine(tmp_path / "m.gcode")
    again = written(read.machine, "marlin", tmp_path, "marlin.gcode")
    assert numbers(again) == text.splitlines()
    # The mean of the rod trims is L's, and the highest adjustment is 0.2 mm below 0, in what is
    # printed; the same machine said otherwise is printed so.
    other = text.replace("L304.51234", "L304.41234").replace("A0.05000", "A0.15000")
    other = other.replace("B-0.08000", "B0.02000").replace("C0.03000", "C0.13000")
    other = other.replace("H325.87100", "H325.37100").replace("X-0.20000", "X-0.70000")
    other = other.replace("Y-0.41200", "Y-0.91200").replace("Z-0.32500", "Z-0.82500")
    (tmp_path / "o.gcode").write_text(other, "utf-8")
    same = written(
        tp.import_machine(tmp_path / "o.gcode").machine, "marlin", tmp_path, "marlin.gcode"
    )
    assert numbers(same) == numbers(again)


def test_a_tilt_is_the_one_number_of_reprap_that_is_lost(tmp_path: Path) -> None:
    text = (
        "M665 L304.50000:304.60000:304.40000 R158.34500 H325.87100 B140.0 X0.187000 Y-0.243000 "
        "Z0.000000\nM666 X0.41200 Y-0.08700 Z-0.32500 A0.060000 B-0.110000\n"
    )
    (tmp_path / "config.g").write_text(text, "utf-8")
    read = tp.import_machine(tmp_path / "config.g")
    assert any("A0.06" in lost for lost in read.lost)
    again = written(read.machine, "reprap", tmp_path, "reprap.g")
    level = text.replace("A0.060000 B-0.110000", "A0.000000 B0.000000")
    assert numbers(again) == level.splitlines()


def test_the_printed_machine_is_the_fitted_one(tmp_path: Path) -> None:
    machine = tp.load(MACHINES / "linear_delta.toml")
    for adapter in ("marlin", "reprap"):
        read = tp.import_machine(written(machine, adapter, tmp_path, ENDINGS[adapter][0]))
        poses = machine.poses()
        theirs, status = read.machine.inverse(poses, status=True)
        tops = [drive.travel[1] for drive in machine.drives]
        own = [drive.travel[1] for drive in read.machine.drives]
        # Counted from the switches both go alike, but for what the sources' shifts are worth.
        away = (theirs - own) - (machine.inverse(poses) - tops)
        assert np.abs(away).max() < 1e-3
        assert not status.any()
