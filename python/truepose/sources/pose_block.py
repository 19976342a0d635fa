"""Some poses of a run as the sources see them; what costs anything is computed when asked for."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from truepose.arrays import Codes, Flags, Floats, Indices
from truepose.machine.compliances import Compliances, compliances_at
from truepose.representation import Represented
from truepose.spatial import quaternion_to_matrix

if TYPE_CHECKING:
    from truepose.machine import Condition, Machine
    from truepose.machine.workspace import PoseTable


Cause = Literal["tool", "own", "all"]
"""What loads come from: the wrench on the tool, weight and inertia of the machine, or both."""


@dataclass(frozen=True, eq=False, repr=False)
class PoseBlock(Represented):
    """Some usable poses of a run, at nominal parameters: where a source looks.

    `requested` (n_requested, n_commanded): all poses of the run, m or rad, usable or not, and
    `indices` (n,): which of them these are.
    `joints` (n, n_joint): commanded joint coordinates, m or rad.
    `placements` (n, 7): tool point, m, and platform's unit quaternion w x y z, base frame.
    `travel` (n, n_joint): direction, -1 or +1, in which each joint last moved on its way along the
    path into the pose, 0 where it has not moved yet; None where the poses are no path.
    `times` (n,): s, where the run is over a temperature log; else None.
    `corrected` (n, n_joint): joint coordinates that the drives are sent to instead of `joints`;
    None where they go there. Loads, lengths and directions are those of `joints` all the same.
    """

    machine: Machine
    condition: Condition
    requested: PoseTable
    indices: Indices
    joints: Floats
    placements: Floats
    travel: Floats | None = None
    times: Floats | None = None
    corrected: Floats | None = None

    def alone(self) -> PoseBlock:
        """The same poses as all that a run has: what is sent elsewhere is as small as they are."""
        requested, count = self.requested[self.indices], self.indices.size
        return dataclasses.replace(
            self, requested=requested, indices=np.arange(count, dtype=np.intp)
        )

    def select(self, usable: Flags) -> PoseBlock:
        """The poses where `usable` (n,); the block itself where all are."""
        if usable.all():
            return self
        return dataclasses.replace(
            self,
            indices=self.indices[usable],
            joints=self.joints[usable],
            placements=self.placements[usable],
            travel=None if self.travel is None else self.travel[usable],
            times=None if self.times is None else self.times[usable],
            corrected=None if self.corrected is None else self.corrected[usable],
        )

    @cached_property
    def drive_joints(self) -> Floats:
        """(n, n_joint) coordinates that the drives are at: `corrected`, else `joints`.

        For what happens at a drive's own coordinate, as a periodic error of its screw does.
        """
        return self.joints if self.corrected is None else self.corrected

    @property
    def is_followed(self) -> bool:
        """Whether a source has asked for `drive_joints`: it deviates as the command says."""
        return "drive_joints" in vars(self)

    def sent_to(self, corrected: Floats) -> PoseBlock:
        """The same poses with the drives at `corrected` (n, n_joint); nothing else is different."""
        block = dataclasses.replace(self, corrected=corrected)
        known = {name: value for name, value in vars(self).items() if name not in _OF_COMMAND}
        vars(block).update(known)
        return block

    @cached_property
    def lengths(self) -> Floats:
        """(n, n_strut) present length of each strut, m."""
        return self.machine.kernel.lengths_at(self.joints, self.placements)

    @cached_property
    def centres(self) -> Floats:
        """(n, n_strut, 2, 3) base-side and platform-side joint centre, base frame, m."""
        return self.machine.kernel.joint_centres(self.joints, self.placements)

    @cached_property
    def directions(self) -> Floats:
        """(n, n_strut, 3) unit vectors from base-side to platform-side joint centre."""
        along = self.centres[:, :, 1] - self.centres[:, :, 0]
        along /= np.sqrt(np.einsum("nsk,nsk->ns", along, along))[:, :, np.newaxis]
        return along

    @cached_property
    def rotations(self) -> Floats:
        """(n, 3, 3) platform axes -> base axes."""
        return quaternion_to_matrix(self.placements[:, 3:])

    @cached_property
    def tool_wrench(self) -> Floats:
        """(1, 6) the condition's force and moment on the tool at the tool point, base axes."""
        return np.asarray(self.condition.wrench, np.float64)[np.newaxis, :]

    @cached_property
    def weight(self) -> Floats:
        """(3,) of one kilogram, N, base axes."""
        weight: Floats = self.condition.gravity * self.machine.down
        return weight

    @cached_property
    def own_wrench(self) -> Floats:
        """(n or 1, 6) weight and inertia of the platform and the struts' share of it, at the tool.

        A strut's weight acts at its joint centres, by the lever rule about its centre of mass.
        """
        platform, struts = self.machine.platform, self.machine.struts
        shares = np.array([strut.mass * strut.centre_of_mass for strut in struts])
        on_platform = platform.mass * (self.weight - np.array(self.condition.acceleration))
        on_struts = shares[:, np.newaxis] * self.weight
        tubes = self.tube_wrench
        if not (on_platform.any() or on_struts.any()):
            return np.zeros((1, 6)) if tubes is None else tubes
        names = self.machine.parameters
        tool = self.machine.nominal[[names.index(f"tool.{axis}") for axis in "xyz"]]
        arm = np.array(platform.centre_of_mass) - tool
        wrench = np.empty((self.indices.size, 6))
        wrench[:, :3] = on_platform + on_struts.sum(axis=0)
        wrench[:, 3:] = _moments((self.rotations.reshape(-1, 3) @ arm).reshape(-1, 3), on_platform)
        if on_struts.any():
            # Weights are parallel: together they act at the mean of their arms.
            arms = np.einsum("s,nsk->nk", shares, self.centres[:, :, 1])
            arms -= shares.sum() * self.placements[:, :3]
            wrench[:, 3:] += _moments(arms, self.weight)
        return wrench if tubes is None else wrench + tubes

    @cached_property
    def tube_wrench(self) -> Floats | None:
        """(n, 6) weight and inertia of tubes that the platform carries, at the tool; None: none."""
        tubes = [(at, limb) for at, limb in enumerate(self.machine.limbs) if limb.mass > 0.0]
        if not tubes:
            return None
        ends = self.machine.kernel.limb_ends_at(self.joints, self.placements)
        wrench = np.zeros((self.indices.size, 6))
        for at, limb in tubes:
            force = limb.mass * (self.weight - np.array(self.condition.acceleration))
            back = ends[:, at, 0] - ends[:, at, 1]
            size = np.linalg.norm(back, axis=1, keepdims=True)
            half = 0.5 * (limb.length or 0.0)
            centre = ends[:, at, 1] + half * back / size - self.placements[:, :3]
            wrench[:, :3] += force
            wrench[:, 3:] += np.cross(centre, force)
        return wrench

    @cached_property
    def sag(self) -> Floats | None:
        """(n, n_closure of limbs) m by which limbs open under their own weight beyond the loads.

        None where no limb weighs anything.
        """
        if not limbs_weigh(self.machine):
            return None
        kernel = self.machine.kernel
        return kernel.limb_sag_at(self.joints, self.placements, self.weight.tolist())

    @cached_property
    def base_forces(self) -> Floats | None:
        """(1, n_strut, 3) weight at the base-side joint centres, N, base axes; None: no mass."""
        forces: Floats = base_masses(self.machine)[np.newaxis, :, np.newaxis] * self.weight
        return forces if forces.any() else None

    @cached_property
    def balance(self) -> tuple[Floats, Codes]:
        """Tension (n, n_strut), N, under everything that acts, and the status (n,) of each pose."""
        kernel = self.machine.kernel
        wrench = self.tool_wrench + self.own_wrench
        return kernel.loads_at(self.joints, self.placements, wrench, kernel.length_parameters)

    @property
    def tension(self) -> Floats:
        """(n, n_strut) strut force under everything that acts, N, tension positive.

        Of a strut that weighs the mean along it: see `end_forces`.
        """
        return self.balance[0]

    @cached_property
    def over_tension(self) -> Floats:
        """(n, n_strut, 2) N by which the force at a strut's base and platform end exceeds the mean.

        The tension is found with the weight at the joint centres, the share c at the platform. Of
        what is along the strut the platform joint hands that share on to the strut, and the base
        joint holds all: c less, and 1 - c more, than the tension (docs/sources/loads.md).
        """
        masses = np.array([strut.mass for strut in self.machine.struts])
        centres = np.array([strut.centre_of_mass for strut in self.machine.struts])
        along = masses * (self.directions.reshape(-1, 3) @ self.weight).reshape(-1, masses.size)
        over = np.empty((*along.shape, 2))
        np.multiply(1.0 - centres, along, out=over[:, :, 0])
        np.multiply(-centres, along, out=over[:, :, 1])
        return over

    @property
    def end_forces(self) -> Floats:
        """(n, n_strut, 2) axial force at each strut's base and platform end, N, tension positive.

        Under everything that acts: what its base joint, and its platform joint, carry along it.
        """
        forces: Floats = self.tension[:, :, np.newaxis] + self.over_tension
        return forces

    @cached_property
    def uneven_stretch(self) -> Floats | None:
        """(n, n_strut) m by which each limb gives way more than under its mean tension.

        None where no strut weighs, or nothing gives way at an end.
        """
        ends = self.machine.end_compliances
        if not (ends.any() and any(strut.mass > 0.0 for strut in self.machine.struts)):
            return None
        over = self.over_tension
        stretch: Floats = over[:, :, 0] * ends[:, 0] + over[:, :, 1] * ends[:, 1]
        return stretch

    def drive_loads(self, drives: Sequence[int]) -> Floats:
        """(n, k) what these drives carry under everything that acts, N, of a crank N m.

        It drives their offset up. A telescopic drive stands at the base end of its strut.
        """
        names = self.machine.parameters
        columns = [names.index(f"{self.machine.drives[drive].part}.offset") for drive in drives]
        loads = self.loads(np.array(columns, np.intp), "all")
        of_strut = {int(c): k for k, c in enumerate(self.machine.kernel.length_parameters)}
        for at, column in enumerate(columns):
            if column in of_strut:
                loads[:, at] += self.over_tension[:, of_strut[column], 0]
        return loads

    @cached_property
    def forces(self) -> Floats:
        """(n, n_closure) force of every closure under everything that acts, N.

        A strut's is its tension, the mean along it; a universal guide's its moment over the
        characteristic length.
        """
        kernel = self.machine.kernel
        if len(kernel.closures) == self.tension.shape[1]:
            return self.tension
        wrench = self.tool_wrench + self.own_wrench
        return kernel.forces(self.requested[self.indices], wrench, status=True)[0]

    def loads(self, columns: Indices, cause: Cause) -> Floats:
        """(n, k) load on parameters by virtual work: N, of an angle N m; it drives them up."""
        if "compliances" in vars(self):
            place = {column: at for at, column in enumerate(self.compliances.columns.tolist())}
            if all(column in place for column in columns.tolist()):
                at = [place[column] for column in columns.tolist()]
                tool, own = self._yielding_loads
                if cause == "all":
                    return tool[:, at] + own[:, at]
                every = at == list(range(len(place)))
                loads = tool if cause == "tool" else own
                return loads if every else loads[:, at]
        wrench = {"tool": self.tool_wrench, "own": self.own_wrench}.get(cause)
        if wrench is None:
            wrench = self.tool_wrench + self.own_wrench
        loads = self.loads_of(wrench, columns)
        if cause != "tool" and self.base_forces is not None:
            loads = loads + self._base_loads(columns)
        return loads

    @cached_property
    def _yielding_loads(self) -> tuple[Floats, Floats]:
        """Loads (n, k) on the columns of `compliances`, of the tool and own: found together."""
        columns = self.compliances.columns
        wrenches = np.broadcast_arrays(self.tool_wrench, self.own_wrench)
        both = self.loads_of(np.concatenate(wrenches, axis=1), columns)
        tool, own = both[:, : columns.size], both[:, columns.size :]
        if self.base_forces is not None:
            own = own + self._base_loads(columns)
        return tool, own

    def _base_loads(self, columns: Indices) -> Floats:
        """(n, k) loads on parameters from what weighs on the base-side joint centres."""
        assert self.base_forces is not None
        flat = self.base_forces.reshape(len(self.base_forces), -1)
        kernel = self.machine.kernel
        return kernel.base_loads_at(self.joints, self.placements, flat, columns)

    def loads_of(self, wrenches: Floats, columns: Indices) -> Floats:
        """(n, k) the same under any wrenches (n or 1, 6) on the tool; (n, 2 k) under two."""
        kernel = self.machine.kernel
        return kernel.loads_at(self.joints, self.placements, wrenches, columns)[0]

    @cached_property
    def compliances(self) -> Compliances:
        """Parameters that may give way, and how far under load, m/N or rad/(N m)."""
        return compliances_at(self.machine, self.joints, self.placements, self.lengths)

    def rise(self, part: str) -> float | Floats:
        """Temperature of a part above the reference, K: one number, or (n, 1) at `times`."""
        if self.times is None:
            return self.condition.temperature_rise(part)
        rise = self.condition.temperature_rise(part, self.times)
        return rise if isinstance(rise, float) else rise[:, np.newaxis]


def base_masses(machine: Machine) -> Floats:
    """(n_strut,) kg at the base-side joint centres.

    The struts' other share, and the carriages', in equal parts on the struts that they carry.
    """
    struts = machine.struts
    masses = np.array([strut.mass * (1.0 - strut.centre_of_mass) for strut in struts])
    for drive in machine.drives:
        carried = np.array([strut.drive == drive.name for strut in struts])
        masses += carried * (drive.mass / carried.sum())
    return masses


def limbs_weigh(machine: Machine) -> bool:
    """Whether a limb weighs anything: its tube, its strut, or the carriage of that."""
    struts = {strut.name: strut for strut in machine.struts}
    drives = {drive.name: drive.mass for drive in machine.drives}
    for limb in machine.limbs:
        strut = struts.get(limb.strut or "")
        carried = 0.0 if strut is None else strut.mass + drives.get(strut.drive or "", 0.0)
        if limb.mass + carried:
            return True
    return False


def _moments(arms: Floats, force: Floats) -> Floats:
    """(n, 3) moments of one force (3,) at arms (n, 3)."""
    x, y, z = force.tolist()
    moments: Floats = arms @ np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return moments


_OF_COMMAND = ("corrected", "drive_joints")
"""What of a block depends on where its drives are sent to."""
