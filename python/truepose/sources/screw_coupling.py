"""Screw coupling: a non-captive screw turns with its universal joints, and so changes the strut.

    shift = lead * (angle - angle at home) / (2 pi)

The angle is that by which the strut's platform end is turned against its base end, about the strut
from base to platform: between the crosses' second axes, which lie across the strut and across the
axis that each universal joint has in its body. It is known: there is no band.
`docs/sources/screw_coupling.md` has the geometry, the sign and the reference.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from pydantic import BaseModel, Field

from truepose._kernel import STATUS
from truepose.arrays import Floats
from truepose.errors import Fault, Problem, TrueposeError
from truepose.files.file_table import FileTable
from truepose.files.quantity import Direction, Length
from truepose.machine.chains import Vector
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock
from truepose.spatial import quaternion_to_matrix

if TYPE_CHECKING:
    from truepose._kernel import Machine as KernelMachine
    from truepose.machine import Condition, Machine, SourceBuilder

PARALLEL = 1e-6
"""Sine of the angle between a universal joint's axis and the strut below which the screw's turn is
not defined: it would be known to no better than rounding over this."""

_ENDS = ("base_axis", "platform_axis")

_PLACED = ("ok", "out_of_travel", "joint_limit")
"""Status of a home pose at which the struts at least stand where they should."""

_NO_HOME = Problem(
    "home-unreachable",
    "screws are taken as adjusted at home, which the machine cannot reach",
    path="workspace",
    found="a home pose that the machine cannot be placed at",
    expected="a home pose within reach and off singularities",
    hint="give [workspace] home",
)


class ScrewTable(FileTable):
    """A screw that is not held against turning, between the universal joints of its strut."""

    lead: Length = Field(
        description="Length that the strut gains when its platform end makes one turn about it; "
        "above zero for a right-hand thread, below for a left-hand one."
    )
    base_axis: Direction = Field(
        description="Axis of the base universal joint that stands still, frame axes."
    )
    platform_axis: Direction = Field(
        description="Axis of the platform universal joint that is fixed in it, platform axes."
    )


class StrutScrew(BaseModel):
    """What a `[[strut]]` says about its screw."""

    screw: ScrewTable | None = Field(
        None,
        description="A non-captive screw, such as `{ lead = 5, base_axis = [1, 0, 0], "
        "platform_axis = [0, 1, 0] }`; for a strut of a telescopic drive.",
    )


@dataclass(frozen=True)
class Screw:
    """One strut's screw: the number of the strut, lead in m a turn, and unit axes."""

    strut: int
    lead: float
    base_axis: Vector
    platform_axis: Vector


