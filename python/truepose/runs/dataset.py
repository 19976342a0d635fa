"""Results as labelled data: the schema, the rows filled block by block, and the Dataset.

`docs/results.md` is the schema in words; a test holds the two together. xarray is imported where a
Dataset is made: a command that makes none starts in less time.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from truepose.arrays import Flags, Floats, Indices
from truepose.machine import Condition, Machine
from truepose.runs.poses import SkippedPoses
from truepose.runs.quantities import POSITIONS, quantities
from truepose.sources import PoseBlock, not_included_text
from truepose.version import version

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Variable:
    """One variable of a result: its dims, its unit, what it is.

    `units` is a unit, or the dim along which it differs: "component", "joint" or "quantity"; or
    "covariance", of the products of two components.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: type = np.float64


Schema = Mapping[str, Variable]

QUANTITY_UNITS = {"position": "m", "orientation": "rad"}

_PRODUCTS = {(False, True): "m^2", (True, False): "rad^2", (True, True): "m^2, m rad, rad^2"}
"""Units of a covariance, by whether the machine turns and whether it moves."""


class DatasetRows:
    """The variables over poses of one result, allocated once and filled in place.

    A million poses of a hexapod leave no room for a second copy of a result.
    """

    def __init__(self, machine: Machine, schema: Schema, sizes: Mapping[str, int]) -> None:
        self._kernel = machine.kernel
        self._arrays: dict[str, np.ndarray] = {
            name: np.empty([sizes[dim] for dim in variable.dims], variable.dtype)
            for name, variable in schema.items()
            if "pose" in variable.dims
        }
        self._indices = np.empty(sizes["pose"], np.intp)
        self._parasitic = [
            at for at, name in enumerate(machine.dof) if name not in machine.commanded
        ]
        self._solved = np.empty((sizes["pose"], len(self._parasitic)))
        self.count = 0

    def room(self, n_pose: int) -> dict[str, np.ndarray]:
        """Where the next `n_pose` poses go, by name: what is filled in there need not be copied."""
        return {
            name: array[self.count : self.count + n_pose] for name, array in self._arrays.items()
        }

    def append(self, block: PoseBlock, values: Mapping[str, np.ndarray], usable: Flags) -> None:
        """Write the poses of `block` where `usable` (n,), with `values` (n, ...) of each name."""
        rows = slice(self.count, self.count + int(usable.sum()))
        every = bool(usable.all())
        for name, array in self._arrays.items():
            given = values[name] if every else values[name][usable]
            if not np.may_share_memory(given, array):
                array[rows] = given
        self._indices[rows] = block.indices if every else block.indices[usable]
        if self._parasitic:
            solved = self._kernel.pose_of(block.placements)
            self._solved[rows] = solved[usable][:, self._parasitic]
        self.count = rows.stop

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """What was written of each variable."""
        return {name: array[: self.count] for name, array in self._arrays.items()}

    @property
    def indices(self) -> Indices:
        """(n,) number of each pose written, in the poses asked for."""
        return self._indices[: self.count]

    @property
    def parasitic(self) -> Floats:
        """(n, n_dof - n_commanded) freedoms that are not commanded, of the nominal machine."""
        return self._solved[: self.count]


def sizes(machine: Machine, n_pose: int, **others: int) -> dict[str, int]:
    """Length of each dim."""
    return {
        "pose": n_pose,
        "component": len(machine.components),
        "joint": len(machine.joints),
        "closure": len(machine.closures),
        "other_component": len(machine.components),
        "quantity": len(quantities(machine.components)),
        **others,
    }


def assemble(
    machine: Machine,
    condition: Condition,
    schema: Schema,
    rows: DatasetRows,
    poses: Floats,
    left_out: SkippedPoses,
    *,
    over_all: Mapping[str, Any] | None = None,
    coords: Mapping[str, xr.Variable] | None = None,
) -> xr.Dataset:
    """The Dataset of `schema`: `rows` over poses, `over_all` what has no pose, more `coords`."""
    values, units = {**rows.arrays, **(over_all or {})}, _units(machine)
    data = {name: data_variable(variable, values[name], units) for name, variable in schema.items()}
    labels = {
        **_machine_coords(machine),
        **_pose_coords(machine, rows, poses),
        **_left_out_coords(machine, poses, left_out),
        **(coords or {}),
    }
    attrs = provenance(machine, condition)
    attrs |= {"poses_used": rows.count, "poses_left_out": len(poses) - rows.count}
    return labelled_dataset(data, labels, attrs)


