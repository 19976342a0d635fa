"""Heights of the bed in what Marlin prints: G30, G29 with its grid, and G33.

A height is the commanded z of the nozzle at which the probe touches, its own offset taken off. The
grid of G29 is printed without its coordinates: they are known where the command in the log has its
bounds (L, R, F, B, or H), or who imports it says them. On a delta Marlin fills in what lies outside
of its circle, unless it leaves them marked; what may be filled in is left out. G29 V4 prints each
point as it is probed, with its coordinates. G33 probes in the middle and on a circle at the towers'
angles; with P4 and more it prints means over several places, with P3 one in the middle; its radius
is printed nowhere but by Marlin 1.1, as M665 B.
Sources: https://marlinfw.org/docs/gcode/G029-abl-bilinear.html, G030.html and G033.html.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from decimal import Decimal

from truepose.controllers._commands import FirmwareCommand, Line, command, lines
from truepose.controllers._decimals import decimal_of
from truepose.controllers._probed import Probed, ProbedPoints
from truepose.files.wording import counted

_POINT = re.compile(r"Bed\s++X:\s*+(\S++)\s++Y:\s*+(\S++)\s++Z:\s*+(\S++)", re.IGNORECASE)
_ROW = re.compile(r"(\d{1,3})((?:\s++(?:[+-]?\d*\.\d+|=+|nan))+)\s*", re.IGNORECASE)
_SAYS = re.compile(r"G\d++ [A-Za-z]{2}")  # "G29 Auto Bed Leveling"
_AT = re.compile(r"\b(c|x|y|z|yz|zx|xy)\s*+:\s*+([+-]?\d++\.\d++)")

GRID = "Bilinear Leveling Grid"
ANGLES = {"x": 210, "y": 330, "z": 90, "yz": 30, "zx": 150, "xy": 270}
"""Where G33 probes, degrees about z."""

HEADING = 3
"""Lines of a grid's heading at most, before its rows."""

MOST = 200
"""Points along a side of a mesh."""

UNPROBED = "====="


Bounds = tuple[Decimal, Decimal, Decimal, Decimal]


def logged(
    text: str,
    file: str,
    scale: Decimal = Decimal(1),
    radius: Decimal | None = None,
    bounds: Bounds | None = None,
) -> ProbedPoints:
    """The heights in a log.

    `scale`: mm of a unit of it. `radius`: on which G33 probes, mm, where that is known. `bounds`:
    left, right, front and back of the grid of G29, mm, where its command does not have them.
    """
    every = list(lines(text))
    points: list[Probed] = []
    unused: list[str] = []
    asked: FirmwareCommand | None = None
    alone = True  # the grid's points were not printed one by one
    for at, line in enumerate(every):
        if line.text.lower().startswith("g33 auto"):
            kept, why = _circle(_below(every, at), asked, file, scale, radius)
            points += kept
            unused += why
        elif _SAYS.match(line.text) or (line.echoed and line.text.startswith("G29 W")):
            continue
        elif (found := command(line)) is not None and found.code in ("G29", "G30", "G33"):
            asked, alone = found, True
        elif match := _POINT.search(line.text):
            alone = False
            points += _points([(match[1], match[2], match[3], line)], file, scale)
        elif line.text.startswith(GRID):
            rows = list(_grid(_below(every, at)))
            if alone:
                kept, why = _placed(rows, asked, file, scale, bounds)
                points += kept
                unused += why
    return ProbedPoints(tuple(points), tuple(unused))


def _points(
    found: Sequence[tuple[str, str, str, Line]], file: str, scale: Decimal
) -> Iterator[Probed]:
    for x, y, z, line in found:
        numbers = [decimal_of(text) for text in (x, y, z)]
        given = [number * scale for number in numbers if number is not None]
        if len(given) == 3:
            yield Probed(given[0], given[1], given[2], file, line.number)


def _below(every: Sequence[Line], at: int) -> Iterator[Line]:
    """The lines after one, without a copy of them for each."""
    return (every[number] for number in range(at + 1, len(every)))


def _grid(below: Iterable[Line]) -> Iterator[tuple[list[str], Line]]:
    """The rows of heights below a grid's heading; the first is of the smallest y."""
    begun = False
    for number, line in enumerate(below):
        match = _ROW.fullmatch(line.text)
        if match is not None:
            begun = True
            yield match[2].split(), line
        elif begun or number == HEADING:
            return


