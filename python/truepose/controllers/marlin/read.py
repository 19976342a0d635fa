"""Marlin's M503, M665 and M666, or Configuration.h, as a linear delta; its logs as measurements.

Towers X, Y and Z stand at 210, 330 and 90 degrees and their trims; each carriage is at its endstop
where the tool, at x = y = 0, is at H less the bed probe's z offset and less the tower's M666. A and
C of M665 are rod trims, and with them B; B alone is the radius on which G33 of Marlin 1.1 probes.
Sources: https://marlinfw.org/docs/gcode/M665.html, M666.html, M851.html, and pull request 18423.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from typing import ClassVar

from truepose.controllers._commands import commands, only_reprap
from truepose.controllers._decimals import numbers_of
from truepose.controllers._delta_file import EFFECTOR, SETTINGS, SPACING, rods_of
from truepose.controllers._probed import (
    ASSUMED_PROBE,
    Probed,
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
from truepose.controllers._towers import Held, Three, Towers, bridged, require
from truepose.controllers.marlin._definitions import Definitions, definitions
from truepose.controllers.marlin._logs import Bounds, logged, mesh
from truepose.controllers.marlin._numbers import (
    INCH,
    Session,
    in_doubt,
    of_commands,
    of_definitions,
)
from truepose.errors import Fault, MachineFileError, Problem
from truepose.files.wording import counted

ANGLES = (210, 330, 90)
NEEDED = {"M665 L": "length of the diagonal rods", "M665 R": "delta radius"}

OTHERS = (
    *("COREXY", "COREXZ", "COREYX", "COREYZ", "COREZX", "COREZY", "MARKFORGED_XY", "MARKFORGED_YX"),
    *(
        "MORGAN_SCARA",
        "MP_SCARA",
        "AXEL_TPARA",
        "POLARGRAPH",
        "POLAR",
        "FIVE_BAR",
        "FOAMCUTTER_XYUV",
    ),
)
"""Kinematics of Configuration.h that are no delta."""

_DEFINES = re.compile(
    r"^\s*#\s*define\s+(?:DELTA\w*|CONFIGURATION_H\w*|MOTHERBOARD|[XYZ]_BED_SIZE)\b", re.M
)
_PRINTED = re.compile(
    r"echo:\s*(?:;|M92|M203|M665|G21|G20)|Bed X:|Leveling Grid|G33 Auto Cal", re.I
)


class MarlinReader:
    """A dump of M503, M665 and M666 as they are sent, or Configuration.h."""

    name: ClassVar[str] = "marlin"
    doc: ClassVar[str] = "M503's output, M665 and M666, or Configuration.h of a linear delta"
    settings: ClassVar[Mapping[str, Setting]] = {
        **SETTINGS,
        "logs": Setting("files beside it with what G29, G30 or G33 printed, commas between", None),
        "g29.bounds": Setting("where G29's grid lies: left, right, front, back, mm", None),
        "g33.radius": Setting("radius on which G33 probed"),
        "workspace.radius": Setting("radius of the bed, where the file does not say it"),
    }

    @classmethod
    def recognises(cls, text: str) -> bool:
        """Whether it has definitions of Marlin's, what Marlin prints, or an M665 of no other's."""
        if _DEFINES.search(text):
            return True
        if only_reprap(text):
            return False
        return bool(_PRINTED.search(text)) or any(
            command.code == "M665" for command in commands(text)
        )

    @classmethod
    def read(cls, file: ControllerFile, settings: Mapping[str, float | str]) -> ControllerReading:
        """The delta. Raises `MachineFileError` with everything that is wrong."""
        known: Definitions | None = None
        session = Session()
        if _DEFINES.search(file.text):
            known = definitions(file.text)
            _require_delta(file, known)
            session.held, session.problems = of_definitions(known, str(file.path))
        else:
            session = of_commands(file.text, str(file.path))
            session.problems += _calibrated_since(file, session.held)
        held, problems = session.held, session.problems
        missing = list(require(held, NEEDED))
        if missing and not problems:
            problems += [file.problem(fault) for fault in _of_missing(missing, known)]
        refuse(problems)
        refuse(_impossible(held))
        rods = rods_of(_with_effector(held, settings))
        towers = _towers(held, settings)
        points, unused = _points(file, settings, session)
        delta = towers.file("Linear delta", f"Marlin's {file.path.name}.", rods)
        return ControllerReading(
            delta.text(),
            measurements_text(points, delta.name, offset=_offset(held)),
            {name: number.text for name, number in held.items()},
            (
                *delta.assumptions(),
                *_assumptions(held, known, session.scale),
                *((ASSUMED_PROBE,) if points else ()),
            ),
            unused,
        )


def _require_delta(file: ControllerFile, known: Definitions) -> None:
    """Decline a Configuration.h of another machine by its name."""
    if "DELTA" in known.of:
        return
    others = [name for name in OTHERS if name in known.of]
    line = known.of[others[0]].line if others else None
    raise MachineFileError(
        file.problem(
            Fault(
                "import-declined",
                "truepose imports a linear delta of Marlin's, and no other machine",
                f"#define {others[0]}" if others else "no #define DELTA: a Cartesian machine",
                "#define DELTA",
            ),
            line,
        )
    )


def _of_missing(missing: Sequence[Fault], known: Definitions | None) -> Iterator[Fault]:
    for fault in missing:
        hint = "send M503 to the printer: what it prints has M665" if known is None else None
        yield Fault(fault.code, fault.message, fault.found, fault.expected, hint)


def _impossible(held: Mapping[str, Held]) -> Iterator[Problem]:
    """What no delta has, and what Marlin refuses."""
    rods, radius = _rods(held), _radius(held)
    if min(radius) <= 0:
        yield held["M665 R"].problem("not-positive", "this is not above zero", "mm, above zero")
    elif min(rods) <= held["M665 R"].value:
        yield from bridged(held, "M665 R", {"M665 L": rods})
    elif any(rod <= out for rod, out in zip(rods, radius, strict=True)):
        yield held["M665 L"].problem(
            "import-value",
            "a rod that does not reach from its tower to the middle",
            f"mm, longer than the delta radius with its trim, {max(radius)}",
        )
    for letter in "XYZ":
        adjusted = held.get(f"M666 {letter}")
        if adjusted is not None and adjusted.value > 0:
            yield adjusted.problem(
                "import-value",
                "Marlin takes no endstop adjustment above zero",
                "zero, or how far below its endstop the carriage begins, negative",
            )


def _three(held: Mapping[str, Held], names: Sequence[str]) -> Three:
    """Three values, 0 for what is not there."""
    a, b, c = (held[name].value if name in held else Decimal(0) for name in names)
    return a, b, c


def has_rod_trims(held: Mapping[str, Held]) -> bool:
    """Whether B of M665 is a rod's trim, as it is beside A and C."""
    return "M665 A" in held and "M665 C" in held


