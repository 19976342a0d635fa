"""Heights of a bed that a probe found, as printers' firmware prints them, as measurements.

The tool was commanded to x, y and there down to the height z, at which the bed was touched: a
`plane` of which nobody knows how high and how level it lies.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal

from truepose.controllers._decimals import plain
from truepose.controllers._reader import Assumption, ControllerFile
from truepose.errors import MachineFileError, ReadingError

UNCERTAINTY = "0.02 mm"
"""Assumed of a height, standard: what switches and sensors of printers repeat to."""

Place = tuple[Decimal, Decimal]
LEVEL: Place = (Decimal(0), Decimal(0))


@dataclass(frozen=True)
class Probed:
    """The tool was commanded to `x`, `y`, and the bed was touched at the commanded height `z`.

    mm. `line` and `file`: where it stands.
    """

    x: Decimal
    y: Decimal
    z: Decimal
    file: str
    line: int


@dataclass(frozen=True)
class ProbedPoints:
    """What a log holds: `points`, and in sentences what of it could not be used."""

    points: tuple[Probed, ...] = ()
    unused: tuple[str, ...] = ()

    def __add__(self, other: ProbedPoints) -> ProbedPoints:
        """Those of two logs."""
        return ProbedPoints((*self.points, *other.points), (*self.unused, *other.unused))


def measurements_text(
    points: Sequence[Probed], machine: str, *, offset: Place = LEVEL, tilt: Place = LEVEL
) -> str | None:
    """The text of a file of measurements; None without a point.

    `machine`: its name. `offset`: from the nozzle to the probe, mm. `tilt`: what the controller
    adds to the carriages' heights, for each mm of x and y: by as much z is more in the machine's
    own frame.
    """
    if not points:
        return None
    lines = [
        f'#: machine = "{machine}"',
        "#: [instrument.probe]",
        '#: kind = "plane"',
        '#: frame = "unknown"',
        f'#: uncertainty = "{UNCERTAINTY}"',
    ]
    if any(offset):
        lines.append(f'#: target = ["{plain(offset[0])} mm", "{plain(offset[1])} mm", "0 mm"]')
    lines.append("command.x (mm), command.y (mm), command.z (mm), id")
    for point in points:
        z = point.z + point.x * tilt[0] + point.y * tilt[1]
        lines.append(f"{plain(point.x)}, {plain(point.y)}, {plain(z)}, line {point.line}")
    return "\n".join([*lines, ""])


ASSUMED_PROBE = Assumption(
    f"a height is read to {UNCERTAINTY}, standard, and where the bed lies is not known",
    "instrument.probe.uncertainty",
)


def logs_beside(file: ControllerFile, names: str) -> Iterator[ControllerFile]:
    """The files with logs that a setting names, commas between. Raises `MachineFileError`."""
    for name in filter(None, (part.strip() for part in names.split(","))):
        try:
            yield from file.included(name)
        except ReadingError as failure:
            raise MachineFileError(file.problem(failure.fault)) from None


__all__ = [
    "ASSUMED_PROBE",
    "LEVEL",
    "Place",
    "Probed",
    "ProbedPoints",
    "logs_beside",
    "measurements_text",
]
