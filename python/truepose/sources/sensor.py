"""Sensor of a drive: it resolves only so much, and its scale is a little too long or too short.

    half of offset  = nominal scale * resolution / 2
    scale  moves by   nominal scale * error
    offset moves by  -nominal scale * error * zero_at

so that the error grows from nothing where the sensor has its zero. `docs/sources/sensor.md` has
the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

from pydantic import BaseModel, Field, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import Coordinate, NonNegativeCoordinate, refuse
from truepose.files.ratio import RatioWithin
from truepose.files.tolerance import Band
from truepose.sources._columns import Columns
from truepose.sources._scale_error import add_scale_error
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock

if TYPE_CHECKING:
    from truepose.machine import Condition, Machine, SourceBuilder


class SensorTable(FileTable):
    """What measures a drive's position."""

    resolution: NonNegativeCoordinate | None = Field(
        None, description="Smallest step that it tells apart, in joint coordinates."
    )
    scale_error: RatioWithin | None = Field(
        None, description="True travel per measured travel, less one, such as `12 ppm`."
    )
    zero_at: Coordinate = Field(
        0.0, description="Joint coordinate at which the scale is right, most often its reference."
    )

    @model_validator(mode="after")
    def _says_something(self) -> SensorTable:
        if self.resolution is None and self.scale_error is None:
            refuse(
                Fault(
                    "missing-key",
                    "a sensor of no error",
                    found="neither resolution nor scale_error",
                    expected='resolution = "1 um", or scale_error = "12 ppm", or both',
                )
            )
        return self


class DriveSensor(BaseModel):
    """What a `[[drive]]` says about its sensor."""

    sensor: SensorTable | None = Field(
        None,
        description='Errors of what measures the position, such as `{ resolution = "1 um", '
        'scale_error = "12 ppm" }`.',
    )


@dataclass(frozen=True)
class Reading:
    """One drive's sensor: the drive's path, resolution and zero in m or rad, scale error as 1."""

    drive: str
    resolution: float
    scale_error: Band | None
    zero_at: float


@dataclass(frozen=True)
class Sensor:
    """Resolution and linear scale error of the drives' sensors."""

    name: ClassVar[str] = "sensor"
    doc: ClassVar[str] = "resolution and scale error of the drives' sensors"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"drive": DriveSensor}
    sets_overall_edges: ClassVar[bool] = False

    readings: tuple[Reading, ...]

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From `sensor` of the drives; None where no drive has it."""
        readings = tuple(
            Reading(
                drive.part,
                row.sensor.resolution or 0.0,
                row.sensor.scale_error,
                row.sensor.zero_at,
            )
            for drive, row in zip(parts.drives, parts.rows(DriveSensor), strict=True)
            if row.sensor is not None
        )
        return cls(readings) if readings else None

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Of offsets, m or rad, and scales, (1, k)."""
        columns = Columns()
        for reading in self.readings:
            offset = machine.parameters.index(f"{reading.drive}.offset")
            if reading.resolution > 0.0:
                # Of the joint coordinate, as the command is: the drive makes `scale` of it.
                scale = machine.nominal[machine.parameters.index(f"{reading.drive}.scale")]
                columns.add(offset, half_width=0.5 * scale * reading.resolution)
            if reading.scale_error is not None:
                add_scale_error(
                    columns, machine, reading.drive, reading.scale_error, reading.zero_at
                )
        return columns.deviation()
