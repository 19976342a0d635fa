"""What the LinuxCNC adapters share: machine units, and joints' homing and limits for the INI."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from truepose.arrays import Floats
from truepose.controllers._export import Export, Option
from truepose.controllers._fit import fit, heading
from truepose.controllers._small_model import (
    MM,
    Printed,
    SmallModel,
    ascii_only,
    fixed,
    more_decimals,
    stem,
)
from truepose.machine import Machine

INCH = 0.0254

UNITS = Option(
    "file",
    "LINEAR_UNITS of the INI; file: inch where the machine file is in inches, else mm",
    dimension=None,
    choices=("file", "mm", "inch"),
)

DIGITS = {"mm": 6, "inch": 8}
"""Decimals that are written: a nanometre, or less; more for machines smaller than `SMALL`."""

SMALL = 0.01
"""m, of the characteristic length."""

SLACK = 1e-3
"""Of the last digit: what a limit that has no more digits may be off by its own rounding."""

SCALE = {"mm": MM, "inch": INCH}


def unit_of(machine: Machine, option: float | str) -> str:
    """`mm` or `inch`."""
    if option != "file":
        return str(option)
    unit = machine.file_units.get("length")
    return "inch" if unit is not None and math.isclose(unit.scale, INCH) else "mm"


def digits_of(machine: Machine, unit: str) -> int:
    """Decimals of a length of this machine in a `unit`."""
    return DIGITS[unit] + more_decimals(machine.characteristic_length, SMALL)


class JointModel(SmallModel, Protocol):
    """A `SmallModel` that is written as lines for a HAL file and for an INI, in a `unit`."""

    unit: str

    def hal(self, printed: Printed) -> list[str]:
        """`setp` of every number that is a pin."""
        ...

    def ini(self, values: Floats, printed: Printed) -> list[str]:
        """The sections of the joints, from the numbers and from what is printed of them."""
        ...


def exported(machine: Machine, model: JointModel, kinematics: str, joints: int) -> Export:
    """The fitted model as a HAL file and an INI.

    Raises `RequestError`: controller-cannot, no-workspace, no-pose-left.
    """
    fitted = fit(machine, model)
    lines = heading(machine, fitted, f"LinuxCNC {kinematics}")
    hal = [*(f"# {line}" for line in lines), f"# in {model.unit}", *model.hal(fitted.printed)]
    ini = ini_head(lines, kinematics, joints, model.unit) + model.ini(fitted.values, fitted.printed)
    files = {
        f"{stem(machine)}_{kinematics}.hal": "\n".join([*hal, ""]),
        f"{stem(machine)}_{kinematics}.ini": "\n".join([*ini, ""]),
    }
    return Export(files, fitted.statement(machine))


def ini_joint(
    machine: Machine,
    joint: int,
    drive: int,
    unit: str,
    *,
    gain: float,
    offset: float,
    home_offset: str,
    home: float,
) -> list[str]:
    """A [JOINT_n] section: LinuxCNC's joint value is `gain` * coordinate + `offset`, m.

    `home_offset`: its value at the home switch, as printed. `home`: its value at the machine's
    home, m.
    """
    scale, digits = SCALE[unit], digits_of(machine, unit)
    ends = sorted((gain * end + offset) / scale for end in machine.drives[drive].travel)
    last = 10.0**-digits  # inwards, so that rounding does not widen the travel
    low, high = (math.ceil(ends[0] / last - SLACK), math.floor(ends[1] / last + SLACK))
    return [
        "",
        f"[JOINT_{joint}]",
        f"# drive {ascii_only(machine.drives[drive].name)}",
        f"MIN_LIMIT = {fixed(low * last, digits)}",
        f"MAX_LIMIT = {fixed(high * last, digits)}",
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


__all__ = ["SCALE", "UNITS", "digits_of", "exported", "ini_joint", "unit_of"]
