"""`[[strut]]`, besides its geometry, which is in the kernel's table of elements."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field, WithJsonSchema

from truepose.machine.file_table import FileTable, PartName
from truepose.machine.materials import MATERIALS
from truepose.machine.quantity import Area, Expansion, Modulus, Stiffness, refuse
from truepose.machine.suggestion import did_you_mean, one_of
from truepose.machine.units import shown_value


def _known_material(value: str) -> str:
    if value not in MATERIALS:
        refuse(
            "unknown-material",
            f"unknown material {shown_value(value)}",
            found=shown_value(value),
            expected=one_of(f'"{name}"' for name in MATERIALS),
            hint=did_you_mean(value, MATERIALS) or "give modulus and expansion outright",
        )
    return value


MaterialName = Annotated[
    str,
    AfterValidator(_known_material),
    WithJsonSchema({"type": "string", "enum": list(MATERIALS)}),
]


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