@dataclass(frozen=True)
class ScrewCoupling:
    """Turn of non-captive screws against home, as a change of their struts' lengths."""

    name: ClassVar[str] = "screw_coupling"
    doc: ClassVar[str] = "non-captive screws that turn with their universal joints"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"strut": StrutScrew}
    sets_overall_edges: ClassVar[bool] = False

    screws: tuple[Screw, ...]

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From `screw` of the struts; None where no strut has one."""
        screws = []
        for index, row in enumerate(parts.rows(StrutScrew)):
            if row.screw is None:
                continue
            if not _driven(parts.kernel, index):
                parts.refuse(
                    Fault(
                        "screw-not-driven",
                        "a screw on a strut whose length no drive sets",
                        found="a strut of fixed length",
                        expected="a strut of a telescopic drive",
                        hint="a drive's own screw that turns with nothing needs no such table",
                    ),
                    f"strut.{parts.struts[index].name}.screw",
                )
                continue
            axes = (row.screw.base_axis, row.screw.platform_axis)
            screws.append(Screw(index, row.screw.lead, *axes))
        if not screws:
            return None
        source = cls(tuple(screws))
        placed = _home(parts.kernel)
        if placed is None:
            parts.record(_NO_HOME)
            return source
        for number, end in np.argwhere(source._turns(*placed)[1][0] < PARALLEL):
            parts.refuse(
                Fault(
                    "screw-axis-parallel",
                    "the axis lies along the strut at home: how far the screw turns is not defined",
                    found="an axis parallel to the strut",
                    expected="the universal joint's axis, across or oblique to the strut",
                ),
                f"strut.{parts.struts[screws[number].strut].name}.screw.{_ENDS[end]}",
            )
        return source

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Change of the struts' lengths, m, (n, k).

        Raises `TrueposeError` (screw-axis-parallel) at a pose where a strut lies along the axis of
        one of its universal joints.
        """
        struts = [screw.strut for screw in self.screws]
        angle, sines = self._turns(block.rotations, block.directions)
        unfit = np.argwhere(sines < PARALLEL)
        if unfit.size:
            raise TrueposeError(self._parallel(machine, block, *unfit[0].tolist()))
        placed = _home(machine.kernel)
        if placed is None:
            raise TrueposeError(_NO_HOME)
        turned = angle - self._turns(*placed)[0]
        # Within half a turn of home either way.
        turned -= math.tau * np.round(turned / math.tau)
        leads = np.array([screw.lead for screw in self.screws])
        return Deviation.of(machine.kernel.length_parameters[struts], leads * turned / math.tau)

    def _turns(self, rotations: Floats, directions: Floats) -> tuple[Floats, Floats]:
        """Angles (n, k) of the platform ends against the base ends, rad, within half a turn.

        About the struts' unit `directions` (n, n_strut, 3), base to platform, with `rotations`
        (n, 3, 3) of the platform. And the sines (n, k, 2) of the angles between each strut and the
        axes of its joints at base and platform.
        """
        along = directions[:, [screw.strut for screw in self.screws]].transpose(2, 0, 1)
        base = np.array([screw.base_axis for screw in self.screws]).T[:, np.newaxis]
        axes = np.array([screw.platform_axis for screw in self.screws])
        platform = (rotations.reshape(-1, 3) @ axes.T).reshape(-1, 3, len(axes)).swapaxes(0, 1)
        # The crosses of both unit axes b and w with the unit strut u have the product
        # b w - (b u)(w u), and (b x w) u is that of their cross product with u.
        of_base, of_platform = _product(base, along), _product(platform, along)
        ahead = _product(np.cross(base, platform, axis=0), along)
        beside = _product(base, platform) - of_base * of_platform
        sines = np.empty((*ahead.shape, 2))
        for end, product in enumerate((of_base, of_platform)):
            sines[..., end] = np.sqrt(np.maximum(1.0 - np.square(product), 0.0))
        return np.arctan2(ahead, beside), sines

    def _parallel(
        self, machine: Machine, block: PoseBlock, pose: int, number: int, end: int
    ) -> Problem:
        strut = machine.struts[self.screws[number].strut]
        requested = block.requested[block.indices[pose]]
        at = ", ".join(
            f"{name} = {value:.6g} {'m' if name in ('x', 'y', 'z') else 'rad'}"
            for name, value in zip(machine.commanded, requested.tolist(), strict=True)
        )
        return Problem(
            "screw-axis-parallel",
            f"strut {strut.name} lies along the axis of its universal joint: "
            "how far its screw turns is not defined",
            machine.file,
            path=f"{strut.part}.screw.{_ENDS[end]}",
            found=f"an axis parallel to the strut at {at}",
            expected="poses at which the strut is across or oblique to the axis",
        )


def _product(one: Floats, other: Floats) -> Floats:
    """Scalar products of vectors (3, ...)."""
    product: Floats = one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
    return product


def _driven(kernel: KernelMachine, strut: int) -> bool:
    """Whether the strut's length is the coordinate of its drive."""
    return kernel.parameters[int(kernel.length_parameters[strut])].endswith(".offset")


def _home(kernel: KernelMachine) -> tuple[Floats, Floats] | None:
    """Rotation (1, 3, 3) and unit directions (1, n_strut, 3) of the struts at home, or None."""
    at = [kernel.dof.index(freedom) for freedom in kernel.commanded]
    joints, placements, status = kernel.place(kernel.home[at][np.newaxis, :])
    if STATUS[status[0]] not in _PLACED:
        return None
    centres = kernel.joint_centres(joints, placements)
    along = centres[:, :, 1] - centres[:, :, 0]
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    return quaternion_to_matrix(placements[:, 3:]), along
