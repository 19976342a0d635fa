"""The kinematics module: C for `halcompile`, made from a template and the machine's own C."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from truepose.controllers._template import exact, fill, one_line, template
from truepose.controllers.linuxcnc._description import (
    FREEDOMS,
    WRENCHES,
    Description,
)
from truepose.version import version

PREFIX = "pkm"
"""Of the names of the machine's own C inside the module."""

TEMPERATURES = (-40.0, 120.0)
"""Degrees Celsius between which a reading is plausible."""

PLAUSIBLE_LOADS = 10.0
"""A force or moment is plausible up to so many times that of the machine file."""

HOMING_TOLERANCE = 1e-3
"""mm from HOME at which a joint may be homed again: what feedback at rest is off, and no more."""

SETTLED = 1e-12
"""How well the forward solution's pose gives the joints back, in sizes of the machine."""

_WIDTH = 100


def module_text(
    description: Description, machine_c: str, clamp: float, rate_limit: float, mark: str
) -> str:
    """The whole module. `clamp` in m; `rate_limit` in m/s; `machine_c` with prefix `PREFIX`.

    `mark`: the hash of the export.
    """
    machine = description.machine
    wrenches = description.wrenches
    condition = machine.condition
    return fill(
        description.with_pins(template(__package__, "module.c.in")),
        {
            "module": description.module,
            "hash": mark,
            "title": description.title,
            "version": version(),
            "file": one_line(machine.file.replace("\\", "/").rpartition("/")[2]),
            "file_hash": machine.file_hash,
            "pin_table": "\n".join(_pin_table(description)),
            "machine_c": machine_c,
            "n_joint": str(len(machine.joints)),
            "n_temperature": str(len(description.temperature_parts)),
            "n_wrench": str(len(wrenches)),
            "n_commanded": str(len(machine.commanded)),
            "settled": exact(float(f"{SETTLED * description.size:.3g}")),
            "unit": _numbers(description.units),
            "arm": _numbers(description.arms),
            "freedom": ", ".join(str(index) for index in description.freedoms),
            "home": _numbers(description.home),
            "temperature_name": "".join(f'"{name}", ' for name in description.temperature_names),
            "wrench": "".join(f"{index}, " for index in wrenches),
            "rate_limit": exact(_millimetres(rate_limit)),
            "clamp": exact(_millimetres(clamp)),
            "homing_tolerance": exact(HOMING_TOLERANCE),
            "temperature_min": exact(TEMPERATURES[0]),
            "temperature_max": exact(TEMPERATURES[1]),
            "temperature_slew": exact(0.0),
            "force_max": exact(PLAUSIBLE_LOADS * _norm(condition.force)),
            "moment_max": exact(PLAUSIBLE_LOADS * _norm(condition.moment)),
        },
    )


def _pin_table(description: Description) -> Iterable[str]:
    for name, part in zip(
        description.temperature_names, description.temperature_parts, strict=True
    ):
        yield f" *   {f'{name}-temperature':<22} in   degrees Celsius of {one_line(part)}"
    commanded = " ".join(FREEDOMS[index] for index in description.freedoms)
    yield f" *   (commanded: {commanded}; loads: {', '.join(_loads(description))})"
    if description.locked:
        yield f" *   (locked, the machine has no such freedom: {' '.join(description.locked)})"
    if description.following:
        yield f" *   (not commanded, made by the others: {' '.join(description.following)})"


def _loads(description: Description) -> list[str]:
    return [WRENCHES[index] for index in description.wrenches]


def _numbers(values: Iterable[float]) -> str:
    return ", ".join(exact(value) for value in values)


def _millimetres(value: float) -> float:
    """Metres as mm, without the digits that the division by 1e-3 adds."""
    return float(f"{value * 1e3:.12g}")


def _norm(vector: tuple[float, float, float]) -> float:
    return float(f"{float(np.linalg.norm(vector)):.6g}")
