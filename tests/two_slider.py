"""The planar two-slider of `machine_texts.PLANAR` by hand: circles about its carriages."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from truepose.machine import Machine

Floats = NDArray[np.float64]

LENGTH = 0.5
RAILS = (0.0, 0.6)


def carriages(joints: Floats) -> Floats:
    """(n, 2, 2) places of the carriages at `joints` (n, 2), m: the rails run along y."""
    return np.stack([np.broadcast_to(RAILS, joints.shape), joints], axis=2)


def tool(centres: Floats, lengths: Floats, near: Floats) -> Floats:
    """(n, 2) where circles about `centres` (n, 2, 2) of radii `lengths` (n, 2) meet, m.

    Of the two points, the one next to `near` (n, 2).
    """
    span = centres[:, 1] - centres[:, 0]
    apart = np.linalg.norm(span, axis=1)
    along = (lengths[:, 0] ** 2 - lengths[:, 1] ** 2 + apart**2) / (2 * apart)
    across = np.sqrt(lengths[:, 0] ** 2 - along**2)
    unit = span / apart[:, np.newaxis]
    normal = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    foot = centres[:, 0] + along[:, np.newaxis] * unit
    points = [foot + side * across[:, np.newaxis] * normal for side in (1.0, -1.0)]
    away = [np.linalg.norm(point - near, axis=1) for point in points]
    return np.where((away[0] < away[1])[:, np.newaxis], *points)


def directions(machine: Machine, poses: Floats) -> Floats:
    """(n, 2, 2) unit vectors along the struts, from carriage to tool."""
    unit: Floats = (poses[:, np.newaxis, :] - carriages(machine.inverse(poses))) / LENGTH
    return unit


def tensions(machine: Machine, poses: Floats, force: tuple[float, float]) -> Floats:
    """(n, 2) forces in the struts that hold `force` on the tool, N, tension positive."""
    along = directions(machine, poses)
    held = np.linalg.solve(np.swapaxes(along, 1, 2), np.array(force)[np.newaxis, :, np.newaxis])
    found: Floats = held[..., 0]
    return found


def displaced(
    machine: Machine, poses: Floats, *, joints: Floats | float = 0.0, lengths: Floats | float = 0.0
) -> Floats:
    """(n, 2) how far the tool goes when carriages and struts are off by so much (n, 2), m."""
    nominal = machine.inverse(poses)
    off = np.broadcast_to(lengths, nominal.shape)
    return tool(carriages(nominal + joints), LENGTH + off, poses) - poses
