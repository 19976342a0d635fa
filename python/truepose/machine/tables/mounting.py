"""`[mounting]`: how the machine stands in the workshop."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable
from truepose.files.quantity import Angle


class MountingTable(FileTable):
    """Orientation of the base frame in the workshop, where z points up.

    It is `R = Rz(c) Ry(b) Rx(a)`; a machine that hangs upside down has `a = "180 deg"`.
    """

    a: Angle = Field(0.0, description="Rotation about x.")
    b: Angle = Field(0.0, description="Rotation about y.")
    c: Angle = Field(0.0, description="Rotation about z.")