def overall_dataset(
    machine: Machine,
    condition: Condition,
    schema: Schema,
    values: Mapping[str, Any],
    coords: Mapping[str, xr.Variable] | None = None,
) -> xr.Dataset:
    """The Dataset of a result that has no dim pose, as over a continuous region; more `coords`."""
    units = _units(machine)
    data = {name: data_variable(variable, values[name], units) for name, variable in schema.items()}
    labels = {
        "component": label("component", list(machine.components), "component of the error"),
        "component_units": label("component", component_units(machine), "unit of the component"),
        "commanded": label("commanded", list(machine.commanded), "commanded freedom"),
        "commanded_units": label("commanded", commanded_units(machine), "unit of the freedom"),
        **quantity_coords(machine),
        **(coords or {}),
    }
    return labelled_dataset(data, labels, provenance(machine, condition))


def labelled_dataset(
    data: Mapping[str, xr.Variable],
    labels: Mapping[str, xr.Variable],
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """The Dataset of variables and coordinates.

    The index of each dim is made here: where xarray makes it, it first imports pint and all that
    pint needs, to see whether labels are quantities.
    """
    import pandas as pd
    import xarray as xr
    from xarray.indexes import PandasIndex

    indexes = {}
    variables = dict(labels)
    for name, variable in labels.items():
        if variable.dims == (name,):
            # As xarray does it: objects are kept as they are.
            values = pd.Index(variable.values, dtype=object if variable.dtype == object else None)
            indexes[name] = PandasIndex(values, name, coord_dtype=variable.dtype)
            variables |= indexes[name].create_variables({name: variable})
    return xr.Dataset(data, xr.Coordinates(variables, indexes), attrs)


def label(dim: str, values: Any, long_name: str, units: str = "1") -> xr.Variable:
    """A coordinate along one dim."""
    import xarray as xr

    return xr.Variable((dim,), values, {"long_name": long_name, "units": units})


def quantity_coords(machine: Machine, long_name: str = "what has a size") -> dict[str, xr.Variable]:
    """What has a size, position and orientation, and its unit."""
    kinds = list(quantities(machine.components))
    units = [QUANTITY_UNITS[kind] for kind in kinds]
    return {
        "quantity": label("quantity", kinds, long_name),
        "quantity_units": label("quantity", units, "unit of the quantity"),
    }


def joint_units(machine: Machine) -> list[str]:
    """Unit of each joint coordinate."""
    unit = {"length": "m", "angle": "rad"}
    return [unit[drive.coordinate] for drive in machine.drives]


def commanded_units(machine: Machine) -> list[str]:
    """Unit of each commanded freedom."""
    return ["m" if name in POSITIONS else "rad" for name in machine.commanded]


def component_units(machine: Machine) -> list[str]:
    """Unit of each component of an error."""
    return ["m" if name in POSITIONS else "rad" for name in machine.components]


def units_of(kind: str, units: Mapping[str, Sequence[str]]) -> dict[str, str]:
    """`units` of a variable: one for all, or all of them and the coordinate that has each.

    `units`: of each entry along a dim, by the dim; a `kind` that is none of them is the unit.
    """
    if kind not in units:
        return {"units": kind}
    distinct = dict.fromkeys(units[kind])
    of_all = {"units": ", ".join(distinct) or "1"}
    return of_all if len(distinct) < 2 else {**of_all, "units_by": f"{kind}_units"}


def data_variable(
    variable: Variable, values: Any, units: Mapping[str, Sequence[str]]
) -> xr.Variable:
    """`values` as a labelled variable, `units` as in `units_of`."""
    import xarray as xr

    of_unit = units_of(variable.units, units)
    attrs = {"units": of_unit.pop("units"), "long_name": variable.long_name, **of_unit}
    return xr.Variable(variable.dims, values, attrs)


def _units(machine: Machine) -> dict[str, Sequence[str]]:
    """Units along each dim that a machine has."""
    components = component_units(machine)
    return {
        "component": components,
        "covariance": [_PRODUCTS["rad" in components, "m" in components]],
        "joint": joint_units(machine),
        "quantity": [QUANTITY_UNITS[kind] for kind in quantities(machine.components)],
        "commanded": commanded_units(machine),
    }


def _machine_coords(machine: Machine) -> dict[str, xr.Variable]:
    return {
        "component": label(
            "component",
            list(machine.components),
            "component of a small displacement of the tool point and a rotation vector, base frame",
        ),
        "component_units": label("component", component_units(machine), "unit of the component"),
        "joint": label("joint", list(machine.joints), "actuated joint"),
        "joint_units": label("joint", joint_units(machine), "unit of the joint coordinate"),
        "closure": label("closure", list(machine.closures), "closure, named by its strut or guide"),
    }


def _pose_coords(machine: Machine, rows: DatasetRows, poses: Floats) -> dict[str, xr.Variable]:
    indices = rows.indices
    coords = {"pose": label("pose", indices, "number of the pose in the poses asked for")}
    parasitic = iter(rows.parasitic.T)
    for freedom in machine.dof:
        unit = "m" if freedom in POSITIONS else "rad"
        if freedom in machine.commanded:
            values, kind = poses[indices, machine.commanded.index(freedom)], "commanded"
        else:
            values, kind = next(parasitic), "parasitic, of the nominal machine"
        coords[f"pose_{freedom}"] = label("pose", values, f"pose {freedom}, {kind}", unit)
    return coords


def _left_out_coords(
    machine: Machine, poses: Floats, left_out: SkippedPoses
) -> dict[str, xr.Variable]:
    indices, status = left_out.sorted()
    coords = {
        "left_out_index": label("left_out", indices, "number of the pose in the poses asked for"),
        "left_out_status": label("left_out", status, "why the pose cannot be used"),
    }
    for at, freedom in enumerate(machine.commanded):
        unit = "m" if freedom in POSITIONS else "rad"
        coords[f"left_out_{freedom}"] = label(
            "left_out", poses[indices, at], f"commanded {freedom} of a pose left out", unit
        )
    return coords


def provenance(machine: Machine, condition: Condition) -> dict[str, str | int | float]:
    """Version, machine file with its hash, changes to it, condition and what is left out of it.

    What every result says.
    """
    attrs: dict[str, str | int | float] = {
        "truepose_version": version(),
        "machine": machine.name,
        "machine_file": machine.file,
        "machine_hash": machine.file_hash,
        "data_files": json.dumps(dict(machine.data_files)),
        "settings": "; ".join(f"{key}={value}" for key, value in machine.settings.items()),
        "replaced": "; ".join(f"{key}={value!r}" for key, value in machine.replaced.items()),
        "condition": json.dumps(_condition(condition)),
        "not_included": not_included_text(machine, condition),
        "seed": "none",
    }
    if machine.accuracy.target is not None:
        attrs["accuracy_target"] = machine.accuracy.target
    if machine.accuracy.angle_target is not None:
        attrs["accuracy_angle_target"] = machine.accuracy.angle_target
    return attrs


def _condition(condition: Condition) -> dict[str, object]:
    """Everything of a condition, SI; a temperature log is among the data files."""
    envelope = condition.envelope
    return {
        "reference_temperature_K": condition.reference_temperature,
        "temperature_K": {
            "default": condition.default_temperature,
            **condition.part_temperatures,
        },
        "gradient_K_per_m": {
            part: list(gradient) for part, gradient in condition.gradients.items()
        },
        "temperature_log": condition.temperature_log is not None,
        "time_s": condition.time,
        "force_N": list(condition.force),
        "moment_Nm": list(condition.moment),
        "envelope_N": None if envelope is None else envelope.force,
        "envelope_normal": None if envelope is None else envelope.normal,
        **({} if envelope is None else {"envelope_varies": envelope.varies}),
        "gravity_m_per_s2": condition.gravity,
        "acceleration_m_per_s2": list(condition.acceleration),
        **{
            key: value
            for table in condition.source_tables
            for key, value in table.model_dump(mode="json").items()
        },
    }
