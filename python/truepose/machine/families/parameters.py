"""The parameters of a machine's family as things that may be off, be tolerated and be found.

Each is called `family.KEY`; one that every limb may have its own of is also `family.KEY.LIMB`, that
of one limb, and `family.KEY` is then all of them together.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, get_args

import numpy as np

from truepose.arrays import Floats
from truepose.files.dimensions import DIMENSIONS
from truepose.files.quantity import FileType
from truepose.machine.chains import Vector
from truepose.machine.families._family import MachineFamily, Values
from truepose.representation import Facts, Represented
from truepose.spatial import tangents

PREFIX = "family."


def is_of_family(name: str) -> bool:
    """Whether a name is one of a family's parameter, and none of a part's."""
    return name.startswith(PREFIX)


_STEP = 1e-30
"""Of the complex step: its square is no number beside anything."""

_NOTHING = 1e-14
"""Relative to the largest effect: what rounding leaves of one that is none."""


@dataclass(frozen=True, repr=False)
class FamilyParameters(Represented):
    """What `[family]` says of a machine, SI, and which parameters of the machine it moves.

    `axes`: of every direction, by its path (`drive.a.axis`), the unit axis that the machine has.
    """

    family: MachineFamily
    axes: Mapping[str, Vector]

    def _facts(self) -> Facts:
        yield "kind", self.family.kind
        for name in self.names:
            yield name, f"{self.value(name):g} {self.unit(name)}"

    def __reduce__(self) -> tuple[Any, ...]:
        return FamilyParameters, (self.family, dict(self.axes))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """`family.rod`, `family.rod.a`, ...: those that move anything, in the family's order."""
        return tuple(name for name in self._all() if self.effects(name))

    def _all(self) -> Iterator[str]:
        for key, value in self.family.values().items():
            yield f"{PREFIX}{key}"
            if value.ndim:
                yield from (f"{PREFIX}{key}.{limb}" for limb in self.family.limbs)

    def value(self, name: str) -> float:
        """SI; of one that the limbs have different ones of, their mean."""
        key, limb = self._place(name)
        value = self.family.values()[key]
        return float(value.mean() if limb is None else value[limb])

    def dimension(self, name: str) -> str:
        """`length` or `angle`."""
        field = type(self.family).model_fields[self._place(name)[0]]
        return next(_dimensions(field.metadata, field.annotation))

    def unit(self, name: str) -> str:
        """SI: m or rad."""
        return DIMENSIONS[self.dimension(name)].si

    def effects(self, name: str) -> dict[str, float]:
        """Derivatives of the machine's parameters that it moves: `strut.a1.length`, ...

        Exact but for rounding, by a complex step. Of a direction those of its two tilts.
        """
        key, limb = self._place(name)
        values: dict[str, Any] = self.family.values()
        stepped = np.array(values[key], np.complex128)
        stepped[() if limb is None else limb] += 1j * _STEP
        moved = dict(self._slopes({**values, key: stepped}))
        largest = max(map(abs, moved.values()), default=0.0)
        return {one: slope for one, slope in moved.items() if abs(slope) > _NOTHING * largest}

    def changed(self, changes: Mapping[str, float]) -> FamilyParameters:
        """With other values, by so much, SI: `{"family.rod": 0.0003}`."""
        values = {key: np.array(value) for key, value in self.family.values().items()}
        for name, change in changes.items():
            key, limb = self._place(name)
            values[key][() if limb is None else limb] += change
        family = self.family.model_copy(
            update={key: tuple(v.tolist()) if v.ndim else float(v) for key, v in values.items()}
        )
        return FamilyParameters(family, self.axes)

    def about(self, axes: Mapping[str, Floats]) -> FamilyParameters:
        """Of a machine with other directions: unit axes (3,) by path."""
        other = {path: (float(x), float(y), float(z)) for path, (x, y, z) in axes.items()}
        return FamilyParameters(self.family, {**self.axes, **other})

    def moved(self, before: FamilyParameters) -> dict[str, float]:
        """Values of the machine's parameters that are others than `before`, but for directions."""
        own, old = dict(self._numbers()), dict(before._numbers())
        return {name: value for name, value in own.items() if value != old[name]}

    def _numbers(self) -> Iterator[tuple[str, float]]:
        for row in self.family.real_rows():
            for key, value in row.numbers.items():
                path = f"{row.table}.{row.name}.{key}"
                if path not in self.axes:
                    yield from _components(path, value)

    def _place(self, name: str) -> tuple[str, int | None]:
        key, _, limb = name.removeprefix(PREFIX).partition(".")
        return key, self.family.limbs.index(limb) if limb else None

    def _slopes(self, values: Values) -> Iterator[tuple[str, float]]:
        for row in self.family.rows(values):
            for key, value in row.numbers.items():
                path = f"{row.table}.{row.name}.{key}"
                slope: Floats = np.imag(np.asarray(value)) / _STEP
                if path in self.axes:
                    tilts = tangents(self.axes[path]) @ slope
                    yield from zip((f"{path}.u", f"{path}.v"), tilts.tolist(), strict=True)
                else:
                    yield from _components(path, slope)


def _components(path: str, value: Floats) -> Iterator[tuple[str, float]]:
    if not value.ndim:
        return iter([(path, float(value))])
    return zip((f"{path}.{axis}" for axis in "xyz"), value.tolist(), strict=True)


def _dimensions(metadata: Any, annotation: Any) -> Iterator[str]:
    """Of a field, which may be optional."""
    yield from (entry.dimension for entry in metadata if isinstance(entry, FileType))
    for argument in get_args(annotation):
        if isinstance(argument, FileType):
            yield argument.dimension
        yield from _dimensions((), argument)
