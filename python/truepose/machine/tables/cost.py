"""`[cost]`: what tolerances, materials and stiffnesses cost, from which a design is chosen.

A band has the unit of the parameters that it is for, which only the machine knows: bands are kept
here as the file writes them, and read by `machine.build_costs`.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from pydantic import Field, WithJsonSchema, model_validator

from truepose.errors import Fault
from truepose.files.file_table import FileTable, Name
from truepose.files.quantity import quantity, refuse

Tie = Literal["feature", "joint", "kind"]
CostModel = Literal["reciprocal", "reciprocal-square", "exponential"]

_WAYS = ("bands", "grades", "table")
_LAW = ("at", "cost")

_BAND = {"anyOf": [{"type": "number"}, {"type": "string"}], "x-takes": "half width, with a unit"}

_SET = {"type": "object", "x-takes": "table of keys"}

Band = Annotated[Any, WithJsonSchema(_BAND)]
Bands = Annotated[
    Any,
    WithJsonSchema(
        {
            "type": "array",
            "minItems": 1,
            "items": {"anyOf": _BAND["anyOf"]},
            "x-takes": "list of half widths",
        }
    ),
]


class ToleranceCostTable(FileTable):
    """One row: tolerances that may be chosen, of some parameters, and what each costs."""

    of: str = Field(
        description="A parameter, or a pattern over the names of parameters, as in `[tolerance]`."
    )
    bands: Bands | None = Field(
        None, description='Half widths to choose from, such as `["5 um", "10 um", "20 um"]`.'
    )
    grades: str | None = Field(
        None,
        description='In their place, grades of ISO 286-1, `"IT5:IT12"`, or `"IT5, IT7, IT9"`: of '
        "sizes above zero.",
    )
    table: str | None = Field(
        None, description="In their place, a CSV file with the columns `band` and `cost`."
    )
    model: CostModel | None = Field(
        None,
        description="How the cost rises with a finer half width t: `cost * at / t`, "
        "`cost * (at / t)^2` or `cost * exp((at - t) / scale)`. Default: `reciprocal`.",
    )
    at: Band | None = Field(None, description="The half width that costs `cost`.")
    cost: quantity("ratio", sign="positive") | None = Field(  # type: ignore[valid-type]
        None, description="Cost of the half width `at`, once for all that is tied."
    )
    scale: Band | None = Field(
        None, description="Of the exponential model: by how much finer costs e times as much."
    )
    tie: Tie = Field(
        "feature",
        description="What has one grade together: each parameter by itself, the coordinates of a "
        "joint, or the same of all parts of the kind.",
    )

    @model_validator(mode="after")
    def _one_way(self) -> ToleranceCostTable:
        given = [key for key in _WAYS if getattr(self, key) is not None]
        if len(given) != 1:
            refuse(
                Fault(
                    "excluding-keys" if given else "missing-key",
                    "what may be chosen is said once",
                    found=" and ".join(given) or f"none of {', '.join(_WAYS)}",
                    expected="bands, grades or table",
                )
            )
        law = [key for key in ("model", *_LAW, "scale") if getattr(self, key) is not None]
        if self.table is not None:
            if law:
                refuse(
                    Fault(
                        "excluding-keys",
                        "a table says itself what each band costs",
                        found=f"table and {' and '.join(law)}",
                        expected="table alone",
                    )
                )
            return self
        lacking = [key for key in _LAW if getattr(self, key) is None]
        exponential = self.model == "exponential"
        if exponential and self.scale is None:
            lacking.append("scale")
        if lacking:
            refuse(
                Fault(
                    "missing-key",
                    "nothing says what these bands cost",
                    found=f"no {' and no '.join(lacking)}",
                    expected=f'at = "10 um" and cost = 4{", and scale" if exponential else ""}',
                    hint="without costs of your own begin with docs/allocation.md",
                )
            )
        if self.scale is not None and not exponential:
            refuse(
                Fault(
                    "excluding-keys",
                    "a scale is that of the exponential model",
                    found=f'scale and model = "{self.model or get_args(CostModel)[0]}"',
                    expected='model = "exponential", or no scale',
                )
            )
        return self


class OptionTable(FileTable):
    """One of the options of a choice."""

    name: Name = Field(description="What it is called.")
    set: Annotated[dict[str, Any], WithJsonSchema(_SET)] = Field(
        description="Keys of the parts and their values, as the file would have them: "
        '`{ material = "carbon fibre", stiffness = "30 N/um" }`. `{}`: the file as it is.'
    )
    cost: quantity("ratio", sign="not negative") = Field(  # type: ignore[valid-type]
        description="What it costs, once for all parts that are tied."
    )


class ChoiceTable(FileTable):
    """One row: a material, a section, a class of stiffness to be chosen for some parts."""

    name: Name = Field(description="What is chosen, such as `rods`.")
    of: str = Field(description='A part, or a pattern over parts: `"strut.*"`, `"platform"`.')
    tie: bool = Field(True, description="Whether all these parts have the same option.")
    options: Annotated[list[OptionTable], Field(min_length=1)] = Field(
        description="What there is to choose from."
    )

    @model_validator(mode="after")
    def _distinct(self) -> ChoiceTable:
        names = [option.name for option in self.options]
        doubled = sorted({name for name in names if names.count(name) > 1})
        if doubled:
            refuse(
                Fault(
                    "duplicate-name",
                    "two options of one name",
                    found=", ".join(doubled),
                    expected="a name of its own for every option",
                )
            )
        return self


class CostTable(FileTable):
    """What tolerances, materials and stiffnesses cost, from which a design is chosen.

    No other command asks it. `[[cost.tolerance]]` and `[[cost.choice]]` are rows; a
    parameter stands in one row.
    """

    unit: str = Field("", description='Of all costs, such as `"EUR"`; nothing is converted.')
    tolerance: list[ToleranceCostTable] = Field([], description="Tolerances that may be chosen.")
    choice: list[ChoiceTable] = Field([], description="What else may be chosen.")
