"""`[condition]`: temperatures, and what acts on the tool."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import (
    GradientValue,
    NonNegativeAcceleration,
    Temperature,
    Time,
    refuse,
)
from truepose.machine.tables.force import (
    AccelerationTable,
    CuttingTable,
    EnvelopeTable,
    ForceTable,
    KienzleTable,
    MomentTable,
)

_FORCES = ("force", "cutting", "kienzle")
"""Keys of which one gives the force on the tool."""


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


def _flattened(value: Any) -> Any:
    return flattened(value) if isinstance(value, dict) else value


Gradients = Annotated[
    dict[str, GradientValue],
    BeforeValidator(_flattened),
    WithJsonSchema(
        {"type": "object", "x-dimension": "temperature_gradient", "x-by-part": True},
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
    gradient: Gradients | None = Field(
        None,
        description='Temperature gradient of parts, `{ "strut.1" = "4 K/m" }`: one number '
        "along a strut from base to platform, or along a drive's coordinate from `fixed_at`; "
        "three of frame, platform and carriages.",
    )
    temperature_log: str | None = Field(
        None, description="CSV file of measured temperatures over time, relative to this file."
    )
    time: Time | None = Field(
        None, description="The time of the log that counts. Default: its last."
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
    kienzle: KienzleTable | None = Field(
        None,
        description="Cutting data after Kienzle that give the force on the tool, in place of "
        "`force`.",
    )
    envelope: EnvelopeTable | None = Field(
        None, description="A further force on the tool, of known size and unknown direction."
    )
    gravity: NonNegativeAcceleration | None = Field(
        None, description="Acts on every mass. Default: 9.80665 m/s^2; 0 switches it off."
    )
    acceleration: AccelerationTable | None = Field(
        None, description="Acceleration of the platform, whose mass resists it."
    )

    @model_validator(mode="after")
    def _one_force(self) -> ConditionTable:
        given = [key for key in _FORCES if getattr(self, key) is not None]
        if len(given) > 1:
            refuse(
                Fault(
                    "excluding-keys",
                    f"the force on the tool is given {'twice' if len(given) == 2 else 'thrice'}, "
                    f"by {' and by '.join(given)}",
                    found=" and ".join(given),
                    expected="one of them",
                )
            )
        if self.time is not None and self.temperature_log is None:
            refuse(
                Fault(
                    "missing-key",
                    "a time is given, but no temperature_log",
                    found="no temperature_log",
                    expected='temperature_log = "file.csv"',
                )
            )
        return self
