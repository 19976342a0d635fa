"""The state that a machine works in: temperatures, and what acts on the tool and by mass."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar, overload

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ValidationError

from truepose.arrays import Floats, is_masked, real_numbers
from truepose.errors import ArgumentError, Problem, RequestError
from truepose.files.units import UnitSystem, default_units, shown_value
from truepose.files.varies import MACHINE, RUN, VISIT
from truepose.files.wording import did_you_mean, one_of
from truepose.machine.chains import Vector
from truepose.machine.parts import is_body, is_limb
from truepose.spatial import tangents

if TYPE_CHECKING:
    from truepose.machine.temperature_log import TemperatureLog

Model = TypeVar("Model", bound=BaseModel)

ISO_1_REFERENCE_TEMPERATURE = 293.15
"""K: 20 degC, at which dimensions hold unless said otherwise (ISO 1)."""

STANDARD_GRAVITY = 9.80665
"""m/s^2 (3rd General Conference on Weights and Measures, 1901)."""

DEFAULT_PART = "default"
"""The key, in a table of temperatures, of every part that the table does not name."""

_ALONG = ("strut.", "drive.")
"""How parts begin that have a gradient along themselves."""

_MAPPINGS = ("part_temperatures", "gradients")


@dataclass(frozen=True)
class Envelope:
    """A force on the tool of known size (N) and unknown direction.

    Any direction in space, or, where a unit `normal` is given, in the plane across it; base axes.
    `varies`: "run" (one direction in a run), "machine" or "visit".
    """

    force: float
    normal: Vector | None = None
    varies: str = RUN

    def __post_init__(self) -> None:
        if not (_finite(self.force) and self.force >= 0.0):
            raise _bad("envelope", str(self.force), "a force of zero or more, N")
        if self.varies not in (RUN, MACHINE, VISIT):
            raise _bad("envelope", shown_value(self.varies), '"run", "machine" or "visit"')
        if self.normal is None:
            return
        normal = _vector("envelope", self.normal)
        size = math.hypot(*normal)
        if not (math.isfinite(size) and size > 0.0):
            raise _bad("envelope", str(normal), "a normal of a length above zero")
        x, y, z = (component / size for component in normal)
        object.__setattr__(self, "normal", (x, y, z))

    @property
    def directions(self) -> Floats:
        """(3 or 2, 3) orthogonal unit vectors that span the directions, base axes."""
        if self.normal is None:
            return np.eye(3)
        return tangents(self.normal)

    @property
    def wrenches(self) -> Floats:
        """(n_axis, 6) the force along each axis of `directions`, on the tool, N and N m."""
        along = self.force * self.directions
        return np.hstack([along, np.zeros_like(along)])


@dataclass(frozen=True)
class Condition:
    """Temperatures in K; force (N) and moment (N m) on the tool at the tool point, base axes.

    `gradients`: K/m by part; along a strut from base to platform, or along a drive's coordinate
    from where its scale is fixed, the first component counts; of frame, platform and carriages it
    is a vector in their axes. `temperature_log`: measured temperatures over time of the parts that
    it names, if `part_temperatures` does not, at `time` (s; None: its last) where a run is not over
    time itself.
    `gravity` (m/s^2) acts on every mass, `acceleration` (m/s^2, base axes) is that of the platform.
    `source_tables`: the keys of `[condition]` that error sources bring, a model of each, SI.
    """

    reference_temperature: float = ISO_1_REFERENCE_TEMPERATURE
    default_temperature: float = ISO_1_REFERENCE_TEMPERATURE
    part_temperatures: Mapping[str, float] = field(default_factory=dict)
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)
    gradients: Mapping[str, Vector] = field(default_factory=dict)
    temperature_log: TemperatureLog | None = None
    time: float | None = None
    gravity: float = STANDARD_GRAVITY
    acceleration: Vector = (0.0, 0.0, 0.0)
    envelope: Envelope | None = None
    source_tables: tuple[BaseModel, ...] = ()

    def __post_init__(self) -> None:
        for name in _MAPPINGS:
            if not isinstance(getattr(self, name), Mapping):
                raise _bad(name, repr(getattr(self, name)), "values by the paths of parts")
        temperatures = {
            "reference_temperature": self.reference_temperature,
            "temperature": self.default_temperature,
            **self.part_temperatures,
        }
        for name, value in temperatures.items():
            if not (_finite(value) and value > 0.0):
                raise _bad(str(name), str(value), "a temperature above absolute zero, K")
        vectors = {
            "force": self.force,
            "moment": self.moment,
            "acceleration": self.acceleration,
            **{f"gradient.{part}": gradient for part, gradient in self.gradients.items()},
        }
        for name, vector in vectors.items():
            _vector(name, vector)
        for part, gradient in self.gradients.items():
            if str(part).startswith(_ALONG) and any(gradient[1:]):
                raise _bad(f"gradient.{part}", str(gradient), "one number, along itself, K/m")
            if is_limb(str(part)) and gradient[0] != 0.0:
                raise _bad(f"gradient.{part}", str(gradient), "0 along it: that is its strut's")
        for part in self.part_temperatures:
            if is_limb(str(part)):
                raise _bad(str(part), "a temperature", "that of its strut or of the platform")
        if not (_finite(self.gravity) and self.gravity >= 0.0):
            raise _bad("gravity", str(self.gravity), "an acceleration of zero or more, m/s^2")
        if self.time is not None and not _finite(self.time):
            raise _bad("time", str(self.time), "a finite time, s")
        for name in _MAPPINGS:
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))

    @overload
    def temperature(self, part: str, times: None = None) -> float: ...
    @overload
    def temperature(self, part: str, times: ArrayLike) -> float | Floats: ...
    def temperature(self, part: str, times: ArrayLike | None = None) -> float | Floats:
        """Temperature in K of a part by its path: `strut.1`.

        (n,) at `times` (n,), s, where it comes from the log; else one number.
        """
        if not isinstance(part, str):
            raise ArgumentError.of("part", part, "the path of a part, such as strut.1")
        log = self.temperature_log
        if part in self.part_temperatures:
            return self.part_temperatures[part]
        named = next(
            (name for name in (part, DEFAULT_PART) if log and name in log.temperatures), None
        )
        if log is None or named is None:
            return self.default_temperature
        if times is not None:
            return np.asarray(log.at(named, np.asarray(times, np.float64)), np.float64)
        moment = float(log.times[-1]) if self.time is None else self.time
        return float(log.at(named, np.array([moment]))[0])

    @overload
    def temperature_rise(self, part: str, times: None = None) -> float: ...
    @overload
    def temperature_rise(self, part: str, times: ArrayLike) -> float | Floats: ...
    def temperature_rise(self, part: str, times: ArrayLike | None = None) -> float | Floats:
        """Temperature of a part above the reference temperature, K; (n,) as `temperature`."""
        if times is None:
            return self.temperature(part) - self.reference_temperature
        return self.temperature(part, times) - self.reference_temperature

    def gradient(self, part: str) -> Vector:
        """Temperature gradient of a part, K/m; zero where none is given."""
        return self.gradients.get(part, (0.0, 0.0, 0.0))

    @property
    def named_parts(self) -> tuple[str, ...]:
        """Parts that the condition names, by its temperatures, gradients and log."""
        logged = () if self.temperature_log is None else self.temperature_log.temperatures
        named = dict.fromkeys([*self.part_temperatures, *self.gradients, *logged])
        return tuple(part for part in named if part != DEFAULT_PART)

    def table(self, model: type[Model]) -> Model:
        """What the condition says in the keys of a source's `model`, SI; else its defaults."""
        return next((table for table in self.source_tables if isinstance(table, model)), model())

    @property
    def source_keys(self) -> dict[str, object]:
        """Every key that error sources bring, and its value, SI."""
        return {
            key: getattr(table, key)
            for table in self.source_tables
            for key in type(table).model_fields
        }

    @property
    def wrench(self) -> Floats:
        """(6,) force, then moment, on the tool."""
        return np.array([*self.force, *self.moment])

    def replace(
        self,
        *,
        reference_temperature: float | None = None,
        temperature: float | Mapping[str, float] | None = None,
        force: Sequence[float] | None = None,
        moment: Sequence[float] | None = None,
        gradient: Mapping[str, float | Sequence[float]] | None = None,
        temperature_log: TemperatureLog | None = None,
        time: float | None = None,
        gravity: float | None = None,
        acceleration: Sequence[float] | None = None,
        envelope: Envelope | float | None = None,
        source_keys: Mapping[str, object] | None = None,
    ) -> Condition:
        """This condition with other values; what is not given stays.

        `temperature`: K, one number for all parts (in place of a log, too), or
        `{"default": ..., "strut.1": ...}`, where parts that are not named stay as they are.
        A default takes the place of the log's. `gradient`: K/m of parts, one number along a strut
        or drive, three of frame, platform and carriages. `envelope`: a force of any direction, N;
        0 takes it away. `source_keys`: keys that error sources bring, SI or with a unit, as
        `{"humidity": "60 %"}`. Raises `RequestError` (bad-condition) for a value that is not finite
        or of the wrong size, or a key that no source brings. Parts that a machine does not have are
        refused where it is known: by `truepose.budget`, `truepose.compensate` and
        `Machine.with_condition`.
        """
        changes: dict[str, object] = {}
        if isinstance(temperature, Mapping):
            if DEFAULT_PART in temperature and self.temperature_log is not None:
                # What a condition names goes before the log, and so does its default.
                changes["temperature_log"] = self.temperature_log.without(DEFAULT_PART)
            changes["default_temperature"] = _number(
                "temperature", temperature.get(DEFAULT_PART, self.default_temperature)
            )
            changes["part_temperatures"] = dict(self.part_temperatures) | {
                part: _number(f"temperature.{part}", value)
                for part, value in temperature.items()
                if part != DEFAULT_PART
            }
        elif temperature is not None:
            changes |= {
                "default_temperature": _number("temperature", temperature),
                "part_temperatures": {},
                "temperature_log": None,
            }
        if gradient is not None:
            if not isinstance(gradient, Mapping):
                raise _bad("gradient", repr(gradient), "gradients by the paths of parts")
            changes["gradients"] = dict(self.gradients) | {
                part: _along(part, value) for part, value in gradient.items()
            }
        for name, number in (
            ("reference_temperature", reference_temperature),
            ("time", time),
            ("gravity", gravity),
        ):
            if number is not None:
                changes[name] = _number(name, number)
        for name, vector in (("force", force), ("moment", moment), ("acceleration", acceleration)):
            if vector is not None:
                changes[name] = _vector(name, vector)
        if temperature_log is not None:
            changes["temperature_log"] = temperature_log
        if envelope is not None:
            given = (
                envelope
                if isinstance(envelope, Envelope)
                else Envelope(_number("envelope", envelope))
            )
            changes["envelope"] = given if given.force > 0.0 else None
        if source_keys is not None:
            if not isinstance(source_keys, Mapping):
                raise _bad("source_keys", repr(source_keys), "values by key")
            changes["source_tables"] = self._with_source_keys(source_keys)
        return dataclasses.replace(self, **changes)  # type: ignore[arg-type]

    def _with_source_keys(self, values: Mapping[str, object]) -> tuple[BaseModel, ...]:
        known = self.source_keys
        expected = one_of(known) if known else "no key: the machine's error sources bring none"
        for key in values:
            if key not in known:
                raise _bad(key, key, expected, did_you_mean(key, known))
        return tuple(
            _validated(
                type(table),
                {key: value for key, value in values.items() if key in type(table).model_fields},
                table,
            )
            for table in self.source_tables
        )

    def __getstate__(self) -> dict[str, object]:
        return vars(self) | {name: dict(getattr(self, name)) for name in _MAPPINGS}

    def __setstate__(self, state: dict[str, object]) -> None:
        vars(self).update(state)
        for name in _MAPPINGS:
            object.__setattr__(self, name, MappingProxyType(getattr(self, name)))


