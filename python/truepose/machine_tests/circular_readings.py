"""BallBarReadings of a ball bar: a file of them, checked, and as measurements for a calibration.

angle (deg), radius (mm), run, direction
0,           100.0021,    1,   counter-clockwise
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.instruments import Instrument
from truepose.calibration.instruments._base import Frame
from truepose.calibration.measurements import Measurements
from truepose.calibration.measurements.arrays import measurements_of
from truepose.errors import Fault, MachineFileError, Problem
from truepose.files.data_file import Column, DataTable, cut_short, read_table
from truepose.files.text_file import FileKind, read_text
from truepose.machine import Condition
from truepose.machine_tests.circle_path import PLANES, CirclePath
from truepose.machine_tests.circular_quantities import DIRECTIONS
from truepose.runs.quantities import POSITIONS

WORDS = {
    "counter-clockwise": 0,
    "ccw": 0,
    "clockwise": 1,
    "cw": 1,
}
"""What may stand in the column `direction`."""

COLUMNS = (
    Column("angle", "angle"),
    Column("radius", "length"),
    Column("run", "ratio"),
    Column("direction", None, words=tuple(WORDS)),
)

KIND = FileKind("readings of a circular test (CSV)", ".csv")

LEAST = 16
"""BallBarReadings of a path, so that a circle and its form can be told."""

WIDEST_GAP = math.radians(30.0)
"""Between two readings of a path: a circle that is less covered has no form."""

FARTHEST = 0.05
"""Of the radius: a reading farther off is none of this circle."""

MOST_ROWS = 360
"""BallBarReadings that are handed on to a calibration, evenly spaced: more say the same again."""


@dataclass(frozen=True, eq=False)
class Path2D:
    """The readings of one path: `angles` (m,), rad, ascending, and `radii` (m,), m."""

    run: int
    direction: int
    angles: Floats
    radii: Floats


@dataclass(frozen=True, eq=False)
class BallBarReadings:
    """The paths of a file, at least one in each direction."""

    file: str
    paths: tuple[Path2D, ...]

    @property
    def pairs(self) -> Iterator[tuple[Path2D, Path2D]]:
        """Paths there and back, the first with the first; of more in one direction the rest."""
        ways: list[list[Path2D]] = [[], []]
        for path in self.paths:
            ways[path.direction].append(path)
        return zip(*ways, strict=False)

    @property
    def count(self) -> int:
        """How many readings there are."""
        return sum(path.angles.size for path in self.paths)


def read_readings(file: str | Path, nominal: float) -> BallBarReadings:
    """The readings in a file, of a circle of the radius `nominal`, m.

    Raises `MachineFileError` with all that is wrong.
    """
    path = Path(file)
    _, text = read_text(path, KIND)
    read = read_table(str(path), path.name, text, COLUMNS)
    problems = list(read.problems)
    if read.table is None or problems:
        raise MachineFileError(*problems)
    table = read.table
    problems = cut_short(_row_problems(table, nominal))
    if problems:
        raise MachineFileError(*problems)
    paths = tuple(_paths(table))
    problems = [*_path_problems(table, paths)]
    if problems:
        raise MachineFileError(*problems)
    return BallBarReadings(str(path), paths)


def _row_problems(table: DataTable, nominal: float) -> list[Problem]:
    radii, runs = table.numbers["radius"], table.numbers["run"]
    problems = []
    for row in np.flatnonzero(np.abs(radii - nominal) > FARTHEST * nominal).tolist():
        fault = Fault(
            "test-readings",
            "this is no radius of the circle that is tested",
            found=table.shown("radius", row),
            expected=f"about {1e3 * nominal:g} mm",
            hint="the whole radius is wanted, not its deviation"
            if abs(radii[row]) < FARTHEST * nominal
            else None,
        )
        problems.append(table.problem(fault, row=row, column="radius"))
    for row in np.flatnonzero((runs != np.rint(runs)) | (runs < 1)).tolist():
        fault = Fault(
            "test-readings",
            "this is no number of a run",
            found=table.shown("run", row),
            expected="a whole number from 1 on",
        )
        problems.append(table.problem(fault, row=row, column="run"))
    return problems


def _paths(table: DataTable) -> Iterator[Path2D]:
    """Runs in their order, counter-clockwise first."""
    angles = np.mod(table.numbers["angle"], 2.0 * np.pi)
    runs = np.rint(table.numbers["run"]).astype(np.intp)
    ways = np.array([WORDS[word] for word in table.texts["direction"]], np.intp)
    for run in np.unique(runs).tolist():
        for way in range(len(DIRECTIONS)):
            rows: Indices = np.flatnonzero((runs == run) & (ways == way))
            if rows.size:
                order = rows[np.argsort(angles[rows], kind="stable")]
                yield Path2D(run, way, angles[order], table.numbers["radius"][order])


def _path_problems(table: DataTable, paths: Iterable[Path2D]) -> Iterator[Problem]:
    there = {path.direction for path in paths}
    for way, name in enumerate(DIRECTIONS):
        if way not in there:
            yield table.problem(
                Fault(
                    "test-readings",
                    f"there is no path {name}",
                    found=DIRECTIONS[1 - way] if there else "nothing",
                    expected="a path in either direction",
                ),
                column="direction",
            )
    for path in paths:
        name = f"run {path.run}, {DIRECTIONS[path.direction]}"
        gap = float(np.diff(path.angles, append=path.angles[0] + 2.0 * np.pi).max())
        if path.angles.size < LEAST:
            said, expected = f"{path.angles.size} readings", f"{LEAST} or more"
        elif gap > WIDEST_GAP:
            said = f"{math.degrees(gap):.3g} deg without a reading"
            expected = f"readings all round, at most {math.degrees(WIDEST_GAP):.0f} deg apart"
        else:
            continue
        yield table.problem(
            Fault("test-readings", f"{name}: no circle", found=said, expected=expected),
            column="angle",
        )


def measurements(
    path: CirclePath,
    readings: BallBarReadings,
    uncertainty: float,
    known: Floats,
    condition: Condition,
) -> Measurements:
    """The readings as those of a `distance` instrument in the middle, whose place is unknown.

    That is, in the plane; `uncertainty`, m, of each, in `condition`. What of the `known` radial
    deviation (2, n), m, is other one way than the other, as play is, is taken from them: rows of
    measurements do not say from where their pose was reached.
    """
    machine = path.machine
    apart = 0.5 * (known[0] - known[1])
    period = 2.0 * np.pi
    radii = [
        one.radii
        - (-1.0) ** one.direction * np.interp(one.angles, path.angles, apart, period=period)
        for one in readings.paths
    ]
    every = np.concatenate([one.angles for one in readings.paths])
    chosen: Indices = np.unique(
        np.linspace(0, len(every) - 1, min(len(every), MOST_ROWS)).round().astype(np.intp)
    )
    angles = every[chosen]
    axes = PLANES[path.plane]
    poses = np.repeat(path.poses[:1], len(angles), axis=0)
    for axis, along in zip(axes, (np.cos(angles), np.sin(angles)), strict=True):
        place = POSITIONS.index(axis)
        poses[:, machine.commanded.index(axis)] = path.middle[place] + path.radius * along
    unknown = tuple(axis in axes for axis in (*POSITIONS, "a", "b", "c"))
    x, y, z = path.middle.tolist()
    ball_bar = Instrument(
        "ball_bar",
        "distance",
        Frame(origin=(x, y, z), unknown=unknown),
        uncertainty={"distance": uncertainty},
    )
    return measurements_of(
        machine,
        ball_bar,
        poses=poses,
        values={"distance": np.concatenate(radii)[chosen]},
        condition=condition,
    )
