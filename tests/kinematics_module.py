"""LinuxCNC's own kinematics modules, as they are installed, with the pins of a HAL file."""

from __future__ import annotations

import shutil
from pathlib import Path

from benchmarks.kinematics_host import PACKAGED, Host, Module


def kinematics_of(host: Host, folder: Path, module: str, count: int, hal: str) -> Module:
    """The module with the pins that `hal` sets, in a copy of its own in the folder."""
    # A copy is another library to the loader: with pins of its own.
    copy = folder / f"{module}.so"
    shutil.copy(PACKAGED / copy.name, copy)
    kinematics = host.load(copy, count)
    for line in hal.splitlines():
        if line.startswith("setp "):
            _, name, value = line.split()
            host.set(name, float(value))
    return kinematics
