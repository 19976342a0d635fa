"""What of a machine gives way under load, as compliances of its parameters.

One rule: what is in series on one parameter adds up. Strut and both joints are on the strut's
length; screw, nut and bearing on the drive's offset (a telescopic drive's offset is its strut's
length, so all of them); carriage or frame on the base joint's x, y and z.

What limbs say of their joints and beams is a matrix between the closures of a limb: a force in one
opens the others too (`crates/kernel/src/statics/chain.rs`).

A strut that weighs is not loaded alike at its two ends; what gives way at an end says
`end_compliances`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose._kernel import Machine as KernelMachine
from truepose.arrays import Flags, Floats, Indices
from truepose.machine.carriages import carriage_compliance, carriage_parameters
from truepose.machine.limbs import Limb
from truepose.machine.parts import Drive, Strut

if TYPE_CHECKING:
    from truepose.machine.model import Machine


@dataclass(frozen=True, eq=False)
class Compliances:
    """How parameters give way under load, pose by pose: a symmetric matrix, most of it zero.

    `columns` (k,): the parameters; `own` (n, k): each under its own load, m/N or rad/(N m).
    `pairs`: places among the columns, two by two, of parameters that give way under each other's
    load, and `shared` (n, n_pair) by how much.
    """

    columns: Indices
    own: Floats
    pairs: tuple[tuple[int, int], ...] = ()
    shared: Floats | None = None

    def deflection(self, loads: Floats) -> Floats:
        """(n, k) shift of each parameter under loads (n or 1, k)."""
        shift: Floats = loads * self.own
        if self.shared is not None:
            for at, (one, other) in enumerate(self.pairs):
                shift[:, one] += self.shared[:, at] * loads[:, other]
                shift[:, other] += self.shared[:, at] * loads[:, one]
        return shift

    @property
    def stacked(self) -> Floats:
        """(n, k + n_pair) as the kernel takes them."""
        if self.shared is None:
            return self.own
        return np.concatenate([self.own, self.shared], axis=1)


def compliances_at(
    machine: Machine, joints: Floats, placements: Floats, lengths: Floats
) -> Compliances:
    """Everything that may give way at joints (n, n_joint) and placements (n, 7), limbs too.

    `lengths` (n, n_strut) there, m. The first n_strut columns are the struts' lengths.
    """
    return _with_limbs(machine.kernel, without_limbs(machine, lengths), joints, placements)


def without_limbs(machine: Machine, lengths: Floats) -> Compliances:
    """What gives way by laws of the struts' lengths (n, n_strut), m, alone: carriages too."""
    scalar = Compliances(*machine.compliances(lengths))
    return _with_carriages(machine.kernel, machine.drives, machine.struts, scalar)


def _with_limbs(
    kernel: KernelMachine, scalar: Compliances, joints: Floats, placements: Floats
) -> Compliances:
    """The same with what limbs give way at joints (n, n_joint) and placements (n, 7)."""
    pairs = kernel.limb_pairs
    if not pairs:
        return scalar
    return _added(scalar, pairs, kernel.limb_compliances_at(joints, placements))


def _with_carriages(
    kernel: KernelMachine,
    drives: Sequence[Drive],
    struts: Sequence[Strut],
    scalar: Compliances,
) -> Compliances:
    """The same with what carriages and arms of several struts give way, alike at every pose."""
    place = {name: at for at, name in enumerate(kernel.parameters)}
    for drive in drives:
        if not drive.chain:
            continue
        columns = [place[name] for name in carriage_parameters(drive)]
        rows, places = np.triu_indices(6)
        pairs = [(columns[i], columns[k]) for i, k in zip(rows, places, strict=True)]
        matrix = carriage_compliance(drive, bases_on(kernel, drive, struts))
        entries = np.broadcast_to(matrix[rows, places], (len(scalar.own), len(pairs)))
        scalar = _added(scalar, pairs, entries)
    return scalar


def bases_on(kernel: KernelMachine, drive: Drive, struts: Sequence[Strut]) -> Floats:
    """(n, 3) m: the base joints of the struts on a drive, in the axes of what it moves."""
    values = dict(zip(kernel.parameters, kernel.nominal.tolist(), strict=True))
    carried = [strut for strut in struts if strut.drive == drive.name]
    return np.array([[values[f"{s.part}.base.{axis}"] for axis in "xyz"] for s in carried])


