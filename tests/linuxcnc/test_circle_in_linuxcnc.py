"""The real LinuxCNC drives a circle, an erroneous machine is on its joints: as the test predicts.

Joint commands are sampled in every servo cycle. Carriages with play and scales, and rods that are
too long, make of them where the tool is, by hand; a ball bar in the middle of both ways round reads
it. It is compared with the prediction at equal commanded angle.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from real_linuxcnc import required, run

import truepose as tp
from machine_texts import load_text
from made_circular import CENTRE, PLAY, Truth, with_keys
from sweeps import sweep
from two_slider import LENGTH, carriages, tool

Floats = NDArray[np.float64]

RADIUS = 0.02
LATEST = 1e-7
"""m: how far the prediction may be off."""
MOVES = 1e-9
"""rad: less is standing still between two programs."""
TURNING = np.radians(1.0)
"""Next to where a drive turns round a step stands between two angles."""

TRUTH = Truth(lengths=(3e-4, 0.0), play=PLAY, scales=(1e-4, 1e-4))
MACHINE = with_keys(
    drive=f'backlash = {{ play = "{1e3 * PLAY} mm", threshold = "5 kN" }}\n'
    'sensor = { scale_error = "100 ppm" }'
).replace("[-0.3, 0.3]", "[0.1, 0.5]")

PROGRAM = """\
G21 G90 G17 G94 G61
{first}
{turn} X320 Y200 I-20 J0 F1000
M2
"""
TURNS = {"there": PROGRAM.format(first="G0 X320 Y200", turn="G3"),
         "back": PROGRAM.format(first="", turn="G2")}  # fmt: skip
"""One turn each; of two the second counts."""


def nominal(joints: Floats) -> Floats:
    """(n, 2) commanded tool points of joints (n, 2), m."""
    near = np.broadcast_to(np.array(CENTRE), joints.shape)
    return tool(carriages(joints), np.full(joints.shape, LENGTH), near)


def actual(joints: Floats, direction: Floats) -> Floats:
    """(n, 2) where the tool is when the carriages came in `direction` (n, 2)."""
    driven = joints * (1.0 + np.array(TRUTH.scales)) - 0.5 * PLAY * direction
    lengths = LENGTH + np.broadcast_to(TRUTH.lengths, joints.shape)
    return tool(carriages(driven), lengths, nominal(joints))


def came(joints: Floats) -> Floats:
    """(n, 2) the last direction of motion, -1 or 1."""
    steps: Floats = np.sign(np.diff(joints, axis=0, prepend=joints[:1]))
    for at in range(1, len(steps)):
        steps[at] = np.where(steps[at] == 0.0, steps[at - 1], steps[at])
    return steps


def evenly(cycles: Floats, angles: Floats) -> Floats:
    """Of cycles and their angles those next to each of 3600 angles."""
    order = np.argsort(angles)
    wanted = np.radians(0.1 * np.arange(3600))
    at = np.clip(np.searchsorted(angles[order], wanted), 0, len(order) - 1)
    return np.asarray(cycles[order[np.unique(at)]])


@sweep
def test_the_polar_plot_is_that_of_the_machine_under_linuxcnc(tmp_path: Path) -> None:
    required()
    machine = load_text(tmp_path, MACHINE)
    folder = tmp_path / "run"
    folder.mkdir()
    steps = [
        {"do": "home"},
        {"do": "sample", "file": "circle.trace"},
        *({"do": "program", "file": f"{name}.ngc"} for name in TURNS for _ in range(2)),
        {"do": "stop_sampling"},
        {"do": "read", "label": "end"},
    ]
    done = run(
        folder,
        tp.export(machine, "linuxcnc").files,
        steps,
        axes="XY",
        joints=2,
        programs={f"{name}.ngc": text for name, text in TURNS.items()},
        time_limit=180.0,
    )
    assert not done["end"]["errors"]
    joints = done.traces["circle"][:, :2] * 1e-3
    wanted = nominal(joints) - np.array(CENTRE)
    turned = np.unwrap(np.arctan2(wanted[:, 1], wanted[:, 0]))
    on_circle = np.abs(np.hypot(*wanted.T) - RADIUS) < 1e-6
    direction, there = came(joints), actual(joints, came(joints))
    begun = int(np.flatnonzero(on_circle)[0])
    top = begun + int(np.argmax(turned[begun:]))
    assert turned[top] - turned[begun] == pytest.approx(4.0 * np.pi, abs=1e-3)
    cycles = np.arange(len(joints))
    ways = [
        on_circle & (cycles < top) & (turned > turned[begun] + 2.0 * np.pi + MOVES),
        on_circle & (cycles > top) & (turned < turned[begun] + 2.0 * np.pi - MOVES),
    ]
    assert all(way.sum() > 7000 for way in ways)  # 125.7 mm at 1000 mm/min, in ms
    assert np.abs(direction[ways[0] | ways[1]]).min() == 1.0
    # Evenly spaced: where LinuxCNC begins and ends a turn it dwells longer.
    picked = [evenly(cycles[way], np.mod(turned[way], 2.0 * np.pi)) for way in ways]
    middle = np.mean([there[way].mean(axis=0) for way in picked], axis=0)
    predicted = tp.circular_test(
        machine, RADIUS, {"x": CENTRE[0], "y": CENTRE[1]}, step=np.radians(0.1), samples=100
    )
    angles, turns = predicted["angle"].values, predicted["turn_angle"].values
    every, read = [], []
    for way in picked:
        at = np.mod(turned[way], 2.0 * np.pi)
        every.append(at)
        # At equal command: what the command itself is off the circle is taken out.
        off = np.hypot(*wanted[way].T) - RADIUS
        read.append(np.linalg.norm(there[way] - middle, axis=1) - off)
    radii = _centred(np.concatenate(every), np.concatenate(read))
    worst, size = 0.0, 0.0
    for number, at in enumerate(every):
        measured = radii[: len(at)] if number == 0 else radii[len(every[0]) :]
        said = np.interp(
            at, angles, predicted["radial_known"].values[0, number], period=2.0 * np.pi
        )
        apart = np.abs(at[:, np.newaxis] - turns)
        away = np.minimum(apart, 2.0 * np.pi - apart).min(axis=1) > TURNING
        assert away.mean() > 0.9
        worst = max(worst, float(np.abs(measured - said)[away].max()))
        size = max(size, float(np.ptp(measured)))
    assert size > 1e-5
    assert worst < LATEST, f"{worst * 1e6:.4f} µm"


def _centred(angles: Floats, radii: Floats) -> Floats:
    """Deviations from the nominal radius about the least-squares centre."""
    centre = np.zeros(2)
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    for _ in range(10):
        away = np.stack([x - centre[0], y - centre[1]])
        distance = np.linalg.norm(away, axis=0)
        columns = np.stack([np.ones_like(x), *(away / distance)], axis=1)
        centre = centre + np.linalg.lstsq(columns, distance, rcond=None)[0][1:]
    return np.asarray(np.hypot(x - centre[0], y - centre[1]) - RADIUS)
