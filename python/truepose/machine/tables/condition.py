"""`[condition]`: temperatures, and what acts on the tool."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from truepose.machine.file_table import FileTable
from truepose.machine.quantity import (
    Direction,
    Force,
    Modulus,
    Moment,
    PositiveLength,
    Temperature,
    refuse,
)


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


def flattened(table: dict[str, Any]) -> dict[str, Any]:
    """Nested tables (TOML's `strut.1 = 40`) -> one table with the keys joined by points."""
    flat: dict[str, Any] = {}
    for key, value in table.items():
        if isinstance(value, dict):
            flat |= {f"{key}.{below}": entry for below, entry in flattened(value).items()}
        else:
            flat[key] = value
    return flat


def _per_part(value: Any) -> dict[str, Any]:
    return flattened(value) if isinstance(value, dict) else {"default": value}


Temperatures = Annotated[
    dict[str, Temperature],
    BeforeValidator(_per_part),
    WithJsonSchema(
        {
            "anyOf": [{"type": "number"}, {"type": "string"}, {"type": "object"}],
            "x-dimension": "temperature",
            "x-per-part": True,
        }
    ),
]


class ConditionTable(FileTable):
    """The state that the machine works in."""

    reference_temperature: Temperature | None = Field(
        None, description="Temperature at which the dimensions hold. Default: 20 degC (ISO 1)."
    )
    temperature: Temperatures | None = Field(
        None,
        description='Temperature of all parts, or a table, `{ default = 20, "strut.1" = 35 }`. '
        "Default: the reference temperature.",
    )
    force: ForceTable | None = Field(
        None, description="Force on the tool, such as `{ x = 1200, y = -1500 }`."
    )
    moment: MomentTable | None = Field(
        None, description="Moment on the tool, such as `{ z = 40 }`."
    )
    cutting: CuttingTable | None = Field(
        None, description="Cutting data that give the force on the tool, in place of `force`."
    )

    @model_validator(mode="after")
    def _one_force(self) -> ConditionTable:
        if self.force is not None and self.cutting is not None:
            refuse(
                "excluding-keys",
                "the force on the tool is given twice, by force and by cutting",
                found="force and cutting",
                expected="one of them",
            )
        return self
