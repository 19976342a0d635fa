"""Weight and compliance of a machine's own parts, on every machine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

import truepose
from machine_under_test import MachineUnderTest
from truepose.machine import Body, Machine
from truepose.sources import PoseBlock

Floats = NDArray[np.float64]

STEP = 1e-6


def loaded(machine: MachineUnderTest, **bodies: object) -> Machine:
    """The machine of the file without its masses, but with the parts given."""
    found = truepose.load(machine.path)
    weightless = replace(
        found,
        platform=Body("platform"),
        drives=tuple(replace(drive, mass=0.0) for drive in found.drives),
        struts=tuple(replace(strut, mass=0.0) for strut in found.struts),
        condition=found.condition.replace(gravity=9.80665, acceleration=(0, 0, 0)),
    )
    return replace(weightless, **bodies)  # type: ignore[arg-type]


def heavy(machine: MachineUnderTest) -> Machine:
    """The machine with masses everywhere, standing askew."""
    random = np.random.default_rng(machine.seed + 20)
    bare = loaded(machine)
    length = machine.kernel.characteristic_length
    ring = {row["name"] for row in machine.description["struts"] if "ring_radius" in row}
    x, y, z = random.uniform(-1, 1, 3) * length
    a, b, c = random.uniform(-3, 3, 3)
    return replace(
        bare,
        mounting=(a, b, c),
        platform=Body("platform", 40.0, (x, y, z)),
        drives=tuple(replace(drive, mass=random.uniform(1, 9)) for drive in bare.drives),
        struts=tuple(
            # A joint on a ring slides as its base moves, which the rule of both ends leaves out.
            replace(
                strut,
                mass=random.uniform(1, 9),
                centre_of_mass=0.0 if strut.name in ring else random.uniform(),
            )
            for strut in bare.struts
        ),
    )


def block_of(machine: MachineUnderTest, loaded: Machine) -> PoseBlock:
    joints, placements = machine.placed
    indices = np.arange(len(machine.poses))
    return PoseBlock(loaded, loaded.condition, machine.poses, indices, joints, placements)


def close(found: Floats, expected: Floats, tolerance: float) -> bool:
    return bool(np.abs(found - expected).max() <= tolerance * np.abs(expected).max())


def test_a_platform_weighs_as_a_force_on_its_centre_of_mass(machine: MachineUnderTest) -> None:
    tool = tuple(
        machine.kernel.nominal[
            [machine.kernel.parameters.index(f"tool.{axis}") for axis in "xyz"]
        ].tolist()
    )
    weighing = loaded(machine, platform=Body("platform", 25.0, tool))
    x, y, z = 25.0 * 9.80665 * weighing.down
    pushed = loaded(machine)
    pushed = pushed.with_condition(pushed.condition.replace(force=(x, y, z), moment=(0, 0, 0)))
    columns = machine.all_columns
    own = block_of(machine, weighing).loads(columns, "own")
    tool_load = block_of(machine, pushed).loads(columns, "tool")
    assert close(own, tool_load, 1e-9)


def test_upside_down_everything_is_loaded_the_other_way(machine: MachineUnderTest) -> None:
    upright = replace(heavy(machine), mounting=(0.0, 0.0, 0.0))
    turned = replace(upright, mounting=(np.pi, 0.0, 0.0))
    columns = machine.all_columns
    up = block_of(machine, upright).loads(columns, "own")
    down = block_of(machine, turned).loads(columns, "own")
    assert close(down, -up, 1e-9)


def test_turning_about_the_vertical_changes_nothing(machine: MachineUnderTest) -> None:
    # In the workshop, that is: the base frame's own z is vertical only where a and b are zero.
    standing = heavy(machine)
    a, b, c = standing.mounting
    turned = replace(standing, mounting=(a, b, c + 1.0))
    columns = machine.all_columns
    before = block_of(machine, standing).loads(columns, "own")
    assert np.array_equal(block_of(machine, turned).loads(columns, "own"), before)


def test_loads_add_up(machine: MachineUnderTest) -> None:
    loaded = heavy(machine)
    block = block_of(machine, loaded)
    columns = machine.all_columns
    both = block.loads(columns, "tool") + block.loads(columns, "own")
    assert close(block.loads(columns, "all"), both, 1e-9)


def height_energy(machine: Machine, placements: Floats, centres: Floats) -> Floats:
    """(n,) -sum of weight . centre of mass, J, worked out mass by mass."""
    weight = machine.condition.gravity * machine.down
    w, x, y, z = placements[:, 3:].T
    names = machine.parameters
    tool = machine.nominal[[names.index(f"tool.{axis}") for axis in "xyz"]]
    arm = np.array(machine.platform.centre_of_mass) - tool
    vector = np.stack([x, y, z], axis=1)
    turned = arm + 2 * np.cross(vector, np.cross(vector, arm) + w[:, None] * arm)
    energy = -machine.platform.mass * (placements[:, :3] + turned) @ weight
    for index, strut in enumerate(machine.struts):
        base, platform = centres[:, index, 0], centres[:, index, 1]
        middle = base + strut.centre_of_mass * (platform - base)
        energy -= strut.mass * middle @ weight
        sharers = [each for each in machine.struts if each.drive == strut.drive]
        for drive in machine.drives:
            if drive.name == strut.drive:
                energy -= drive.mass / len(sharers) * base @ weight
    return np.asarray(energy)


def test_loads_are_the_work_of_the_weights(machine: MachineUnderTest) -> None:
    # A second road: move a parameter a little, let the machine follow, and weigh what rose.
    loaded = heavy(machine)
    block = block_of(machine, loaded)
    kernel = loaded.kernel
    joints, placements = machine.placed
    # Where a joint sits on the platform decides where a strut's weight is, not whether it bends.
    fixed = [
        i
        for i, name in enumerate(kernel.parameters)
        if name.startswith("tool.") or ".platform." in name or name.endswith("ring_radius")
    ]
    columns = np.setdiff1d(machine.all_columns, fixed)
    found = block.loads(columns, "own")
    start = kernel.pose_of(placements)
    energies = []
    for column in columns:
        name, nominal = kernel.parameters[column], kernel.nominal[column]
        step = STEP * (machine.unit_of_parameter[column] if nominal == 0.0 else 1.0)
        sides = []
        for side in (step, -step):
            moved = kernel.replace({name: nominal + side})
            poses = moved.forward(joints, start)
            at = moved.placement_of(poses)
            sides.append(height_energy(loaded, at, moved.joint_centres(joints, at)))
        energies.append((sides[1] - sides[0]) / (2 * step))
    expected = np.stack(energies, axis=1)
    scale = np.abs(expected / machine.unit_of_parameter[columns]).max()
    gap = np.abs((found - expected) / machine.unit_of_parameter[columns]).max()
    assert gap < 1e-5 * scale


def test_series_compliance_adds(machine: MachineUnderTest) -> None:
    base = truepose.load(machine.path)
    lengths = base.kernel.lengths_at(*machine.placed)
    columns, before = base.compliances(lengths)
    joints = [replace(strut.base_joint, stiffness=80e6) for strut in base.struts]
    softer = replace(
        base,
        struts=tuple(
            replace(strut, base_joint=joint)
            for strut, joint in zip(base.struts, joints, strict=True)
        ),
    )
    same, after = softer.compliances(lengths)
    was = np.array([strut.base_joint.stiffness or np.inf for strut in base.struts])
    assert np.array_equal(columns, same)
    gap = (after - before)[:, : len(base.struts)] - (1 / 80e6 - 1 / was)
    assert np.abs(gap).max() < 1e-12 / 80e6 + 1e-20
