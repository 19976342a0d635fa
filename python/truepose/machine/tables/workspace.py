"""`[workspace]`: the poses to evaluate, and home."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import (
    Field,
    GetJsonSchemaHandler,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import core_schema

from truepose.errors import Fault
from truepose.files.dimensions import FREEDOMS
from truepose.files.file_table import FileTable
from truepose.files.quantity import Angle, Length, PositiveAngle, PositiveLength, list_of, refuse
from truepose.files.units import shown_value, type_phrase


def _range(value: Any, read: ValidatorFunctionWrapHandler) -> tuple[float, float, int]:
    """`[from, to, count]`: a count of one or more, and equal ends where it is one."""
    if not isinstance(value, list) or len(value) != 3:
        found = f"a list of {len(value)}" if isinstance(value, list) else type_phrase(value)
        refuse(
            Fault(
                "wrong-type",
                f"expected [from, to, count], found {found}",
                found=shown_value(value),
                expected="[from, to, count], such as [200, 400, 5]",
            )
        )
    count = value[2]
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        refuse(
            Fault(
                "grid-count",
                "a grid count is a whole number of one or more",
                found=shown_value(count),
                expected="a whole number of one or more",
                hint="for one value write [value, value, 1]",
            )
        )
    start, stop, count = read(tuple(value))
    if count == 1 and start != stop:
        refuse(
            Fault(
                "grid-ends",
                "a grid of one value has two different ends",
                found=shown_value(value),
                expected="equal ends, or a count of two or more",
            )
        )
    return start, stop, count


def _schema(dimension: str) -> WithJsonSchema:
    return WithJsonSchema(
        {
            "type": "array",
            "minItems": 3,
            "maxItems": 3,
            "x-dimension": dimension,
            "x-grid": True,
        }
    )


LengthRange = Annotated[tuple[Length, Length, int], WrapValidator(_range), _schema("length")]
AngleRange = Annotated[tuple[Angle, Angle, int], WrapValidator(_range), _schema("angle")]


LengthSpan = Annotated[tuple[Length, Length], list_of(2)]
AngleSpan = Annotated[tuple[Angle, Angle], list_of(2)]

Rows = list[list[float | int | str]]


@dataclass(frozen=True)
class _FileOrRows:
    """A list of poses, or the name of a CSV file of them."""

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], core_schema.CoreSchema]
    ) -> core_schema.CoreSchema:
        def read(value: Any, read_rows: Callable[[Any], Rows]) -> Rows | str:
            return value if isinstance(value, str) else read_rows(value)

        return core_schema.no_info_wrap_validator_function(read, handler(Rows))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        number = {"anyOf": [{"type": "number"}, {"type": "string"}]}
        rows = {"type": "array", "items": {"type": "array", "items": number}}
        return {"anyOf": [rows, {"type": "string"}], "x-poses": True}


PoseRows = Annotated[Rows | str, _FileOrRows()]


class GridTable(FileTable):
    """From, to and count along each commanded freedom; one that is not named stays at home."""

    x: LengthRange | None = Field(None, description="Range of x.")
    y: LengthRange | None = Field(None, description="Range of y.")
    z: LengthRange | None = Field(None, description="Range of z.")
    a: AngleRange | None = Field(None, description="Range of the rotation about x.")
    b: AngleRange | None = Field(None, description="Range of the rotation about y.")
    c: AngleRange | None = Field(None, description="Range of the rotation about z.")


class HomeTable(FileTable):
    """The pose at which solutions start; the orientation is `R = Rz(c) Ry(b) Rx(a)`."""

    x: Length = Field(0.0, description="Home's x.")
    y: Length = Field(0.0, description="Home's y.")
    z: Length = Field(0.0, description="Home's z.")
    a: Angle = Field(0.0, description="Home's rotation about x.")
    b: Angle = Field(0.0, description="Home's rotation about y.")
    c: Angle = Field(0.0, description="Home's rotation about z.")


def _require_steps(
    table: BoxTable | CylinderTable, lengths: tuple[str, ...], angles: tuple[str, ...]
) -> None:
    """A span that is filled names the step to fill it with."""
    for names, key in ((lengths, "step"), (angles, "angle_step")):
        wide = [name for name in names if (span := getattr(table, name)) and span[0] != span[1]]
        if wide and getattr(table, key) is None:
            refuse(
                Fault(
                    "missing-key",
                    f"{key} is missing",
                    found=f"{', '.join(wide)} without {key}",
                    expected=f'{key} = "{"20 mm" if key == "step" else "5 deg"}", the largest '
                    "distance of two neighbours",
                )
            )


_POSITIONS = tuple(name for name, dimension in FREEDOMS.items() if dimension == "length")
_ANGLES = tuple(name for name, dimension in FREEDOMS.items() if dimension == "angle")


class BoxTable(FileTable):
    """Ends along each commanded freedom, filled with poses at most a step apart, ends included.

    A freedom that is not named stays at home.
    """

    x: LengthSpan | None = Field(None, description="Ends of x.")
    y: LengthSpan | None = Field(None, description="Ends of y.")
    z: LengthSpan | None = Field(None, description="Ends of z.")
    a: AngleSpan | None = Field(None, description="Ends of the rotation about x.")
    b: AngleSpan | None = Field(None, description="Ends of the rotation about y.")
    c: AngleSpan | None = Field(None, description="Ends of the rotation about z.")
    step: PositiveLength | None = Field(
        None, description="Largest distance of two neighbours along x, y and z."
    )
    angle_step: PositiveAngle | None = Field(
        None, description="Largest distance of two neighbours along a, b and c."
    )

    @model_validator(mode="after")
    def _steps(self) -> BoxTable:
        _require_steps(self, _POSITIONS, _ANGLES)
        return self


class CylinderTable(FileTable):
    """An upright cylinder, its axis along z: rings of poses about the axis, layer on layer.

    Neighbours are at most a step apart; axis, rim and ends are included. Other freedoms fill their
    span, or stay at home. The platform must have x and y commanded; without `z` it is a disc.
    """

    centre: Annotated[tuple[Length, Length], list_of(2)] | None = Field(
        None, description="Where the axis is, `[x, y]`. Default: home."
    )
    radius: PositiveLength = Field(description="Radius.")
    z: LengthSpan | None = Field(None, description="Ends along z.")
    a: AngleSpan | None = Field(None, description="Ends of the rotation about x.")
    b: AngleSpan | None = Field(None, description="Ends of the rotation about y.")
    c: AngleSpan | None = Field(None, description="Ends of the rotation about z.")
    step: PositiveLength = Field(description="Largest distance of two neighbours in space.")
    angle_step: PositiveAngle | None = Field(
        None, description="Largest distance of two neighbours along a, b and c."
    )

    @model_validator(mode="after")
    def _steps(self) -> CylinderTable:
        _require_steps(self, (), _ANGLES)
        return self


class PathTable(FileTable):
    """Poses on straight lines from point to point, passed through in their order.

    Every commanded freedom goes at a constant rate along a line, positions and angles alike.
    """

    points: PoseRows = Field(
        description="The points, one list per point with the commanded freedoms, or a CSV file."
    )
    step: PositiveLength | None = Field(
        None, description="Largest distance of two neighbours. Default: the points alone."
    )
    angle_step: PositiveAngle | None = Field(
        None, description="Largest turn between two neighbours, of any of a, b and c."
    )


WAYS = ("grid", "box", "cylinder", "poses", "path")
"""The keys of `[workspace]` of which a file has one."""


class WorkspaceTable(FileTable):
    """The poses that a budget is made for: one of `grid`, `box`, `cylinder`, `poses` and `path`."""

    home: HomeTable | None = Field(
        None,
        description="Where the forward solution starts; what it does not name is 0. "
        "Default: the middle of the poses.",
    )
    grid: GridTable | None = Field(
        None,
        description="A grid of poses, from, to and how many: `{ x = [200, 400, 5], "
        "y = [100, 300, 5] }`.",
    )
    box: BoxTable | None = Field(
        None,
        description="A box filled with poses at most a step apart, ends included, such as "
        "`{ x = [200, 400], z = [0, 50], step = 25 }`. A freedom that is not named stays at home.",
    )
    cylinder: CylinderTable | None = Field(
        None,
        description="An upright cylinder, `{ radius = 150, z = [0, 50], step = 25 }`: rings of "
        "poses about its axis, which is parallel to z, layer on layer; axis, rim and ends "
        "included. Without `z` it is a disc. Other freedoms fill their span, or stay at home.",
    )
    poses: PoseRows | None = Field(
        None,
        description="The poses outright, one list per pose with the commanded freedoms, or a CSV "
        "file of them.",
    )
    path: PathTable | None = Field(
        None,
        description="Poses on straight lines from point to point, passed through in their order, "
        "`{ points = [[0, 0], [100, 0]], step = 2 }`. Positions and angles go at constant rates "
        "along a line.",
    )

    @model_validator(mode="after")
    def _one_way(self) -> WorkspaceTable:
        given = [key for key in WAYS if getattr(self, key) is not None]
        if len(given) > 1:
            refuse(
                Fault(
                    "excluding-keys",
                    f"the poses are given {'twice' if len(given) == 2 else f'{len(given)} times'}, "
                    f"by {' and by '.join(given)}",
                    found=" and ".join(given),
                    expected="one of them",
                )
            )
        if not given:
            refuse(
                Fault(
                    "missing-key",
                    f"none of {', '.join(WAYS)}",
                    found="no poses",
                    expected="grid, box, cylinder, poses or path",
                )
            )
        return self
