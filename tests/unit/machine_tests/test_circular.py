"""The circular test against a simulation by hand and closed forms; what drives, causes, play do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import truepose as tp
from machine_texts import load_text
from made_circular import (
    CENTRE,
    PLAY,
    Truth,
    fitted,
    narrowest,
    read_by,
    with_keys,
)
from truepose.machine import Machine
from truepose.machine_tests.circular_quantities import QUANTITIES

RADIUS = 0.05
PLACE = {"x": CENTRE[0], "y": CENTRE[1]}
SAME = 1e-9
"""m: what the simulation by hand may differ by."""

OPEN = f'backlash = {{ play = "{1e3 * PLAY} mm", threshold = "5 kN" }}'


def with_play(folder: Path) -> Machine:
    """Both drives have play that friction leaves open; strut 1 has its tolerance."""
    return load_text(folder, with_keys(drive=OPEN))


def values(result: object, name: str = "known", state: int = 0) -> dict[str, float]:
    """A variable by quantity, m."""
    return dict(zip(QUANTITIES, result[name].values[state].tolist(), strict=True))  # type: ignore[index]


def by_hand(truth: Truth, count: int = 360) -> dict[str, float]:
    """The quantities of the circle by the simulation and the fits by hand, m."""
    angles = 2.0 * np.pi * np.arange(count) / count
    there, back = read_by(truth, angles, RADIUS)
    both = np.tile(angles, 2)
    radius, distance = fitted(both, np.concatenate([there, back]))
    one, other = distance[:count] - RADIUS, distance[count:] - RADIUS
    return {
        "G_b": narrowest(both, np.concatenate([there, back])),
        "G_ccw": narrowest(angles, there),
        "G_cw": narrowest(angles, back),
        "H": float(np.abs(one - other).max()),
        "D": radius - RADIUS,
        "F_max_ccw": float(one.max()),
        "F_min_ccw": float(one.min()),
        "F_max_cw": float(other.max()),
        "F_min_cw": float(other.min()),
    }


@pytest.mark.parametrize(
    ("drive", "tolerance", "truth"),
    [
        (OPEN, "[-0.3, 0.3]", Truth(play=PLAY)),
        ('sensor = { scale_error = "3000 ppm" }', "[-0.3, 0.3]", Truth(scales=(3e-3, 3e-3))),
        ("", "[0.1, 0.5]", Truth(lengths=(3e-4, 0.0))),
        (OPEN, "[0.1, 0.5]", Truth(lengths=(3e-4, 0.0), play=PLAY)),
    ],
    ids=["play", "scale", "length", "play and length"],
)
def test_known_error_is_that_of_the_simulation_by_hand(
    drive: str, tolerance: str, truth: Truth, tmp_path: Path
) -> None:
    text = with_keys(drive=drive).replace("[-0.3, 0.3]", tolerance)
    found = values(tp.circular_test(load_text(tmp_path, text), RADIUS, PLACE, samples=100))
    expected = by_hand(truth)
    assert expected["G_b"] > 1e-6
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, abs=SAME), name


def test_a_machine_that_only_grows_draws_a_rounder_circle(tmp_path: Path) -> None:
    """All of one material and one temperature: everything is larger by alpha dT, and no form."""
    alpha, warmer = 1.1e-5, 15.0
    text = with_keys(drive=f'expansion = "{alpha} 1/K"').replace(
        'material = "steel"', f'modulus = "210 GPa"\nexpansion = "{alpha} 1/K"'
    )
    text = text.replace("temperature = 20\n[workspace]", "temperature = 35\n[workspace]")
    text += f'\n[frame]\nexpansion = "{alpha} 1/K"\n'
    machine = load_text(tmp_path, text)
    found = values(tp.circular_test(machine, RADIUS, PLACE, samples=100))
    assert found["D"] == pytest.approx(alpha * warmer * RADIUS, rel=1e-9)
    assert found["G_b"] == pytest.approx(0.0, abs=1e-12)
    assert found["H"] == pytest.approx(0.0, abs=1e-12)


def test_drives_turn_where_they_turn_and_not_at_the_quadrants(tmp_path: Path) -> None:
    """tan = 4/3: of rods of 500 mm over 300 mm."""
    result = tp.circular_test(with_play(tmp_path), 1e-4, PLACE, samples=100)
    degrees = np.degrees(result["turn_angle"].values)
    drives = result["turn_drive"].values
    slope = np.degrees(np.arctan2(4.0, 3.0))
    assert degrees[drives == "d1"][::2] == pytest.approx([180 - slope, 360 - slope], abs=0.03)
    assert degrees[drives == "d2"][::2] == pytest.approx([slope, 180 + slope], abs=0.03)
    steps = dict(zip(drives[::4], result["turn_step"].values[::4], strict=True))
    # There the carriage moves the tool along its rod's normal of the other rod, by 1 / (2 * 0.4).
    assert steps["d1"] == pytest.approx(PLAY * _outward_move(np.radians(180 - slope), 0), rel=1e-3)
    assert steps["d2"] == pytest.approx(PLAY * _outward_move(np.radians(slope), 1), rel=1e-3)


def _outward_move(angle: float, drive: int) -> float:
    """How far the tool goes outwards for a metre of a carriage, the rods' closures by hand.

    u_i . dp = u_i . dc_i, with u_i along the rods from carriage to tool. Where a carriage has come
    to its highest place it goes down with the next step, so that it first lags above.
    """
    rods = np.array([[0.3, -0.4], [-0.3, -0.4]]) / 0.5
    moved = np.zeros(2)
    moved[drive] = rods[drive] @ [0.0, 1.0]
    along = np.linalg.solve(rods, moved) @ [np.cos(angle), np.sin(angle)]
    return abs(float(along))


def test_the_known_step_is_in_the_readings_where_the_drive_turns(tmp_path: Path) -> None:
    result = tp.circular_test(with_play(tmp_path), RADIUS, PLACE, samples=100)
    radial = result["radial_known"].values[0]
    for at in range(0, result.sizes["turn"], 2):
        after = int(np.ceil(np.degrees(result["turn_angle"].values[at])))
        way = int(result["turn_direction"].values[at] == "clockwise")
        jump = radial[way, after % 360] - radial[way, after - 1]
        assert jump == pytest.approx(result["turn_step"].values[at], abs=0.35e-6)
        assert abs(jump) > 5e-6
    quadrant = np.abs(radial[0, [1, 91, 181, 271]] - radial[0, [359, 89, 179, 269]])
    assert quadrant.max() < 0.5e-6


def test_a_load_closes_the_play(tmp_path: Path) -> None:
    text = with_keys(drive=f'backlash = {{ play = "{1e3 * PLAY} mm" }}')
    text = text.replace("[workspace]", "force = { x = 100, y = -1500 }\n[workspace]")
    result = tp.circular_test(load_text(tmp_path, text), RADIUS, PLACE, samples=100)
    assert values(result)["H"] == pytest.approx(0.0, abs=1e-12)
    assert result["turn_step"].values == pytest.approx(0.0, abs=1e-12)


def test_after_compensation_nothing_known_is_left(tmp_path: Path) -> None:
    text = with_keys(drive=OPEN).replace("[-0.3, 0.3]", "[0.1, 0.5]")
    result = tp.circular_test(load_text(tmp_path, text), RADIUS, PLACE, samples=100)
    assert values(result, state=1)["G_b"] < 1e-9
    assert values(result, "standard_uncertainty", state=1)["G_b"] > 1e-6


def test_sampled_machines_are_those_by_hand(tmp_path: Path) -> None:
    """One uniform length: the ends are those of machines at this share of the band."""
    machine = load_text(tmp_path, with_keys(drive=OPEN))
    result = tp.circular_test(machine, RADIUS, PLACE, samples=1500, seed=3)
    ends = [by_hand(Truth((share * 3e-4, 0.0), PLAY))["D"] for share in (-0.95, 0.95)]
    low, high = values(result, "lower")["D"], values(result, "upper")["D"]
    assert [low, high] == pytest.approx(sorted(ends), rel=0.03)
    same = tp.circular_test(machine, RADIUS, PLACE, samples=1500, seed=3)
    assert same.identical(result)


def test_causes_are_ranked_and_make_up_the_whole(tmp_path: Path) -> None:
    text = with_keys(drive=OPEN).replace("[-0.3, 0.3]", "[0.1, 0.5]")
    result = tp.circular_test(load_text(tmp_path, text), RADIUS, PLACE, samples=100)
    names = [str(name) for name in result["known_cause"].values]
    assert names[0] == "tolerance: strut 1, length"
    assert set(names[1:]) == {"backlash: drive d1, play", "backlash: drive d2, play"}
    assert (
        result["known_shape"].values[0] == "mixed" or "ellipse" in result["known_shape"].values[0]
    )
    assert result["known_share"].values.sum() == pytest.approx(1.0, abs=1e-3)
    assert result["uncertain_share"].values.sum() == pytest.approx(1.0, abs=1e-12)
    own = by_hand(Truth((3e-4, 0.0)))["G_b"]
    assert result["known_form"].values[0] == pytest.approx(own, abs=SAME)


def test_a_ripple_of_unknown_phase_makes_form(tmp_path: Path) -> None:
    """Nothing is known, and every machine has a form (a band alike at all poses has none)."""
    text = with_keys(drive='actuator = { periodic = { amplitude = "5 um", period = 5 } }').replace(
        "length_tolerance = [-0.3, 0.3]\n", ""
    )
    result = tp.circular_test(load_text(tmp_path, text), RADIUS, PLACE, samples=200)
    assert values(result)["G_b"] == pytest.approx(0.0, abs=1e-12)
    assert values(result, "lower")["G_b"] > 10e-6
    assert set(result["uncertain_cause"].values) == {"drive.d1.offset", "drive.d2.offset"}
