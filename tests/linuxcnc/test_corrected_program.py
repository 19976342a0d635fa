"""A corrected program in the real LinuxCNC with nominal kinematics, and the actual machine on it.

What LinuxCNC commands its joints to is sampled in every servo cycle, and the actual machine (warm
and loaded, in the computer) is driven by it: its tool has to stay as near to the programmed path
as the proof of the correction states.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from real_linuxcnc import required, run
from scipy.spatial import cKDTree

import truepose as tp
from build_machine import MACHINES
from sweeps import sweep
from truepose import _kernel
from truepose.compensation.commands import actual_of_joints
from truepose.controllers.gcode._axes import Axes
from truepose.machine import Machine

Floats = NDArray[np.float64]

SPACING = 5e-7
"""m between the points of the programmed path."""
BESIDES = 4e-8
"""m by which the tool may be off besides: what halsampler prints of the joints, and LinuxCNC's
joint interpolator in arcs, (v T)^2 / (6 R), which is 4 nm here."""

PLANAR = """\
G21 G90 G17 G94 G61
G0 X280 Y180
G1 X320 Y180 F900 (along the bottom)
G3 X330 Y190 I0 J10
G1 X300 Y200
G2 X280 Y180 R60
M2
"""

HEXAPOD = """\
G21 G90 G94 G61
G0 X-15 Y-10 Z500 A0 B0 C0
G1 X15 F900
G3 X25 Y0 J10
G1 X0 Y10 Z495 A2 B-1
M2
"""


def hot(name: str) -> Machine:
    machine = tp.load(MACHINES / f"{name}.toml")
    warm = machine.condition.reference_temperature + 25.0
    return machine.with_condition(
        machine.condition.replace(temperature=warm, force=(300.0, 200.0, -150.0))
    )


def programmed(machine: Machine, program: Path) -> Floats:
    """(n, n_commanded) points of the feeds, closely."""
    axes = Axes(machine)
    moves = _kernel.GcodeReader(program, start=axes.home(), axes=axes.names).read(1000)
    table = []
    for number in np.flatnonzero(moves.kind != 0):
        share = np.linspace(0.0, 1.0, 2 + int(moves.length[number] * 1e-3 / SPACING))
        table.append(moves.points(np.full(share.size, number), share))
    return axes.poses(np.concatenate(table))


@sweep
@pytest.mark.parametrize(
    ("name", "part"),
    [("planar_two_slider", PLANAR), ("hexapod", HEXAPOD)],
)
def test_the_actual_tool_stays_as_near_as_stated(name: str, part: str, tmp_path: Path) -> None:
    required()
    machine = hot(name)
    source, target = tmp_path / "part.ngc", tmp_path / "corrected.ngc"
    source.write_text(part)
    proof = tp.correct_program(machine, source, target, interpolation="pose")
    folder = tmp_path / "run"
    folder.mkdir()
    axes = "".join(freedom.upper() for freedom in machine.commanded)
    files = tp.export(machine, "linuxcnc").files
    # The module's kinematics are the nominal ones: nothing sets truepose.enable.
    steps = [
        {"do": "home"},
        {"do": "sample", "file": "program.trace"},
        {"do": "program", "file": "corrected.ngc"},
        {"do": "stop_sampling"},
        {"do": "read", "label": "end"},
    ]
    done = run(
        folder,
        files,
        steps,
        axes=axes,
        joints=len(machine.joints),
        programs={"corrected.ngc": target.read_text()},
    )
    assert not done["end"]["errors"]
    joints = np.ascontiguousarray(done.traces["program"][:, : len(machine.joints)] * 1e-3)
    tool, status = actual_of_joints(machine, joints)
    assert not status.any()
    # An angle counts times the characteristic length, as in the correction's tolerance.
    size = machine.characteristic_length
    unit = np.array([1.0 if axis in "xyz" else size for axis in machine.commanded])
    path = programmed(machine, source) * unit
    # On the way to the first feed no path is promised; there LinuxCNC stops exactly.
    begun = np.flatnonzero(np.linalg.norm(tool * unit - path[0], axis=1) < 1e-6)[0]
    off, at = cKDTree(path).query(tool[begun:] * unit)
    assert np.linalg.norm(tool[-1] * unit - path[-1]) < 1e-6
    assert np.diff(at).max() < 0.01 * len(path)  # all of it was gone along
    assert proof.after.position
    assert proof.before.position
    turned = proof.after.orientation.value if proof.after.orientation else 0.0
    stated = float(np.hypot(proof.after.position.value, size * turned))
    assert stated < 0.1 * proof.before.position.value
    assert off.max() <= stated + BESIDES
    assert off.max() > 0.1 * stated
