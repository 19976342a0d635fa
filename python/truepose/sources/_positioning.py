"""A measured positioning table, evaluated as ISO 230-2:2014 does.

At each target position and for each direction of approach, over n runs:

    mean = sum(deviation) / n                 s = sqrt(sum((deviation - mean)^2) / (n - 1))

The standard's names: mean unidirectional positional deviation, and estimator of the
unidirectional positioning repeatability, which it expands with k = 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats
from truepose.errors import Fault, Problem
from truepose.files.data_file import Column, DataTable
from truepose.sources._coverage import uncovered

if TYPE_CHECKING:
    from truepose.machine import Drive, SourceBuilder

COVERAGE = 2.0
"""Expanded in standard deviations: the coverage factor of ISO 230-2:2014."""

FEWEST_RUNS = 2
"""Runs below which a spread has no estimate."""

DIRECTIONS = ("-", "+")

_COLUMNS = ("target", "direction", "deviation")


@dataclass(frozen=True, eq=False)
class PositioningTable:
    """Statistics at m targets, m or rad: `targets` (m,) ascending; `means` and `spreads` (2, m).

    The first row is of approaches in the direction -, the second of those in +.
    """

    targets: Floats
    means: Floats
    spreads: Floats

    def at(self, joint: Floats) -> tuple[Floats, Floats]:
        """Means and spreads (2, n) at joint coordinates (n,), on straight lines between targets."""
        both = [
            np.stack([np.interp(joint, self.targets, row) for row in rows])
            for rows in (self.means, self.spreads)
        ]
        return both[0], both[1]


def read_positioning(
    parts: SourceBuilder, drive: Drive, file: str, path: str
) -> PositioningTable | None:
    """The table in `file`, which the machine file names at `path`; None, and problems, if bad."""
    target, direction, deviation = _COLUMNS
    table = parts.data_file(
        file,
        (
            Column(target, drive.coordinate),
            Column(direction, None, words=DIRECTIONS),
            Column(deviation, drive.coordinate),
        ),
        path,
    )
    if table is None:
        return None
    targets, place = np.unique(table.numbers[target], return_inverse=True)
    ways = np.array([DIRECTIONS.index(word) for word in table.texts[direction]])
    runs = np.zeros((2, targets.size), np.intp)
    np.add.at(runs, (ways, place), 1)
    problems = _too_few(table, targets, runs)
    if not problems:
        problems = uncovered(drive, table, target)
    if problems:
        parts.problems.extend(problems)
        return None
    deviations = table.numbers[deviation]
    means = np.zeros(runs.shape)
    np.add.at(means, (ways, place), deviations)
    means /= runs
    squares = np.zeros(runs.shape)
    np.add.at(squares, (ways, place), np.square(deviations - means[ways, place]))
    return PositioningTable(targets, means, np.sqrt(squares / (runs - 1)))


def _too_few(table: DataTable, targets: Floats, runs: np.ndarray) -> list[Problem]:
    """One problem for each direction that has too few runs at some target, at the first of them."""
    problems = []
    for way, word in enumerate(DIRECTIONS):
        short = np.flatnonzero(runs[way] < FEWEST_RUNS)
        if not short.size:
            continue
        row = int(np.flatnonzero(table.numbers["target"] == targets[short[0]])[0])
        count = int(runs[way, short[0]])
        more = f", and at {short.size - 1} more" if short.size > 1 else ""
        problems.append(
            table.problem(
                Fault(
                    "too-few-runs",
                    f"too few runs in direction {word} at the target "
                    f"{table.shown('target', row)}{more}",
                    found=f"{count} in direction {word}",
                    expected=f"{FEWEST_RUNS} or more in each direction, 5 by ISO 230-2",
                    hint="a row for each run: the same target, and what was measured there"
                    if count
                    else "approach every target in both directions: their difference is the "
                    "reversal",
                ),
                row=row,
            )
        )
    return problems
