"""Files of measurements made for tests: good ones, to be spoilt."""

from __future__ import annotations

from pathlib import Path

import pytest

from truepose.calibration import Measurements, read_measurements
from truepose.errors import Problem, RequestError
from truepose.machine import Machine

HEAD = """\
#: [instrument.camera]
#: kind = "position"
#: frame = "unknown"
#: uncertainty = "10 um"
"""
TABLE = "command.x (mm),command.y (mm),x (mm),y (mm)\n"
GOOD = HEAD + TABLE + "300,200,1,2\n250,200,3,4\n"
"""The header of the table stands in line 5, its rows in lines 6 and 7."""


def read(folder: Path, text: str | bytes, machine: Machine) -> Measurements:
    path = folder / "measured.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_measurements(path, machine)


def problems(folder: Path, text: str | bytes, machine: Machine) -> tuple[Problem, ...]:
    with pytest.raises(RequestError) as error:
        read(folder, text, machine)
    return error.value.problems


SEVERAL = """\
#: [instrument.tracker]
#: kind = "position"
#: frame = "base"
#: uncertainty = "10 um"
#: [instrument.scales]
#: kind = "strut-length"
#: [instrument.eye]
#: kind = "strut-direction"
#: frame = "base"
#: uncertainty = 1e-4
instrument,command.x (mm),command.y (mm),x (mm),y (mm),x.uncertainty (um),strut.1.length (mm),\
strut.1.length.uncertainty (um),strut.2.length (mm),\
strut.1.direction.x,strut.1.direction.y,strut.1.direction.z,\
temperature.default (degC),temperature.strut.1 (degC),set
tracker,300,200,1,2,,,,,,,,,
scales,250,200,,,,500,,,,,,,
eye,250,200,,,,,,0.6,0.8,0.05,20,,check
"""
"""Rows without the cell of strut.1.length.uncertainty: `several` puts it in."""


def several(*rows: str) -> str:
    """A file of three instruments with these rows more.

    The rows have no cell of strut.1.length.uncertainty: it is 1 where strut 1 was measured.
    """
    head, body = SEVERAL.split("set\n")
    filled = []
    for row in (*body.splitlines(), *rows):
        cells = row.split(",")
        cells.insert(7, "1" if cells[0] == "scales" and cells[6] else "")
        filled.append(",".join(cells))
    return "\n".join([head + "set", *filled, ""])
