"""The machine as lines: where its struts, guideways, arms and joints are at one pose.

Nothing here knows an element: the path of a drive is where the kernel puts its joint centres
while the joint runs through its travel, and the element's own `drawing` ("line", "circle" or
"none") says how that path is shown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from truepose.arrays import Floats

if TYPE_CHECKING:
    from truepose.machine import Machine

PATH_POINTS = 33
# A quarter turn either side: enough to see an arm's arc without hiding the machine behind circles.
WIDEST_ARC = np.pi / 2


@dataclass(frozen=True)
class Outline:
    """Points in the base frame, m.

    `struts` (n_strut, 2, 3): base-side and platform-side joint centre.
    `paths`: polylines (n, 3) that drives move along.
    `arms`: polylines (n, 3) from pivots and along carriages to joint centres.
    `frame`, `platform` (n, 3): closed outlines through the joint centres fixed to the frame and
    through those of the platform; empty where there are none or all lie in one point.
    `tool` (3,): tool point.
    """

    struts: Floats
    paths: tuple[Floats, ...]
    arms: tuple[Floats, ...]
    frame: Floats
    platform: Floats
    tool: Floats


def is_planar(machine: Machine) -> bool:
    """Whether the platform moves in the x-y plane only."""
    return not {"z", "a", "b"} & set(machine.dof)


def outline(machine: Machine, pose: Floats) -> Outline:
    """The machine at one commanded pose (n_commanded,), m and rad."""
    joints, placements, _ = machine.kernel.place(np.atleast_2d(pose))
    centres = machine.kernel.joint_centres(joints, placements)[0]
    carried: dict[str, list[int]] = {}
    drawn = {drive.name for drive in machine.drives if drive.drawing != "none"}
    for index, strut in enumerate(machine.struts):
        if strut.drive is not None:
            carried.setdefault(strut.drive, []).append(index)
    paths: list[Floats] = []
    arms: list[Floats] = []
    for number, drive in enumerate(machine.drives):
        struts = carried.get(drive.name, [])
        if drive.drawing == "none" or not struts:
            continue
        path = _path(machine, joints[0], placements[0], number, struts)
        paths.append(path)
        carriage = centres[struts, 0].mean(axis=0)
        if drive.drawing == "circle":
            arms.append(np.stack([_centre_of_arc(path), carriage]))
        if len(struts) > 1:
            arms.append(centres[struts, 0])
    fixed = [index for index, strut in enumerate(machine.struts) if strut.drive not in drawn]
    return Outline(
        struts=centres,
        paths=tuple(paths),
        arms=tuple(arms),
        frame=_around(centres[fixed, 0], machine.characteristic_length),
        platform=_around(centres[:, 1], machine.characteristic_length),
        tool=placements[0, :3],
    )


def _path(
    machine: Machine, joints: Floats, placement: Floats, number: int, struts: list[int]
) -> Floats:
    """(n, 3) where the middle of a drive's joint centres goes within its travel."""
    drive = machine.drives[number]
    low, high = drive.travel
    if drive.coordinate == "angle":
        low, high = max(low, joints[number] - WIDEST_ARC), min(high, joints[number] + WIDEST_ARC)
    moved = np.repeat(joints[None], PATH_POINTS, axis=0)
    moved[:, number] = np.linspace(low, high, PATH_POINTS)
    centres = machine.kernel.joint_centres(moved, np.repeat(placement[None], PATH_POINTS, axis=0))
    return np.asarray(centres[:, struts, 0].mean(axis=1))


def _centre_of_arc(path: Floats) -> Floats:
    """Centre (3,) of the circle through the ends and the middle of an arc."""
    first, middle, last = path[0], path[len(path) // 2], path[-1]
    along, across = middle - first, last - first
    normal = np.cross(along, across)
    squared = float(normal @ normal)
    if squared == 0.0:
        return np.asarray(first)
    offset = np.cross((along @ along) * across - (across @ across) * along, normal)
    # Circumcentre: ((|a|^2 b - |b|^2 a) x (a x b)) / (2 |a x b|^2), from the first point.
    return np.asarray(first + offset / (2.0 * squared))


def _around(points: Floats, length: float) -> Floats:
    """Points in order round their middle, closed; empty where they are one point or on a line."""
    if len(points) < 2:
        return np.empty((0, 3))
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle)
    if len(points) < 3 or size[1] < 1e-6 * length:
        line = points[[0, -1]]
        return np.asarray(line) if size[0] > 1e-6 * length else np.empty((0, 3))
    flat = (points - middle) @ axes[:2].T
    order = np.argsort(np.arctan2(flat[:, 1], flat[:, 0]))
    return np.asarray(points[[*order, order[0]]])