def _rods(held: Mapping[str, Held]) -> Three:
    trims = _three(held, ["M665 A", "M665 B", "M665 C"]) if has_rod_trims(held) else None
    rod = held["M665 L"].value
    return (rod, rod, rod) if trims is None else (rod + trims[0], rod + trims[1], rod + trims[2])


def _radius(held: Mapping[str, Held]) -> Three:
    a, b, c = _three(held, [f"DELTA_RADIUS_TRIM_TOWER {tower}" for tower in "ABC"])
    out = held["M665 R"].value
    return out + a, out + b, out + c


def _offset(held: Mapping[str, Held]) -> tuple[Decimal, Decimal]:
    return _three(held, ["M851 X", "M851 Y", "M851 Z"])[:2]


def _towers(held: Mapping[str, Held], settings: Mapping[str, float | str]) -> Towers:
    turned = _three(held, ["M665 X", "M665 Y", "M665 Z"])
    lowered = _three(held, ["M666 X", "M666 Y", "M666 Z"])
    probe = _three(held, ["M851 X", "M851 Y", "M851 Z"])[2]
    height = held["M665 H"].value if "M665 H" in held else 2 * held["M665 L"].value
    reach = held.get("DELTA_PRINTABLE_RADIUS")
    given = settings.get("workspace.radius")
    return Towers(
        _radius(held),
        (ANGLES[0] + turned[0], ANGLES[1] + turned[1], ANGLES[2] + turned[2]),
        _rods(held),
        (
            height - probe - lowered[0],
            height - probe - lowered[1],
            height - probe - lowered[2],
        ),
        _mm(given) if given is not None else None if reach is None else reach.value,
    )


def _mm(value: float | str) -> Decimal:
    """A setting's length, m, in mm."""
    return Decimal(f"{float(value) * 1000.0:.12g}")


