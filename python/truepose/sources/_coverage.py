"""Whether a table of measured positions reaches over a drive's whole travel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from truepose.errors import Fault, Problem
from truepose.files.data_file import DataTable

if TYPE_CHECKING:
    from truepose.machine import Drive

ROUNDING = 1e-12
"""Of the farther end of the travel: a position so near to an end is at it, for the same number may
round differently in the units of two files."""


def uncovered(drive: Drive, table: DataTable, column: str) -> list[Problem]:
    """A problem where the joint coordinates in `column` do not span the drive's travel."""
    positions, (start, stop) = table.numbers[column], drive.travel
    first, last = int(np.argmin(positions)), int(np.argmax(positions))
    slack = ROUNDING * max(abs(start), abs(stop))
    short = positions[first] > start + slack
    if not short and positions[last] >= stop - slack:
        return []
    unit = table.units[column]
    wanted = " to ".join(f"{float(unit.to_file(end)):.10g}" for end in (start, stop))
    return [
        table.problem(
            Fault(
                "travel-not-covered",
                f"the table does not reach over the travel of drive {drive.name}",
                found=f"{table.shown(column, first)} to {table.shown(column, last)}",
                expected=f"the whole travel, {wanted} {unit.label}",
                hint="nothing is guessed beyond the last position: measure on, or shorten the "
                "travel",
            ),
            row=first if short else last,
            column=column,
        )
    ]
