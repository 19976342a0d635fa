"""The parts of a machine as its file says them: drives and struts with their properties, SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Drive:
    """An actuated joint. `travel` and `coordinate`: m (`length`) or rad (`angle`).

    `fields` are the element's own (origin, axis, offset, ...) as the file gives them, SI, base
    frame; `drawing` is how the element is drawn (`line`, `circle`, `none`).
    """

    name: str
    kind: str
    coordinate: str
    travel: tuple[float, float]
    working_mode: str | None
    fields: Mapping[str, float | tuple[float, ...]]
    drawing: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "fields", MappingProxyType(dict(self.fields)))

    @property
    def part(self) -> str:
        """Its path: `drive.d1`."""
        return f"drive.{self.name}"

    def __getstate__(self) -> dict[str, object]:
        return vars(self) | {"fields": dict(self.fields)}

    def __setstate__(self, state: dict[str, object]) -> None:
        fields = state["fields"]
        assert isinstance(fields, dict)
        vars(self).update(state | {"fields": MappingProxyType(fields)})


@dataclass(frozen=True)
class Strut:
    """A strut's properties: what it is made of, not where it is (that is in the parameters).

    `drive` is the drive that carries its base joint, None on the frame. `area` in m^2, `modulus` in
    Pa, `expansion` in 1/K, `stiffness` (axial, outright) in N/m; None where the file says nothing.
    """

    name: str
    drive: str | None
    area: float | None
    modulus: float | None
    expansion: float | None
    stiffness: float | None
    material: str | None

    @property
    def part(self) -> str:
        """Its path: `strut.1`."""
        return f"strut.{self.name}"

    def axial_stiffness(self, length: float) -> float | None:
        """N/m of the strut `length` m long: outright, else modulus * area / length, else None."""
        if self.stiffness is not None:
            return self.stiffness
        if self.area is None or self.modulus is None:
            return None
        return self.modulus * self.area / length
