"""The snippets of INI and HAL that go with the module."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from truepose.controllers._template import exact, fill, one_line, template
from truepose.controllers.linuxcnc._description import (
    DEGREE,
    HELD,
    MILLIMETRE,
    WRENCHES,
    Description,
)
from truepose.controllers.linuxcnc._safe_box import Box
from truepose.version import version


def ini_text(description: Description, box: Box, clamp: float, mark: str) -> str:
    """Sections KINS, TRAJ, AXIS and JOINT, mm and degrees. `clamp` in m; `mark`: its hash."""
    machine = description.machine
    home = description.home / np.array([MILLIMETRE] * 3 + [DEGREE] * 3)
    home[[k for k in range(6) if k not in description.freedoms]] = 0.0
    return fill(
        description.with_pins(template(__package__, "ini.in")),
        {
            "hash": mark,
            "title": description.title,
            "version": version(),
            "file": one_line(machine.file.replace("\\", "/").rpartition("/")[2]),
            "module": description.module,
            "n_joint": str(len(machine.joints)),
            "absent": "".join(_absent(description)),
            "coordinates": " ".join(name.upper() for name in machine.commanded),
            "home": " ".join(_clean(value) for value in home),
            "checked": str(box.checked),
            "clamp": _short(clamp / MILLIMETRE),
            "least": f"{box.least:.3g}",
            "conditioning": f"{box.conditioning:.3g}",
            "cut": ""
            if box.asked
            else " The workspace of the machine file was larger; not all of it\n# is like that.",
            "axes": "\n".join(_axes(description, box)),
            "joints": "\n".join(_joints(description)),
        },
    )


def _absent(description: Description) -> Iterable[str]:
    """Why axes are not among COORDINATES."""
    if description.locked:
        yield f"# No axis {_listed(description.locked)}: the machine has no such freedom, locked.\n"
    if description.following:
        following = _listed(description.following)
        yield f"# No axis {following}: not commanded, follows from the others.\n"


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name.upper() for name in names)


def _axes(description: Description, box: Box) -> Iterable[str]:
    units = description.pose_units
    for name, low, high, held in zip(
        description.machine.commanded,
        box.low / units,
        box.high / units,
        description.held,
        strict=True,
    ):
        unit = "mm" if name in "xyz" else "degrees"
        yield f"\n[AXIS_{name.upper()}]"
        if held:
            centre = _short(round(0.5 * (low + high), 9))
            yield f"# Axis {name.upper()} is locked at {centre} {unit}: the machine file's"
            yield f"# workspace holds it within {HELD:g}, left for rounding and corrections."
        yield f"MIN_LIMIT = {_short(low)}"
        yield f"MAX_LIMIT = {_short(high)}"
        yield f"# MAX_VELOCITY =\n# MAX_ACCELERATION =\n# {unit} per s, per s^2"


def _joints(description: Description) -> Iterable[str]:
    machine = description.machine
    home = machine.inverse(description.commanded_home) / description.units
    for index, drive in enumerate(machine.drives):
        linear = drive.coordinate == "length"
        low, high = description.travels[index] / description.units[index]
        yield f"\n[JOINT_{index}]"
        yield f"# drive {one_line(drive.name)}"
        yield f"TYPE = {'LINEAR' if linear else 'ANGULAR'}"
        yield f"HOME = {exact(home[index])}"
        yield f"HOME_OFFSET = {exact(home[index])}"
        yield "HOME_SEQUENCE = 0"
        yield f"MIN_LIMIT = {_short(low)}"
        yield f"MAX_LIMIT = {_short(high)}"
        yield "# MAX_VELOCITY =\n# MAX_ACCELERATION =\n# FERROR ="
        yield f"# {'mm' if linear else 'degrees'} per s, per s^2; {'mm' if linear else 'degrees'}"


def hal_text(description: Description, clamp: float, rate_limit: float, mark: str) -> str:
    """The lines that load, order and connect the module. `clamp` in m, `rate_limit` in m/s.

    `mark`: the hash of the export.
    """
    temperatures = [
        f"#net {name}  YOUR.SENSOR  => {description.pins}.{name}-temperature   # {one_line(part)}"
        for name, part in zip(
            description.temperature_names, description.temperature_parts, strict=True
        )
    ]
    wrench = [
        f"#net {WRENCHES[index]}  YOUR.SENSOR  => {description.pins}.{WRENCHES[index]}"
        for index in description.wrenches
    ]
    return fill(
        description.with_pins(template(__package__, "hal.in")),
        {
            "module": description.module,
            "hash": mark,
            "title": description.title,
            "version": version(),
            "file": one_line(description.machine.file.replace("\\", "/").rpartition("/")[2]),
            "temperatures": "\n".join(temperatures) or "# None: no part expands.",
            "wrench": "\n".join(wrench),
            "rate_limit": _short(rate_limit / MILLIMETRE),
            "clamp": _short(clamp / MILLIMETRE),
        },
    )


def _clean(value: float) -> str:
    """A number with all its digits, but for a last one that only the change of units has made."""
    text = f"{value:.15g}"
    return text if abs(float(text) - value) <= 4e-16 * abs(value) else exact(value)


def _short(value: float) -> str:
    """A number without the digits of rounding: 200.00000000000003 is 200."""
    return f"{float(f'{value:.12g}'):.12g}"
