"""The kinds of files, good ones of each, and what reads them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import truepose
from made_measurement_files import GOOD, several
from truepose._kernel import toml_lines
from truepose.calibration import read_measurements
from truepose.errors import MachineFileError
from truepose.files.document import read
from truepose.machine import Machine

ROOT = Path(__file__).parent.parent.parent
PLANAR = ROOT / "machines" / "planar_two_slider.toml"

SMALL = ("planar_two_slider", "3rpr", "five_bar", "tripod", "linear_delta", "hexapod_all_sources")
"""Machine files that are spoilt: planar and spatial, small ones and one with every source."""

LOG = "time (min), default (degC), strut.1 (degC)\n0, 20, 20\n10, 24, 40\n# noon\n20, 25, 44\n"
POSES = 'x (mm), y (mm)\n300, 200\n250.5, 210\n"350", 120\n\n200, 300\n'


TOML = r'''
a.b."c d".1 = [1, 2.5e-3, [true, { x = 0x1F, "y" = 'z' }], ] # a comment
date = 1979-05-27T07:32:00Z
text = """
two \u00e9 \
  lines"""
[table."of words"]
inf = -inf
[[row]]
name = "one"
when = 07:32:00
[[row]]
name = "two"
[row.inside]
n = 1_000
'''
"""A document with something of everything that there is."""


@dataclass(frozen=True)
class Kind:
    """Good texts, the name of the file that is spoilt, and how it is read in a folder.

    `arguments` of the command line that reads it likewise, {folder} being the folder.
    """

    texts: tuple[str, ...]
    file: str
    read: Callable[[Path], object]
    arguments: tuple[str, ...]
    companion: str | None = None
    """Text of the machine file beside it, where it is not one itself."""


@cache
def planar() -> Machine:
    """The machine that the measurements are of."""
    return truepose.load(PLANAR)


def _load(folder: Path) -> object:
    return truepose.load(folder / "machine.toml")


def _document(folder: Path) -> object:
    return read(folder / "machine.toml")


def _lines(folder: Path) -> object:
    """The parser in the kernel by itself, which elsewhere has only what the other one takes."""
    try:
        return toml_lines((folder / "machine.toml").read_text("utf-8"))
    except ValueError as refusal:
        raise MachineFileError from refusal


def _measured(folder: Path) -> object:
    return read_measurements(folder / "measured.csv", planar())


def _planar_with(old: str, new: str) -> str:
    text = PLANAR.read_text("utf-8")
    assert text.count(old) == 1
    return text.replace(old, new)


def _planar_line(start: str) -> str:
    """The only line of the planar machine's file that begins so."""
    (line,) = (one for one in PLANAR.read_text("utf-8").splitlines() if one.startswith(start))
    return line


KINDS = {
    "machine": Kind(
        tuple((ROOT / "machines" / f"{name}.toml").read_text("utf-8") for name in SMALL),
        "machine.toml",
        _load,
        ("check", "{folder}/machine.toml"),
    ),
    "toml": Kind(
        (TOML,),
        "machine.toml",
        _document,
        ("check", "{folder}/machine.toml"),
    ),
    "lines": Kind((TOML,), "machine.toml", _lines, ("check", "{folder}/machine.toml")),
    "measurements": Kind(
        (GOOD, several()),
        "measured.csv",
        _measured,
        ("calibrate", str(PLANAR), "{folder}/measured.csv"),
    ),
    "temperatures": Kind(
        (LOG,),
        "log.csv",
        _load,
        ("check", "{folder}/machine.toml"),
        _planar_with(_planar_line("[condition]"), '[condition]\ntemperature_log = "log.csv"'),
    ),
    "poses": Kind(
        (POSES,),
        "poses.csv",
        _load,
        ("check", "{folder}/machine.toml"),
        _planar_with(_planar_line("grid = "), 'poses = "poses.csv"'),
    ),
}
