"""A circular test of the planar two-slider by hand: where play takes the carriages, and ball bars.

In plain NumPy from the drawing alone: `truepose` is not asked for joints, flanks or errors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from machine_texts import PLANAR
from two_slider import LENGTH, RAILS, carriages, tool

Floats = NDArray[np.float64]

CENTRE = (0.3, 0.2)
PLAY = 10e-6

UNLOADED = PLANAR.replace("temperature = 35", "temperature = 20").replace(
    "force = { x = 1200, y = -1500 }\n", ""
)
"""The machine at reference temperature with nothing on the tool."""


def with_keys(drive: str = "", strut: str = "") -> str:
    """The machine with further keys of every drive, and of every strut."""
    text = UNLOADED.replace('working_mode = "+"\n', f'working_mode = "+"\n{drive}\n')
    return text.replace("platform = [0, 0, 0]\n", f"platform = [0, 0, 0]\n{strut}\n")


@dataclass(frozen=True)
class Truth:
    """A machine as it is: lengths off, m, and play, m, of each side; scales off."""

    lengths: tuple[float, float] = (0.0, 0.0)
    play: float | tuple[float, float] = 0.0
    scales: tuple[float, float] = (0.0, 0.0)


def joints_at(points: Floats) -> Floats:
    """(n, 2) carriages above their tool, m, of tool points (n, 2)."""
    across = points[:, :1] - np.array(RAILS)
    return np.asarray(points[:, 1:] + np.sqrt(LENGTH**2 - across**2))


def slopes_at(angles: Floats, radius: float) -> Floats:
    """(n, 2) how the carriages move with the angle: by hand, of the circle about `CENTRE`."""
    x = CENTRE[0] + radius * np.cos(angles)
    across = x[:, np.newaxis] - np.array(RAILS)
    dx = -radius * np.sin(angles)[:, np.newaxis]
    dy = radius * np.cos(angles)[:, np.newaxis]
    return np.asarray(dy - across * dx / np.sqrt(LENGTH**2 - across**2))


def circle(angles: Floats, radius: float) -> Floats:
    """(n, 2) tool points."""
    way = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.asarray(np.array(CENTRE) + radius * way)


def driven(truth: Truth, angles: Floats, radius: float, way: int) -> Floats:
    """(n, 2) where the tool goes, `way` +1 counter-clockwise or -1; carriages lag by half the play.

    At an angle where a carriage turns it lies on the flank from which it came.
    """
    wanted = circle(angles, radius)
    ahead = way * slopes_at(angles - way * 1e-9, radius)
    joints = joints_at(wanted) * (1.0 + np.array(truth.scales)) - 0.5 * np.array(
        truth.play
    ) * np.sign(ahead)
    lengths = LENGTH + np.broadcast_to(truth.lengths, joints.shape)
    return tool(carriages(joints), lengths, wanted)


def read_by(truth: Truth, angles: Floats, radius: float) -> Floats:
    """(2, n) what a ball bar reads that stands in the middle of both paths, m."""
    points = np.stack([driven(truth, angles, radius, way) for way in (1, -1)])
    middle = points.reshape(-1, 2).mean(axis=0)
    return np.asarray(np.linalg.norm(points - middle, axis=2))


def fitted(angles: Floats, radii: Floats) -> tuple[float, Floats]:
    """Radius of the least-squares circle, and the distances (n,) from its centre, m."""
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    centre = np.zeros(2)
    for _ in range(20):
        away = np.stack([x - centre[0], y - centre[1]])
        distance = np.linalg.norm(away, axis=0)
        columns = np.stack([np.ones_like(x), *(away / distance)], axis=1)
        step, *_ = np.linalg.lstsq(columns, distance, rcond=None)
        centre = centre + step[1:]
    distance = np.hypot(x - centre[0], y - centre[1])
    return float(distance.mean()), distance


def narrowest(angles: Floats, radii: Floats) -> float:
    """Width of the narrowest ring: a linear programme, about a centre until that stands, m.

    Unknown are the centre's step a, b, and the ring's ends o and i: o - i least, where every
    distance less its part of the step is between them.
    """
    x, y = radii * np.cos(angles), radii * np.sin(angles)
    centre = np.zeros(2)
    for _ in range(6):
        away = np.stack([x - centre[0], y - centre[1]])
        distance = np.linalg.norm(away, axis=0)
        unit, one, none = away / distance, np.ones_like(x), np.zeros_like(x)
        size = float(distance.mean())
        outer = np.stack([-unit[0], -unit[1], -one, none], axis=1)
        inner = np.stack([unit[0], unit[1], none, one], axis=1)
        off = 1e6 * (distance - size)  # of some micrometres, as the solver likes numbers
        found = linprog(
            [0.0, 0.0, 1.0, -1.0],
            A_ub=np.concatenate([outer, inner]),
            b_ub=np.concatenate([-off, off]),
            bounds=(None, None),
            options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
        )
        centre = centre + 1e-6 * found.x[:2]
    return float(np.ptp(np.hypot(x - centre[0], y - centre[1])))


def readings_text(
    truth: Truth, radius: float, noise: Floats, every: float = 2.0, eccentric: complex = 0.0
) -> str:
    """A file of readings, with `noise` (2, n), m, of a ball bar off the middle."""
    angles = np.radians(np.arange(0.0, 360.0, every))
    lines = ["angle (deg), radius (mm), run, direction"]
    points = np.stack([driven(truth, angles, radius, way) for way in (1, -1)])
    middle = points.reshape(-1, 2).mean(axis=0) + np.array([eccentric.real, eccentric.imag])
    radii = np.linalg.norm(points - middle, axis=2) + noise
    for row, word in zip(radii, ("counter-clockwise", "cw"), strict=True):
        degrees = np.degrees(angles)
        lines += [f"{d:.6f}, {1e3 * r:.9f}, 1, {word}" for d, r in zip(degrees, row, strict=True)]
    return "\n".join([*lines, ""])
