"""Small machine files as text, for tests that edit them."""

from __future__ import annotations

import re
from pathlib import Path

from build_machine import MACHINES
from truepose.machine import Machine, load
from truepose.sources import REGISTRY

PLANAR = """\
schema = 1
[machine]
name = "planar"
dof = ["x", "y"]
[units]
length = "mm"
angle = "deg"
force = "N"
temperature = "degC"
[[drive]]
name = "d1"
kind = "slider"
axis = [0, 1, 0]
travel = [0, 900]
working_mode = "+"
[[drive]]
name = "d2"
kind = "slider"
origin = [600, 0, 0]
axis = [0, 1, 0]
travel = [0, 900]
working_mode = "+"
[[strut]]
name = "1"
drive = "d1"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 500
length_tolerance = [-0.3, 0.3]
section_area = "28 mm^2"
modulus = "210 GPa"
expansion = "1.1e-5 1/K"
[[strut]]
name = "2"
drive = "d2"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 500
section_area = "28 mm^2"
material = "steel"
[condition]
reference_temperature = 20
temperature = 35
force = { x = 1200, y = -1500 }
[workspace]
grid = { x = [200, 400, 5], y = [100, 300, 3] }
[accuracy]
target = "0.5 mm"
"""

_TELESCOPIC_DRIVE = """\
[[drive]]
name = "d{i}"
kind = "telescopic"
offset = 600
travel = [-200, 400]
"""
_TELESCOPIC_STRUT = """\
[[strut]]
name = "{i}"
drive = "d{i}"
base = [{base[0]}, {base[1]}, 0]
platform = [{platform[0]}, {platform[1]}, 0]
"""
_BASES = ((300, 100), (-100, 300), (-250, 200), (-250, -200), (-100, -300), (300, -100))
_PLATFORMS = ((90, 80), (20, 120), (-120, 50), (-120, -50), (20, -120), (90, -80))

HEXAPOD = (
    """\
schema = 1
[machine]
name = "hexapod"
dof = ["x", "y", "z", "a", "b", "c"]
[units]
length = "mm"
angle = "deg"
[workspace]
home = { z = 650 }
grid = { x = [-50, 50, 3], z = [600, 700, 2], c = [-5, 5, 2] }
"""
    + "".join(_TELESCOPIC_DRIVE.format(i=i) for i in range(1, 7))
    + "".join(
        _TELESCOPIC_STRUT.format(i=i, base=base, platform=platform)
        for i, (base, platform) in enumerate(zip(_BASES, _PLATFORMS, strict=True), start=1)
    )
)


def edited(text: str, *edits: tuple[str, str]) -> str:
    """The text with the first occurrence of each `old` replaced; an `old` must be there."""
    for old, new in edits:
        if old not in text:
            raise ValueError(f"{old!r} is not in the text")
        text = text.replace(old, new, 1)
    return text


def line_of(text: str, fragment: str) -> int:
    """The line, from 1, where `fragment` first stands."""
    return text[: text.index(fragment)].count("\n") + 1


def load_text(folder: Path, text: str, *settings: str) -> Machine:
    """Load a machine file of this text, with the registered sources."""
    path = folder / "machine.toml"
    path.write_text(text, encoding="utf-8")
    return load(path, settings=settings, registry=REGISTRY)


def with_workspace(name: str, folder: Path, workspace: str) -> Path:
    """The file of a machine of the library, with other poses."""
    text = (MACHINES / f"{name}.toml").read_text(encoding="utf-8")
    text, count = re.subn(
        r"(?m)^\[workspace\]\n(?:(?!\[).*\n)*", f"[workspace]\n{workspace}\n\n", text
    )
    assert count == 1
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    return path