def mesh(
    text: str, file: str, scale: Decimal = Decimal(1), bounds: Bounds | None = None
) -> ProbedPoints:
    """The mesh of bilinear levelling as M503 prints it, a G29 W for each point; as `logged`."""
    cells: dict[tuple[int, int], tuple[str, Line]] = {}
    for line in lines(text):
        found = command(line) if line.echoed and line.text.startswith("G29 W") else None
        if found is None:
            continue
        place = [decimal_of(found.words.get(letter, "")) for letter in "IJ"]
        column, row = (-1 if at is None else int(at) for at in place)
        if 0 <= column < MOST and 0 <= row < MOST:
            cells[column, row] = (found.words.get("Z", ""), line)
    if not cells:
        return ProbedPoints()
    columns, count = (1 + max(cell[at] for cell in cells) for at in (0, 1))
    any_line = next(iter(cells.values()))[1]
    rows = []
    for row in range(count):
        of_row = [cells.get((column, row), (UNPROBED, any_line)) for column in range(columns)]
        last = max((line for _, line in of_row), key=lambda line: line.number)
        rows.append(([height for height, _ in of_row], last))
    points, unused = _placed(rows, None, file, scale, bounds)
    return ProbedPoints(tuple(points), tuple(unused))


def _placed(
    rows: Sequence[tuple[list[str], Line]],
    asked: FirmwareCommand | None,
    file: str,
    scale: Decimal,
    given: Bounds | None,
) -> tuple[list[Probed], list[str]]:
    """The points of a grid, where the command, or who imports it, says how far it reaches."""
    bounds = _bounds(asked)
    if bounds is None and given is not None:
        left, right, front, back = given
        bounds = left / scale, right / scale, front / scale, back / scale
    widths = {len(cells) for cells, _ in rows}
    if len(rows) < 2 or len(widths) != 1 or widths == {1}:
        return [], ["a grid of G29 that is not whole"] if rows else []
    if bounds is None:
        return [], [
            f"a grid of G29 with {len(rows)} rows: nothing says where it lies. G29 with L, R, F "
            "and B does, and so does --set g29.bounds=left,right,front,back; G29 V4 prints every "
            "point"
        ]
    left, right, front, back = bounds
    columns = widths.pop()
    # Where a point is marked as not probed, none was filled in.
    whole = all(decimal_of(cell) is not None for cells, _ in rows for cell in cells)
    outer = min(right - left, back - front) / 2 * Decimal("1.001")
    middle = ((left + right) / 2, (front + back) / 2)
    found, out = [], 0
    for row, (cells, line) in enumerate(rows):
        for column, cell in enumerate(cells):
            x = left + (right - left) * column / (columns - 1)
            y = front + (back - front) * row / (len(rows) - 1)
            if decimal_of(cell) is None:
                continue
            if whole and (x - middle[0]) ** 2 + (y - middle[1]) ** 2 > outer**2:
                out += 1
                continue
            found.append((f"{x:.6f}", f"{y:.6f}", cell, line))
    why = [
        f"{counted(out, 'point')} of a grid of G29 outside of its circle, which may be filled in"
    ]
    return list(_points(found, file, scale)), why if out else []


def _bounds(asked: FirmwareCommand | None) -> Bounds | None:
    """Left, right, front and back of the grid of a G29, in its unit."""
    if asked is None or asked.code != "G29":
        return None
    if (width := decimal_of(asked.words.get("H", ""))) is not None:
        half = width / 2
        return -half, half, -half, half
    values = [decimal_of(asked.words.get(letter, "")) for letter in "LRFB"]
    given = [value for value in values if value is not None]
    if len(given) < 4 or given[0] >= given[1] or given[2] >= given[3]:
        return None
    return given[0], given[1], given[2], given[3]


def _circle(
    below: Iterable[Line],
    asked: FirmwareCommand | None,
    file: str,
    scale: Decimal,
    radius: Decimal | None,
) -> tuple[list[Probed], list[str]]:
    """What a G33 that changed nothing found in the middle and on its circle."""
    heights: dict[str, tuple[str, Line]] = {}
    for line in below:
        if not line.text.startswith("."):
            if heights or command(line) is not None or line.text.lower() == "ok":
                break
            continue
        for name, height in _AT.findall(line.text):
            heights.setdefault(name, (height, line))
    if not heights:
        return [], []
    count = asked.words.get("P", "") if asked is not None and asked.code == "G33" else ""
    dry = asked is not None and asked.words.get("V") == "0"
    if not dry:
        return [], [
            "heights of a G33 that calibrated: they are of other numbers (G33 V0 keeps them)"
        ]
    if count not in ("1", "2", "3"):
        return [], ["heights of G33: without P2 or P3 they are means over several places"]
    if count != "1" and radius is None:
        return [], ["heights of G33: nothing says on which radius, as --set g33.radius=80 does"]
    found = []
    for name, (height, line) in heights.items():
        if name == "c":
            if count != "3":
                found.append(("0", "0", height, line))
            continue
        assert radius is not None
        angle = math.radians(ANGLES[name])
        out = radius / scale
        x, y = (f"{out * Decimal(turn(angle)):.4f}" for turn in (math.cos, math.sin))
        found.append((x, y, height, line))
    return list(_points(found, file, scale)), []


__all__ = ["Bounds", "logged", "mesh"]
