"""`[accuracy]`: what is asked of the machine."""

from __future__ import annotations

from pydantic import Field

from truepose.machine.file_table import FileTable
from truepose.machine.quantity import PositiveAngle, PositiveLength


class AccuracyTable(FileTable):
    """The error that is allowed at the tool point."""

    target: PositiveLength | None = Field(None, description="Largest position error allowed.")
    angle_target: PositiveAngle | None = Field(
        None, description="Largest orientation error allowed, where the platform turns."
    )