def _added(scalar: Compliances, pairs: Sequence[tuple[int, int]], matrix: Floats) -> Compliances:
    """With entries (n, n_pair) of a symmetric matrix between parameters; those of one: its own."""
    known = set(scalar.columns.tolist())
    further = [column for column in dict.fromkeys(sum(pairs, ())) if column not in known]
    columns = np.concatenate([scalar.columns, np.array(further, np.intp)])
    place = {int(column): at for at, column in enumerate(columns)}
    own = np.zeros((len(matrix), columns.size))
    own[:, : scalar.columns.size] = scalar.own
    between: list[tuple[int, int]] = list(scalar.pairs)
    shared: list[Floats] = [] if scalar.shared is None else list(scalar.shared.T)
    for at, (one, other) in enumerate(pairs):
        if one == other:
            own[:, place[one]] += matrix[:, at]
        else:
            between.append((place[one], place[other]))
            shared.append(matrix[:, at])
    if not between:
        return Compliances(columns, own)
    return Compliances(columns, own, tuple(between), np.stack(shared, axis=1))


def drives_of_limbs(struts: Sequence[Strut], limbs: Sequence[Limb]) -> set[str | None]:
    """Telescopic drives that are a part of a limb's chain: how they give way is in its matrix."""
    telescopic = {limb.strut for limb in limbs if limb.family in ("UPS", "RPS")}
    return {strut.drive for strut in struts if strut.name in telescopic}


def compliances(
    kernel: KernelMachine,
    drives: Sequence[Drive],
    struts: Sequence[Strut],
    lengths: Floats,
    limbs: Sequence[Limb] = (),
) -> tuple[Indices, Floats]:
    """Every parameter that may give way (k,), first the struts' lengths, and its compliance (n, k).

    `lengths` (n, n_strut), m. Compliance in m/N, or rad/(N m) of a crank; 0 is rigid.
    """
    n_pose = len(lengths)
    by_column: dict[int, Floats] = {}
    for index, (strut, column) in enumerate(zip(struts, kernel.length_parameters, strict=True)):
        own = np.zeros(n_pose)
        if strut.stiffness is not None:
            own += 1.0 / strut.stiffness
        elif strut.area is not None and strut.modulus is not None:
            own += lengths[:, index] / (strut.area * strut.modulus)
        for joint in strut.joints:
            own += 0.0 if joint.stiffness is None else 1.0 / joint.stiffness
        by_column[int(column)] = own
    names = {name: column for column, name in enumerate(kernel.parameters)}
    others: dict[str, float] = {}
    of_limbs = drives_of_limbs(struts, limbs)
    for drive in drives:
        if drive.held_stiffness is not None and drive.name not in of_limbs:
            others[f"{drive.part}.offset"] = 1.0 / drive.held_stiffness
    for strut in struts:
        for axis, compliance in zip("xyz", strut.base_compliance, strict=True):
            if compliance > 0.0:
                others[f"{strut.part}.base.{axis}"] = compliance
    for name, compliance in others.items():
        column = names[name]
        by_column[column] = by_column.get(column, np.zeros(n_pose)) + compliance
    return np.array(list(by_column), np.intp), np.stack(list(by_column.values()), axis=1)


def end_compliances(
    kernel: KernelMachine,
    drives: Sequence[Drive],
    struts: Sequence[Strut],
    limbs: Sequence[Limb] = (),
) -> Floats:
    """(n_strut, 2) m/N of what gives way along each strut at its base and at its platform end.

    Its joints and, at the base end, the drive of a telescopic strut: shares of what `compliances`
    adds up on the strut's length.
    """
    ends = np.zeros((len(struts), 2))
    offsets = {drive.name: f"{drive.part}.offset" for drive in drives}
    of_limbs = drives_of_limbs(struts, limbs)
    held = {
        drive.name: None if drive.name in of_limbs else drive.held_stiffness for drive in drives
    }
    for at, (strut, column) in enumerate(zip(struts, kernel.length_parameters, strict=True)):
        for end, joint in enumerate(strut.joints):
            ends[at, end] = 0.0 if joint.stiffness is None else 1.0 / joint.stiffness
        stiffness = held.get(strut.drive or "")
        # The offset of a telescopic drive, and of no other, is its strut's length.
        if stiffness is not None and offsets[str(strut.drive)] == kernel.parameters[column]:
            ends[at, 0] += 1.0 / stiffness
    return ends


def known(drives: Sequence[Drive], struts: Sequence[Strut], limbs: Sequence[Limb] = ()) -> Flags:
    """(n_strut,) whether something along each limb, drive to platform, has a stiffness.

    What of such a limb says none is rigid; a limb that says nothing at all is not known. A
    `[[limb]]` says all of it.
    """
    of_limb = {limb.strut for limb in limbs}
    of_drive = {drive.name: drive.held_stiffness for drive in drives}
    return np.array(
        [
            strut.name in of_limb
            or strut.stiffness_known
            or strut.base_stiffness is not None
            or any(joint.stiffness is not None for joint in strut.joints)
            or of_drive.get(strut.drive or "") is not None
            for strut in struts
        ],
        np.bool_,
    )
