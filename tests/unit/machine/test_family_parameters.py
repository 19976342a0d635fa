"""What a parameter of a family moves: derivatives against files with other values."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest

from family_machines import KINDS, family_file
from machine_file import loaded
from truepose.arrays import Floats
from truepose.machine import Machine
from truepose.spatial import tangents

SI = {"mm": 1e-3, "in": 0.0254, "deg": np.pi / 180.0}


def stepped(file: dict[str, Any], machine: Machine, name: str, step: float) -> Machine:
    """The machine of a file whose parameter `name` is `step` more, m or rad."""
    _, key, *limb = name.split(".")
    assert machine.family is not None
    unit = file["units"][machine.family.dimension(name)]
    more = step / SI[unit]
    old = file["family"].get(key)
    if old is None:  # a default, three angles
        old = np.degrees(machine.family.family.values()[key]).tolist()
    if limb:
        limbs = machine.family.family.limbs
        values = list(old) if isinstance(old, list) else [old] * len(limbs)
        values[limbs.index(limb[0])] += more
    else:
        values = [value + more for value in old] if isinstance(old, list) else old + more
    return loaded({**file, "family": file["family"] | {key: values}})


def told_about(machine: Machine, axes: Machine) -> Floats:
    """Parameters of a machine with its directions as tilts about those of another."""
    values = np.array(machine.nominal)
    for own, others in zip(
        (*machine.drives, *machine.guides), (*axes.drives, *axes.guides), strict=True
    ):
        for key in own.fields:
            if not key.endswith(("axis", "normal")):
                continue
            one, other = np.array(own.fields[key]), np.array(others.fields[key])
            across = tangents(other) @ one / (other @ one)
            for tilt, value in zip("uv", across, strict=True):
                values[machine.parameters.index(f"{own.part}.{key}.{tilt}")] = value
    return values


@pytest.mark.parametrize("kind", KINDS)
def test_effects_are_finite_differences_of_the_file(kind: str) -> None:
    file = family_file(kind)
    machine = loaded(file)
    assert machine.family is not None
    assert machine.family.names
    for name in machine.family.names:
        # Of an exact derivative a central difference is off by the third order, h^2 / 6.
        step = 2e-5
        up, down = (stepped(file, machine, name, sign * step) for sign in (1.0, -1.0))
        slope = (told_about(up, machine) - told_about(down, machine)) / (2.0 * step)
        effects = np.zeros(len(machine.parameters))
        for moved, effect in machine.family.effects(name).items():
            effects[machine.parameters.index(moved)] = effect
        largest = np.abs(effects).max()
        np.testing.assert_allclose(slope, effects, rtol=0, atol=1e-9 * max(largest, 1.0))


@pytest.mark.parametrize("kind", KINDS)
def test_the_tool_moves_as_with_another_file(kind: str) -> None:
    """The group's effect at the tool, against the forward kinematics of two other files."""
    file = family_file(kind)
    machine = loaded(file)
    pose = machine.home[[machine.dof.index(freedom) for freedom in machine.commanded]]
    joints = machine.inverse(pose)
    sensitivity = machine.sensitivity(pose)
    assert machine.family is not None
    step = 1e-5
    for name in machine.family.names:
        told = np.zeros(len(machine.components))
        for moved, effect in machine.family.effects(name).items():
            told += sensitivity[:, machine.parameters.index(moved)] * effect
        up, down = (
            stepped(file, machine, name, sign * step).forward(joints, start=machine.home)
            for sign in (1.0, -1.0)
        )
        # At home nothing is turned, so that small angles a b c are the rotation vector.
        difference = (up - down) / (2.0 * step)
        largest = max(np.abs(told).max(), 1.0)
        np.testing.assert_allclose(difference, told, rtol=0, atol=1e-7 * largest)


def test_the_parts_of_a_parameter_make_the_whole() -> None:
    machine = loaded(family_file("linear_delta"))
    family = machine.family
    assert family is not None
    parts = [family.effects(f"family.radius.{limb}") for limb in "abc"]
    whole = {name: slope for part in parts for name, slope in part.items()}
    assert family.effects("family.radius") == whole
    assert family.value("family.radius.a") == pytest.approx(0.20475, abs=1e-7)
    assert family.unit("family.angle") == "rad"
    assert "family.height" not in loaded(family_file("hexapod")).family.names


def test_a_machine_of_a_family_is_pickled_and_compared() -> None:
    machine = loaded(family_file("rotary_delta"))
    assert copy.copy(machine) == machine
    assert copy.deepcopy(machine) == machine
    assert machine.family.changed({"family.spacing": 1e-3}) != machine.family
