"""What the LinuxCNC adapters share: machine units, and joints' homing and limits for the INI."""

from __future__ import annotations

import math
from collections.abc import Sequence

from truepose.controllers._export import Option
from truepose.controllers._small_model import ascii_only, fixed
from truepose.machine import Machine

INCH, MM = 0.0254, 1e-3

UNITS = Option(
    "file",
    "LINEAR_UNITS of the INI; file: inch where the machine file is in inches, else mm",
    dimension=None,
    choices=("file", "mm", "inch"),
)

DIGITS = {"mm": 6, "inch": 8}
"""Decimals that are written: a nanometre, or less."""

SCALE = {"mm": MM, "inch": INCH}


def unit_of(machine: Machine, option: float | str) -> str:
    """`mm` or `inch`."""
    if option != "file":
        return str(option)
    unit = machine.file_units.get("length")
    return "inch" if unit is not None and math.isclose(unit.scale, INCH) else "mm"


def ini_joint(
    machine: Machine,
    joint: int,
    drive: int,
    unit: str,
    *,
    up: float,
    offset: float,
    home_offset: str,
    home: float,
) -> list[str]:
    """A [JOINT_n] section: LinuxCNC's joint value is `up` * coordinate + `offset`, m.

    `home_offset`: its value at the home switch, as printed. `home`: its value at the machine's
    home, m.
    """
    scale, digits = SCALE[unit], DIGITS[unit]
    ends = sorted((up * end + offset) / scale for end in machine.drives[drive].travel)
    last = 10.0**-digits  # inwards, so that rounding does not widen the travel
    return [
        "",
        f"[JOINT_{joint}]",
        f"# drive {ascii_only(machine.drives[drive].name)}",
        f"MIN_LIMIT = {fixed(math.ceil(ends[0] / last) * last, digits)}",
        f"MAX_LIMIT = {fixed(math.floor(ends[1] / last) * last, digits)}",
        f"HOME_OFFSET = {home_offset}",
        f"HOME = {fixed(home / scale, digits)}",
    ]


def ini_head(lines: Sequence[str], kinematics: str, joints: int, unit: str) -> list[str]:
    """The comment and the sections [KINS] and [TRAJ]."""
    return [
        *(f"# {line}" for line in lines),
        "[KINS]",
        f"KINEMATICS = {kinematics}",
        f"JOINTS = {joints}",
        "",
        "[TRAJ]",
        f"LINEAR_UNITS = {unit}",
        "ANGULAR_UNITS = degree",
    ]


__all__ = ["DIGITS", "SCALE", "UNITS", "ini_head", "ini_joint", "unit_of"]
