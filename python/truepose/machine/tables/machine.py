"""`[machine]`."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable, Freedoms, Name
from truepose.files.quantity import Point, PositiveLength


class MachineTable(FileTable):
    """What the machine is."""

    name: Name = Field(description="Name of the machine, as reports show it.")
    description: str = Field("", description="What the machine is, in a sentence or two.")
    origin: str = Field("", description="Where its numbers come from, in one paragraph.")
    dof: Freedoms = Field(
        description="The platform's freedoms among `x y z a b c`; the frame holds the others. "
        "A `[family]` gives them."
    )
    commanded: Freedoms | None = Field(
        None,
        description="The freedoms that a pose commands, as many as there are drives. "
        "Default: those of `[family]`, else all of `dof`.",
    )
    tool: Point = Field((0.0, 0.0, 0.0), description="The tool point, platform frame.")
    characteristic_length: PositiveLength | None = Field(
        None,
        description="The length that weighs rotations against displacements in tests for "
        "singularity. Default: the rms distance of the platform's joint centres from the tool "
        "point; for a platform that is a point, the mean length of the struts.",
    )
