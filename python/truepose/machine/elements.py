"""The kernel's table of elements as models of the machine file.

Nothing here knows an element: names, dimensions, defaults and docs come from `_kernel.elements()`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import Field, ValidatorFunctionWrapHandler, WrapValidator, create_model

from truepose import _kernel
from truepose.machine.file_table import FileTable
from truepose.machine.quantity import (
    Angle,
    Direction,
    Length,
    Point,
    PositiveLength,
    Scale,
    list_of,
    refuse,
)
from truepose.machine.units import shown_value


@dataclass(frozen=True)
class DriveKind:
    """One kind of drive: its model of the file, and what its joint coordinate is."""

    kind: str
    doc: str
    drawing: str
    coordinate: str
    """Dimension of the joint coordinate: `length` or `angle`."""
    sets_length: bool
    """Whether the joint coordinate is the strut's length, which the file then does not give."""
    model: type[FileTable]


def _ascending(value: Any, read: ValidatorFunctionWrapHandler) -> tuple[float, float]:
    start, stop = read(value)
    if not start < stop:
        refuse(
            "travel-reversed",
            "the travel ends where it starts or below",
            found=shown_value(value),
            expected="[from, to] with to above from",
            hint="swap the two" if start > stop else None,
        )
    return start, stop


def _type(dimension: str, shape: int, coordinate: str) -> Any:
    if dimension == "coordinate":
        dimension = coordinate
    types: dict[tuple[str, int], Any] = {
        ("length", 0): Length,
        ("length", 3): Point,
        ("angle", 0): Angle,
        ("scale", 0): Scale,
        ("direction", 3): Direction,
    }
    return types[dimension, shape]


def _fields(entry: dict[str, Any], coordinate: str) -> dict[str, Any]:
    fields: dict[str, Any] = {}
    for field in entry["fields"]:
        default = ... if field["default"] is None else field["default"]
        if isinstance(default, list):
            default = tuple(default)
        fields[field["name"]] = (
            _type(field["dimension"], field["shape"], coordinate),
            Field(default, description=field["doc"]),
        )
    return fields


@cache
def drive_kinds() -> dict[str, DriveKind]:
    """Every kind of drive, by the word that a file writes for it."""
    kinds = {}
    for entry in _kernel.elements()["drive"]:
        coordinate: str = entry["coordinate"]
        one: Any = Angle if coordinate == "angle" else Length
        fields = _fields(entry, coordinate)
        fields["travel"] = (
            Annotated[tuple[one, one], list_of(2), WrapValidator(_ascending)],
            Field(description="First and last value of the joint coordinate."),
        )
        model: type[FileTable] = create_model(
            f"{entry['kind'].title()}Drive", __base__=FileTable, __doc__=entry["doc"], **fields
        )
        kinds[entry["kind"]] = DriveKind(
            entry["kind"],
            entry["doc"],
            entry["drawing"],
            coordinate,
            # Such a drive has nothing to draw beyond its strut, for it is the strut.
            bool(entry["sets_length"]),
            model,
        )
    return kinds


@cache
def strut_geometry() -> type[FileTable]:
    """What the kernel knows of a strut."""
    (entry,) = _kernel.elements()["strut"]
    fields = _fields(entry, "length")
    # Whether a strut has a length of its own depends on its drive, which `checks.py` looks at.
    doc = "Distance of its joint centres; not for a strut whose length is its drive's coordinate."
    fields["length"] = (PositiveLength | None, Field(None, description=doc))
    model: type[FileTable] = create_model(
        "StrutGeometry", __base__=FileTable, __doc__=entry["doc"], **fields
    )
    return model
