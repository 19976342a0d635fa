"""`[workspace]`: the poses to evaluate, and home."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import (
    Field,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
    model_validator,
)

from truepose.machine.file_table import FileTable
from truepose.machine.quantity import Angle, Length, refuse
from truepose.machine.units import shown_value, type_phrase


def _range(value: Any, read: ValidatorFunctionWrapHandler) -> tuple[float, float, int]:
    """`[from, to, count]`: a count of one or more, and equal ends where it is one."""
    if not isinstance(value, list) or len(value) != 3:
        found = f"a list of {len(value)}" if isinstance(value, list) else type_phrase(value)
        refuse(
            "wrong-type",
            f"expected [from, to, count], found {found}",
            found=shown_value(value),
            expected="[from, to, count], such as [200, 400, 5]",
        )
    count = value[2]
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        refuse(
            "grid-count",
            "a grid count is a whole number of one or more",
            found=shown_value(count),
            expected="a whole number of one or more",
            hint="for one value write [value, value, 1]",
        )
    start, stop, count = read(tuple(value))
    if count == 1 and start != stop:
        refuse(
            "grid-ends",
            "a grid of one value has two different ends",
            found=shown_value(value),
            expected="equal ends, or a count of two or more",
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


class WorkspaceTable(FileTable):
    """The poses that a budget is made for."""

    home: HomeTable | None = Field(
        None,
        description="Where the forward solution starts; what it does not name is 0. "
        "Default: the grid's centre.",
    )
    grid: GridTable | None = Field(
        None, description="A grid of poses, such as `{ x = [200, 400, 5], y = [100, 300, 5] }`."
    )
    poses: list[list[float | int | str]] | None = Field(
        None, description="The poses outright, one list per pose with the commanded freedoms."
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> WorkspaceTable:
        if self.grid is not None and self.poses is not None:
            refuse(
                "excluding-keys",
                "the poses are given twice, by grid and by poses",
                found="grid and poses",
                expected="one of them",
            )
        if self.grid is None and self.poses is None:
            refuse(
                "missing-key",
                "neither grid nor poses",
                found="no poses",
                expected="grid or poses",
            )
        return self
