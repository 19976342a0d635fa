"""Clearance of passive joints: a loaded strut takes up the play at both its ends.

    reach = clearance / 2                                       spherical, universal
    reach = (clearance * |u across| + axial_clearance * |u along|) / 2       revolute

with u the strut's direction, across and along the joint's axis. Each joint that is pulled along its
strut lets that grow by its reach, pressed it lets it shrink; one that carries no more than the
threshold has a half band of the reach. A strut that weighs may pull one joint and press the
other. `docs/sources/clearance.md` has the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from truepose.arrays import Floats
from truepose.errors import Fault
from truepose.files.file_table import FileTable
from truepose.files.quantity import quantity
from truepose.files.varies import ByItself
from truepose.sources._play import DeadZone, pressed
from truepose.sources.deviation import Deviation
from truepose.sources.pose_block import PoseBlock
from truepose.sources.variation import WITH_VISIT, Variation, variation
from truepose.spatial import rotate_about

if TYPE_CHECKING:
    from pydantic import BaseModel

    from truepose._kernel import Machine as KernelMachine
    from truepose.machine import Condition, Drive, Machine, SourceBuilder
    from truepose.machine.parts import Joint

_ENDS = ("base_joint", "platform_joint")


class ClearanceTable(FileTable):
    """What holds for the clearance of every passive joint."""

    threshold: quantity("force", sign="not negative") = Field(  # type: ignore[valid-type]
        0.0, description="Force in a strut up to which its joints' play stays open, by friction."
    )
    varies: ByItself | None = Field(
        None, description="What play that stays open varies with. Default: visit."
    )


@dataclass(frozen=True)
class JointOfStrut:
    """A passive joint with play: the number of its strut, and the end (0 base, 1 platform)."""

    strut: int
    end: int


@dataclass(frozen=True)
class Clearance:
    """Play of the joints at the struts' ends. `threshold` in N."""

    name: ClassVar[str] = "clearance"
    doc: ClassVar[str] = "clearance of the passive joints"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {"clearance": ClearanceTable}
    sets_overall_edges: ClassVar[bool] = False

    joints: tuple[JointOfStrut, ...]
    threshold: float
    variation: Variation = WITH_VISIT

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """From the joints of the struts; None where none has play."""
        table = parts.table(ClearanceTable)
        clearances = []
        for index, strut in enumerate(parts.struts):
            for end, joint in enumerate(strut.joints):
                if not (joint.clearance or joint.axial_clearance):
                    continue
                clearances.append(JointOfStrut(index, end))
                if joint.kind == "revolute" and joint.axis is None:
                    parts.refuse(
                        Fault(
                            "missing-key",
                            "a revolute joint has play across its axis, which is not given",
                            found="nothing",
                            expected="axis, three plain numbers such as [0, 0, 1]",
                        ),
                        f"{strut.part}.{_ENDS[end]}.axis",
                    )
        if not clearances and table is None:
            return None
        if table is None:
            return cls(tuple(clearances), 0.0)
        return cls(tuple(clearances), table.threshold, variation(table.varies, WITH_VISIT))

    def acts(self, condition: Condition) -> bool:
        """In every condition."""
        return True

    def dead_zones(self, machine: Machine) -> tuple[DeadZone, ...]:
        """One a column of `deviation`."""
        columns = machine.kernel.length_parameters.tolist()
        return tuple(
            DeadZone(columns[at.strut], self.threshold, end=(at.strut, at.end))
            for at in self.joints
        )

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """What each joint adds to the distance of its strut's joint centres, m, (n, k)."""
        struts = [joint.strut for joint in self.joints]
        reaches = [_reach(machine, block, joint) for joint in self.joints]
        alike = all(isinstance(one, float) for one in reaches)
        reach = np.empty((1 if alike else block.indices.size, len(struts)))
        for column, one in enumerate(reaches):
            reach[:, column] = one
        columns = machine.kernel.length_parameters[struts]
        forces = block.end_forces[:, struts, [joint.end for joint in self.joints]]
        side, _ = pressed(block, columns, forces, self.threshold)
        return Deviation.of(
            columns,
            side * reach,
            np.where(side == 0.0, reach, 0.0),
            variation=self.variation,
        )


def half_clearances(block: PoseBlock) -> Floats:
    """(n, n_strut) m: how far the play of both its joints lets each strut give way, either side."""
    struts = block.machine.struts
    half = np.zeros((block.indices.size, len(struts)))
    for index in range(len(struts)):
        for end in range(len(_ENDS)):
            half[:, index] += _reach(block.machine, block, JointOfStrut(index, end))
    return half


def _reach(machine: Machine, block: PoseBlock, at: JointOfStrut) -> Floats | float:
    """(n,) m: how far the joint gives way along its strut."""
    strut = machine.struts[at.strut]
    joint: Joint = strut.joints[at.end]
    if joint.kind != "revolute" or joint.axis is None:
        return 0.5 * joint.clearance
    if at.end == 1:
        axis = block.rotations @ np.array(joint.axis)
    else:
        drive = next((drive for drive in machine.drives if drive.name == strut.drive), None)
        axis = _in_base_axes(machine.kernel, drive, block.joints, joint.axis)
    direction = block.directions[:, at.strut]
    along = np.abs((axis * direction).sum(axis=1))
    across = np.linalg.norm(np.cross(axis, direction), axis=1)
    return np.asarray(0.5 * (joint.clearance * across + joint.axial_clearance * along))


def _in_base_axes(
    kernel: KernelMachine,
    drive: Drive | None,
    joints: Floats,
    direction: ArrayLike,
) -> Floats:
    """(n or 1, 3) unit `direction` (3,) in the axes of what carries a strut's base joint.

    A frame (`drive` None, or a telescopic one) and a carriage have base axes. An arm has base axes
    at angle 0 and turns about its drive's axis by scale q + offset, `joints` q (n, n_joint), rad.
    """
    given = np.asarray(direction, np.float64)
    if drive is None or drive.coordinate != "angle":
        return given[np.newaxis, :]
    nominal = dict(zip(kernel.parameters, kernel.nominal.tolist(), strict=True))
    scale, offset = nominal[f"{drive.part}.scale"], nominal[f"{drive.part}.offset"]
    angle = scale * joints[:, [kernel.joints.index(drive.name)]] + offset
    axis = np.asarray(drive.fields["axis"], np.float64)
    return rotate_about(given, axis, angle)
