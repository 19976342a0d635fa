"""A LinuxCNC configuration with lineardeltakins -> a linear delta.

R and L are two numbers for three towers, at 90, 210 and 330 degrees, joints 0, 1 and 2; a joint's
value is the height of its carriage. Facts: the manual page lineardeltakins(9), and the INI's
documentation (https://linuxcnc.org/docs/stable/html/config/ini-config.html).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import ClassVar

from truepose.controllers._delta_file import SETTINGS, LinearDeltaFile, Rods, rods_of
from truepose.controllers._hal_text import value_of
from truepose.controllers._linuxcnc_files import Configuration
from truepose.controllers._linuxcnc_read import (
    UNIT,
    Range,
    configuration_of,
    kinematics_named,
    limits,
    machine_name,
    pins,
    unit_of,
)
from truepose.controllers._reader import (
    Assumption,
    ControllerFile,
    ControllerReading,
    Setting,
    refuse,
)
from truepose.controllers._towers import NARROW, STEEPEST
from truepose.errors import Problem

KINEMATICS = "lineardeltakins"
ANGLES = (90.0, 210.0, 330.0)


class LinearDeltaKinsReader:
    """R and L, and the INI's units and limits."""

    name: ClassVar[str] = "linuxcnc-lineardelta"
    doc: ClassVar[str] = "LinuxCNC's INI or HAL file of a linear delta with lineardeltakins"
    settings: ClassVar[Mapping[str, Setting]] = {**SETTINGS, "units.length": UNIT}

    @classmethod
    def recognises(cls, text: str) -> bool:
        """An INI with this kinematics, or a HAL file that sets R or L."""
        return kinematics_named(text, KINEMATICS)

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """The delta. Raises `MachineFileError` with everything that is wrong."""
        config = configuration_of(file)
        problems: list[Problem] = []
        _, scale = unit_of(file, config, settings, problems)
        values = pins(file, config, [f"{KINEMATICS}.R", f"{KINEMATICS}.L"], problems)
        refuse(problems)
        refuse(list(_impossible(config, values)))
        radius, rod = values[f"{KINEMATICS}.R"], values[f"{KINEMATICS}.L"]
        size = radius + rod
        joints = [limits(config, f"JOINT_{joint}", size, problems) for joint in range(3)]
        axes = [limits(config, f"AXIS_{axis}", size, problems) for axis in "XYZ"]
        homes = [config.number(f"JOINT_{joint}", "HOME", problems) for joint in range(3)]
        refuse(problems)
        delta, assumptions = _delta(
            file, config, scale, radius, rod, joints, axes, homes, rods_of(settings)
        )
        return ControllerReading(
            delta.text(),
            None,
            {
                **{pin: entry.text for pin, entry in config.pins.items() if KINEMATICS in pin},
                **{
                    str(entry): entry.text
                    for entry in config.ini
                    if entry.section.startswith("JOINT_") and entry.key in ("HOME_OFFSET", "HOME")
                },
            },
            (*delta.assumptions(), *assumptions),
            tuple(_lost(config)),
        )


def _impossible(config: Configuration, values: Mapping[str, Decimal]) -> Iterator[Problem]:
    radius, rod = values[f"{KINEMATICS}.R"], values[f"{KINEMATICS}.L"]
    for pin, wrong, expected in (
        (f"{KINEMATICS}.R", radius <= 0, "above zero"),
        (f"{KINEMATICS}.L", rod <= max(radius, Decimal(0)), "longer than R"),
    ):
        if wrong:
            entry = config.pins[pin]
            message = f"{pin}: a rod and a radius that make no delta"
            yield Problem(
                "import-value", message, entry.file, entry.line, pin, entry.text, expected
            )


def _delta(
    file: ControllerFile,
    config: Configuration,
    scale: Decimal,
    radius: Decimal,
    rod: Decimal,
    joints: list[Range | None],
    axes: list[Range | None],
    homes: list[Decimal | None],
    rods: Rods | None,
) -> tuple[LinearDeltaFile, list[Assumption]]:
    """The machine file, in mm, and what besides the usual is assumed in it."""
    assumptions: list[Assumption] = []
    narrowed = None
    out, length = float(radius * scale), float(rod * scale)
    x, y, z = axes
    if x is not None and y is not None:
        reach = float(min(-x[0], x[1], -y[0], y[1]) * scale)
    if x is None or y is None or reach <= 0.0:
        reach = float(f"{max(min(NARROW * out, STEEPEST * length - out), 0.05 * out):.3g}")
        narrowed = (
            "nothing says how far the tool may go sideways: the workspace's radius is three "
            "quarters of R, or less where the rods are short"
        )
    ends = [pair for pair in joints if pair is not None]
    if len(ends) == len(joints):
        tops = [float(pair[1] * scale) for pair in ends]
        lows = [float(pair[0] * scale) for pair in ends]
    else:
        tops, lows = [3.0 * length] * 3, [0.0] * 3
        assumptions.append(Assumption("carriages go up to three rods' lengths", "drive.*.travel"))
    rise = math.sqrt(length * length - out * out)
    low = max(max(lows) - rise, 0.0) if z is None else float(z[0] * scale)
    cone = min(tops) - length
    high = float(z[1] * scale) if z is not None else cone
    if z is None:
        high = high if high > low else min(tops) - rise
        assumptions.append(
            Assumption("the tool goes up until a carriage may be at its end", "workspace.cylinder")
        )
    known = [float(home * scale) for home in homes if home is not None]
    level = len(known) == 3 and max(known) - min(known) < 1e-9
    return (
        LinearDeltaFile(
            name=machine_name(config, "Linear delta (lineardeltakins)"),
            origin=f"LinuxCNC's {file.path.name}.",
            radius=[out] * 3,
            angles=list(ANGLES),
            arms=[length] * 3,
            ends=tops,
            workspace=(reach, low, high),
            rods=rods,
            reach_assumed=narrowed,
            lows=lows if len(ends) == len(joints) else None,
            home=known[0] - rise if level else None,
        ),
        assumptions,
    )


def _lost(config: Configuration) -> Iterator[str]:
    offsets = [value_of(config.ini, f"JOINT_{joint}", "HOME_OFFSET") for joint in range(3)]
    if all(offset is not None for offset in offsets):
        said = ", ".join(offset.text for offset in offsets if offset is not None)
        yield (
            "where the home switches trip, HOME_OFFSET: to print it again, "
            f'--option switches="{said}"'
        )
    for name in config.left_out:
        yield f"{name}, which is named and was not read"


__all__ = ["LinearDeltaKinsReader"]
