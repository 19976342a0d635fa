"""Sensor of a drive: it resolves only so much, and its scale is a little too long or too short.

    half of offset  = nominal scale * resolution / 2
    scale  moves by   nominal scale * error
    offset moves by  -nominal scale * error * zero_at

so that the error grows from nothing where the sensor has its zero. The joint coordinate is rounded
on a grid of unknown origin, which varies with position. `docs/sources/sensor.md` has
the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Self

from pydantic import BaseModel, Field, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import Coordinate, NonNegativeCoordinate, refuse
from truepose.files.ratio import RatioWithin
from truepose.files.tolerance import Band
from truepose.files.varies import ByItself
from truepose.sources._columns import Columns
from truepose.sources._scale_error import add_scale_error
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock
from truepose.sources.variation import (
    WITH_MACHINE,
    Rounding,
    Variation,
    refuse_without_band,
    variation,
    with_position,
)

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
    varies: Literal["position", "machine", "run", "visit"] | None = Field(
        None,
        description="What the error of `resolution` varies with. Default: position, rounded on a "
        "grid of unknown origin.",
    )
    scale_error_varies: ByItself | None = Field(
        None, description="What `scale_error` varies with, within its limits. Default: machine."
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
        if self.varies is not None and not self.resolution:
            refuse_without_band(
                "varies",
                "the error of a resolution is what it is about",
                "varies, and no resolution",
                'resolution = "1 um", or scale_error_varies for the scale error',
            )
        if self.scale_error_varies is not None and not _has_band(self.scale_error):
            refuse_without_band(
                "scale_error_varies",
                "a scale error within limits is what it is about",
                "no scale_error" if self.scale_error is None else "a scale_error that is known",
                'limits, such as scale_error = "+-12 ppm"',
            )
        return self


def _has_band(error: Band | None) -> bool:
    return error is not None and error.half > 0.0


class DriveSensor(BaseModel):
    """What a `[[drive]]` says about its sensor."""

    sensor: SensorTable | None = Field(
        None,
        description='Errors of what measures the position, such as `{ resolution = "1 um", '
        'scale_error = "12 ppm" }`.',
    )


@dataclass(frozen=True)
class Reading:
    """One drive's sensor: the drive's path, resolution and zero in m or rad, scale error as 1.

    `variation` of the resolution's error, `of_scale` of the scale error.
    """

    drive: str
    resolution: float
    scale_error: Band | None
    zero_at: float
    variation: Variation = WITH_MACHINE
    of_scale: Variation = WITH_MACHINE


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
        rows = zip(parts.drives, parts.rows(DriveSensor), strict=True)
        readings = tuple(
            _reading(drive.part, joint, row.sensor)
            for joint, (drive, row) in enumerate(rows)
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
                columns.add(
                    offset,
                    half_width=0.5 * scale * reading.resolution,
                    variation=reading.variation,
                )
            if reading.scale_error is not None:
                add_scale_error(
                    columns,
                    machine,
                    reading.drive,
                    reading.scale_error,
                    reading.zero_at,
                    reading.of_scale,
                )
        return columns.deviation()


def _reading(drive: str, joint: int, sensor: SensorTable) -> Reading:
    resolution = sensor.resolution or 0.0
    usual = with_position(Rounding(joint, resolution)) if resolution > 0.0 else WITH_MACHINE
    return Reading(
        drive,
        resolution,
        sensor.scale_error,
        sensor.zero_at,
        variation(sensor.varies, usual),
        variation(sensor.scale_error_varies, WITH_MACHINE),
    )
