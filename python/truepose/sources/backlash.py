"""Backlash: within its play, a carriage stands where the load, or else the motion, has put it.

    shift = sign(load) * play / 2              where |load| exceeds the threshold
    shift = -sign(travel) * play / 2           below it, on a path: the carriage lags behind
    half  = play / 2                           else

The load is that of all that acts, on the drive's offset, by virtual work; of a telescopic drive the
force at the base end of its strut. `docs/sources/backlash.md` has the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, Field

from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import NonNegativeCoordinate, NonNegativeDriveLoad
from truepose.sources._play import DeadZone, pressed
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock
from truepose.sources.variation import WITH_DIRECTION, Variation, variation

if TYPE_CHECKING:
    from truepose.machine import Condition, Drive, Machine, SourceBuilder


class BacklashTable(FileTable):
    """Play between what a drive's position is measured on and what it moves."""

    play: NonNegativeCoordinate = Field(description="Total play, from flank to flank.")
    threshold: NonNegativeDriveLoad = Field(
        0.0, description="Load on the drive up to which the play stays open, by friction."
    )
    varies: Literal["direction", "machine", "run", "visit"] | None = Field(
        None,
        description="What the side of an open play varies with. Default: direction, the flank by "
        "the way of a path; with any other word the way says nothing.",
    )


class DriveBacklash(BaseModel):
    """What a `[[drive]]` says about its backlash."""

    backlash: BacklashTable | None = Field(
        None, description='Play of the drive, such as `{ play = "10 um", threshold = "20 N" }`.'
    )


@dataclass(frozen=True)
class Backlash:
    """Play of drives whose position is measured at the motor.

    `joints` (k): number of each such drive; `plays` in m or rad; `thresholds` in N or N m;
    `variations` of where each stands while its play is open.
    """

    name: ClassVar[str] = "backlash"
    doc: ClassVar[str] = "backlash of the drives"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"drive": DriveBacklash}
    sets_overall_edges: ClassVar[bool] = False

    joints: tuple[int, ...]
    plays: tuple[float, ...]
    thresholds: tuple[float, ...]
    variations: tuple[Variation, ...]

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From `backlash` of the drives; None where no drive has it."""
        of_drives = []
        for index, (drive, row) in enumerate(
            zip(parts.drives, parts.rows(DriveBacklash), strict=True)
        ):
            if row.backlash is None:
                continue
            if drive.feedback == "direct":
                _refuse_direct(parts, drive)
            of_drives.append(
                (
                    index,
                    row.backlash.play,
                    row.backlash.threshold,
                    variation(row.backlash.varies, WITH_DIRECTION),
                )
            )
        if not of_drives:
            return None
        joints, plays, thresholds, variations = zip(*of_drives, strict=True)
        return cls(joints, plays, thresholds, variations)

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def dead_zones(self, machine: Machine) -> tuple[DeadZone, ...]:
        """One a column of `deviation`."""
        of_strut = {int(c): at for at, c in enumerate(machine.kernel.length_parameters)}
        zones = []
        for joint, threshold in zip(self.joints, self.thresholds, strict=True):
            drive = machine.drives[joint]
            column = machine.parameters.index(f"{drive.part}.offset")
            # A moment on a crank goes by the machine's size, as the moments on the tool do.
            lever = machine.characteristic_length if drive.coordinate == "angle" else 1.0
            # A telescopic drive stands at the base end of its strut.
            end = (of_strut[column], 0) if column in of_strut else None
            zones.append(DeadZone(column, threshold, lever, end))
        return tuple(zones)

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Where the carriages stand in their play, m or rad, (n, k)."""
        zones = self.dead_zones(machine)
        columns = np.array([zone.parameter for zone in zones], np.intp)
        lever = [zone.lever for zone in zones]
        loads = block.drive_loads(self.joints)
        side, free = pressed(block, columns, loads, self.thresholds, lever)
        if block.travel is not None:
            by_way = np.array([one == WITH_DIRECTION for one in self.variations])
            side = np.where(free & by_way, -np.sign(block.travel[:, self.joints]), side)
        reach = 0.5 * np.array(self.plays)
        return Deviation.of(
            columns,
            side * reach,
            np.where(side == 0.0, reach, 0.0),
            variation=self.variations,
        )


def _refuse_direct(parts: SourceBuilder, drive: Drive) -> None:
    parts.refuse(
        Fault(
            "unwanted-backlash",
            "a drive that is measured directly on its carriage has no backlash to see",
            found='backlash, and feedback = "direct"',
            expected='no backlash, or feedback = "motor"',
            hint="the control closes its loop round the play",
        ),
        f"{drive.part}.backlash",
    )
