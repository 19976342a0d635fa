"""A drive that two joint coordinates would serve takes the branch that the file asks for."""

from __future__ import annotations

import copy

import numpy as np

from drive_kinds import is_strut, turned_alike, turns
from machine_under_test import OK, MachineUnderTest
from reference_kinematics import Reference
from truepose import _kernel

CLOSED = 1e-10
OTHER = {"+": "-", "-": "+", None: None}


def test_the_other_working_mode_is_the_other_root(machine: MachineUnderTest) -> None:
    other = copy.deepcopy(machine.description)
    for drive in other["drives"]:
        drive["working_mode"] = OTHER[drive["working_mode"]]
        drive["travel"] = [-np.pi, np.pi] if turns(drive["kind"]) else [-10.0, 10.0]
    for strut in other["struts"]:
        # Nor do its joints let a strut lean the other way.
        for end in ("base", "platform"):
            strut.pop(f"{end}_angle_limit", None)
    kernel, reference = _kernel.Machine(other), Reference(other)
    one_root = all(is_strut(drive["kind"]) for drive in other["drives"])
    joints, status = kernel.inverse(machine.poses, status=True)
    assert (status == OK).any()
    for pose, found, code in zip(machine.poses, joints, status, strict=True):
        # The strut on the frame need not close in the other mode near the file's home.
        if code == OK:
            expected, _, _ = reference.inverse(pose)
            assert np.abs(turned_alike(other, found, expected)).max() < CLOSED
    difference = np.abs(joints[status == OK] - machine.placed[0][status == OK]).max()
    assert one_root or difference > 0.1


def test_without_a_mode_the_root_nearest_mid_travel_at_home(machine: MachineUnderTest) -> None:
    description = copy.deepcopy(machine.description)
    home = [machine.reference.home[name] for name in machine.kernel.commanded]
    _, point, rotation = machine.reference.inverse(home)
    for wanted in ("+", "-"):
        expected = []
        for drive in description["drives"]:
            drive["working_mode"] = None
            roots = machine.reference.roots(drive, point, rotation)
            middle = roots["-+".index(wanted)] if len(roots) == 2 else roots[0]
            # Not on the root but a fifth of the way to the other one.
            middle += (sum(roots) / len(roots) - middle) * 0.4
            drive["travel"] = [middle - 1.0, middle + 1.0]
            expected.append(wanted if len(roots) == 2 else "+")
        assert list(_kernel.Machine(description).working_modes) == expected
