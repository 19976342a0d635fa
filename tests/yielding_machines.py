"""Deltas of the library on carriages that tilt and on arms that bend and twist."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from build_machine import MACHINES

_FOLDER = TemporaryDirectory(prefix="yielding_machines")

ARM = """
chain = [
  { joint = "revolute", radial = "100 N/um", axial = "80 N/um", tilt = "2e4 N m/rad" },
  { beam = "box", height = 20, width = 30, wall = 2, material = "aluminium", length = 60 },
  { beam = "tube", outside = 18, wall = 2, material = "aluminium" },
]
stiffness = "3e3 N m/rad"
"""
CARRIAGE = """
chain = [
  { joint = "prismatic", across = ["20 N/um", "30 N/um"], axis = [0.3, 0.5, 0.8], \
    tilt = ["2e4 N m/rad", "3e4 N m/rad", "1e4 N m/rad"] },
]
stiffness = "30 N/um"
"""
CHAINS = {"rotary_delta": ARM, "linear_delta": CARRIAGE}
"""Of the drives of each."""


@cache
def yielding(name: str) -> Path:
    """The file of the machine with what its drives' bodies stand on; its name begins with it."""
    text = (MACHINES / f"{name}.toml").read_text(encoding="utf-8")
    line = "[each.drive] # what every drive has\n"
    assert line in text
    path = Path(_FOLDER.name) / f"yielding_{name}.toml"
    path.write_text(text.replace(line, line + CHAINS[name]), encoding="utf-8")
    return path
