"""`[units]`: the unit of the file's bare numbers, by dimension."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler, create_model
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from truepose.errors import Fault
from truepose.files.dimensions import DIMENSIONS
from truepose.files.file_table import FileTable
from truepose.files.quantity import refuse
from truepose.files.units import FileUnit, QuantityError, shown_value, type_phrase, unit_of


@dataclass(frozen=True)
class _DeclaredUnit:
    """Metadata of an `Annotated` type: the name of a unit of one dimension -> FileUnit."""

    dimension: str

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], core_schema.CoreSchema]
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_plain_validator_function(self._read)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"type": "string"}

    def _read(self, value: Any) -> FileUnit:
        wanted = DIMENSIONS[self.dimension]
        if not isinstance(value, str):
            refuse(
                Fault(
                    "wrong-type",
                    f"expected the name of a unit, found {type_phrase(value)}",
                    found=shown_value(value),
                    expected=f'the unit of {wanted.phrase}, such as "{wanted.si}"',
                )
            )
        try:
            return unit_of(value, wanted)
        except QuantityError as error:
            expected = f'the unit of {wanted.phrase}, such as "{wanted.si}"'
            refuse(replace(error.fault, expected=expected))


def _field(dimension: str) -> Any:
    description = f"Unit of bare {DIMENSIONS[dimension].plural}."
    if dimension == "temperature_difference":
        description += " Default: the degree of `temperature`."
    annotation = Annotated[FileUnit | None, _DeclaredUnit(dimension)]
    return (annotation, Field(None, description=description))


_FIELDS: dict[str, Any] = {name: _field(name) for name in DIMENSIONS if name != "ratio"}

UnitsTable: type[FileTable] = create_model(
    "UnitsTable",
    __base__=FileTable,
    __doc__="The unit of every bare number of the file, by dimension.",
    **_FIELDS,
)
