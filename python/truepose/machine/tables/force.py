"""What acts on the tool, and how the platform accelerates: tables of `[condition]`."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable
from truepose.files.quantity import (
    Acceleration,
    Direction,
    Force,
    Modulus,
    Moment,
    PositiveForce,
    PositiveLength,
    ProperFraction,
)
from truepose.files.varies import RUN, ByItself


class ForceTable(FileTable):
    """Force on the tool at the tool point, base axes."""

    x: Force = Field(0.0, description="Component along x.")
    y: Force = Field(0.0, description="Component along y.")
    z: Force = Field(0.0, description="Component along z.")


class MomentTable(FileTable):
    """Moment on the tool, base axes."""

    x: Moment = Field(0.0, description="Component about x.")
    y: Moment = Field(0.0, description="Component about y.")
    z: Moment = Field(0.0, description="Component about z.")


class CuttingTable(FileTable):
    """Cutting data that give the force on the tool (Gojtan & Hess-Coelho 2005).

    It is `specific_force * chip_thickness * (depth * depth_direction + width * width_direction)`.
    """

    specific_force: Modulus = Field(description="Specific cutting force.")
    chip_thickness: PositiveLength = Field(description="Thickness of the chip.")
    depth: PositiveLength = Field(description="Depth of cut.")
    width: PositiveLength = Field(description="Width of cut.")
    depth_direction: Direction = Field(
        description="Where the force that goes with the depth acts, base axes."
    )
    width_direction: Direction = Field(
        description="Where the force that goes with the width acts, base axes."
    )


class KienzleTable(FileTable):
    """Cutting data after Kienzle (1952) that give the force on the tool.

    It is `specific_force * width * chip_thickness * (chip_thickness / 1 mm)^-exponent`.
    """

    specific_force: Modulus = Field(
        description="Specific cutting force k_c1.1, of a chip 1 mm wide and 1 mm thick."
    )
    exponent: ProperFraction = Field(
        description="Exponent m_c: how the specific force falls as the chip gets thicker."
    )
    chip_thickness: PositiveLength = Field(description="Thickness h of the chip.")
    width: PositiveLength = Field(description="Width b of the chip.")
    direction: Direction = Field(description="Where the force on the tool acts, base axes.")


class EnvelopeTable(FileTable):
    """A force on the tool of known size and unknown direction."""

    force: PositiveForce = Field(description="Its size.")
    normal: Direction | None = Field(
        None,
        description="Normal of the plane in which it acts, base axes. Default: it may act in any "
        "direction.",
    )
    varies: ByItself = Field(
        RUN, description="What its direction varies with; run: one direction a run."
    )


class AccelerationTable(FileTable):
    """Acceleration of the platform, base axes."""

    x: Acceleration = Field(0.0, description="Component along x.")
    y: Acceleration = Field(0.0, description="Component along y.")
    z: Acceleration = Field(0.0, description="Component along z.")
