"""Heights of the bed in what RepRapFirmware prints: G30 S-1, and G32 or G30 with P.

A height is the commanded z of the nozzle at which the probe touches, its trigger height taken off.
`Stopped at height` is where the head stands; `bed probe heights` are those of the points P0, P1 and
so on of the last G30 with P each, most often in bed.g, to which the *probe* was brought. Sources:
https://docs.duet3d.com, G30, G31 and G32.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from decimal import Decimal

from truepose.controllers._commands import Line, command, lines
from truepose.controllers._decimals import decimal_of
from truepose.controllers._probed import LEVEL, Place, Probed, ProbedPoints
from truepose.files.wording import counted

_STOPPED = re.compile(r"Stopped at height\s++(\S++)\s*+mm", re.IGNORECASE)
_HEIGHTS = re.compile(r"(?:G32 )?bed probe heights:\s*+(.*+)", re.IGNORECASE)

_FAILED = re.compile(r"not set|failed|probe error")


def points_asked(text: str, before: Mapping[int, Place] | None = None) -> dict[int, Place]:
    """Where the points P of G30 lie, mm; `before`: known already, which later ones replace."""
    places = dict(before or {})
    for line in lines(text):
        asked = command(line)
        if asked is None or asked.code != "G30" or "P" not in asked.words:
            continue
        number = decimal_of(asked.words["P"])
        x, y = (decimal_of(asked.words.get(letter, "")) for letter in "XY")
        if number is not None and x is not None and y is not None and 0 <= number < 1000:
            places[int(number)] = (x, y)
    return places


def logged(
    text: str, file: str, places: Mapping[int, Place], offset: Place = LEVEL
) -> ProbedPoints:
    """The heights in a log.

    `places`: of the points of G30 P, as far as they are known. `offset`: from the nozzle to the
    probe, mm.
    """
    points: list[Probed] = []
    unused: list[str] = []
    here: dict[str, Decimal | None] = {"X": None, "Y": None}
    known = dict(places)
    relative = False
    for line in lines(text):
        asked = command(line)
        if match := _HEIGHTS.match(line.text):
            kept, why = _of_points(match[1], line, file, known, offset)
            points += kept
            unused += why
        elif asked is not None:
            if asked.code == "G30":
                known = points_asked(line.text, known)
            elif asked.code in ("G90", "G91"):
                relative = asked.code == "G91"
            elif asked.code in ("G0", "G1"):
                for letter in "XY":
                    if letter in asked.words:
                        here[letter] = None if relative else decimal_of(asked.words[letter])
            elif asked.code == "G28":
                here = {"X": None, "Y": None}
        elif match := _STOPPED.search(line.text):
            height, x, y = decimal_of(match[1]), here["X"], here["Y"]
            if height is None:
                continue
            if x is None or y is None:
                unused.append(f"a height of line {line.number}: nothing says where the head stands")
                continue
            points.append(Probed(x, y, height, file, line.number))
    return ProbedPoints(tuple(points), tuple(unused))


def _of_points(
    heights: str, line: Line, file: str, known: Mapping[int, Place], offset: Place
) -> tuple[list[Probed], list[str]]:
    """The heights of points P0, P1, ...; what failed or was not set has none."""
    cells = _FAILED.sub("-", heights.split(",")[0]).split()
    missing = [number for number in range(len(cells)) if number not in known]
    if missing:
        return [], [
            f"{counted(len(cells), 'height')} of line {line.number}: nothing says where "
            f"P{missing[0]} lies (its G30 P X Y stands in bed.g)"
        ]
    found = []
    for number, cell in enumerate(cells):
        if (height := decimal_of(cell)) is not None:
            x, y = known[number]
            found.append(Probed(x - offset[0], y - offset[1], height, file, line.number))
    return found, []


__all__ = ["logged", "points_asked"]
