"""A Dataset on its way into a file for programs: full precision, in the machine file's units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from truepose.files.units import meant
from truepose.reporting.display import is_position

if TYPE_CHECKING:
    import xarray as xr

    from truepose.machine import Machine

DIMENSION_OF = {"m": "length", "rad": "angle", "N": "force", "K": "temperature", "s": "time"}
"""SI unit of a result -> dimension of the unit that the machine file declares for it."""

SQUARE_METRE = "m^2"
OTHER = "other_"
"""Begins the name of the second dimension of a matrix: `component` and `other_component`."""

_OVER_TIME = ("temperature", "time")
"""Dimensions that only some results have."""


def in_file_units(machine: Machine, value: float, unit: str) -> tuple[float, str]:
    """An SI value of `unit` in the file's unit, with that; other units stay as they are."""
    dimension = DIMENSION_OF.get(unit)
    if dimension is None:
        return value, unit
    to = machine.file_units[dimension]
    return float(to.to_file(value)), to.label


def pose_in_file_units(machine: Machine, pose: Mapping[str, float]) -> dict[str, float]:
    """A pose by freedom, from SI to the file's units."""
    return {name: in_file_units(machine, value, pose_si(name))[0] for name, value in pose.items()}


def pose_si(freedom: str) -> str:
    """SI unit of a freedom of the platform (x y z a b c)."""
    return "m" if is_position(freedom) else "rad"


@dataclass(frozen=True)
class Values:
    """One variable in file units.

    `units` is one unit, or one for each index along the axes `mixed`: one axis, or the two of a
    covariance, whose units are in the order of its rows.
    """

    dims: tuple[str, ...]
    array: NDArray[np.generic]
    units: tuple[str, ...]
    mixed: tuple[int, ...]
    long_name: str

    def unit(self, *along: int) -> str:
        """The unit at an index of each mixed axis, or the only one."""
        if not self.mixed:
            return self.units[0]
        index = 0
        for axis, at in zip(self.mixed, along, strict=True):
            index = index * self.array.shape[axis] + at
        return self.units[index]


@dataclass(frozen=True)
class Result:
    """What a command found: a Dataset (SI) and the machine whose file's units it is written in."""

    command: str
    machine: Machine
    dataset: xr.Dataset

    def units(self) -> dict[str, str]:
        """Unit of every dimension that appears in results: {"length": "mm", ...}."""
        return {
            name: self.machine.file_units[name].label
            for name in DIMENSION_OF.values()
            if name not in _OVER_TIME or name in self.dataset.variables
        }

    def values(self, name: str) -> Values:
        """One variable or coordinate in the units of the machine file."""
        variable = self.dataset[name].variable
        dims = tuple(str(dim) for dim in variable.dims)
        array = np.asarray(variable.values)
        long_name = str(variable.attrs.get("long_name", ""))
        by = variable.attrs.get("units_by")
        if "component" in dims and OTHER + "component" in dims:
            return self._covariance(dims, array, long_name)
        if by is None:
            array, unit = self._converted(array, str(variable.attrs.get("units", "1")))
            return Values(dims, array, (unit,), (), long_name)
        si = [str(unit) for unit in self.dataset[by].values]
        axis = dims.index(str(self.dataset[by].dims[0]))
        parts, units = zip(
            *(self._converted(np.take(array, i, axis=axis), unit) for i, unit in enumerate(si)),
            strict=True,
        )
        return Values(dims, np.stack(parts, axis=axis), units, (axis,), long_name)

    def _covariance(
        self, dims: tuple[str, ...], array: NDArray[np.generic], long_name: str
    ) -> Values:
        """A variable over pairs of components, in the products of their units."""
        axes = (dims.index("component"), dims.index(OTHER + "component"))
        si = [str(unit) for unit in self.dataset["component_units"].values]
        moved = np.moveaxis(array, axes, (0, 1)).astype(np.float64)
        units = []
        for row, one in enumerate(si):
            for column, other in enumerate(si):
                once, first = self._converted(moved[row, column], one)
                moved[row, column], second = self._converted(once, other)
                units.append(_product(first, second))
        same = tuple(dict.fromkeys(units))
        rows = np.moveaxis(moved, (0, 1), axes)
        if len(same) == 1:
            return Values(dims, rows, same, (), long_name)
        return Values(dims, rows, tuple(units), axes, long_name)

    def variables(self) -> list[str]:
        """Names of what was computed, also what xarray takes for a coordinate by its name."""
        coordinates = [
            str(name) for name, coordinate in self.dataset.coords.items() if coordinate.ndim > 1
        ]
        return [*coordinates, *map(str, self.dataset.data_vars)]

    def coordinates(self) -> list[str]:
        """Names of what labels the variables, without the poses left out."""
        names = [
            str(name) for name, coordinate in self.dataset.coords.items() if coordinate.ndim <= 1
        ]
        return [name for name in names if not name.startswith("left_out") and not _is_units(name)]

    def accuracy(self) -> dict[str, dict[str, object]]:
        """The accuracy asked of position and orientation, those that are asked."""
        asked = self.machine.accuracy
        columns = {}
        for name, value, si in (
            ("position", asked.target, "m"),
            ("orientation", asked.angle_target, "rad"),
        ):
            if value is not None:
                converted, unit = in_file_units(self.machine, value, si)
                columns[name] = {"target": converted, "units": unit}
        return columns

    def labels(self, dim: str) -> list[str]:
        """Names along a dimension, or its numbers as text where it has no names.

        A dimension that shares its name with a result has its names in `<dim>_name`.
        """
        for name in (dim, f"{dim}_name"):
            if name in self.dataset.variables and self.dataset[name].ndim == 1:
                return [str(value) for value in self.dataset[name].values]
        return [str(index) for index in range(self.dataset.sizes[dim])]

    def left_out(self) -> list[dict[str, object]]:
        """Every pose that cannot be used: its number, coordinates in file units, and why.

        A result over a region of the workspace has none.
        """
        if "left_out_index" not in self.dataset.variables:
            return []
        poses = [self.values(f"left_out_{name}").array.tolist() for name in self.machine.commanded]
        return [
            {
                "pose": int(number),
                "status": str(status),
                **dict(zip(self.machine.commanded, coordinates, strict=True)),
            }
            for number, status, *coordinates in zip(
                self.dataset["left_out_index"].values,
                self.dataset["left_out_status"].values,
                *poses,
                strict=True,
            )
        ]

    def _converted(self, array: NDArray[np.generic], unit: str) -> tuple[NDArray[np.generic], str]:
        if unit == SQUARE_METRE:
            once, label = self._converted(array, "m")
            return self._converted(once, "m")[0], _product(label, label)
        dimension = DIMENSION_OF.get(unit)
        if dimension is None:
            return (meant(array) if array.dtype == np.float64 else array), unit
        to = self.machine.file_units[dimension]
        return to.to_file(array), to.label


def _product(one: str, other: str) -> str:
    """A product of two units: "mm^2", "mm deg"."""
    return f"{one}^2" if one == other else f"{one} {other}"


def _is_units(name: str) -> bool:
    """Whether a coordinate holds SI units, which every variable names itself in a file."""
    return name.endswith("_units")
