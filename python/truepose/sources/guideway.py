"""Guideway of a carriage: it is not straight, and not quite where it should point.

    straightness  shift of origin along its direction = amplitude * shape(q)
                  or, where the amplitude is but a bound, half of origin = amplitude * |shape(q)|
    table         shift of origin along each direction = measured deviation at q
    lean          half of axis.u and axis.v = slope, or along one direction, to the first order,
                  half of origin = slope * |scale q + offset|

at the joint coordinate q. `docs/sources/guideway.md` has the shapes and the reference.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BaseModel, BeforeValidator, Field, WithJsonSchema, model_validator

from truepose.arrays import Floats
from truepose.errors import Fault
from truepose.files.data_file import Column
from truepose.files.file_table import FileTable
from truepose.files.quantity import Direction, Length, PositiveLength, refuse
from truepose.files.ratio import SlopeWithin, one_or_limits
from truepose.files.tolerance import Band
from truepose.files.varies import ByItself
from truepose.machine.chains import Vector
from truepose.machine.elements import drive_kinds
from truepose.sources._columns import Columns
from truepose.sources._coverage import uncovered
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock
from truepose.sources.variation import (
    WITH_MACHINE,
    Variation,
    refuse_without_band,
    variation,
)

if TYPE_CHECKING:
    from truepose.machine import Condition, Drive, Machine, SourceBuilder

ALONG = 1e-2
"""Cosine of the angle between a direction and the guideway above which it is not across it."""

SHAPES: Mapping[str, Callable[[Floats], Floats]] = {
    "bow": lambda way: 4.0 * way * (1.0 - way),
    "s": lambda way: 6.0 * math.sqrt(3.0) * way * (1.0 - way) * (1.0 - 2.0 * way),
    "sine": lambda way: np.sin(math.tau * way),
}
"""Deviation over amplitude at the fraction of the travel, or, of a sine, of its period."""

_POSITION = "position"


class StraightnessTable(FileTable):
    """How far a carriage is off the straight line between the ends of its travel."""

    direction: Direction = Field(description="Across the guideway, base axes.")
    amplitude: Length = Field(description="Largest deviation of the shape.")
    shape: Literal["bow", "s", "sine"] = Field(
        description="One arc, one arc to each side, or a sine; 0 at both ends."
    )
    period: PositiveLength | None = Field(
        None, description="Of a sine that starts with the travel. Default: the whole travel."
    )
    known: bool = Field(
        False, description="Whether the amplitude is what was measured, and not its bound."
    )
    varies: ByItself | None = Field(
        None, description="What an amplitude that is not known varies with. Default: machine."
    )

    @model_validator(mode="after")
    def _fits(self) -> StraightnessTable:
        if self.period is not None and self.shape != "sine":
            refuse(
                Fault(
                    "excluding-keys",
                    "only a sine has a period",
                    found=f'period and shape = "{self.shape}"',
                    expected='shape = "sine", or no period',
                )
            )
        if not self.known and self.amplitude < 0.0:
            refuse(
                Fault(
                    "negative",
                    "a bound of the amplitude is zero or more",
                    found="an amplitude below zero that is not known",
                    expected="an amplitude of zero or more, or known = true",
                )
            )
        if self.known and self.varies is not None:
            refuse_without_band(
                "varies",
                "nothing does where the amplitude is known",
                "varies and known = true",
                "one of them",
            )
        return self


class LeanTable(FileTable):
    """How far a guideway points another way than it should."""

    band: SlopeWithin = Field(description="Angle, or rise over a length.")
    direction: Direction | None = Field(
        None, description="Towards which it leans, base axes. Default: any, across the guideway."
    )
    varies: ByItself | None = Field(
        None, description="What it varies with inside the band. Default: machine."
    )

    @model_validator(mode="after")
    def _round(self) -> LeanTable:
        if self.varies is not None and self.band.half == 0.0:
            refuse_without_band(
                "varies", "nothing does where the angle is known", "limits that are one", "a band"
            )
        if self.direction is None and self.band.shift != 0.0:
            refuse(
                Fault(
                    "missing-key",
                    "the limits are not alike, so the direction between them counts",
                    found="two limits, and no direction",
                    expected='one half band, or { band = ["0 um/m", "20 um/m"], direction = ... }',
                )
            )
        return self


def _as_table(value: Any) -> Any:
    return value if isinstance(value, dict) else {"band": value}


_LEAN_SCHEMA = one_or_limits("angle") | {"x-slope": True}
_LEAN_SCHEMA["anyOf"].append({"type": "object"})
Lean = Annotated[LeanTable, BeforeValidator(_as_table), WithJsonSchema(_LEAN_SCHEMA)]


class GuidewayTable(FileTable):
    """What a carriage runs on."""

    straightness: list[StraightnessTable] = Field(
        [],
        description="Deviations of a stated shape, such as `[{ direction = [1, 0, 0], "
        'amplitude = "5 um", shape = "bow" }]`.',
    )
    table: str | None = Field(
        None,
        description="CSV file of measured straightness, relative to this file: column position, "
        "and one for each of `directions`.",
    )
    directions: dict[str, Direction] | None = Field(
        None,
        description="Columns of the table: a unit vector each, across the guideway, base axes.",
    )
    squareness: Lean | None = Field(
        None,
        description="To what it should stand square to: such as `20 um/m` in any direction, or "
        '`{ band = "20 um/m", direction = [1, 0, 0] }`.',
    )
    parallelism: Lean | None = Field(
        None, description="To what it should be parallel to, as `squareness`."
    )

    @model_validator(mode="after")
    def _complete(self) -> GuidewayTable:
        if (self.table is None) != (self.directions is None):
            given, lacking = "table", "directions"
            if self.table is None:
                given, lacking = lacking, given
            refuse(
                Fault(
                    "missing-key",
                    "a table needs a direction for each of its columns",
                    found=f"{given}, but no {lacking}",
                    expected='table = "rail1.csv" and directions = { horizontal = [1, 0, 0] }',
                )
            )
        if self.directions is not None and (not self.directions or _POSITION in self.directions):
            refuse(
                Fault(
                    "bad-name",
                    "directions are named by the columns of deviations",
                    found=f"the name {_POSITION}" if self.directions else "no direction",
                    expected="a name and direction for each column of deviations",
                )
            )
        if not (self.straightness or self.table or self.squareness or self.parallelism):
            refuse(
                Fault(
                    "missing-key",
                    "a guideway of no error",
                    found="none of straightness, table, squareness and parallelism",
                    expected='one of them, such as squareness = "20 um/m"',
                )
            )
        return self


class DriveGuideway(BaseModel):
    """What a `[[drive]]` says about its guideway."""

    guideway: GuidewayTable | None = Field(
        None,
        description='Errors of a carriage\'s guideway, such as `{ squareness = "20 um/m" }`; for '
        "a slider.",
    )


@dataclass(frozen=True)
class Shape:
    """Deviation `amplitude` (m) times `shape` along unit `direction`, from `start` of the travel.

    It is over (or, of a sine, begins again) after `period` (m). `known`, or but a bound.
    """

    shape: str
    amplitude: float
    direction: Vector
    start: float
    period: float
    known: bool
    variation: Variation = WITH_MACHINE


@dataclass(frozen=True, eq=False)
class Profile:
    """Deviations (m,) along unit `direction` measured at joint coordinates `positions` (m,), m."""

    direction: Vector
    positions: Floats
    deviations: Floats


@dataclass(frozen=True)
class LeanTowards:
    """Slope towards a unit `direction`, or, where that is None, round the guideway."""

    band: Band
    direction: Vector | None
    variation: Variation = WITH_MACHINE


@dataclass(frozen=True, eq=False)
class Rail:
    """One drive's guideway: its path and number, and what is known of it."""

    drive: str
    joint: int
    shapes: tuple[Shape, ...]
    profiles: tuple[Profile, ...]
    leans: tuple[LeanTowards, ...]


