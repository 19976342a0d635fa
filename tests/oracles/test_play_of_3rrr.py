"""Clearance and backlash of a 3-RRR against a brute-force search for where the load takes it.

Rigid links, pins that may stand anywhere in their holes, cranks anywhere in their play: of all
places that the links allow, a load goes to that of least potential energy. The search knows no
direction of a strut, no tension and no virtual work, and closes the loops by itself.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from machine_texts import load_text
from made_source import with_sources
from sweeps import sweep, thinned
from truepose.machine import Machine

Floats = NDArray[np.float64]
ArrayOrOne = Floats | float

# m, rad
BASE, ARM, COUPLER, BODY = 0.30, 0.15, 0.17, 0.09
AROUND = np.radians([90.0, 210.0, 330.0])
BODY_TURN = np.radians(10.0)
TIP_CLEARANCE = np.array([40e-6, 60e-6, 20e-6])
BODY_CLEARANCE = np.array([30e-6, 50e-6, 70e-6])
PLAY = np.radians([0.02, 0.03, 0.01])

_HEAD = """\
schema = 1
[machine]
name = "3-RRR"
dof = ["x", "y", "c"]
[units]
length = "m"
angle = "rad"
force = "N"
moment = "N m"
"""
_DRIVE = """\
[[drive]]
name = "{name}"
kind = "crank"
origin = [{origin[0]}, {origin[1]}, 0]
axis = [0, 0, 1]
travel = [-7, 7]
working_mode = "+"
{backlash}
"""
_STRUT = """\
[[strut]]
name = "{name}"
drive = "{name}"
base = [{arm}, 0, 0]
platform = [{platform[0]}, {platform[1]}, 0]
length = {length}
{joints}
"""
_JOINTS = """\
base_joint = {{ kind = "revolute", axis = [0, 0, 1], clearance = {tip} }}
platform_joint = {{ kind = "revolute", axis = [0, 0, 2], clearance = {body} }}"""


def around(radius: float, angles: Floats) -> Floats:
    """(n, 2) points on a circle about the origin."""
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def text(*, clearance: bool, backlash: bool) -> str:
    """The machine file, with the play asked for."""
    parts = [_HEAD]
    for leg in range(3):
        given = f"backlash = {{ play = {PLAY[leg]} }}"
        parts.append(
            _DRIVE.format(
                name="abc"[leg],
                origin=around(BASE, AROUND)[leg],
                backlash=given if backlash else "",
            )
        )
    for leg in range(3):
        given = _JOINTS.format(tip=TIP_CLEARANCE[leg], body=BODY_CLEARANCE[leg])
        parts.append(
            _STRUT.format(
                name="abc"[leg],
                arm=ARM,
                platform=around(BODY, AROUND + BODY_TURN)[leg],
                length=COUPLER,
                joints=given if clearance else "",
            )
        )
    return "".join(parts)


@dataclass(frozen=True)
class Links:
    """The 3-RRR's links at some crank angles (3,), under a load: where its body goes.

    A state is nine numbers: the direction in which the pin at each crank's tip stands off, the same
    of the body's pins, rad, and where each crank stands in its play, -1 to 1.
    """

    cranks: Floats
    start: Floats
    load: Floats
    clearance: float
    backlash: float

    def poses(self, states: Floats, radius: ArrayOrOne = 1.0) -> Floats:
        """(n, 3) x, y and turn of the body at `states` (n, 9), by Newton on the three links.

        `radius` (n, 6) or 1: how far each pin stands off, in its hole's radius.
        """
        reach = self.clearance * np.concatenate([TIP_CLEARANCE, BODY_CLEARANCE]) / 2 * radius
        off = reach[..., np.newaxis] * np.stack([np.cos(states[:, :6]), np.sin(states[:, :6])], -1)
        angles = self.cranks + self.backlash * PLAY / 2 * states[:, 6:]
        tips = around(BASE, AROUND) + around(ARM, angles) + off[:, :3]
        pose = np.tile(self.start, (len(states), 1))
        for _ in range(20):
            turned = AROUND + BODY_TURN + pose[:, 2:]
            pins = pose[:, np.newaxis, :2] + around(BODY, turned) + off[:, 3:]
            span = pins - tips
            length = np.linalg.norm(span, axis=-1)
            along = span / length[..., np.newaxis]
            ahead = BODY * np.stack([-np.sin(turned), np.cos(turned)], axis=-1)
            jacobian = np.concatenate([along, (along * ahead).sum(-1, keepdims=True)], axis=-1)
            step = np.linalg.solve(jacobian, (length - COUPLER)[..., np.newaxis])[..., 0]
            pose -= step
            if np.abs(step).max() < 1e-16:
                break
        assert np.abs(length - COUPLER).max() < 1e-14
        return pose

    def energy(self, states: Floats, radius: ArrayOrOne = 1.0) -> Floats:
        """(n,) J: what the load has still to give, less what it has at the start."""
        return -(self.poses(states, radius) - self.start) @ self.load

    def least(self) -> Floats:
        """(3,) the pose of least energy: every state of a coarse grid, then ever finer ones."""
        directions = np.linspace(0.0, 2 * np.pi, 5)[:-1] if self.clearance else [0.0]
        flanks = [-1.0, 0.0, 1.0] if self.backlash else [0.0]
        grid = np.array(list(itertools.product(*[directions] * 6, *[flanks] * 3)))
        best = grid[self.energy(grid).argmin()]
        step = np.array([np.pi / 4] * 6 + [0.5] * 3)
        for _ in range(24):
            for moving in ([*range(6)] * bool(self.clearance), [6, 7, 8] * bool(self.backlash)):
                near = list(itertools.product([-1.0, 0.0, 1.0], repeat=len(moving)))
                states = np.tile(best, (len(near), 1))
                states[:, moving] += step[moving] * np.array(near)
                states[:, 6:] = np.clip(states[:, 6:], -1.0, 1.0)
                best = states[self.energy(states).argmin()]
            step = 0.6 * step
        return self.poses(best[np.newaxis, :])[0]


def rigid(folder: Path, *, clearance: bool, backlash: bool) -> Machine:
    """The machine with nothing but its play: its links stretch under no load."""
    machine = load_text(folder, text(clearance=clearance, backlash=backlash))
    return with_sources(machine, *(each for each in machine.sources if each.name in PLAYS))


PLAYS = ("backlash", "clearance")
POSES = np.array([[0.0, 0.0, 0.0], [0.03, -0.02, 0.15]])
LOADS = np.array([[60.0, -25.0, 3.0], [-10.0, 40.0, -1.5]])


@sweep
@pytest.mark.parametrize("load", thinned([*LOADS, *-LOADS[:1]]))
@pytest.mark.parametrize(
    ("clearance", "backlash"), [(True, False), (False, True), (True, True)], ids=str
)
def test_the_load_takes_the_body_where_the_search_finds_it(
    tmp_path: Path, clearance: bool, backlash: bool, load: Floats
) -> None:
    machine = rigid(tmp_path, clearance=clearance, backlash=backlash)
    condition = machine.condition.replace(force=[*load[:2], 0.0], moment=[0.0, 0.0, load[2]])
    found = tp.budget(machine, POSES, condition)
    assert not found.uncertainty.values.any()
    for pose, cranks, error in zip(
        POSES, machine.inverse(POSES), found.overall_error.values, strict=True
    ):
        links = Links(cranks, pose, load, float(clearance), float(backlash))
        assert np.abs(links.poses(np.zeros((1, 9)), 0.0) - pose).max() < 1e-14
        searched = links.least() - pose
        # The pins stand off along the struts to the last digit, since the search turns them with
        # the struts: only its last step, 0.6^24 of 45 deg, is left, by its square.
        assert np.linalg.norm(error[:2]) > 1e-5
        assert np.abs(error - searched).max() < 1e-7 * np.abs(searched).max()


def test_no_place_inside_the_holes_has_less_energy(tmp_path: Path) -> None:
    (cranks,) = rigid(tmp_path, clearance=True, backlash=True).inverse(POSES[1:])
    links = Links(cranks, POSES[1], LOADS[0], 1.0, 1.0)
    random = np.random.default_rng(7)
    states = random.uniform(-1, 1, (20000, 9)) * np.array([np.pi] * 6 + [1.0] * 3)
    inside = links.energy(states, np.sqrt(random.uniform(size=(20000, 6))))
    assert inside.min() > -(links.least() - POSES[1]) @ LOADS[0]
