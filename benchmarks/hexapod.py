"""The subject of the benchmarks: the hexapod of machines/, its poses and its moved parameters."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import truepose

Array = NDArray[np.float64]

MACHINE = Path(__file__).parent.parent / "machines" / "hexapod.toml"
N_STRUT = 6
AXES = "xyz"
# As large as a careless assembly: Newton's steps are then as many as in any real use.
SPREAD = 50e-6  # m, standard deviation of every moved parameter


def load(machines: Path = MACHINE.parent) -> truepose.Machine:
    """The hexapod of the machine file, of another folder where one is given."""
    return truepose.load(machines / MACHINE.name)


def geometry_columns(machine: truepose.Machine) -> NDArray[np.int64]:
    """(42,) indices of base joints, platform joints and drive offsets, strut by strut in each."""
    names = [
        f"strut.{strut.name}.{end}.{axis}"
        for end in ("base", "platform")
        for strut in machine.struts
        for axis in AXES
    ]
    names += [f"drive.{strut.drive}.offset" for strut in machine.struts]
    return columns_of(machine, names)


def columns_of(machine: truepose.Machine, names: list[str]) -> NDArray[np.int64]:
    """Indices of parameters by their names."""
    index = {name: i for i, name in enumerate(machine.parameters)}
    return np.array([index[name] for name in names])


def workspace_poses(machine: truepose.Machine, count: int, seed: int = 1) -> Array:
    """(count, 6) poses, uniform over the ranges of the machine file's grid."""
    grid = machine.poses()
    return np.random.default_rng(seed).uniform(grid.min(0), grid.max(0), (count, grid.shape[1]))


@dataclass(frozen=True)
class Batch:
    """Commanded poses, each with a set of deviations of the 42 geometry parameters."""

    machine: truepose.Machine
    columns: NDArray[np.int64]  # (42,)
    joints: Array  # (n, 6), m
    placements: Array  # (n, 7), tool point and unit quaternion w x y z
    deviations: Array  # (n, 42), m

    @classmethod
    def of(cls, count: int, machines: Path = MACHINE.parent) -> Batch:
        """`count` random poses of the hexapod with random deviations."""
        machine = load(machines)
        columns = geometry_columns(machine)
        joints, placements, status = machine.kernel.place(workspace_poses(machine, count))
        if np.any(status):
            raise ValueError("a pose of the benchmark is out of the machine's reach")
        deviations = np.random.default_rng(2).normal(0.0, SPREAD, (count, columns.size))
        return cls(machine, columns, joints, placements, deviations)

    @property
    def count(self) -> int:
        """Number of poses."""
        return len(self.joints)

    def geometry(self) -> tuple[Array, Array, Array]:
        """Actual base joints (n, 6, 3), platform joints (n, 6, 3) and strut lengths (n, 6), m."""
        moved = self.machine.nominal[self.columns] + self.deviations
        base, platform, offset = np.split(moved, (18, 36), axis=1)
        shape = (self.count, N_STRUT, 3)
        return (
            np.ascontiguousarray(base.reshape(shape)),
            np.ascontiguousarray(platform.reshape(shape)),
            self.joints + offset,
        )
