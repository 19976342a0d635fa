"""Machines with limbs in CalculiX: their beams as solids, their joints as equations and springs.

`tests/calculix_beams.py` builds them at the points of a machine file's pose. Without contraction
across (Poisson's ratio 0) what the solids of a tube are off a beam by is 0.05 %, of steel 0.6 %
(`test_calculix_beams.py`); asked is 2 % beyond that.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.typing import NDArray

import calculix
import truepose as tp
from build_machine import MACHINES
from calculix_beams import (
    Material,
    Tube,
    platform,
    prismatic,
    sliding_tube,
    strut,
    swinging_limb,
)
from reference_kinematics import rotation_of_quaternion
from sweeps import thinned
from truepose.machine import Machine

Vector = NDArray[np.float64]

ERRORS = {0.0: 5e-4, 0.3: 0.006}
"""By Poisson's ratio: how far the solids of these tubes are off a beam."""
FORCES = ([1000.0, 0.0, 0.0], [-300.0, 700.0, 400.0])

PRISMATIC = 'tilt = ["4e6 N m/rad", "4e6 N m/rad", "8e6 N m/rad"]'
SLIDING = 'joint = "prismatic", across = "500 N/um", tilt = "4e6 N m/rad"'
ASIDE = ("tool = [0, 0, -300]", "tool = [250, 0, -300]")


def machine_of(name: str, poisson: float, *changes: tuple[str, str]) -> Machine:
    """The shipped machine, its beams of 210 GPa and that ratio."""
    text = (MACHINES / f"{name}.toml").read_text()
    beams = f'modulus = "210 GPa", poisson = {poisson} }},'
    for found, put in (('material = "steel" },', beams), *changes):
        assert found in text
        text = text.replace(found, put)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        path.write_text(text)
        return tp.load(path)


def points(machine: Machine, name: str) -> Vector:
    """(3,) nominal, m."""
    return np.array([machine.nominal[machine.parameters.index(f"{name}.{x}")] for x in "xyz"])


def agrees(found: Vector, expected: Vector, poisson: float) -> None:
    error = ERRORS[poisson]
    for part in (slice(0, 3), slice(3, 6)):
        off = np.linalg.norm(found[part] - expected[part]) / np.linalg.norm(expected[part])
        assert off < error + (0.02 if poisson else 1e-3), off


@pytest.mark.parametrize("poisson", sorted(ERRORS))
@pytest.mark.parametrize("number", thinned([60, 4, 100]))
def test_a_3_prs(number: int, poisson: float, tmp_path: Path) -> None:
    calculix.required()
    machine = machine_of("3prs", poisson, (PRISMATIC, 'tilt = "4e6 N m/rad"'))
    pose = machine.poses()[number]
    joints, placements, _ = machine.kernel.place(pose[np.newaxis])
    at, rotation = placements[0, :3], rotation_of_quaternion(placements[0, 3:])
    deck = calculix.Deck()
    ends = [
        at + rotation @ (points(machine, f"{each.part}.platform") - points(machine, "tool"))
        for each in machine.struts
    ]
    body, holds = platform(deck, at, ends)
    for number, limb in enumerate(machine.limbs):
        drive = machine.drives[number]
        way = np.array(drive.fields["axis"])
        start = np.array(drive.fields["origin"]) + joints[0, number] * way
        carriage, _ = platform(deck, start, [start])
        prismatic(deck, carriage, None, way, across=4e8, tilt=4e6)
        swinging_limb(
            deck,
            start,
            ends[number],
            np.array(limb.axis),
            Tube(0.05, 0.006),
            Material(210e9, poisson),
            by=carriage,
            holds=holds[number],
            joint_stiffness={"axial": 3e8, "radial": 3e8, "tilt": 1e6},
            spherical_stiffness=3e8,
        )
    force = FORCES[number % 2]
    deck.load(body.point, force)
    moved = deck.run(tmp_path)
    found = np.r_[moved[body.point], moved[body.turn]]
    agrees(found, machine.compliance(pose) @ np.r_[force, 0, 0, 0], poisson)


@pytest.mark.parametrize("poisson", sorted(ERRORS))
@pytest.mark.parametrize("number", thinned([62, 3, 120]))
def test_a_tricept_with_its_tool_aside(number: int, poisson: float, tmp_path: Path) -> None:
    calculix.required()
    rigid = (SLIDING, 'joint = "prismatic", stiffness = "rigid"')
    machine = machine_of("tricept", poisson, rigid, ASIDE)
    poses = machine.poses()
    usable = poses[machine.kernel.place(poses)[2] == 0]
    pose = usable[number % len(usable)]
    _, placements, _ = machine.kernel.place(pose[np.newaxis])
    at, rotation = placements[0, :3], rotation_of_quaternion(placements[0, 3:])
    deck = calculix.Deck()
    tool = points(machine, "tool")
    ends = [at + rotation @ (points(machine, f"{s.part}.platform") - tool) for s in machine.struts]
    middle = at + rotation @ -tool
    body, (*holds, centre) = platform(deck, at, [*ends, middle])
    for each, end, held in zip(machine.struts, ends, holds, strict=True):
        strut(deck, points(machine, f"{each.part}.base"), held, end, 60e6)
    sliding_tube(
        deck,
        np.zeros(3),
        middle,
        [1.0, 0.0, 0.0],
        rotation @ [0.0, 1.0, 0.0],
        Tube(0.15, 0.012),
        Material(210e9, poisson),
        holds=centre,
        radial=4e8,
        tilt=2e6,
    )
    force = FORCES[number % 2]
    deck.load(body.point, force)
    moved = deck.run(tmp_path)
    found = np.r_[moved[body.point], moved[body.turn]]
    agrees(found, machine.compliance(pose) @ np.r_[force, 0, 0, 0], poisson)
