"""RepRapFirmware's config.g as a linear delta; its logs and height map as measurements.

Towers X, Y and Z stand at 210, 330 and 90 degrees and their corrections; each carriage is at its
endstop where the tool, at x = y = 0, is at H and the tower's M666. The tilt A, B is added to the
heights of all carriages, (A x + B y) / 100: z is counted from a tilted bed, along the guideways.
That is no machine with z square to x and y, so that here z is that of the guideways: a command x y
z of the firmware is x, y, z + (A x + B y) / 100 of the machine file, and readings are written so.
Sources: https://docs.duet3d.com, M665, M666, M669, M557, G30, G31, G32.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import ClassVar

from truepose.controllers._commands import commands, only_reprap
from truepose.controllers._delta_file import SETTINGS, rods_of
from truepose.controllers._probed import (
    ASSUMED_PROBE,
    Place,
    ProbedPoints,
    logs_beside,
    measurements_text,
)
from truepose.controllers._reader import (
    Assumption,
    ControllerFile,
    ControllerReading,
    Setting,
    refuse,
)
from truepose.controllers._towers import Held, Towers, bridged, require
from truepose.controllers.reprap._height_map import FIRST_WORDS, height_map
from truepose.controllers.reprap._logs import logged, points_asked
from truepose.controllers.reprap._numbers import DELTA, KINDS, RepRapNumbers, numbers
from truepose.errors import Fault, MachineFileError, ReadingError

ANGLES = (210, 330, 90)
NEEDED = {"M665 L0": "length of the rods", "M665 R": "delta radius"}
MOST_RODS = 3

CONFIGURES = {"M665", "M666", "M667", "M669", "M98", "M501"}
"""Any of these makes a file one of a machine."""


class RepRapReader:
    """config.g with what it takes in."""

    name: ClassVar[str] = "reprap"
    doc: ClassVar[str] = "RepRapFirmware's config.g of a linear delta, and config-override.g"
    settings: ClassVar[Mapping[str, Setting]] = {
        **SETTINGS,
        "logs": Setting("files beside it: logs, bed.g, height maps, commas between", None),
        "workspace.radius": Setting("radius of the bed, where the file does not say it"),
    }

    @classmethod
    def recognises(cls, text: str) -> bool:
        """Whether it has commands that only this firmware has, or is a height map of its."""
        return text.startswith(FIRST_WORDS) or only_reprap(text)

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """The delta. Raises `MachineFileError` with everything that is wrong."""
        _require_configuration(file)

        def beside(name: str) -> tuple[str, str] | None:
            try:
                others = file.included(name)
            except ReadingError:
                return None
            return (str(others[0].path), others[0].text) if others else None

        configured = numbers(file.text, str(file.path), beside)
        _require_delta(file, configured)
        held, problems = configured.held, configured.problems
        if not problems:
            problems += [file.problem(fault) for fault in require(held, NEEDED)]
        refuse(problems)
        refuse(list(bridged(held, "M665 R", {n: v.value for n, v in held.items() if " L" in n})))
        rods = rods_of(settings)
        towers = _towers(held, settings)
        points = _points(file, settings, held)
        delta = towers.file("Linear delta", f"RepRapFirmware's {file.path.name}.", rods)
        measured = measurements_text(
            points.points,
            delta.name,
            offset=_offset(held),
            tilt=_tilt(held),
        )
        return ControllerReading(
            delta.text(),
            measured,
            {name: number.text for name, number in held.items()},
            (
                *delta.assumptions(),
                *_assumptions(held),
                *((ASSUMED_PROBE,) if points.points else ()),
            ),
            (*_lost(held, configured), *points.unused),
        )


def _require_configuration(file: ControllerFile) -> None:
    """Refuse a height map or a log by itself."""
    every = {command.code for command in commands(file.text)}
    if file.text.startswith(FIRST_WORDS) or not every & {
        "M665",
        "M666",
        "M669",
        "M667",
        "M98",
        "M501",
    }:
        name = file.path.name
        raise MachineFileError(
            file.problem(
                Fault(
                    "import-incomplete",
                    "heights of a bed, or a macro, but no machine",
                    "no M665",
                    "config.g, with M665",
                    f"truepose import config.g --set logs={name}",
                )
            )
        )


def _require_delta(file: ControllerFile, said: RepRapNumbers) -> None:
    """Decline other kinematics, and more towers, by name."""
    kind = said.kind
    if kind is None or (kind.text not in DELTA):
        name = "no M665: a Cartesian machine" if kind is None else KINDS.get(kind.text, kind.text)
        message = "truepose imports a linear delta of RepRapFirmware's, and no other machine"
        if kind is None:
            fault = Fault("import-declined", message, name, "M665, or M669 K3")
            raise MachineFileError(file.problem(fault))
        shown = f"{kind.name} {'S' if kind.name == 'M667' else 'K'}{kind.text}, {name}"
        fault = Fault("import-declined", message, shown, "M665, or M669 K3")
        raise MachineFileError(fault.at(kind.file, kind.line))
    more = said.held.get(f"M665 L{MOST_RODS}")
    if more is not None:
        raise MachineFileError(
            more.problem(
                "import-declined",
                "a delta of more than three towers is over-constrained, which is not imported",
                "one rod length, or three",
            )
        )
    if "M665 L1" in said.held and "M665 L2" not in said.held:
        raise MachineFileError(
            said.held["M665 L1"].problem("import-value", "two rods", "one rod length, or three")
        )


def _of(held: Mapping[str, Held], name: str) -> Decimal:
    return held[name].value if name in held else Decimal(0)


def _tilt(held: Mapping[str, Held]) -> Place:
    """What is added to the carriages' heights for each mm of x and of y."""
    return _of(held, "M666 A") / 100, _of(held, "M666 B") / 100


