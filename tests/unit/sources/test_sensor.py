"""The sensor source: resolution of the offset, scale error of the scale about its zero."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

import space_slider
import truepose as tp
from machine_texts import HEXAPOD, PLANAR, edited, line_of, load_text
from truepose.errors import MachineFileError
from truepose.machine import Machine
from truepose.runs.poses import PoseRun
from truepose.sources import UNIFORM, Deviation
from two_slider import displaced

CRANKED = edited(
    PLANAR,
    ('kind = "slider"\naxis = [0, 1, 0]\ntravel = [0, 900]\nworking_mode = "+"',
     'kind = "crank"\naxis = [0, 0, 1]\ntravel = [-180, 180]\nworking_mode = "+"'),
    ('kind = "slider"\norigin = [600, 0, 0]\naxis = [0, 1, 0]\ntravel = [0, 900]',
     'kind = "crank"\norigin = [600, 0, 0]\naxis = [0, 0, 1]\ntravel = [-180, 180]'),
    ("base = [0, 0, 0]", "base = [300, 0, 0]"),
    ("base = [0, 0, 0]", "base = [300, 0, 0]"),
)  # fmt: skip


def with_sensor(given: str, drive: str = "d1", text: str = PLANAR) -> str:
    return edited(text, (f'name = "{drive}"', f'name = "{drive}"\nsensor = {given}'))


def deviation_of(machine: Machine) -> Deviation:
    (source,) = (each for each in machine.sources if each.name == "sensor")
    at = [machine.dof.index(name) for name in machine.commanded]
    (block,) = PoseRun(machine, machine.home[at][np.newaxis, :], machine.condition)
    return cast("Any", source).deviation(machine, machine.condition, block)


def columns_of(machine: Machine) -> dict[str, tuple[Any, Any]]:
    """Shift and signed half band of each parameter, SI."""
    found = deviation_of(machine)
    names = [machine.parameters[column] for column in found.parameters]
    assert len(set(names)) == len(names)
    return {
        name: (pytest.approx(shift, rel=1e-12, abs=0), pytest.approx(half, rel=1e-12, abs=0))
        for name, shift, half in zip(
            names, found.shift[0].tolist(), found.signed_half[0].tolist(), strict=True
        )
    }


def test_a_step_is_half_to_either_side(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_sensor('{ resolution = "10 um" }'))
    assert columns_of(machine) == {"drive.d1.offset": (0.0, 5e-6)}
    deviation = deviation_of(machine)
    assert deviation.distribution == (UNIFORM,)
    assert deviation.edge.tolist() == [True]
    found = tp.budget(machine).sel(source="sensor")
    poses = machine.poses()
    up, down = (displaced(machine, poses, joints=np.array([side, 0])) for side in (5e-6, -5e-6))
    assert np.abs(found.error_upper - up).max() < 1e-14
    assert np.abs(found.error_lower - down).max() < 1e-14
    assert not found.error.values.any()
    most = np.abs(up - down) / 2
    assert np.abs(found.worst - most).max() < 1e-5 * most.max()
    assert np.abs(found.uncertainty - most / 3**0.5).max() < 1e-5 * most.max()


def test_a_step_of_the_joint_coordinate_goes_through_a_gear(tmp_path: Path) -> None:
    geared = edited(
        with_sensor('{ resolution = "10 um" }'),
        ("travel = [0, 900]", "travel = [0, 1800]\nscale = 0.5"),
    )
    assert columns_of(load_text(tmp_path, geared)) == {"drive.d1.offset": (0.0, 2.5e-6)}


def test_a_known_scale_error_grows_from_the_sensor_s_zero(tmp_path: Path) -> None:
    machine = load_text(tmp_path, with_sensor('{ scale_error = "40 um/m", zero_at = 150 }'))
    joints = machine.inverse(machine.poses())
    off = np.stack([40e-6 * (joints[:, 0] - 0.15), np.zeros(len(joints))], axis=1)
    assert (off[:, 0] > 0).any()
    expected = displaced(machine, machine.poses(), joints=off)
    found = tp.budget(machine).sel(source="sensor")
    assert np.abs(found.error - expected).max() < 1e-14
    assert np.abs(found.error_upper - expected).max() < 1e-14  # a scale has no edge
    assert not found.uncertainty.values.any()
    # All of it is compensated.
    alone = edited(
        with_sensor('{ scale_error = "40 um/m", zero_at = 150 }'),
        ("length_tolerance = [-0.3, 0.3]\n", ""),
        ("temperature = 35\nforce = { x = 1200, y = -1500 }\n", ""),
    )
    left = tp.compensate(load_text(tmp_path, alone))
    assert np.abs(left.residual_middle).max() < 1e-13


def test_limits_of_a_scale_error_are_a_shift_and_one_variable(tmp_path: Path) -> None:
    machine = load_text(
        tmp_path, with_sensor('{ scale_error = ["-2 ppm", "10 ppm"], zero_at = 200 }', text=PLANAR)
    )
    assert columns_of(machine) == {
        "drive.d1.scale": (4e-6, 6e-6),
        "drive.d1.offset": (-0.2 * 4e-6, -0.2 * 6e-6),
    }
    deviation = deviation_of(machine)
    assert deviation.groups[0] == deviation.groups[1] >= 0
    assert not deviation.edge.any()
    joints = machine.inverse(machine.poses())
    reach = np.stack([6e-6 * (joints[:, 0] - 0.2), np.zeros(len(joints))], axis=1)
    most = np.abs(displaced(machine, machine.poses(), joints=reach))
    shift = displaced(machine, machine.poses(), joints=reach * 4 / 6)
    found = tp.budget(machine).sel(source="sensor")
    assert np.abs(found.worst - np.abs(shift) - most).max() < 1e-4 * most.max()


def test_a_plus_minus_sign_is_a_band_and_scale_goes_by_its_nominal(tmp_path: Path) -> None:
    text = edited(
        with_sensor('{ scale_error = "+-12 ppm" }'),
        ("travel = [0, 900]", "travel = [0, 900]\nscale = 1.25"),
    )
    assert columns_of(load_text(tmp_path, text)) == {"drive.d1.scale": (0.0, 1.25 * 12e-6)}


def test_carriages_in_space(tmp_path: Path) -> None:
    text = space_slider.SPACE
    for drive, error in (("d1", "30 ppm"), ("d2", "-20 ppm"), ("d3", "50 ppm")):
        text = with_sensor(f'{{ scale_error = "{error}", zero_at = 100 }}', drive, text)
    machine = load_text(tmp_path, text)
    joints = machine.inverse(machine.poses())
    off = np.array([30e-6, -20e-6, 50e-6]) * (joints - 0.1)
    expected = space_slider.tool(space_slider.carriages(joints + off), machine.poses())
    found = tp.budget(machine).sel(source="sensor").error
    assert np.abs(found - (expected - machine.poses())).max() < 1e-13


def test_angles_of_cranks_and_lengths_of_telescopes(tmp_path: Path) -> None:
    sensor = '{ resolution = "20 arcsec", scale_error = "5 ppm", zero_at = "90 deg" }'
    arcsec = np.deg2rad(1 / 3600)
    assert columns_of(
        load_text(tmp_path, with_sensor('{ resolution = "20 arcsec" }', text=CRANKED))
    ) == {"drive.d1.offset": (0.0, 10 * arcsec)}
    found = deviation_of(load_text(tmp_path, with_sensor(sensor, text=CRANKED)))
    assert found.shift.sum() == pytest.approx(5e-6 * (1 - np.pi / 2), rel=1e-12)
    telescope = with_sensor('{ resolution = "2 um" }', "d3", HEXAPOD)
    assert columns_of(load_text(tmp_path, telescope)) == {"drive.d3.offset": (0.0, 1e-6)}


@pytest.mark.parametrize("given", ["resolution = 0", "resolution = 0, scale_error = 0"])
def test_a_sensor_without_error_changes_nothing(tmp_path: Path, given: str) -> None:
    machine = load_text(tmp_path, with_sensor(f"{{ {given} }}"))
    found = tp.budget(machine)
    for name in ("error", "error_lower", "error_upper", "worst", "uncertainty"):
        assert not found[name].sel(source="sensor").values.any()
    without = tp.budget(load_text(tmp_path, PLANAR))
    assert np.array_equal(found.overall_error_upper, without.overall_error_upper)


@pytest.mark.parametrize(
    ("given", "code", "words"),
    [
        ("{}", "missing-key", "neither resolution nor scale_error"),
        ("{ resolution = -1 }", "negative", "zero or more"),
        ("{ resolutio = 1 }", "unknown-key", 'did you mean "resolution"?'),
        ('{ resolution = "1 deg" }', "wrong-dimension", "a length, found an angle"),
        ('{ scale_error = "3 um" }', "wrong-dimension", "a plain number, found a length"),
        ("{ scale_error = [0.2, 0.1] }", "tolerance-reversed", "[0.2, 0.1]"),
        ("{ scale_error = [1, 2, 3] }", "wrong-type", "a list of 3"),
        ("{ scale_error = true }", "wrong-type", "true or false"),
        ('{ scale_error = "+- -1 ppm" }', "unknown-unit", "-1 ppm"),
        ('{ scale_error = "3 um / 0 m" }', "not-positive", "divided by zero"),
        ("{ scale_error = 12 }", "not-a-fraction", "neither ppm nor um/m"),
        ('{ scale_error = ["-2 m/m", "2 ppm"] }', "not-a-fraction", "between -1 and 1"),
    ],
)
def test_what_a_sensor_may_not_say(tmp_path: Path, given: str, code: str, words: str) -> None:
    text = with_sensor(given)
    with pytest.raises(MachineFileError) as caught:
        load_text(tmp_path, text)
    (problem,) = caught.value.problems
    assert (problem.code, problem.line) == (code, line_of(text, "sensor ="))
    assert words in str(problem)
    assert problem.expected
