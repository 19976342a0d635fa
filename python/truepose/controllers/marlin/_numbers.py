"""The numbers of a Marlin delta by the words of M665, M666 and M851, wherever they stand.

From what M503 prints, from commands that were sent, or from Configuration.h. In inch mode M503
divides every number of M665 by 25.4, the angles too; a command that is typed has them in degrees.
Sources: https://marlinfw.org/docs/gcode/M665.html, M666.html, M851.html, M503.html, G020.html.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from decimal import Decimal

from truepose.controllers._commands import FirmwareCommand, commands
from truepose.controllers._decimals import decimal_of, plain
from truepose.controllers._towers import Held
from truepose.controllers.marlin._definitions import Definitions, NotComputedError
from truepose.errors import Problem

INCH = Decimal("25.4")

WORDS = {"M665": "LRHSXYZABC", "M666": "XYZ", "M851": "XYZ", "M92": "XYZ", "M206": "Z"}
"""Commands whose words count, and the words."""

ANGLES = {"M665 X", "M665 Y", "M665 Z"}
BARE = {"M665 S", "M92 X", "M92 Y", "M92 Z"}
"""Words that are no lengths."""

LISTS = {
    "DELTA_ENDSTOP_ADJ": "M666",
    "DELTA_TOWER_ANGLE_TRIM": "M665",
    "NOZZLE_TO_PROBE_OFFSET": "M851",
    "DEFAULT_AXIS_STEPS_PER_UNIT": "M92",
}
"""Names of Configuration.h that are a list for X, Y and Z -> the command that prints it."""

SINGLE = {
    "DELTA_DIAGONAL_ROD": "M665 L",
    "DELTA_RADIUS": "M665 R",
    "DELTA_HEIGHT": "M665 H",
    "MANUAL_Z_HOME_POS": "M665 H",
    "PRINTABLE_RADIUS": "DELTA_PRINTABLE_RADIUS",
    "DELTA_PRINTABLE_RADIUS": "DELTA_PRINTABLE_RADIUS",
    "DELTA_EFFECTOR_OFFSET": "DELTA_EFFECTOR_OFFSET",
    "DELTA_CALIBRATION_RADIUS": "DELTA_CALIBRATION_RADIUS",
    "X_PROBE_OFFSET_FROM_EXTRUDER": "M851 X",
    "Y_PROBE_OFFSET_FROM_EXTRUDER": "M851 Y",
    "Z_PROBE_OFFSET_FROM_EXTRUDER": "M851 Z",
}
"""Names that are one number -> the word that prints it, or the name; of two the first counts."""

TRIMS = {"DELTA_DIAGONAL_ROD_TRIM_TOWER": "M665 rod", "DELTA_RADIUS_TRIM_TOWER": "radius trim"}
"""Lists for the towers; older files have a name for each, ending in _1, _2 and _3."""

PROBES = (
    *("FIX_MOUNTED_PROBE", "NOZZLE_AS_PROBE", "BLTOUCH", "Z_PROBE_SERVO_NR", "Z_PROBE_ALLEN_KEY"),
    *("Z_PROBE_SLED", "SOLENOID_PROBE", "SENSORLESS_PROBING", "TOUCH_MI_PROBE", "MAGLEV4"),
    *("RACK_AND_PINION_PROBE", "MAG_MOUNTED_PROBE", "BIQU_MICROPROBE_V1", "BIQU_MICROPROBE_V2"),
    *("BD_SENSOR", "Z_SERVO_ENDSTOP"),
)
"""Any of these makes a bed probe, without which its offset is not used."""


@dataclass
class Session:
    """What commands say: the numbers by their words, problems, mm of a unit.

    A word counts until it stands again. `changed`: the line of the last one that said another
    geometry than before; what was probed above it was probed with another.
    """

    held: dict[str, Held] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    scale: Decimal = Decimal(1)
    changed: int = 0


def of_commands(text: str, file: str) -> Session:
    """The numbers of commands, printed or sent."""
    session = Session()
    for command in commands(text):
        if command.code in ("G20", "G21"):
            session.scale = INCH if command.code == "G20" else Decimal(1)
        elif command.code in WORDS:
            for word in _words(command, file, session.scale):
                if isinstance(word, Problem):
                    session.problems.append(word)
                    continue
                before = session.held.get(word.name)
                if before is not None and before.value != word.value and word.name not in BARE:
                    session.changed = word.line
                session.held[word.name] = word
    return session


def _words(command: FirmwareCommand, file: str, scale: Decimal) -> Iterator[Held | Problem]:
    for letter, text in command.words.items():
        name = f"{command.code} {letter}"
        if letter not in WORDS[command.code]:
            continue
        number = decimal_of(text)
        if number is None:
            yield Problem(
                "import-value",
                f"{name} cannot be read",
                file,
                command.line,
                found=repr(text),
                expected="a number",
            )
            continue
        divided = name in ANGLES and command.echoed
        value = number if name in BARE or (name in ANGLES and not divided) else number * scale
        yield Held(name, text, value, file, command.line)


def of_definitions(known: Definitions, file: str) -> tuple[dict[str, Held], list[Problem]]:
    """The numbers of a Configuration.h by the same words, its own names where there is none."""
    held: dict[str, Held] = {}
    problems: list[Problem] = []
    for name, word in SINGLE.items():
        if word in held or name not in known.of:
            continue
        for value in _computed(known, name, problems, file, single=True):
            held[word] = Held(word, plain(value), value, file, known.of[name].line)
    for name, code in LISTS.items():
        if name in known.of:
            values = _computed(known, name, problems, file)
            for letter, value in zip("XYZ", values, strict=False):
                word = f"{code} {letter}"
                held[word] = Held(word, plain(value), value, file, known.of[name].line)
    for name, word in TRIMS.items():
        for at, (line, value) in enumerate(_of_towers(known, name, problems, file)):
            key = f"M665 {'ABC'[at]}" if word == "M665 rod" else f"{name} {'ABC'[at]}"
            held[key] = Held(key, plain(value), value, file, line)
    if not any(probe in known.of for probe in PROBES):
        for letter in "XYZ":
            held.pop(f"M851 {letter}", None)
    return held, problems


def in_doubt(known: Definitions) -> dict[str, int]:
    """The names of those above whose `#define` stands under a condition that is not understood."""
    return {
        name: definition.doubt
        for name in (*SINGLE, *LISTS, *TRIMS)
        if (definition := known.of.get(name)) is not None and definition.doubt is not None
    }


def _of_towers(
    known: Definitions, name: str, problems: list[Problem], file: str
) -> list[tuple[int, Decimal]]:
    """A number for each tower, with its line: of a list, or of three names."""
    if name in known.of:
        line = known.of[name].line
        return [(line, value) for value in _computed(known, name, problems, file)[:3]]
    single = [f"{name}_{tower}" for tower in (1, 2, 3)]
    if not any(each in known.of for each in single):
        return []
    found = []
    for each in single:
        values = _computed(known, each, problems, file, single=True) if each in known.of else []
        line = known.of[each].line if each in known.of else 0
        found.append((line, values[0] if values else Decimal(0)))
    return found


def _computed(
    known: Definitions, name: str, problems: list[Problem], file: str, *, single: bool = False
) -> list[Decimal]:
    """The values of a name; none, and a problem, where they cannot be computed."""
    definition = known.of[name]
    try:
        values = [known.number(definition.text)] if single else known.numbers(definition.text)
        if all(decimal_of(f"{value:.12f}") is not None for value in values):
            return values
        reason = "a number of no size that anything has"
    except NotComputedError as failure:
        reason = str(failure)
    problems.append(
        Problem(
            "import-value",
            f"{name} cannot be computed: {reason}",
            file,
            definition.line,
            found=definition.text[:80] or "nothing",
            expected="a number" if single else "numbers, as { 0.0, 0.0, 0.0 }",
        )
    )
    return []


__all__ = ["INCH", "Session", "in_doubt", "of_commands", "of_definitions"]
