"""`[platform]`, `[frame]` and `[tool]`: the bodies that every machine has once."""

from __future__ import annotations

from pydantic import Field

from truepose.machine.file_table import FileTable
from truepose.machine.quantity import Expansion, Mass, Point
from truepose.machine.tables.material import MaterialName

_ORIGIN = (0.0, 0.0, 0.0)


class _Growing(FileTable):
    material: MaterialName | None = Field(
        None, description="Gives `expansion` where it is not written."
    )
    expansion: Expansion | None = Field(
        None, description="Coefficient of linear thermal expansion. Default: it does not grow."
    )


class PlatformTable(_Growing):
    """The platform with what it carries, such as the spindle."""

    mass: Mass = Field(0.0, description="Mass of platform, spindle and tool together.")
    centre_of_mass: Point = Field(_ORIGIN, description="Its centre of mass, platform axes.")
    anchor: Point = Field(_ORIGIN, description="The point about which it grows, platform axes.")


class FrameTable(_Growing):
    """The frame on which guideways and joints stand."""

    anchor: Point = Field(_ORIGIN, description="The point about which it grows, base axes.")


class ToolTable(_Growing):
    """The tool, which grows from where it is held to the tool point.

    Without an expansion the tool point is one of the platform.
    """

    anchor: Point = Field(_ORIGIN, description="Where it is held, platform axes.")
