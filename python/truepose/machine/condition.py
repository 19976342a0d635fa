"""The state that a machine works in: temperatures and the wrench on the tool."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from truepose.errors import Problem, RequestError

ISO_1_REFERENCE_TEMPERATURE = 293.15
"""K: 20 degC, at which dimensions hold unless said otherwise (ISO 1)."""

DEFAULT_PART = "default"
"""The key, in a table of temperatures, of every part that the table does not name."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Condition:
    """Temperatures in K; force (N) and moment (N m) on the tool at the tool point, base axes."""

    reference_temperature: float = ISO_1_REFERENCE_TEMPERATURE
    default_temperature: float = ISO_1_REFERENCE_TEMPERATURE
    part_temperatures: Mapping[str, float] = field(default_factory=dict)
    force: Vector = (0.0, 0.0, 0.0)
    moment: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        temperatures = {
            "reference_temperature": self.reference_temperature,
            "temperature": self.default_temperature,
            **self.part_temperatures,
        }
        for name, value in temperatures.items():
            if not (math.isfinite(value) and value > 0.0):
                raise _bad(name, str(value), "a temperature above absolute zero, K")
        for name, vector in (("force", self.force), ("moment", self.moment)):
            if len(vector) != 3 or not all(math.isfinite(component) for component in vector):
                raise _bad(name, str(vector), "three finite components")
        object.__setattr__(
            self, "part_temperatures", MappingProxyType(dict(self.part_temperatures))
        )

    def temperature(self, part: str) -> float:
        """Temperature in K of a part by its path: `strut.1`."""
        return self.part_temperatures.get(part, self.default_temperature)

    def temperature_rise(self, part: str) -> float:
        """Temperature of a part above the reference temperature, K."""
        return self.temperature(part) - self.reference_temperature

    @property
    def wrench(self) -> NDArray[np.float64]:
        """(6,) force, then moment, on the tool."""
        return np.array([*self.force, *self.moment])

    def replace(
        self,
        *,
        reference_temperature: float | None = None,
        temperature: float | Mapping[str, float] | None = None,
        force: Sequence[float] | None = None,
        moment: Sequence[float] | None = None,
    ) -> Condition:
        """This condition with other values; what is not given stays.

        `temperature`: K, one number for all parts, or `{"default": ..., "strut.1": ...}`, where
        parts that are not named stay as they are. Raises `RequestError` (bad-condition) for a
        value that is not finite or of the wrong size.
        """
        default, parts = self.default_temperature, dict(self.part_temperatures)
        if isinstance(temperature, Mapping):
            default = float(temperature.get(DEFAULT_PART, default))
            parts |= {
                part: float(value) for part, value in temperature.items() if part != DEFAULT_PART
            }
        elif temperature is not None:
            default, parts = float(temperature), {}
        reference = self.reference_temperature
        return replace(
            self,
            reference_temperature=reference
            if reference_temperature is None
            else float(reference_temperature),
            default_temperature=default,
            part_temperatures=parts,
            force=self.force if force is None else _vector("force", force),
            moment=self.moment if moment is None else _vector("moment", moment),
        )

    def __getstate__(self) -> dict[str, object]:
        return vars(self) | {"part_temperatures": dict(self.part_temperatures)}

    def __setstate__(self, state: dict[str, object]) -> None:
        parts = state["part_temperatures"]
        assert isinstance(parts, dict)
        vars(self).update(state | {"part_temperatures": MappingProxyType(parts)})


def _vector(name: str, values: Sequence[float]) -> Vector:
    if len(values) != 3:
        raise _bad(name, str(values), "three finite components")
    x, y, z = (float(value) for value in values)
    return (x, y, z)


def _bad(name: str, found: str, expected: str) -> RequestError:
    return RequestError(
        Problem(
            "bad-condition",
            f"a condition cannot have this {name}",
            path=f"condition.{name}",
            found=found,
            expected=expected,
        )
    )
