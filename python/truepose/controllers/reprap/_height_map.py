"""RepRapFirmware's heightmap.csv: a line of the firmware, of labels, of the grid, then heights.

Three versions of the labels were written; a height that was not probed is a `0` without a point,
in newer ones also an empty cell or a word. Source: https://docs.duet3d.com (G29, M374, M557).
"""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal

from truepose.controllers._decimals import decimal_of
from truepose.controllers._probed import LEVEL, Place, Probed, ProbedPoints
from truepose.errors import MachineFileError, Problem

FIRST_WORDS = "RepRapFirmware height map file"

LABELS = (
    ("xmin", "xmax", "ymin", "ymax", "radius", "spacing", "xnum", "ynum"),
    ("xmin", "xmax", "ymin", "ymax", "radius", "xspacing", "yspacing", "xnum", "ynum"),
    (
        *("axis0", "axis1", "min0", "max0", "min1", "max1"),
        *("radius", "spacing0", "spacing1", "num0", "num1"),
    ),
)
"""Labels of the grid, the oldest first."""

MOST_POINTS = 100_000


def height_map(text: str, file: str, offset: Place = LEVEL) -> ProbedPoints:
    """The heights of a map. `offset`: from the nozzle to the probe, which stood at its points.

    Raises `MachineFileError` (import-value).
    """
    lines = text.split("\n")
    rows = [
        (number, [cell.strip() for cell in line.split(",")])
        for number, line in enumerate(lines, start=1)
        if line.strip() and number > 1
    ]
    labels = rows[0] if rows else (1, [])
    if tuple(labels[1]) not in LABELS:
        raise _refused(
            file,
            labels[0],
            "the grid's labels are not known",
            ",".join(labels[1])[:80] or "nothing",
            "one of " + "; ".join(",".join(known) for known in LABELS),
        )
    if len(rows) < 2 or len(rows[1][1]) != len(labels[1]):
        raise _refused(
            file, labels[0] + 1, "the grid's line is not there", "nothing", "its numbers"
        )
    grid = dict(zip(labels[1], rows[1][1], strict=True))
    axes = (grid.get("axis0", "X"), grid.get("axis1", "Y"))
    if axes != ("X", "Y"):
        raise _refused(file, rows[1][0], "a map of other axes", "".join(axes), "X and Y")
    start = [_number(grid, word, file, rows[1][0]) for word in _words(grid, "min")]
    step = [_number(grid, word, file, rows[1][0]) for word in _words(grid, "spacing")]
    count = [_number(grid, word, file, rows[1][0]) for word in _words(grid, "num")]
    heights = rows[2:]
    if len(heights) != count[1] or any(len(cells) != count[0] for _, cells in heights):
        raise _refused(
            file,
            rows[1][0],
            "the heights are not as many as the grid has points",
            f"{len(heights)} rows of heights",
            f"{count[1]} rows of {count[0]}",
        )
    points = []
    for row, (number, cells) in enumerate(heights):
        for column, cell in enumerate(cells):
            height = decimal_of(cell)
            if cell == "0" or height is None:
                continue
            x, y = start[0] + column * step[0], start[1] + row * step[1]
            points.append(Probed(x - offset[0], y - offset[1], height, file, number))
    return ProbedPoints(tuple(points))


def _words(grid: Mapping[str, str], what: str) -> tuple[str, str]:
    """The labels of both axes: `xmin`, `ymin` or `min0`, `min1`; one spacing is of both."""
    if what == "spacing" and "spacing" in grid:
        return "spacing", "spacing"
    old = (f"x{what}", f"y{what}")
    return old if old[0] in grid else (f"{what}0", f"{what}1")


def _number(grid: Mapping[str, str], word: str, file: str, line: int) -> Decimal:
    value = decimal_of(grid[word])
    whole = word.strip("01xy") == "num"
    if value is None or (whole and not 0 < value <= MOST_POINTS):
        expected = f"a whole number up to {MOST_POINTS}" if whole else "a number"
        raise _refused(file, line, f"{word} of the grid cannot be read", grid[word], expected)
    return value


def _refused(file: str, line: int, message: str, found: str, expected: str) -> MachineFileError:
    return MachineFileError(
        Problem("import-value", message, file, line, found=found, expected=expected)
    )


__all__ = ["FIRST_WORDS", "height_map"]
