"""The loads source: weight, inertia, and a force of unknown direction, against hand calculation."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError, TrueposeError
from truepose.machine import Envelope
from truepose.sources import ARCSINE, UNIFORM, Deviation, Loads, PoseBlock, acting

G = 9.80665
NO_FORCE = ("force = { x = 1200, y = -1500 }\n", "")
SOFT = 'mass = "2 kg"\nsection_area = "100 mm^2"\nmodulus = "200 GPa"\n'
HUNG = HEXAPOD.replace("platform = [", f"{SOFT}platform = [")
PLATFORM = '[platform]\nmass = "30 kg"\n[workspace]'

# One strut that hangs on a rail overhead and carries a tool that a guideway holds upright.
HANGING = """\
schema = 1
[machine]
name = "hanging"
dof = ["z"]
[units]
length = "mm"
angle = "deg"
[[drive]]
name = "d"
kind = "slider"
axis = [0, 0, 1]
travel = [500, 2000]
working_mode = "+"
[[strut]]
name = "1"
drive = "d"
base = [0, 0, 0]
platform = [0, 0, 0]
length = 800
mass = "5 kg"
section_area = "100 mm^2"
modulus = "200 GPa"
[workspace]
grid = { z = [100, 300, 3] }
"""
LENGTH, AREA_MODULUS = 0.8, 100e-6 * 200e9


def error_of(machine: tp.Machine, **condition: object) -> np.ndarray:
    found = tp.budget(machine, condition=machine.condition.replace(**condition))
    return np.asarray(found.error.sel(source="loads").values)


def deviation_of(machine: tp.Machine, **condition: object) -> Deviation:
    given = machine.condition.replace(**condition)
    poses = machine.poses()
    joints, placements, _ = machine.kernel.place(poses)
    block = PoseBlock(machine, given, poses, np.arange(len(poses)), joints, placements)
    (source,) = [source for source in machine.sources if isinstance(source, Loads)]
    return source.deviation(machine, given, block)


def test_a_hanging_strut_stretches_under_half_its_own_weight(tmp_path: Path) -> None:
    # Strength of materials: m g L / (2 E A), the weight at its middle.
    error = error_of(load_text(tmp_path, HANGING))
    assert error == pytest.approx(-5 * G * LENGTH / (2 * AREA_MODULUS), rel=1e-6)


@pytest.mark.parametrize("centre", [0.0, 0.3, 1.0])
def test_the_lever_rule_shares_a_strut_between_its_joints(tmp_path: Path, centre: float) -> None:
    text = edited(HANGING, ('mass = "5 kg"', f'mass = "5 kg"\ncentre_of_mass = {centre}'))
    error = error_of(load_text(tmp_path, text))
    assert error == pytest.approx(-5 * G * centre * LENGTH / AREA_MODULUS, rel=1e-6, abs=1e-18)


def test_strut_and_carriage_weigh_on_the_drive(tmp_path: Path) -> None:
    # The drive holds all that hangs on it: 3 kg of carriage, 5 kg of strut, 30 kg of platform.
    text = edited(
        HANGING,
        ('name = "d"\n', 'name = "d"\nmass = "3 kg"\nstiffness = "10 N/um"\n'),
        ("[workspace]", PLATFORM),
    )
    error = error_of(load_text(tmp_path, text))
    stretch = (30 + 5 / 2) * G * LENGTH / AREA_MODULUS
    assert error == pytest.approx(-(stretch + 38 * G / 10e6), rel=1e-6)


def test_what_the_base_joint_stands_on_holds_the_carriage_too(tmp_path: Path) -> None:
    text = edited(
        HANGING,
        ('name = "d"\n', 'name = "d"\nmass = "3 kg"\n'),
        ("length = 800", 'length = 800\nbase_stiffness = [inf, inf, "10 N/um"]'),
    )
    error = error_of(load_text(tmp_path, text))
    stretch = 2.5 * G * LENGTH / AREA_MODULUS
    assert error == pytest.approx(-(stretch + 8 * G / 10e6), rel=1e-6)


def test_upside_down_all_deflections_change_their_sign(tmp_path: Path) -> None:
    text = edited(HUNG, ("[workspace]", PLATFORM))
    upright = deviation_of(load_text(tmp_path, text))
    turned = deviation_of(load_text(tmp_path, text, "mounting.a=180"))
    assert upright.shift.any()
    assert turned.shift == pytest.approx(-upright.shift, rel=1e-9, abs=1e-18)


def test_gravity_can_be_another_or_none(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HUNG)
    half = deviation_of(machine, gravity=G / 2).shift
    assert half == pytest.approx(0.5 * deviation_of(machine).shift, rel=1e-12)
    assert "loads" in {source.name for source in acting(machine)}
    weightless = machine.condition.replace(gravity=0.0)
    assert "loads" not in {source.name for source in acting(machine, weightless)}


def test_an_accelerated_platform_resists(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path,
        edited(
            HEXAPOD.replace("platform = [", f"{SOFT[14:]}platform = ["), ("[workspace]", PLATFORM)
        ),
    )
    # As if the acceleration were gravity, the other way.
    fallen = deviation_of(machine, gravity=2.0).shift
    accelerated = deviation_of(machine, gravity=0.0, acceleration=(0, 0, 2.0)).shift
    assert accelerated == pytest.approx(fallen, rel=1e-9, abs=1e-18)
    falling = deviation_of(machine, acceleration=(0.0, 0.0, -G)).shift
    assert np.abs(falling).max() < 1e-12 * np.abs(fallen).max(), "in free fall nothing has weight"


def test_a_centre_of_mass_away_from_the_tool_also_turns_the_platform(tmp_path: Path) -> None:
    text = edited(HUNG.replace('mass = "2 kg"\n', ""), ("[workspace]", PLATFORM))
    text = edited(text, ('mass = "30 kg"', 'mass = "30 kg"\ncentre_of_mass = [40, -20, 70]'))
    machine = load_text(tmp_path, text)
    angle = machine.poses()[:, 5]
    arm = np.stack(
        [0.04 * np.cos(angle) + 0.02 * np.sin(angle), 0.04 * np.sin(angle) - 0.02 * np.cos(angle)]
    )
    weight = 30 * G
    wrench = np.zeros((len(angle), 6))
    wrench[:, 2] = -weight
    wrench[:, 3], wrench[:, 4] = -weight * arm[1], weight * arm[0]
    tension = machine.forces(machine.poses(), wrench)
    lengths = machine.inverse(machine.poses()) + 0.6
    found = deviation_of(machine)
    assert found.shift == pytest.approx(tension * lengths / (100e-6 * 200e9), rel=1e-9, abs=1e-16)


def test_a_force_of_any_direction_is_three_variables(tmp_path: Path) -> None:
    text = HEXAPOD.replace("platform = [", f"{SOFT[14:]}platform = [")
    machine = load_text(tmp_path, text)
    found = deviation_of(machine, envelope=300.0)
    banded = found.banded
    assert len(np.unique(found.variables[banded])) == 3
    assert not found.shift.any()
    assert {found.distribution[k] for k in banded} == {UNIFORM}
    assert not found.edge.any()
    columns, lengths = machine.kernel.length_parameters, machine.inverse(machine.poses()) + 0.6
    for axis in range(3):
        mine = (found.groups == axis).nonzero()[0]
        wrench = np.zeros(6)
        wrench[axis] = 300.0
        moved = machine.forces(machine.poses(), wrench) * lengths / (100e-6 * 200e9)
        assert found.parameters[mine].tolist() == columns.tolist()
        assert found.signed_half[:, mine] == pytest.approx(moved, rel=1e-9, abs=1e-18)


def test_its_worst_is_that_of_the_worst_direction(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HEXAPOD.replace("platform = [", f"{SOFT[14:]}platform = ["))
    condition = machine.condition.replace(envelope=300.0)
    found = tp.budget(machine, condition=condition).sel(source="loads")
    flexible = machine.compliance(machine.poses())[:, :, :3]
    sphere = 300.0 * np.linalg.norm(flexible, axis=2)
    assert np.abs(found.worst - sphere).max() < 1e-9 * sphere.max()
    # The standard uncertainty is that of a direction which is as likely anywhere on the sphere.
    assert np.abs(found.uncertainty - sphere / math.sqrt(3)).max() < 1e-9 * sphere.max()


def test_a_force_in_a_plane_is_two_variables(tmp_path: Path) -> None:
    machine = load_text(tmp_path, HEXAPOD.replace("platform = [", f"{SOFT[14:]}platform = ["))
    envelope = Envelope(300.0, (0.0, 3.0, 4.0))
    found = deviation_of(machine, envelope=envelope)
    assert len(np.unique(found.variables[found.banded])) == 2
    assert {found.distribution[k] for k in found.banded} == {ARCSINE}
    directions = np.vstack([envelope.directions, np.array([0.0, 0.6, 0.8])])
    assert directions @ directions.T == pytest.approx(np.eye(3), abs=1e-15)
    # Whatever the two directions are, the uncertainty is that of one as likely all round.
    budget = tp.budget(machine, condition=machine.condition.replace(envelope=envelope))
    across = machine.compliance(machine.poses())[:, :, :3] @ directions[:2].T
    expected = 300.0 * np.linalg.norm(across, axis=2) / math.sqrt(2)
    found = budget.uncertainty.sel(source="loads")
    assert np.abs(found - expected).max() < 1e-9 * expected.max()


def test_the_file_gives_envelope_acceleration_and_gravity(tmp_path: Path) -> None:
    text = edited(
        PLANAR,
        (
            NO_FORCE[0],
            'envelope = { force = "300 N", normal = [0, 0, 1] }\ngravity = "1.62 m/s^2"\n'
            'acceleration = { x = "5 m/s^2" }\n',
        ),
        ("[condition]", '[platform]\nmass = "10 kg"\n[condition]'),
    )
    condition = load_text(tmp_path, text).condition
    assert condition.envelope == Envelope(300.0, (0.0, 0.0, 1.0))
    assert (condition.gravity, condition.acceleration) == (1.62, (5.0, 0.0, 0.0))
    assert condition.replace(envelope=0.0).envelope is None
    assert load_text(tmp_path, PLANAR).condition.gravity == G


def test_it_acts_where_something_has_a_mass_or_is_asked_for(tmp_path: Path) -> None:
    light = load_text(tmp_path, PLANAR)
    assert "loads" not in {source.name for source in acting(light)}
    for asked in ({"envelope": 10.0}, {"acceleration": (0.0, 1.0, 0.0)}):
        condition = light.condition.replace(**asked)
        assert "loads" in {source.name for source in acting(light, condition)}


def test_an_acceleration_of_no_mass_is_refused(tmp_path: Path) -> None:
    machine = load_text(tmp_path, PLANAR)
    with pytest.raises(TrueposeError) as caught:
        tp.budget(machine, condition=machine.condition.replace(acceleration=(1.0, 0.0, 0.0)))
    assert [problem.code for problem in caught.value.problems] == ["no-mass"]


def test_a_mass_wants_a_stiffness(tmp_path: Path) -> None:
    text = edited(HEXAPOD, ("[workspace]", PLATFORM))
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    problems = caught.value.problems
    assert [problem.code for problem in problems] == ["no-stiffness"] * 6
    assert problems[0].line == line_of(text, "[[strut]]")
    assert "weight, inertia" in problems[0].message
    machine = load_text(tmp_path, HEXAPOD)
    with pytest.raises(TrueposeError) as later:
        tp.budget(machine, condition=machine.condition.replace(envelope=10.0))
    assert {problem.code for problem in later.value.problems} == {"no-stiffness"}


def test_compensation_takes_the_weight_away_and_leaves_the_band(tmp_path: Path) -> None:
    machine = load_text(tmp_path, edited(HUNG, ("[workspace]", PLATFORM)))
    found = tp.compensate(machine, condition=machine.condition.replace(envelope=100.0))
    assert np.abs(found.residual_middle).max() < 1e-12
    sphere = 100.0 * np.linalg.norm(machine.compliance(machine.poses())[:, :, :3], axis=2)
    assert np.allclose(found.bound, sphere, rtol=1e-9)
