"""The simulator goes where the kernel does: all parameters off, every machine with struts alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from build_machine import awkward_files, description_of, machine_files
from machine_under_test import MachineUnderTest
from part_simulator.closed_struts import ClosedStruts, closed_by_struts_alone
from sweeps import thinned
from truepose._kernel import Points, Study

MACHINES = 60
OFF = 1e-4
"""m, rad and 1: of every parameter."""
SAME = 1e-13
"""m: rounding of a metre, and some."""


def _readable(path: Path) -> bool:
    try:
        return closed_by_struts_alone(description_of(path))
    except (TypeError, ValueError):  # a file with units in its values, or a family
        return False


FILES = [path for path in (*machine_files(), *awkward_files()) if _readable(path)]


def test_every_kind_of_drive_and_parasitic_freedoms_are_among_them() -> None:
    described = [description_of(path) for path in FILES]
    kinds = {drive["kind"] for one in described for drive in one["drives"]}
    assert kinds == {"slider", "telescopic", "crank"}
    assert any(one["dof"] != one["commanded"] for one in described)
    assert len(FILES) >= 16


@pytest.mark.parametrize("path", thinned(FILES, FILES[::4]), ids=lambda path: path.stem)
def test_machines_go_where_the_kernel_says(path: Path) -> None:
    under_test = MachineUnderTest(path)
    kernel, poses = under_test.kernel, under_test.poses
    machine = ClosedStruts(under_test.description)
    joints, points, rotations = machine.inverse(poses)
    expected, placements, _ = kernel.place(poses)
    assert np.abs(joints - expected).max() < SAME
    assert np.abs(points - placements[:, :3]).max() < SAME
    random = np.random.default_rng(under_test.seed)
    t = random.uniform(-1.0, 1.0, (MACHINES, len(kernel.parameters)))
    off = {name: OFF * t[:, [at]] for at, name in enumerate(kernel.parameters)}
    found, _ = machine.forward(joints, points, rotations, off)
    columns = under_test.all_columns
    nothing = np.empty((len(poses), 0))
    half = np.full((len(poses), columns.size), OFF)
    study = Study(
        kernel, expected, placements, columns[:0], nothing, columns, columns.tolist(), half
    )
    moves = [at for at, name in enumerate("xyz") if name in kernel.components]
    rows = [kernel.components.index("xyz"[at]) for at in moves]
    for pose in range(len(poses)):
        errors = np.asarray(study.errors(pose, Points(t, columns.size))[0])[:, rows]
        assert np.abs(found[:, pose, moves] - points[pose, moves] - errors).max() < SAME
        assert np.abs(errors).max() > OFF / 10


@pytest.mark.parametrize("name", ["hexapod", "linear_delta", "rotary_delta"])
def test_what_the_control_believes_leads_back(name: str) -> None:
    """An inverse of the machine as it is sends it exactly where it is wanted."""
    under_test = MachineUnderTest(next(path for path in FILES if path.stem == name))
    machine, poses = ClosedStruts(under_test.description), under_test.poses
    random = np.random.default_rng(under_test.seed)
    off = {name: OFF * random.uniform(-1.0, 1.0) for name in under_test.kernel.parameters}
    joints, points, rotations = machine.inverse(poses, off)
    found, turned = machine.forward(joints, points, rotations, off)
    assert np.abs(found[0] - points).max() < SAME
    assert np.abs(turned[0] - rotations).max() < SAME


def test_tensions_hold_the_force() -> None:
    """By virtual work: a strut that is longer moves the tool along its force, or against it."""
    under_test = MachineUnderTest(next(path for path in FILES if path.stem == "hexapod"))
    machine = ClosedStruts(under_test.description)
    joints, points, rotations = machine.inverse(under_test.three_poses)
    force, step = np.array([30.0, -50.0, 80.0]), 1e-6
    tensions = machine.tensions(joints, points, rotations, force)
    for number, strut in enumerate(machine.struts):
        parameter = f"drive.{strut['drive']}.offset"
        ends = [
            machine.forward(joints, points, rotations, {parameter: sign * step})[0][0]
            for sign in (1.0, -1.0)
        ]
        work = (ends[0] - ends[1]) @ force / (2.0 * step)
        assert tensions[:, number] == pytest.approx(work, rel=1e-6, abs=1e-5)
