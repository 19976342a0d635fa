"""`[machine]`."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from truepose.files.file_table import FileTable, Freedoms, Name
from truepose.files.quantity import Point, PositiveLength


def _written(value: Any) -> Any:
    """A date of TOML as text."""
    return value.isoformat() if isinstance(value, date) else value


Day = Annotated[str, BeforeValidator(_written)]
"""A date: TOML's own, or text, for which people have many forms."""


class MachineTable(FileTable):
    """What the machine is."""

    name: Name = Field(description="Name of the machine, as reports show it.")
    description: str = Field("", description="What the machine is, in a sentence or two.")
    origin: str = Field("", description="Where its numbers come from, in one paragraph.")
    serial: str = Field("", description="Serial number of the machine, as certificates have it.")
    date: Day = Field("", description="Date of the state that the file describes.")
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
