"""Actuator of a drive: its screw's lead, what repeats with every turn, or a measured table.

    lead      scale  moves by   nominal scale * error
              offset moves by  -nominal scale * error * zero_at
    periodic  shift of offset = amplitude * sin(2 pi q / period + phase)
              half of offset  = amplitude, where the phase is not known
    table     shift of offset = mean deviation
              half of offset  = 2 * spread, and half the reversal where the way is not known

at the joint coordinate q. `docs/sources/actuator.md` has the reference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, Field, model_validator

from truepose.arrays import Floats
from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import (
    Angle,
    Coordinate,
    NonNegativeCoordinate,
    PositiveCoordinate,
    refuse,
)
from truepose.files.ratio import RatioWithin
from truepose.files.tolerance import Band
from truepose.files.varies import ByItself
from truepose.sources._columns import Columns
from truepose.sources._positioning import COVERAGE, PositioningTable, read_positioning
from truepose.sources._scale_error import add_scale_error
from truepose.sources.deviation import ARCSINE, TWO_POINT, Deviation, normal
from truepose.sources.pose_block import PoseBlock
from truepose.sources.variation import (
    WITH_DIRECTION,
    WITH_MACHINE,
    WITH_VISIT,
    Ripple,
    Variation,
    refuse_without_band,
    variation,
    with_position,
)

if TYPE_CHECKING:
    from truepose.machine import Condition, Drive, Machine, SourceBuilder

_OF_THE_SCREW = ("lead_error", "periodic")
"""Keys of what a direct scale does not let through."""

_IN_A_TABLE = ("backlash", "sensor.scale_error")
"""Keys of a drive for what measured positions already show."""


class PeriodicTable(FileTable):
    """An error that repeats along the travel, as with every turn of a screw."""

    amplitude: NonNegativeCoordinate = Field(description="Half of what it swings in all.")
    period: PositiveCoordinate = Field(description="After which it repeats: the lead, say.")
    phase: Angle | None = Field(
        None, description="Of the sine at joint coordinate 0. Default: not known."
    )
    varies: Literal["position", "machine", "run", "visit"] | None = Field(
        None,
        description="What it varies with where its phase is not known. Default: position, a sine "
        "along the travel.",
    )

    @model_validator(mode="after")
    def _unknown_where_it_varies(self) -> PeriodicTable:
        if self.varies is not None and self.phase is not None:
            refuse_without_band(
                "varies",
                "nothing does where the phase is known",
                "varies and phase",
                "one of them",
            )
        return self


class ActuatorTable(FileTable):
    """What moves a drive."""

    lead_error: RatioWithin | None = Field(
        None,
        description="True travel per nominal travel, less one, such as `20 um / 300 mm`.",
    )
    zero_at: Coordinate = Field(
        0.0,
        description="Joint coordinate at which `lead_error` has no effect: where the axis is "
        "homed.",
    )
    periodic: PeriodicTable | None = Field(
        None, description="An error that repeats, such as with every turn of the screw."
    )
    table: str | None = Field(
        None,
        description="CSV file of measured positions, after ISO 230-2, relative to this file: "
        "columns target, direction (`+` or `-`) and deviation, a row for each run.",
    )
    varies: ByItself | None = Field(
        None,
        description="What the spread of `table` varies with, or `lead_error` within its limits. "
        "Default: visit, or machine.",
    )

    @model_validator(mode="after")
    def _one_way_to_say_it(self) -> ActuatorTable:
        given = [key for key in _OF_THE_SCREW if getattr(self, key) is not None]
        if not given and self.table is None:
            refuse(
                Fault(
                    "missing-key",
                    "an actuator of no error",
                    found="none of lead_error, periodic and table",
                    expected='lead_error = "20 um / 300 mm", periodic, or table = "d1.csv"',
                )
            )
        if given and self.table is not None:
            refuse(
                Fault(
                    "excluding-keys",
                    "a measured table has all of the actuator's errors in it",
                    found=" and ".join([*given, "table"]),
                    expected="table, or what is known of the screw",
                )
            )
        banded = self.lead_error is not None and self.lead_error.half > 0.0
        if self.varies is not None and self.table is None and not banded:
            refuse_without_band(
                "varies",
                "the spread of a table, or a lead error within limits, is what it is about",
                "no lead_error and no table"
                if self.lead_error is None
                else "a lead_error that is known",
                'table, limits such as lead_error = "+-66 ppm", or periodic.varies',
            )
        return self


class DriveActuator(BaseModel):
    """What a `[[drive]]` says about its actuator."""

    actuator: ActuatorTable | None = Field(
        None,
        description='Errors of what moves the drive, such as `{ lead_error = "20 um / 300 mm" }`, '
        'or measured, `{ table = "d1.csv" }`.',
    )


@dataclass(frozen=True, eq=False)
class Actuation:
    """One drive's actuator: its path and number, and what is known of it; `zero_at` in m or rad.

    `variation` of the lead error, or of the table's spread.
    """

    drive: str
    joint: int
    lead_error: Band | None
    zero_at: float
    periodic: PeriodicTable | None
    table: PositioningTable | None
    variation: Variation = WITH_MACHINE

    @property
    def ripple(self) -> Variation:
        """What a periodic error of unknown phase varies with."""
        assert self.periodic is not None
        by_position = with_position(Ripple(self.joint, self.periodic.period))
        return variation(self.periodic.varies, by_position)


@dataclass(frozen=True, eq=False)
class Actuator:
    """Lead errors, periodic errors and measured positioning tables of the drives."""

    name: ClassVar[str] = "actuator"
    doc: ClassVar[str] = "lead errors, periodic errors and measured positioning of the drives"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"drive": DriveActuator}
    sets_overall_edges: ClassVar[bool] = False

    actuations: tuple[Actuation, ...]

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From `actuator` of the drives; None where no drive has it."""
        rows = zip(parts.drives, parts.rows(DriveActuator), strict=True)
        actuations = tuple(
            _actuation(parts, joint, drive, row.actuator)
            for joint, (drive, row) in enumerate(rows)
            if row.actuator is not None
        )
        return cls(actuations) if actuations else None

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Of offsets, m or rad, and scales, (n or 1, k)."""
        columns = Columns()
        for actuation in self.actuations:
            if actuation.lead_error is not None:
                add_scale_error(
                    columns,
                    machine,
                    actuation.drive,
                    actuation.lead_error,
                    actuation.zero_at,
                    actuation.variation,
                )
            offset = machine.parameters.index(f"{actuation.drive}.offset")
            if actuation.periodic is not None:
                _add_periodic(columns, offset, actuation, block.drive_joints[:, actuation.joint])
            if actuation.table is not None:
                travel = None if block.travel is None else block.travel[:, actuation.joint]
                _add_table(
                    columns, offset, actuation, block.drive_joints[:, actuation.joint], travel
                )
        return columns.deviation()


def _actuation(parts: SourceBuilder, joint: int, drive: Drive, row: ActuatorTable) -> Actuation:
    path = f"{drive.part}.actuator"
    for key in _OF_THE_SCREW:
        if drive.feedback == "direct" and getattr(row, key) is not None:
            parts.refuse(
                Fault(
                    "unwanted-lead-error",
                    "a drive that is measured directly on its carriage has no such error to see",
                    found=f'{key}, and feedback = "direct"',
                    expected=f'no {key}, or feedback = "motor"',
                    hint="the errors of a direct scale are those of sensor",
                ),
                f"{path}.{key}",
            )
    positioning = None
    if row.table is not None:
        for key in _IN_A_TABLE:
            if parts.has(f"{drive.part}.{key}"):
                parts.refuse(
                    Fault(
                        "excluding-keys",
                        f"the measured positions have the drive's {key} in them",
                        found=f"actuator.table and {key}",
                        expected="one of them",
                    ),
                    f"{path}.table",
                )
        positioning = read_positioning(parts, drive, row.table, f"{path}.table")
    return Actuation(
        drive.part,
        joint,
        row.lead_error,
        row.zero_at,
        row.periodic,
        positioning,
        variation(row.varies, WITH_MACHINE if row.table is None else WITH_VISIT),
    )


def _add_periodic(columns: Columns, offset: int, actuation: Actuation, joint: Floats) -> None:
    periodic = actuation.periodic
    assert periodic is not None
    if periodic.phase is None:
        columns.add(
            offset,
            half_width=periodic.amplitude,
            distribution=ARCSINE,
            variation=actuation.ripple,
        )
    else:
        turns = math.tau * joint / periodic.period
        columns.add(offset, periodic.amplitude * np.sin(turns + periodic.phase))


def _add_table(
    columns: Columns,
    offset: int,
    actuation: Actuation,
    joint: Floats,
    travel: Floats | None,
) -> None:
    """`travel` (n,): direction in which the joint comes to each pose, -1, 0 or +1; None unknown.

    Where the direction is known, that of the table counts, to 2 spreads. Where it is not, the
    middle of both counts; the reversal, at either end as likely, is a variable of its own.
    """
    assert actuation.table is not None
    means, spreads = actuation.table.at(joint)
    way = np.zeros(joint.size) if travel is None else np.sign(travel)
    known = [way < 0.0, way > 0.0]
    columns.add(
        offset,
        np.select(known, list(means), 0.5 * (means[0] + means[1])),
        COVERAGE * np.select(known, list(spreads), spreads.max(axis=0)),
        distribution=normal(COVERAGE),
        variation=actuation.variation,
    )
    reversal = np.where(way == 0.0, 0.5 * (means[1] - means[0]), 0.0)
    columns.add(offset, half_width=reversal, distribution=TWO_POINT, variation=WITH_DIRECTION)
