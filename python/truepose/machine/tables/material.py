"""The name of a material, wherever a table takes one."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

from truepose.errors import Fault
from truepose.files.quantity import refuse
from truepose.files.units import shown_value
from truepose.files.wording import did_you_mean, one_of
from truepose.machine.materials import MATERIALS


def _known_material(value: str) -> str:
    if value not in MATERIALS:
        refuse(
            Fault(
                "unknown-material",
                f"unknown material {shown_value(value)}",
                found=shown_value(value),
                expected=one_of(f'"{name}"' for name in MATERIALS),
                hint=did_you_mean(value, MATERIALS) or "give modulus and expansion outright",
            )
        )
    return value


MaterialName = Annotated[
    str,
    AfterValidator(_known_material),
    WithJsonSchema({"type": "string", "enum": list(MATERIALS)}),
]
