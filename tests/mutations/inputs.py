"""The kinds of files, good ones of each, and what reads them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import truepose
from klipper_printer import LINEAR, ROTARY, as_saved, saved
from made_measurement_files import GOOD, several
from truepose._kernel import toml_lines
from truepose.calibration import read_measurements
from truepose.controllers import ControllerFile
from truepose.controllers.klipper.read import KlipperReader
from truepose.errors import MachineFileError
from truepose.files.document import read
from truepose.machine import Machine
from truepose.workpiece.read import read_part

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
    """Text of the machine file beside it, or of another file with this name."""
    companion_name: str = "machine.toml"
    most_read: float = 0.6
    """The share of spoilt texts that may be read; of a log nearly all, whose other lines pass."""


@cache
def planar() -> Machine:
    """The machine that the measurements are of."""
    return truepose.load(PLANAR)


@cache
def delta() -> Machine:
    """The machine that makes the parts."""
    return truepose.load(DELTA)


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


def _imported(folder: Path, file: str, **settings: str) -> object:
    return truepose.import_machine(folder / file, settings=settings)


def _controller_file(name: str) -> str:
    return (ROOT / "tests" / "controller_files" / name).read_text("utf-8")


def _part(folder: Path) -> object:
    return read_part(delta(), SQUARE, folder / "features.toml")


def _part_of_comments(folder: Path) -> object:
    return read_part(delta(), folder / "part.ngc")


def _lines_with(text: str, *words: str) -> str:
    """The lines of a text that have one of the words."""
    kept = [line for line in text.splitlines() if any(word in line for word in words)]
    return "\n".join([*kept, ""])


def _planar_with(old: str, new: str) -> str:
    text = PLANAR.read_text("utf-8")
    assert text.count(old) == 1
    return text.replace(old, new)


def _planar_line(start: str) -> str:
    """The only line of the planar machine's file that begins so."""
    (line,) = (one for one in PLANAR.read_text("utf-8").splitlines() if one.startswith(start))
    return line


KLIPPER = (
    "[include none*.cfg]\n" + LINEAR.config() + saved(LINEAR, LINEAR, z_offset=0.5),
    ROTARY.config(probe=False) + as_saved(saved(ROTARY, ROTARY, z_offset=0.0)),
)

MARLIN = _lines_with(_controller_file("marlin/m503.txt"), "G21", "M665 L", "M666 X", "M851 X")
G29 = "Send: G29 L-70 R70 F-70 B70\n" + _controller_file("marlin/g29_bilinear.log")
REPRAP = _lines_with(_controller_file("reprap/config.g"), "M665", "M666", "M584", "G31")
PLACES = _controller_file("reprap/bed.g") + _controller_file("reprap/g32.log")
CENTRES = "name, x (mm), y (mm), z (mm), role\n" + "".join(
    f"{strut}, {x}, {y}, {z}, {role}\n"
    for strut, out in enumerate(((1, 0), (2, 3), (-2, 3), (-3, 0), (-1, -3), (1, -3)))
    for role, (x, y, z) in (
        ("base", (100 * out[0], 100 * out[1], 0)),
        ("platform", (40 * out[1], 40 * out[0], 510)),
    )
) + "t, 0, 0, 500, tool\n"  # fmt: skip

DELTA = str(ROOT / "machines" / "linear_delta.toml")
SQUARE = str(ROOT / "examples" / "part" / "square.ngc")

PART = """G21 G17 G90 G94 F900
G0 X-20 Y-20 Z20
G1 Z10
(datum: A)
N20 G1 X20
(feature: corner, perpendicularity 0.05, datums A)
N30 G1 Y20
(feature: width, size 40 +-0.1)
N40 G1 X-20
(end feature)
G0 X10 Y0
(feature: hole, diameter 20 mm +0.025 0, roundness 0.02)
G3 X10 Y0 I-10 J0
(feature: width)
G0 X20 Y-20
N50 G1 X-20
"""

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
    "klipper": Kind(
        KLIPPER,
        "printer.cfg",
        lambda folder: _imported(folder, "printer.cfg"),
        ("import", "{folder}/printer.cfg"),
    ),
    "klipper-reader": Kind(
        KLIPPER,
        "printer.cfg",
        lambda folder: KlipperReader.read(ControllerFile.at(folder / "printer.cfg"), {}),
        ("import", "{folder}/printer.cfg"),
    ),
    "marlin": Kind(
        (MARLIN, "G20\n" + MARLIN.replace("Recv: echo:  G21 ; (mm)\n", "")),
        "m503.txt",
        lambda folder: _imported(folder, "m503.txt"),
        ("import", "{folder}/m503.txt"),
    ),
    "marlin-log": Kind(
        (
            MARLIN + G29 + _controller_file("marlin/g30.log"),
            _controller_file("marlin/m503_old_dialect.txt")
            + _controller_file("marlin/g33_dry_run.log").replace("V0", "V0 P3"),
        ),
        "session.log",
        lambda folder: _imported(folder, "session.log"),
        ("import", "{folder}/session.log"),
        most_read=0.95,
    ),
    "marlin-configuration": Kind(
        (_controller_file("marlin/Configuration.h"),),
        "Configuration.h",
        lambda folder: _imported(folder, "Configuration.h"),
        ("import", "{folder}/Configuration.h"),
    ),
    "reprap": Kind(
        (REPRAP,),
        "config.g",
        lambda folder: _imported(folder, "config.g"),
        ("import", "{folder}/config.g"),
    ),
    "reprap-log": Kind(
        (REPRAP + PLACES, REPRAP + _controller_file("reprap/g30_s-1.log")),
        "config.g",
        lambda folder: _imported(folder, "config.g"),
        ("import", "{folder}/config.g"),
        most_read=0.95,
    ),
    "reprap-height-map": Kind(
        (_controller_file("reprap/heightmap.csv"),),
        "heightmap.csv",
        lambda folder: _imported(folder, "config.g", logs="heightmap.csv"),
        ("import", "{folder}/config.g", "--set", "logs=heightmap.csv"),
        REPRAP,
        "config.g",
    ),
    "linuxcnc-hal": Kind(
        (_lines_with(_controller_file("linuxcnc/hexapod.hal"), "setp genhexkins", "net tool"),),
        "hexapod.hal",
        lambda folder: _imported(folder, "hexapod.hal"),
        ("import", "{folder}/hexapod.hal"),
        _controller_file("linuxcnc/hexapod.ini"),
        "hexapod.ini",
    ),
    "features": Kind(
        ((ROOT / "examples" / "part" / "square.toml").read_text("utf-8"),),
        "features.toml",
        _part,
        ("part", DELTA, SQUARE, "--features", "{folder}/features.toml"),
    ),
    "feature-comments": Kind(
        (PART,),
        "part.ngc",
        _part_of_comments,
        ("part", DELTA, "{folder}/part.ngc"),
    ),
    "joint-centres": Kind(
        (CENTRES,),
        "centres.csv",
        lambda folder: _imported(folder, "centres.csv"),
        ("import", "{folder}/centres.csv"),
    ),
}
