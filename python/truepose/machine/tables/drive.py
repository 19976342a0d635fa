"""`[[drive]]`, what every kind has: the rest is in the kernel's table of elements."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from truepose.machine.file_table import FileTable, PartName


class DriveTable(FileTable):
    """An actuated joint."""

    name: PartName = Field(description="Name of the drive and of its joint coordinate.")
    kind: str = Field(description="The kind of drive, such as `slider`.")
    working_mode: Literal["+", "-"] | None = Field(
        None,
        description="The branch of the inverse kinematics. "
        "Default: the root nearest mid-travel at home.",
    )
