"""Materials that a part may name: modulus of elasticity and expansion, each with its source.

Typical values at room temperature for a first budget. What matters is written outright in the
machine file: `modulus` and `expansion` win over those of `material`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import AfterValidator, WithJsonSchema

from truepose.errors import Fault
from truepose.files.quantity import refuse
from truepose.files.units import shown_value
from truepose.files.wording import did_you_mean, one_of


@dataclass(frozen=True)
class Material:
    """Young's modulus (Pa) along the part and linear expansion coefficient (1/K).

    `poisson`: Poisson's ratio, None of a material that is not alike in all directions.
    """

    name: str
    modulus: float
    expansion: float
    source: str
    poisson: float | None = None


MATERIALS: dict[str, Material] = {
    material.name: material
    for material in (
        Material(
            "steel",
            210e9,
            12e-6,
            "EN 1993-1-1, 3.2.6: structural steel, up to 100 degC",
            0.3,
        ),
        Material(
            "aluminium",
            70e9,
            23e-6,
            "EN 1999-1-1, 3.2.5: structural aluminium alloys",
            0.3,
        ),
        Material(
            "cast iron",
            110e9,
            11e-6,
            "EN 1561, annex: grey iron EN-GJL-250, 103 to 118 GPa; expansion between its values "
            "below 20 degC (10e-6) and from 20 to 200 degC (11.7e-6), which want confirming; "
            "Poisson's ratio 0.26",
            0.26,
        ),
        Material(
            "invar",
            141e9,
            1.2e-6,
            "makers' data sheets of Invar 36, annealed: 20.5e6 psi, 1.18e-6 1/K from 25 to 100 "
            "degC; ASTM F1684 allows more, and cold work changes it; Poisson's ratio 0.29",
            0.29,
        ),
        Material(
            "carbon fibre",
            134e9,
            -0.2e-6,
            "maker's data sheet of a pultruded tube (Goodwinds), along its axis, 60 % of fibre by "
            "volume; the layers decide, so a wound tube is another material",
        ),
    )
}


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
"""The name of a material, wherever a table takes one."""