@dataclass(frozen=True, eq=False)
class Guideway:
    """Straightness of guideways, and how far they lean."""

    name: ClassVar[str] = "guideway"
    doc: ClassVar[str] = "straightness, squareness and parallelism of the guideways"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"drive": DriveGuideway}
    sets_overall_edges: ClassVar[bool] = False

    rails: tuple[Rail, ...]

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From `guideway` of the drives; None where no drive has it."""
        rails = []
        for joint, (drive, row) in enumerate(
            zip(parts.drives, parts.rows(DriveGuideway), strict=True)
        ):
            if row.guideway is None:
                continue
            if drive.carriage is None:
                runs = [f'kind = "{k.kind}"' for k in drive_kinds().values() if k.has_carriage]
                parts.refuse(
                    Fault(
                        "unwanted-guideway",
                        "only a carriage runs on a guideway",
                        found=f'kind = "{drive.kind}"',
                        expected=f"{' or '.join(runs)}, or no guideway",
                        hint="what else a drive's axis and position may be off, [tolerance] says",
                    ),
                    f"{drive.part}.guideway",
                )
                continue
            rails.append(_rail(parts, joint, drive, row.guideway))
        return cls(tuple(rails)) if rails else None

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Of origins, m, and axes, rad, (n or 1, k)."""
        columns = Columns()
        for rail in self.rails:
            moved = _Moved(columns, machine, rail.drive)
            joint = block.drive_joints[:, rail.joint]
            for shape in rail.shapes:
                reach = shape.amplitude * SHAPES[shape.shape]((joint - shape.start) / shape.period)
                where = {"shift" if shape.known else "half_width": reach}
                moved.along(shape.direction, **where, variation=shape.variation)
            for profile in rail.profiles:
                moved.along(
                    profile.direction, np.interp(joint, profile.positions, profile.deviations)
                )
            for lean in rail.leans:
                moved.lean(lean, joint)
        return columns.deviation()


