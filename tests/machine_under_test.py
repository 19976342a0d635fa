"""A shipped machine with everything the law tests ask of it, built once per file."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

import truepose as tp
from build_machine import Description, description_of, grid_of
from machine_file import File, file_at
from reference_kinematics import Reference
from truepose import _kernel
from truepose.machine import Machine

OK = _kernel.STATUS.index("ok")


@dataclass(frozen=True, eq=False)
class MachineUnderTest:
    """The machine of a file, on both roads, and poses of its workspace."""

    path: Path

    @cached_property
    def description(self) -> Description:
        return description_of(self.path)

    @cached_property
    def kernel(self) -> _kernel.Machine:
        return _kernel.Machine(self.description)

    @cached_property
    def reference(self) -> Reference:
        return Reference(self.description)

    @cached_property
    def loaded(self) -> Machine:
        """The machine that the loader makes of the file."""
        return tp.load(self.path)

    @cached_property
    def file(self) -> File:
        """The file as plain tables, for a test to change."""
        return file_at(self.path)

    @cached_property
    def parameter_units(self) -> dict[str, str]:
        """Name -> unit of every parameter."""
        return dict(zip(self.kernel.parameters, self.kernel.units, strict=True))

    @property
    def seed(self) -> int:
        """The file's own, so that one machine's draws do not move with another's."""
        return zlib.crc32(self.path.stem.encode())

    @cached_property
    def box(self) -> NDArray[np.float64]:
        """(n_commanded, 2) workspace, SI."""
        return grid_of(self.path, self.kernel.commanded)

    @cached_property
    def poses(self) -> NDArray[np.float64]:
        """(37, n_commanded) poses, no multiple of the lanes.

        16 anywhere in the workspace, 20 with some coordinates within a thousandth of their borders,
        and one at its very corner.
        """
        random = np.random.default_rng(self.seed)
        at = random.uniform(size=(37, len(self.box)))
        border = random.choice([0.0, 1.0], size=at.shape)
        near = border + (1 - 2 * border) * 1e-3 * random.uniform(size=at.shape)
        pushed = random.uniform(size=at.shape) < 0.6
        at[16:] = np.where(pushed, near, at)[16:]
        at[36] = border[36]
        return np.asarray(self.box[:, 0] + at * (self.box[:, 1] - self.box[:, 0]))

    three: ClassVar = [0, 16, 36]
    """Three of the poses: one anywhere, one at a border, one at a corner."""

    @property
    def three_poses(self) -> NDArray[np.float64]:
        """(3, n_commanded) these."""
        return self.poses[self.three]

    @cached_property
    def wild_poses(self) -> NDArray[np.float64]:
        """(400, n_commanded) in a box six times the workspace: some good, many beyond reach."""
        random = np.random.default_rng(self.seed + 10)
        middle, half = self.box.mean(1), np.ptp(self.box, axis=1) / 2
        at = random.uniform(-6, 6, (400, len(middle)))
        return np.asarray(middle + np.maximum(half, 0.1) * at)

    @cached_property
    def placed(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Joints (37, n_joint) and placements (37, 7) of the poses."""
        joints, placements, status = self.kernel.place(self.poses)
        assert (status == OK).all()
        return joints, placements

    @cached_property
    def all_columns(self) -> NDArray[np.intp]:
        return np.arange(len(self.kernel.parameters))

    @cached_property
    def soft_columns(self) -> NDArray[np.intp]:
        """Parameters that give way so that the platform does in all its freedoms.

        The struts' lengths, and of each guide what it is held by on the frame.
        """
        names = self.kernel.parameters
        held = [
            i
            for i, name in enumerate(names)
            if name.startswith("guide.") and name.split(".")[-2] in ("origin", "base_axis")
        ]
        return np.array([*self.kernel.length_parameters, *held], dtype=np.intp)

    @cached_property
    def unit_of_component(self) -> NDArray[np.float64]:
        """(n_component,) the unit of a component: the characteristic length, or 1 rad."""
        length = self.kernel.characteristic_length
        return np.array([length if name in "xyz" else 1.0 for name in self.kernel.components])

    @cached_property
    def unit_of_parameter(self) -> NDArray[np.float64]:
        """(n_parameter,) likewise for parameters: 1 for rad and for ratios."""
        length = self.kernel.characteristic_length
        return np.array([length if unit == "m" else 1.0 for unit in self.kernel.units])