def _offset(held: Mapping[str, Held]) -> Place:
    return _of(held, "G31 X"), _of(held, "G31 Y")


def _towers(held: Mapping[str, Held], settings: Mapping[str, float | str]) -> Towers:
    radius = held["M665 R"].value
    first = held["M665 L0"].value
    rods = [held[name].value if name in held else first for name in ("M665 L1", "M665 L2")]
    height = held["M665 H"].value if "M665 H" in held else 2 * first
    given = settings.get("workspace.radius")
    said = held.get("M665 B")
    reach = None if said is None else said.value
    if given is not None:
        reach = Decimal(f"{float(given) * 1000.0:.12g}")
    return Towers(
        (radius, radius, radius),
        (
            ANGLES[0] + _of(held, "M665 X"),
            ANGLES[1] + _of(held, "M665 Y"),
            ANGLES[2] + _of(held, "M665 Z"),
        ),
        (first, rods[0], rods[1]),
        (
            height + _of(held, "M666 X"),
            height + _of(held, "M666 Y"),
            height + _of(held, "M666 Z"),
        ),
        reach if reach is not None and reach > 0 else None,
    )


def _points(
    file: ControllerFile, settings: Mapping[str, float | str], held: Mapping[str, Held]
) -> ProbedPoints:
    """The heights in the file, in logs and in height maps; places of points from any of them."""
    logs = [file, *logs_beside(file, str(settings.get("logs", "")))]
    places: dict[int, Place] = {}
    for log in logs:
        places = points_asked(log.text, places)
    points = ProbedPoints()
    offset = _offset(held)
    for log in logs:
        name = str(log.path)
        if log.text.startswith(FIRST_WORDS):
            points += height_map(log.text, name, offset)
        else:
            points += logged(log.text, name, places, offset)
    return points


def _assumptions(held: Mapping[str, Held]) -> Iterator[Assumption]:
    if "M665 H" not in held:
        yield Assumption(
            "M665 H is not said: carriages are taken to go up to twice the rods' length",
            "drive.*.travel",
        )
    yield Assumption(
        "axis skew (M556), a height map (G29 S1), tool offsets (G10) and baby steps (M290) are off",
        "drive",
    )


def _lost(held: Mapping[str, Held], said: RepRapNumbers) -> Iterator[str]:
    a, b = _of(held, "M666 A"), _of(held, "M666 B")
    if a or b:
        yield (
            f"the bed's tilt, M666 A{a} B{b}: z of this machine is that of the guideways, so that "
            f"a command x y z of the firmware is x, y, z + ({a} x {b:+} y) / 100 here; "
            "measurements are written so, programs must be"
        )
    for name in said.missing:
        yield f"{name}, which is taken in and is not beside the file"


__all__ = ["RepRapReader"]