class _Moved:
    """Adds columns of one drive."""

    def __init__(self, columns: Columns, machine: Machine, drive: str) -> None:
        self._columns = columns
        self._at = {
            name: machine.parameters.index(f"{drive}.{name}")
            for name in ("origin.x", "origin.y", "origin.z", "axis.u", "axis.v", "scale", "offset")
        }
        self._scale, self._offset = machine.nominal[[self._at["scale"], self._at["offset"]]]

    def along(
        self,
        direction: Vector,
        shift: Floats | float = 0.0,
        half_width: Floats | float = 0.0,
        variation: Variation = WITH_MACHINE,
    ) -> None:
        """The carriage along a unit direction, m, as one variable; coordinates have no edges."""
        group = self._columns.new_group()
        for axis, component in zip("xyz", direction, strict=True):
            if component != 0.0:
                parameter = self._at[f"origin.{axis}"]
                self._columns.add(
                    parameter,
                    component * shift,
                    component * half_width,
                    group=group,
                    edge=False,
                    variation=variation,
                )

    def lean(self, lean: LeanTowards, joint: Floats) -> None:
        """The axis, in both its freedoms by itself, or the carriage by its way along the axis."""
        if lean.direction is None:
            for freedom in ("axis.u", "axis.v"):
                self._columns.add(
                    self._at[freedom],
                    half_width=lean.band.half,
                    edge=False,
                    variation=lean.variation,
                )
            return
        way = self._scale * joint + self._offset
        self.along(lean.direction, lean.band.shift * way, lean.band.half * way, lean.variation)


def _rail(parts: SourceBuilder, joint: int, drive: Drive, row: GuidewayTable) -> Rail:
    path = f"{drive.part}.guideway"
    start, stop = drive.travel
    shapes = []
    for number, entry in enumerate(row.straightness):
        direction = _across(parts, drive, entry.direction, f"{path}.straightness", number)
        period = stop - start if entry.period is None else entry.period
        shapes.append(
            Shape(
                entry.shape,
                entry.amplitude,
                direction,
                start,
                period,
                entry.known,
                variation(entry.varies, WITH_MACHINE),
            )
        )
    leans = []
    for key in ("squareness", "parallelism"):
        lean: LeanTable | None = getattr(row, key)
        if lean is not None:
            towards = lean.direction
            if towards is not None:
                towards = _across(parts, drive, towards, f"{path}.{key}")
            leans.append(LeanTowards(lean.band, towards, variation(lean.varies, WITH_MACHINE)))
    profiles = _profiles(parts, drive, row, path)
    return Rail(drive.part, joint, tuple(shapes), profiles, tuple(leans))


def _across(
    parts: SourceBuilder, drive: Drive, direction: Vector, path: str, number: int | None = None
) -> Vector:
    """The part of a unit direction across the guideway, as a unit vector; a problem, if along."""
    given, axis = np.array(direction), np.array(drive.fields["axis"], np.float64)
    along = float(given @ axis)
    if abs(along) > ALONG:
        parts.refuse(
            Fault(
                "direction-along-guideway",
                "a direction that is not across the guideway"
                + ("" if number is None else f", in entry {number + 1}"),
                found=f"{math.degrees(math.acos(min(abs(along), 1.0))):.4g} deg to the axis",
                expected=f"a direction at right angles to the axis {axis.tolist()}",
                hint="errors along the guideway are those of sensor and actuator",
            ),
            path,
        )
        return direction
    across = given - along * axis
    x, y, z = (across / np.linalg.norm(across)).tolist()
    return (x, y, z)


def _profiles(
    parts: SourceBuilder, drive: Drive, row: GuidewayTable, path: str
) -> tuple[Profile, ...]:
    if row.table is None or row.directions is None:
        return ()
    directions = {
        name: _across(parts, drive, direction, f"{path}.directions.{name}")
        for name, direction in row.directions.items()
    }
    columns = [Column(name, "length") for name in (_POSITION, *directions)]
    table = parts.data_file(row.table, columns, f"{path}.table")
    if table is None:
        return ()
    positions = table.numbers[_POSITION]
    order = np.argsort(positions, kind="stable")
    doubled = np.flatnonzero(np.diff(positions[order]) == 0.0)
    if doubled.size:
        at = int(order[doubled[0] + 1])
        parts.problems.append(
            table.problem(
                Fault(
                    "doubled-position",
                    "the position is there twice",
                    found=table.shown(_POSITION, at),
                    expected="every position once",
                    hint="of repeated runs, write the mean",
                ),
                row=at,
                column=_POSITION,
            )
        )
    parts.problems.extend(uncovered(drive, table, _POSITION))
    return tuple(
        Profile(direction, positions[order], table.numbers[name][order])
        for name, direction in directions.items()
    )
