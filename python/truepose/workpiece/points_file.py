"""The points of the path as CSV, written as the path is walked: memory does not grow with it."""

from __future__ import annotations

import csv
from typing import IO

import numpy as np

from truepose.machine import Machine
from truepose.workpiece.along import PathErrors


class PointsFile:
    """A row for each point of the path: its line, where it is, and the known error there.

    In the units of the machine file, named in the header.
    """

    wants_half = True

    def __init__(self, machine: Machine, file: IO[str]) -> None:
        self._unit = machine.file_units["length"]
        self._writer = csv.writer(file, lineterminator="\n")
        label = self._unit.label
        self._writer.writerow(
            [
                "line",
                "feed",
                *(f"{axis} ({label})" for axis in "xyz"),
                *(f"known_{axis} ({label})" for axis in "xyz"),
                f"half_95 ({label})",
            ]
        )

    def add(self, errors: PathErrors) -> None:
        """The next points."""
        assert errors.half is not None
        values = np.column_stack([errors.points, errors.known, errors.half])
        batch = errors.batch
        self._writer.writerows(
            [line, int(feed), *row]
            for line, feed, row in zip(
                batch.line.tolist(),
                batch.is_feed.tolist(),
                self._unit.to_file(values).tolist(),
                strict=True,
            )
        )
