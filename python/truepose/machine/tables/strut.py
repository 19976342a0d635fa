"""`[[strut]]`, besides its geometry, which is in the kernel's table of elements."""

from __future__ import annotations

from pydantic import Field

from truepose.files.file_table import FileTable, PartName
from truepose.files.quantity import (
    Area,
    AxisStiffness,
    Expansion,
    Fraction,
    Mass,
    Modulus,
    Stiffness,
)
from truepose.machine.materials import MaterialName
from truepose.machine.tables.joint import JointTable


class StrutTable(FileTable):
    """A limb of one strut between two joint centres."""

    name: PartName = Field(description="Name of the strut and of its closure.")
    drive: str | None = Field(
        None,
        description="The drive that carries the strut's base joint. "
        "Default: none, the base joint is on the frame.",
    )
    section_area: Area | None = Field(None, description="Area of the cross section.")
    material: MaterialName | None = Field(
        None, description="Gives `modulus` and `expansion` where they are not written."
    )
    modulus: Modulus | None = Field(None, description="Young's modulus.")
    expansion: Expansion | None = Field(
        None, description="Coefficient of linear thermal expansion."
    )
    stiffness: Stiffness | None = Field(
        None, description="Axial stiffness outright, in place of `modulus * section_area / length`."
    )
    mass: Mass = Field(0.0, description="Mass of the strut, joints included.")
    centre_of_mass: Fraction = Field(
        0.5,
        description="Where the mass has its centre, as a fraction of the way from the base joint "
        "to the platform joint.",
    )
    base_joint: JointTable | None = Field(
        None, description='The passive joint at the base, such as `{ stiffness = "120 N/um" }`.'
    )
    platform_joint: JointTable | None = Field(
        None, description="The passive joint at the platform."
    )
    base_stiffness: AxisStiffness | None = Field(
        None,
        description="Stiffness of the carriage or frame at the base joint, along its x, y and z. "
        "Default: rigid.",
    )
