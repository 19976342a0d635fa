"""What of a machine gives way under load, as compliances of its parameters.

One rule: what is in series on one parameter adds up. Strut and both joints are on the strut's
length; screw, nut and bearing on the drive's offset (a telescopic drive's offset is its strut's
length, so all of them); carriage or frame on the base joint's x, y and z.

A strut that weighs is not loaded alike at its two ends; what gives way at an end says
`end_compliances`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose._kernel import Machine as KernelMachine
from truepose.arrays import Flags, Floats, Indices
from truepose.machine.parts import Drive, Strut


def compliances(
    kernel: KernelMachine, drives: Sequence[Drive], struts: Sequence[Strut], lengths: Floats
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
    for drive in drives:
        if drive.held_stiffness is not None:
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
    kernel: KernelMachine, drives: Sequence[Drive], struts: Sequence[Strut]
) -> Floats:
    """(n_strut, 2) m/N of what gives way along each strut at its base and at its platform end.

    Its joints and, at the base end, the drive of a telescopic strut: shares of what `compliances`
    adds up on the strut's length.
    """
    ends = np.zeros((len(struts), 2))
    offsets = {drive.name: f"{drive.part}.offset" for drive in drives}
    held = {drive.name: drive.held_stiffness for drive in drives}
    for at, (strut, column) in enumerate(zip(struts, kernel.length_parameters, strict=True)):
        for end, joint in enumerate(strut.joints):
            ends[at, end] = 0.0 if joint.stiffness is None else 1.0 / joint.stiffness
        stiffness = held.get(strut.drive or "")
        # The offset of a telescopic drive, and of no other, is its strut's length.
        if stiffness is not None and offsets[str(strut.drive)] == kernel.parameters[column]:
            ends[at, 0] += 1.0 / stiffness
    return ends


def known(drives: Sequence[Drive], struts: Sequence[Strut]) -> Flags:
    """(n_strut,) whether something along each limb, drive to platform, has a stiffness.

    What of such a limb says none is rigid; a limb that says nothing at all is not known.
    """
    of_drive = {drive.name: drive.held_stiffness for drive in drives}
    return np.array(
        [
            strut.stiffness_known
            or strut.base_stiffness is not None
            or any(joint.stiffness is not None for joint in strut.joints)
            or of_drive.get(strut.drive or "") is not None
            for strut in struts
        ],
        np.bool_,
    )
