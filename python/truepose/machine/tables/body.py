"""`[platform]`, `[frame]`, `[tool]` and `[drive.carriage]`: the bodies of a machine."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable
from truepose.files.quantity import Expansion, Mass, Point
from truepose.machine.materials import MaterialName

_ORIGIN = (0.0, 0.0, 0.0)


class _Growing(FileTable):
    material: MaterialName | None = Field(
        None, description="Gives `expansion` where it is not written."
    )
    expansion: Expansion | None = Field(
        None,
        description="Coefficient of linear thermal expansion. Default: it does not grow, and where "
        "it is off the reference temperature results say that it is not included.",
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


class CarriageTable(_Growing):
    """The carriage of a slider, which carries the base joints of its struts.

    It grows about the point that the drive moves, from which the struts' bases are measured.
    """