def _with_effector(
    held: Mapping[str, Held], settings: Mapping[str, float | str]
) -> Mapping[str, float | str]:
    """The settings, and the effector's radius where Configuration.h has it and nobody else."""
    offset = held.get("DELTA_EFFECTOR_OFFSET")
    if offset is None or SPACING not in settings or EFFECTOR in settings:
        return settings
    return {**settings, EFFECTOR: float(offset.value) / 1000.0}


def _points(
    file: ControllerFile, settings: Mapping[str, float | str], session: Session
) -> tuple[tuple[Probed, ...], tuple[str, ...]]:
    """The heights in the file and in its logs, and in sentences what of them cannot be used."""
    held, scale = session.held, session.scale
    radius = None
    if "g33.radius" in settings:
        radius = _mm(settings["g33.radius"])
    elif "M665 B" in held and not has_rod_trims(held):
        radius = held["M665 B"].value
    bounds: Bounds | None = None
    if "g29.bounds" in settings:
        values = numbers_of(str(settings["g29.bounds"]))
        if len(values) != 4 or values[0] >= values[1] or values[2] >= values[3]:
            raise MachineFileError(
                file.problem(
                    Fault(
                        "bad-setting",
                        "--set g29.bounds cannot be read",
                        repr(settings["g29.bounds"]),
                        "left, right, front and back of the grid, mm",
                        "--set g29.bounds=-70,70,-70,70",
                    )
                )
            )
        bounds = (values[0], values[1], values[2], values[3])
    found = ProbedPoints()
    if not _DEFINES.search(file.text):
        found += _with_these_numbers(
            logged(file.text, str(file.path), scale, radius, bounds), session.changed
        )
    for other in logs_beside(file, str(settings.get("logs", ""))):
        found += logged(other.text, str(other.path), scale, radius, bounds)
    if not found.points:
        found += mesh(file.text, str(file.path), scale, bounds)
    return found.points, found.unused


def _with_these_numbers(points: ProbedPoints, changed: int) -> ProbedPoints:
    """What was probed after the line in which the numbers changed for the last time."""
    kept = tuple(point for point in points.points if point.line > changed)
    out = len(points.points) - len(kept)
    if not out:
        return points
    why = f"{counted(out, 'height')} from before line {changed}, where the numbers changed"
    return ProbedPoints(kept, (*points.unused, why))


def _calibrated_since(file: ControllerFile, held: Mapping[str, Held]) -> Iterator[Problem]:
    """A G33 that was sent after the numbers were printed: the controller holds others now."""
    for asked in commands(file.text):
        printed = asked.echoed or "A" in asked.words  # "G33 Auto Calibrate"
        if asked.code != "G33" or printed or asked.words.get("V") == "0":
            continue
        radius = held.get("M665 R")
        if radius is not None and asked.line > radius.line:
            fault = Fault(
                "import-value",
                "G33 changed the numbers after they were printed",
                "no M665 below it",
                "what M503 prints after it",
                "send M503 once more; G33 V0 changes nothing",
            )
            yield file.problem(fault, asked.line)


def _assumptions(
    held: Mapping[str, Held], known: Definitions | None, scale: Decimal
) -> Iterator[Assumption]:
    if "M665 H" not in held:
        yield Assumption(
            "M665 H is not said: carriages are taken to go up to twice the rods' length",
            "drive.*.travel",
        )
    if "M851 Z" in held and held["M851 Z"].value != 0:
        yield Assumption(
            f"Marlin homes to H less the bed probe's z offset, M851 Z{held['M851 Z'].text}",
            "drive.*.travel",
        )
    if known is None and not has_rod_trims(held):
        yield Assumption(
            "the firmware is older than 2.0.6: M665 has no A and C, so B is no rod's trim; 1.1.9 "
            "and early 2.0 stop 0.1 mm farther from an endstop than M666 says",
            "drive.*.travel",
        )
    if known is None:
        yield Assumption(
            "DELTA_RADIUS_TRIM_TOWER is 0: it stands in Configuration.h and is not printed",
            "drive.*.origin",
        )
    elif doubts := in_doubt(known):
        shown = ", ".join(f"{name}, line {line}" for name, line in doubts.items())
        yield Assumption(f"conditions that are not understood hold: of {shown}", "drive")
    if scale == INCH:
        yield Assumption("M503 in inches divides the towers' angles by 25.4 too", "drive.*.origin")


__all__ = ["MarlinReader"]
