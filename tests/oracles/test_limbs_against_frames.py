"""Machines with limbs against frames of beams and joints (frame_model, frame_of_machine).

The frame is solved as a whole, with every beam and joint in it; the kernel has the closure forces
from equilibrium and one matrix a limb. To first order both are the same, to rounding; the exact
error of the budget, with its limbs as they have given way, differs in the second order.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.typing import NDArray

import truepose as tp
from build_machine import MACHINES
from frame_of_machine import MachineFrame
from sweeps import thinned
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import PoseBlock
from yielding_machines import CHAINS, yielding

Array = NDArray[np.float64]

AGREE = 1e-9
THIRD_ORDER = 2e-5
"""Of the error without its second order, which the error under half the force tells."""
POSES, FEWEST = 30, 27

ASIDE = ("tool = [0, 0, -300]", "tool = [250, 0, -300]")

CASES: dict[str, tuple[str, Sequence[tuple[str, str]]]] = {
    "3prs": ("3prs", ()),
    "3rps": ("3rps", ()),
    "tricept, the tool on its axis": ("tricept", ()),
    "tricept, the tool aside": ("tricept", (ASIDE,)),
    "rotary_delta, arms in torsion": ("rotary_delta", ()),
    "linear_delta, carriages": ("linear_delta", ()),
}
HEAVY = {
    "3rps": ("length_tolerance = [-0.01, 0.01]\n", 'length_tolerance = 0.01\nmass = "25 kg"\n'),
    "3prs": ('length_tolerance = "IT7"', 'length_tolerance = "IT7"\nmass = "12 kg"'),
    "tricept": ('name = "tube"\nguides', 'name = "tube"\nmass = "80 kg"\nlength = 1900\nguides'),
}
PLATFORM = ("[platform]\n", '[platform]\nmass = "80 kg"\ncentre_of_mass = [20, -10, 60]\n')
LEANING = ("[condition]", "[mounting]\na = 70\nb = 20\n\n[condition]")


@cache
def machine_of(name: str, changes: tuple[tuple[str, str], ...] = ()) -> Machine:
    text = (yielding(name) if name in CHAINS else MACHINES / f"{name}.toml").read_text()
    for found, put in changes:
        assert found in text
        text = text.replace(found, put)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.toml"
        path.write_text(text)
        return tp.load(path)


@cache
def poses_of(machine: Machine) -> tuple[Array, Array, Array]:
    """Some usable poses of the workspace, and their joints and placements."""
    poses = machine.poses()
    poses = poses[np.unique(np.linspace(0, len(poses) - 1, POSES).astype(int))]
    joints, placements, status = machine.kernel.place(poses)
    usable = status == 0
    assert usable.sum() >= FEWEST
    return poses[usable], joints[usable], placements[usable]


def apart(machine: Machine, found: Array, expected: Array) -> float:
    """The largest difference of displacements and turns, of the largest of them."""
    size = np.repeat([1.0, machine.characteristic_length], 3)
    return float((np.abs(found - expected) * size).max() / (np.abs(expected) * size).max())


@pytest.mark.parametrize("case", thinned(CASES, ["3prs", "rotary_delta, arms in torsion"]))
def test_compliance_is_that_of_the_frame(case: str) -> None:
    name, changes = CASES[case]
    machine = machine_of(name, tuple(changes))
    poses, joints, placements = poses_of(machine)
    compliance = machine.compliance(poses)
    size = machine.characteristic_length
    for at in range(len(poses)):
        frame = MachineFrame(machine, joints[at], placements[at])
        for direction in range(6):
            wrench = np.zeros(6)
            wrench[direction] = 1.0 if direction < 3 else size
            moved = frame.moved(wrench)
            assert apart(machine, compliance[at] @ wrench, moved) < AGREE
    stiffness = machine.stiffness(poses)
    unit = np.einsum("nij,njk->nik", stiffness, compliance)
    np.testing.assert_allclose(unit, np.broadcast_to(np.eye(6), unit.shape), atol=1e-8)


@pytest.mark.parametrize("case", thinned(CASES, ["3prs"]))
def test_the_exact_error_is_that_of_the_frame_but_for_the_second_order(case: str) -> None:
    name, changes = CASES[case]
    machine = machine_of(name, tuple(changes))
    poses, joints, placements = poses_of(machine)
    small = "delta" in name
    force = (20.0, 10.0, 15.0) if small else (800.0, -600.0, 300.0)
    whole, half = (_errors(machine, poses, [share * f for f in force]) for share in (1.0, 0.5))
    linear = 4.0 * half - whole
    off, beyond = 0.0, 0.0
    for at in range(len(poses)):
        moved = MachineFrame(machine, joints[at], placements[at]).moved([*force, 0, 0, 0])
        off = max(off, apart(machine, whole[at], moved))
        beyond = max(beyond, apart(machine, linear[at], moved))
    largest = float(np.linalg.norm(whole[:, :3], axis=1).max())
    print(f"{case}: {1e6 * largest:.1f} um, off {off:.2g}, without the second order {beyond:.2g}")
    assert beyond < THIRD_ORDER
    # The second order of a displacement is the displacement over the size of what turns.
    assert off < largest / machine.characteristic_length


def _errors(machine: Machine, poses: Array, force: Sequence[float]) -> Array:
    """(n, 6) exact errors under a force alone."""
    result = tp.budget(machine, poses, machine.condition.replace(force=force))
    return np.asarray(result["error"].sel(source="elastic").to_numpy())


def shifts_of(machine: Machine, source: str, condition: tp.Condition) -> tuple[PoseBlock, Array]:
    """The first block of poses, and the displacement to first order under one source."""
    poses = poses_of(machine)[0]
    block = next(iter(PoseRun(machine, poses, condition)))
    (found,) = (each for each in machine.sources if each.name == source)
    deviation = found.deviation(machine, condition, block)  # type: ignore[attr-defined]
    shift = np.zeros((len(poses), len(machine.parameters)))
    table = np.broadcast_to(deviation.shift, (len(poses), deviation.parameters.size))
    np.add.at(shift, (slice(None), deviation.parameters), table)
    return block, np.einsum("nij,nj->ni", machine.sensitivity(poses), shift)


@pytest.mark.parametrize("name", thinned(["3prs", "3rps", "tricept"]))
def test_limbs_sag_as_the_frame_does(name: str) -> None:
    """Every kilogram where it is: spread over the beams, not at their ends."""
    machine = machine_of(name, (LEANING, HEAVY[name], PLATFORM))
    reference = machine.condition.reference_temperature
    condition = machine.condition.replace(force=(0, 0, 0), temperature=reference)
    block, moved = shifts_of(machine, "loads", condition)
    weight = condition.gravity * machine.down
    masses = {strut.name: strut.mass for strut in machine.struts}
    for at in range(block.indices.size):
        frame = MachineFrame(machine, block.joints[at], block.placements[at])
        frame.load_platform(weight)
        for limb in machine.limbs:
            if limb.strut is None:
                assert limb.length is not None
                frame.load_tube(limb, limb.mass * weight / limb.length, limb.length)
            else:
                frame.load_beams(limb, masses[limb.strut] * weight)
        assert apart(machine, moved[at], frame.frame.solve()[frame.tool]) < AGREE


def test_a_prismatic_cantilever_sags_by_an_eighth() -> None:
    """q l^4 / 8 E I; half the weight at the end, the lever rule, would give a third more."""
    stiff = [
        ('across = "400 N/um", tilt = ["4e6 N m/rad", "4e6 N m/rad", "8e6 N m/rad"]', RIGID),
        ('radial = "300 N/um", axial = "300 N/um", tilt = "1e6 N m/rad"', RIGID),
        (
            'joint = "spherical", radial = "300 N/um", axial = "300 N/um"',
            f'joint = "spherical", {RIGID}',
        ),
        ('wall = 6, material = "steel"', 'wall = 6, material = "steel", shear_modulus = "1e9 GPa"'),
        HEAVY["3prs"],
        # Gravity along base x: across limb 1.
        ("[condition]", "[mounting]\nb = 90\n\n[condition]"),
    ]
    machine = machine_of("3prs", tuple(stiff))
    condition = machine.condition.replace(force=(0, 0, 0), temperature=293.15)
    block = next(iter(PoseRun(machine, poses_of(machine)[0], condition)))
    (loads,) = (each for each in machine.sources if each.name == "loads")
    deviation = loads.deviation(machine, condition, block)  # type: ignore[attr-defined]
    column = machine.parameters.index("guide.g1.offset")
    (at,) = np.flatnonzero(deviation.parameters == column)
    inertia = np.pi * (0.05**4 - 0.038**4) / 64
    weight, length = 12.0 * condition.gravity, 0.5
    bent = deviation.shift[:, at]
    # What the platform's closures carry beside: its share of all three struts' weight.
    force = block.loads(np.array([column]), "own")[:, 0]
    beam = 210e9 * inertia
    expected = force * length**3 / (3 * beam)
    across = float(machine.down @ np.array([-1.0, 0.0, 0.0]))
    expected = expected - weight * across * length**3 * (1 / 6 - 1 / 8) / beam
    np.testing.assert_allclose(bent, expected, rtol=1e-6)
    assert abs(across) > 0.9


RIGID = 'stiffness = "rigid"'


@pytest.mark.parametrize("name", thinned(["3prs", "3rps", "tricept"]))
def test_limbs_warmer_on_one_side_bend_as_the_frame_does(name: str) -> None:
    machine = machine_of(name)
    reference = machine.condition.reference_temperature
    parts = dict.fromkeys(machine.condition.part_temperatures, reference)
    condition = machine.condition.replace(
        force=(0, 0, 0),
        temperature={"default": reference, **parts},
        gradient={limb.part: (0.0, 3.0, -2.0) for limb in machine.limbs},
    )
    block, moved = shifts_of(machine, "thermal", condition)
    for at in range(block.indices.size):
        frame = MachineFrame(machine, block.joints[at], block.placements[at])
        frame.warm_beams(3.0, -2.0)
        assert apart(machine, moved[at], frame.frame.solve()[frame.tool]) < AGREE
