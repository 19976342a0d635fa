"""Whose file it is: of everything that a controller writes or an adapter prints, one reader's."""

from __future__ import annotations

from pathlib import Path

import pytest

import truepose as tp
from build_machine import MACHINES
from truepose.controllers import READERS, reader

ROOT = Path(__file__).parents[3]
FILES = ROOT / "tests" / "controller_files"

KNOWN = {
    "marlin": sorted(path for path in (FILES / "marlin").iterdir() if path.suffix != ".json"),
    "reprap": sorted(path for path in (FILES / "reprap").iterdir() if path.suffix != ".json"),
    "linuxcnc-genhexkins": [FILES / "linuxcnc" / "hexapod.hal", FILES / "linuxcnc" / "hexapod.ini"],
    "klipper": [ROOT / "examples" / "data" / "printer.cfg"],
    "joint-centres": [ROOT / "examples" / "data" / "joint_centres.csv"],
}


def who(text: str) -> list[str]:
    return [name for name in READERS if reader(name).recognises(text)]


@pytest.mark.parametrize(
    ("name", "path"), [(name, path) for name, paths in KNOWN.items() for path in paths]
)
def test_a_file_of_a_controller_is_one_readers(name: str, path: Path) -> None:
    assert who(path.read_text("utf-8")) == [name]


@pytest.mark.parametrize(
    ("name", "machine"),
    [
        *((name, "linear_delta") for name in ("klipper", "marlin", "reprap")),
        ("linuxcnc-lineardelta", "linear_delta"),
        ("klipper", "rotary_delta"),
        ("linuxcnc-genhexkins", "hexapod"),
    ],
)
def test_what_an_adapter_prints_is_its_readers(name: str, machine: str) -> None:
    for file, text in tp.export(tp.load(MACHINES / f"{machine}.toml"), name).files.items():
        assert who(text) == [name], file


@pytest.mark.parametrize("path", sorted(MACHINES.glob("*.toml")), ids=lambda path: path.stem)
def test_a_machine_file_is_no_controllers(path: Path) -> None:
    assert who(path.read_text("utf-8")) == []


@pytest.mark.parametrize("name", ["delta_heights.csv", "delta_positions.csv"])
def test_measurements_are_no_controllers(name: str) -> None:
    assert who((ROOT / "examples" / "data" / name).read_text("utf-8")) == []
