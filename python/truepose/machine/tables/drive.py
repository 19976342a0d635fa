"""`[[drive]]`, what every kind has: the rest is in the kernel's table of elements."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from truepose.files.file_table import FileTable, PartName
from truepose.files.quantity import Expansion, Mass
from truepose.machine.materials import MaterialName
from truepose.machine.tables.body import CarriageTable
from truepose.machine.tables.limb import LimbPartTable


class DriveTable(FileTable):
    """An actuated joint."""

    name: PartName = Field(description="Name of the drive and of its joint coordinate.")
    kind: str = Field(description="The kind of drive, such as `slider`.")
    working_mode: Literal["+", "-"] | None = Field(
        None,
        description="The branch of the inverse kinematics. "
        "Default: the root nearest mid-travel at home.",
    )
    feedback: Literal["motor", "direct"] = Field(
        "motor",
        description="Where the position is measured: at the motor, so that screw and backlash come "
        "after it, or by a direct scale on what moves.",
    )
    material: MaterialName | None = Field(
        None, description="Gives `expansion` where it is not written."
    )
    expansion: Expansion | None = Field(
        None,
        description="Coefficient of linear thermal expansion of what the position is measured by: "
        "screw, rack or scale; of a crank that of its arm.",
    )
    mass: Mass = Field(
        0.0, description="Mass of the carriage, shared by the struts that it carries."
    )
    chain: list[LimbPartTable] | None = Field(
        None,
        min_length=1,
        description="What lies between the frame and the body that the drive moves, where several "
        "struts are on it: of a slider the guidance of its carriage, a prismatic joint; of a crank "
        "its bearing, a revolute joint, and the beams of its arm. Default: rigid.",
    )
    carriage: CarriageTable | None = Field(
        None,
        description="What the carriage of a slider is made of: it grows about the point that the "
        "drive moves, and with it the base joints that it carries.",
    )
