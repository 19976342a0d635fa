"""Types for the fields of a machine file: quantities with a dimension, points, directions.

Each is a pydantic type whose validated value is a plain SI float (or a tuple of them). The units
of bare numbers come with the validation's context: `context={"units": UnitSystem}`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NoReturn

from pydantic import BeforeValidator, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

from truepose.errors import Fault
from truepose.files.dimensions import DIMENSIONS
from truepose.files.tolerance import TABLE_KEYS, Tolerance, read_tolerance
from truepose.files.tolerance_standards import designations
from truepose.files.units import QuantityError, UnitSystem, shown_value, type_phrase

Sign = Literal["any", "positive", "not negative"]


def refuse(fault: Fault) -> NoReturn:
    """Refuse a value inside a pydantic validator; the fault stands in the error's context."""
    raise PydanticCustomError(fault.code, "{message}", {"message": fault.message, "fault": fault})


def _units(info: ValidationInfo) -> UnitSystem:
    context = info.context
    if not context or "units" not in context:
        raise RuntimeError("a quantity is validated with context={'units': UnitSystem}")
    units = context["units"]
    assert isinstance(units, UnitSystem)
    return units


@dataclass(frozen=True)
class FileType:
    """Metadata of an `Annotated` type: a validator, and the JSON schema of what a file writes."""

    dimension: str

    def of(self, info: ValidationInfo) -> FileType:
        """The type that reads a value in this place of the file."""
        return self

    def read(self, value: Any, units: UnitSystem) -> Any:
        """The value in SI. Raises as `refuse` does."""
        raise NotImplementedError

    def json_schema(self) -> JsonSchemaValue:
        """What the machine file's schema says of it."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(
        self, source: Any, handler: Callable[[Any], core_schema.CoreSchema]
    ) -> core_schema.CoreSchema:
        def validate(value: Any, info: ValidationInfo) -> Any:
            try:
                return self.of(info).read(value, _units(info))
            except QuantityError as error:
                refuse(error.fault)

        return core_schema.with_info_plain_validator_function(validate)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return self.json_schema()


@dataclass(frozen=True)
class _Quantity(FileType):
    """One number; `hint` is for who writes one of the wrong sign."""

    sign: Sign = "any"
    hint: str | None = None

    def read(self, value: Any, units: UnitSystem) -> float:
        result = units.read(value, self.dimension)
        phrase = DIMENSIONS[self.dimension].phrase
        if self.sign == "positive" and result <= 0.0:
            zero = "absolute zero" if self.dimension == "temperature" else "zero"
            raise QuantityError(
                "not-positive",
                f"expected {phrase} above {zero}, found {shown_value(value)}",
                found=shown_value(value),
                expected=f"{phrase} above {zero}",
                hint=self.hint,
            )
        if self.sign == "not negative" and result < 0.0:
            raise QuantityError(
                "negative",
                f"expected {phrase} of zero or more, found {shown_value(value)}",
                found=shown_value(value),
                expected=f"{phrase} of zero or more",
                hint=self.hint,
            )
        return result

    def json_schema(self) -> JsonSchemaValue:
        number: JsonSchemaValue = {"type": "number"}
        # Zero of a unit is zero in SI, except on a temperature scale.
        if self.dimension != "temperature" and self.sign == "positive":
            number["exclusiveMinimum"] = 0
        elif self.sign == "not negative":
            number["minimum"] = 0
        return {"anyOf": [number, {"type": "string"}], "x-dimension": self.dimension}


@dataclass(frozen=True)
class _Fraction(_Quantity):
    """A plain number from 0 to 1; a `proper` one is below 1."""

    proper: bool = False

    def read(self, value: Any, units: UnitSystem) -> float:
        result = super().read(value, units)
        if not 0.0 <= result <= 1.0 or (self.proper and result == 1.0):
            wanted = "from 0 to below 1" if self.proper else "from 0 to 1"
            raise QuantityError(
                "not-a-fraction",
                f"expected a fraction {wanted}, found {shown_value(value)}",
                found=shown_value(value),
                expected=f"a plain number {wanted}",
            )
        return result

    def json_schema(self) -> JsonSchemaValue:
        upper = "exclusiveMaximum" if self.proper else "maximum"
        number = {"type": "number", "minimum": 0, upper: 1}
        return {"anyOf": [number, {"type": "string"}], "x-dimension": self.dimension}


@dataclass(frozen=True)
class _Stiffness(_Quantity):
    """A stiffness above zero; with `rigid`, also an infinite one."""

    sign: Sign = "positive"
    rigid: bool = False

    def read(self, value: Any, units: UnitSystem) -> float:
        if self.rigid and value in (math.inf, RIGID):
            return math.inf
        if units.read(value, self.dimension) == 0.0:
            raise QuantityError(
                "not-positive",
                "a stiffness of zero cannot carry a load",
                found=shown_value(value),
                expected=f"{DIMENSIONS[self.dimension].phrase} above zero",
                hint="leave the key out where the strut is rigid",
            )
        return super().read(value, units)


@dataclass(frozen=True)
class _Series(_Stiffness):
    """One stiffness, or a table of several named as one likes, which are in series."""

    def read(self, value: Any, units: UnitSystem) -> float:
        if not isinstance(value, dict):
            return super().read(value, units)
        if not value:
            raise QuantityError(
                "missing-key",
                "no stiffness in the table",
                found="{}",
                expected='one or more, such as { screw = "80 N/um", nut = "200 N/um" }',
            )
        stiffnesses = []
        for name, entry in value.items():
            try:
                stiffnesses.append(super().read(entry, units))
            except QuantityError as error:
                error.message = f"{name}: {error.message}"
                raise
        return 1.0 / sum(1.0 / stiffness for stiffness in stiffnesses)

    def json_schema(self) -> JsonSchemaValue:
        one = super().json_schema()
        table = {"type": "object", "additionalProperties": {"anyOf": one["anyOf"]}}
        return one | {"anyOf": [*one["anyOf"], table], "x-series": True}


@dataclass(frozen=True)
class _PerAxis(_Stiffness):
    """Stiffness along or about some axes: one for all, or a list of them; `inf` is rigid."""

    rigid: bool = True
    axes: tuple[str, ...] = ("x", "y", "z")

    def read(self, value: Any, units: UnitSystem) -> Any:
        if not isinstance(value, list):
            return (super().read(value, units),) * len(self.axes)
        if len(value) != len(self.axes):
            raise QuantityError(
                "wrong-type",
                f"expected one stiffness or a list of {len(self.axes)}, found a list of "
                f"{len(value)}",
                found=shown_value(value),
                expected=f"one stiffness, or [{', '.join(self.axes)}]",
                hint="inf is a rigid one",
            )
        return tuple(super(_PerAxis, self).read(component, units) for component in value)

    def json_schema(self) -> JsonSchemaValue:
        one = super().json_schema()
        several = {
            "type": "array",
            "items": {"anyOf": one["anyOf"]},
            "minItems": len(self.axes),
            "maxItems": len(self.axes),
        }
        return one | {"anyOf": [*one["anyOf"], several], "x-per-axis": list(self.axes)}


@dataclass(frozen=True)
class _PerWay(_Quantity):
    """A plain number above zero along y and z: one for both, or a list of them."""

    def read(self, value: Any, units: UnitSystem) -> Any:
        if not isinstance(value, list):
            return (super().read(value, units),) * 2
        if len(value) != 2:
            raise QuantityError(
                "wrong-type",
                f"expected one number or a list of 2, found a list of {len(value)}",
                found=shown_value(value),
                expected="one number, or [along y, along z]",
            )
        return tuple(super(_PerWay, self).read(component, units) for component in value)


@dataclass(frozen=True)
class _PerLimb(_Quantity):
    """A quantity of each limb: one for all, unless they differ by nature, or a list of them."""

    limbs: int = 3
    alike: bool = True

    def read(self, value: Any, units: UnitSystem) -> Any:
        phrase = DIMENSIONS[self.dimension].phrase
        if not isinstance(value, list) and self.alike:
            return (super().read(value, units),) * self.limbs
        if not isinstance(value, list) or len(value) != self.limbs:
            found = f"a list of {len(value)}" if isinstance(value, list) else type_phrase(value)
            wanted = f"a list of {self.limbs}, one for each limb"
            expected = f"{phrase}, or {wanted}" if self.alike else wanted
            raise QuantityError(
                "wrong-type",
                f"expected {expected}, found {found}",
                found=shown_value(value),
                expected=expected,
            )
        return tuple(super(_PerLimb, self).read(component, units) for component in value)

    def json_schema(self) -> JsonSchemaValue:
        one = super().json_schema()
        several = {
            "type": "array",
            "items": {"anyOf": one["anyOf"]},
            "minItems": self.limbs,
            "maxItems": self.limbs,
        }
        choices = [*one["anyOf"], several] if self.alike else [several]
        return one | {"anyOf": choices, "x-per-limb": self.limbs, "x-alike": self.alike}


@dataclass(frozen=True)
class _Gradient(_Quantity):
    """A gradient along a part, kept as the first of three components, or a list of all three."""

    def read(self, value: Any, units: UnitSystem) -> Any:
        if not isinstance(value, list):
            return (super().read(value, units), 0.0, 0.0)
        if len(value) != 3:
            raise QuantityError(
                "wrong-type",
                f"expected one gradient or a list of 3, found a list of {len(value)}",
                found=shown_value(value),
                expected="one gradient, or [x, y, z]",
            )
        x, y, z = (super(_Gradient, self).read(component, units) for component in value)
        return (x, y, z)


@dataclass(frozen=True)
class _OfDrive(_Quantity):
    """A quantity of `dimension`, or, of a drive whose coordinate is an angle, of `angular`.

    The validation's context says which: `context={"coordinate": "angle"}`. Where the drive's kind
    is not known, and thus refused, the value is not looked at.
    """

    angular: str = ""

    def of(self, info: ValidationInfo) -> FileType:
        coordinate = (info.context or {}).get("coordinate")
        if coordinate is None:
            return self
        return _Quantity(self.angular if coordinate == "angle" else self.dimension, self.sign)

    def read(self, value: Any, units: UnitSystem) -> float:
        return math.nan

    def json_schema(self) -> JsonSchemaValue:
        return super().json_schema() | {"x-angular": self.angular}


@dataclass(frozen=True)
class _Tolerance(FileType):
    def read(self, value: Any, units: UnitSystem) -> Tolerance:
        return read_tolerance(value, self.dimension, units)

    def json_schema(self) -> JsonSchemaValue:
        quantity = _Quantity(self.dimension).json_schema()["anyOf"]
        limits = {
            "type": "array",
            "items": {"anyOf": quantity},
            "minItems": 2,
            "maxItems": 2,
        }
        keys = {key: {"description": meaning} for key, meaning in TABLE_KEYS.items()}
        table = {"type": "object", "properties": keys, "additionalProperties": False}
        return {
            "anyOf": [limits, *quantity, table],
            "x-dimension": self.dimension,
            "x-tolerance": list(designations("length")) if self.dimension == "length" else [],
        }


@dataclass(frozen=True)
class _Unitise(FileType):
    """A direction: three plain numbers that are not all zero, made of length one."""

    def read(self, value: Any, units: UnitSystem) -> tuple[float, float, float]:
        if not isinstance(value, (list, tuple)) or len(value) != 3:
            raise QuantityError(
                "wrong-type",
                "expected a direction: a list of 3 plain numbers",
                found=shown_value(value),
                expected="a list of 3 plain numbers, such as [0, 0, 1]",
            )
        x, y, z = (units.read(component, "ratio") for component in value)
        # Largest component first, so that neither tiny nor huge ones under- or overflow.
        largest = max(abs(x), abs(y), abs(z))
        if largest == 0.0:
            raise QuantityError(
                "zero-direction",
                "a direction has a length above zero",
                found=shown_value(value),
                expected="at least one component that is not zero",
            )
        norm = math.hypot(x / largest, y / largest, z / largest)
        return (x / largest / norm, y / largest / norm, z / largest / norm)

    def json_schema(self) -> JsonSchemaValue:
        return {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 3,
            "maxItems": 3,
            "x-dimension": "direction",
        }


def list_of(count: int) -> BeforeValidator:
    """A list of so many entries, as the tuple that a strict model takes."""

    def read(value: Any) -> Any:
        if not isinstance(value, list) or len(value) != count:
            found = f"a list of {len(value)}" if isinstance(value, list) else type_phrase(value)
            refuse(
                Fault(
                    "wrong-type",
                    f"expected a list of {count}, found {found}",
                    found=shown_value(value),
                    expected=f"a list of {count}",
                )
            )
        return tuple(value)

    return BeforeValidator(read)


def quantity(dimension: str, *, sign: Sign = "any") -> Any:
    """The type of a field that holds one quantity of `dimension`, SI once validated."""
    return Annotated[float, _Quantity(dimension, sign)]


RIGID = "rigid"
"""The word for a stiffness that is infinite, where a file may say so."""

_NO_ERROR = "no machine is without error; leave the key out where nothing is asked"

Length = Annotated[float, _Quantity("length")]
PositiveLength = Annotated[float, _Quantity("length", "positive")]
AllowedLength = Annotated[float, _Quantity("length", "positive", _NO_ERROR)]
NonNegativeLength = Annotated[float, _Quantity("length", "not negative")]
Angle = Annotated[float, _Quantity("angle")]
PositiveAngle = Annotated[float, _Quantity("angle", "positive")]
AllowedAngle = Annotated[float, _Quantity("angle", "positive", _NO_ERROR)]
Force = Annotated[float, _Quantity("force")]
Moment = Annotated[float, _Quantity("moment")]
Temperature = Annotated[float, _Quantity("temperature", "positive")]
TemperatureDifference = Annotated[float, _Quantity("temperature_difference")]
Coordinate = Annotated[float, _OfDrive("length", angular="angle")]
PositiveCoordinate = Annotated[float, _OfDrive("length", "positive", angular="angle")]
NonNegativeCoordinate = Annotated[float, _OfDrive("length", "not negative", angular="angle")]
NonNegativeDriveLoad = Annotated[float, _OfDrive("force", "not negative", angular="moment")]
Area = Annotated[float, _Quantity("area", "positive")]
Modulus = Annotated[float, _Quantity("stress", "positive")]
Stiffness = Annotated[float, _Stiffness("stiffness")]
SeriesStiffness = Annotated[float, _Series("stiffness")]
SeriesTorsionalStiffness = Annotated[float, _Series("torsional_stiffness")]
RigidStiffness = Annotated[float, _Stiffness("stiffness", rigid=True)]
AcrossStiffness = Annotated[tuple[float, float], _PerAxis("stiffness", axes=("y", "z"))]
TiltStiffness = Annotated[tuple[float, float, float], _PerAxis("torsional_stiffness")]
SecondMoment = Annotated[float, _Quantity("second_moment", "positive")]
ShearCoefficient = Annotated[tuple[float, float], _PerWay("ratio", "positive")]
AxisStiffness = Annotated[tuple[float, float, float], _PerAxis("stiffness")]
Mass = Annotated[float, _Quantity("mass", "not negative")]
Time = Annotated[float, _Quantity("time")]
Acceleration = Annotated[float, _Quantity("acceleration")]
NonNegativeAcceleration = Annotated[float, _Quantity("acceleration", "not negative")]
PositiveForce = Annotated[float, _Quantity("force", "positive")]
GradientValue = Annotated[tuple[float, float, float], _Gradient("temperature_gradient")]
Expansion = Annotated[float, _Quantity("expansion")]
Ratio = Annotated[float, _Quantity("ratio")]
Scale = Annotated[float, _Quantity("ratio", "positive")]
Fraction = Annotated[float, _Fraction("ratio")]
ProperFraction = Annotated[float, _Fraction("ratio", proper=True)]
TwoPositiveLengths = Annotated[tuple[float, float], _PerLimb("length", "positive", limbs=2)]
ThreePositiveLengths = Annotated[tuple[float, float, float], _PerLimb("length", "positive")]
ThreeAngles = Annotated[tuple[float, float, float], _PerLimb("angle", alike=False)]
Point = Annotated[tuple[Length, Length, Length], list_of(3)]
Direction = Annotated[tuple[float, float, float], _Unitise("ratio")]
LengthTolerance = Annotated[Tolerance, _Tolerance("length")]
AngleTolerance = Annotated[Tolerance, _Tolerance("angle")]
