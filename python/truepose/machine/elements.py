"""The kernel's table of elements, and the families, as kinds of tables of the machine file.

Nothing here knows an element: names, dimensions, defaults and docs come from `_kernel.elements()`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import Field, ValidatorFunctionWrapHandler, WrapValidator, create_model

from truepose._kernel import elements
from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import (
    Angle,
    Direction,
    Length,
    Point,
    PositiveLength,
    Scale,
    SeriesStiffness,
    SeriesTorsionalStiffness,
    list_of,
    refuse,
)
from truepose.files.units import shown_value
from truepose.machine.families import REGISTRY, MachineFamily


@dataclass(frozen=True)
class ElementKind:
    """One kind of a drive or guide: its model of the file."""

    kind: str
    doc: str
    drawing: str
    model: type[FileTable]


@dataclass(frozen=True)
class DriveKind(ElementKind):
    """One kind of drive, and what its joint coordinate is."""

    coordinate: str
    """Dimension of the joint coordinate: `length` or `angle`."""
    sets_length: bool
    """Whether the joint coordinate is the strut's length, which the file then does not give."""

    @property
    def has_carriage(self) -> bool:
        """Whether it moves a carriage: neither the strut itself, nor an arm."""
        return self.coordinate == "length" and not self.sets_length


@dataclass(frozen=True)
class FamilyKind(ElementKind):
    """One family of machines: its drawing is one of characters."""

    model: type[MachineFamily]


@dataclass(frozen=True)
class GuideKind(ElementKind):
    """One kind of guide."""

    closures: int
    """How many freedoms it takes from the platform."""


def _ascending(value: Any, read: ValidatorFunctionWrapHandler) -> tuple[float, float]:
    start, stop = read(value)
    if not start < stop:
        refuse(
            Fault(
                "travel-reversed",
                "the travel ends where it starts or below",
                found=shown_value(value),
                expected="[from, to] with to above from",
                hint="swap the two" if start > stop else None,
            )
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


def _fixed_at(one: Any, sets_length: bool) -> Any:
    """Where what the position is measured by is held; of a strut's own scale, at its base joint."""
    what = "Joint coordinate at which screw, rack or scale is fixed."
    if sets_length:
        default = " Default: that at which the strut's length is 0, so that all of it grows."
        return (one | None, Field(None, description=what + default))
    return (one, Field(0.0, description=what))


@cache
def drive_kinds() -> dict[str, DriveKind]:
    """Every kind of drive, by the word that a file writes for it."""
    kinds = {}
    for entry in elements()["drive"]:
        coordinate: str = entry["coordinate"]
        one: Any = Angle if coordinate == "angle" else Length
        fields = _fields(entry, coordinate)
        fields["travel"] = (
            Annotated[tuple[one, one], list_of(2), WrapValidator(_ascending)],
            Field(description="First and last value of the joint coordinate."),
        )
        fields["fixed_at"] = _fixed_at(one, bool(entry["sets_length"]))
        fields["stiffness"] = (
            (SeriesTorsionalStiffness if coordinate == "angle" else SeriesStiffness) | None,
            Field(
                None,
                description="Stiffness along the joint coordinate; or a table of what is in "
                "series, such as `{ screw = ..., nut = ..., bearing = ... }`. Default: rigid.",
            ),
        )
        model: type[FileTable] = create_model(
            f"{entry['kind'].title()}Drive", __base__=FileTable, __doc__=entry["doc"], **fields
        )
        kinds[entry["kind"]] = DriveKind(
            entry["kind"],
            entry["doc"],
            entry["drawing"],
            model,
            coordinate,
            # Such a drive has nothing to draw beyond its strut, for it is the strut.
            bool(entry["sets_length"]),
        )
    return kinds


@cache
def guide_kinds() -> dict[str, GuideKind]:
    """Every kind of guide, by the word that a file writes for it."""
    kinds = {}
    for entry in elements()["guide"]:
        fields = _fields(entry, "length")
        model: type[FileTable] = create_model(
            f"{entry['kind'].title()}Guide", __base__=FileTable, __doc__=entry["doc"], **fields
        )
        kinds[entry["kind"]] = GuideKind(
            entry["kind"], entry["doc"], entry["drawing"], model, entry["closures"]
        )
    return kinds


@cache
def family_kinds() -> dict[str, FamilyKind]:
    """Every family of machines, by the word that a file writes for it."""
    return {
        family.kind: FamilyKind(family.kind, family.doc, family.drawing, family)
        for family in REGISTRY
    }


def kinds_of(table: str) -> Mapping[str, ElementKind]:
    """The kinds of a table or of its rows, by their word; none where there is but one."""
    of_table: dict[str, Callable[[], Mapping[str, ElementKind]]] = {
        "drive": drive_kinds,
        "guide": guide_kinds,
        "family": family_kinds,
    }
    return of_table[table]() if table in of_table else {}


@cache
def strut_geometry() -> type[FileTable]:
    """What the kernel knows of a strut."""
    (entry,) = elements()["strut"]
    fields = _fields(entry, "length")
    # Whether a strut has a length of its own depends on its drive, which `checks.py` looks at.
    doc = "Distance of its joint centres; not for a strut whose length is its drive's coordinate."
    fields["length"] = (PositiveLength | None, Field(None, description=doc))
    model: type[FileTable] = create_model(
        "StrutGeometry", __base__=FileTable, __doc__=entry["doc"], **fields
    )
    return model