def _finite(value: object) -> bool:
    """Whether it is a number, and a finite one."""
    if is_masked(value):
        return False
    try:
        return math.isfinite(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return False


def _number(name: str, value: object) -> float:
    """A finite number. Raises `RequestError` (bad-condition)."""
    if not _finite(value) or isinstance(value, str | bytes):
        raise _bad(name, str(value), "a finite number")
    return float(value)  # type: ignore[arg-type]


def _along(part: str, value: float | Sequence[float]) -> Vector:
    if isinstance(value, (int, float)):
        if is_body(part) or is_limb(part):
            raise _bad(f"gradient.{part}", str(value), "three numbers, along its axes, K/m")
        return (_number(f"gradient.{part}", value), 0.0, 0.0)
    return _vector(f"gradient.{part}", value)


def _vector(name: str, values: Sequence[float]) -> Vector:
    """Three finite numbers. Raises `RequestError` (bad-condition)."""
    try:
        given = real_numbers(name, values)
    except ArgumentError:
        given = np.empty(0)
    if given.shape != (3,) or not np.isfinite(given).all():
        raise _bad(name, str(values), "three finite components")
    x, y, z = given.tolist()
    return (x, y, z)


def _validated(model: type[BaseModel], values: Mapping[str, object], table: BaseModel) -> BaseModel:
    """The `table` of a source with new `values` in it, SI or with a unit."""
    if not values:
        return table
    try:
        read = model.model_validate(dict(values), context={"units": UnitSystem(default_units())})
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        fault = first.get("ctx", {}).get("fault")
        raise _bad(
            str(first["loc"][0]),
            shown_value(first["input"]),
            first["msg"] if fault is None else fault.expected,
        ) from None
    return table.model_copy(update={key: getattr(read, key) for key in values})


def _bad(name: str, found: str, expected: str, hint: str | None = None) -> RequestError:
    return RequestError(
        Problem(
            "bad-condition",
            f"a condition cannot have this {name}",
            path=f"condition.{name}",
            found=found,
            expected=expected,
            hint=hint,
        )
    )
