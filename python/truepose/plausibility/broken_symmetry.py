"""A wrong sign, or x and y exchanged: one joint centre falls out of a threefold pattern."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import permutations, product

import numpy as np

from truepose.arrays import Floats
from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

ALIKE = 0.002
APART = 0.05
"""Of the joint circle's radius: what still fits the pattern, and what does not at all."""

_TURN = np.array([[-0.5, -math.sqrt(0.75), 0.0], [math.sqrt(0.75), -0.5, 0.0], [0.0, 0.0, 1.0]])


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Base joints, platform joints and drives' origins, each in its own frame."""
    struts, drives = view.machine.struts, view.machine.drives
    for parts, name in ((struts, "base"), (struts, "platform"), (drives, "origin")):
        paths = [f"{part.part}.{name}" for part in parts]
        vectors = [view.vector(path) for path in paths]
        if len(paths) not in (3, 6) or any(vector is None for vector in vectors):
            continue
        points = np.array(vectors)
        for at, expected in _misfits(points):
            said, asked = (_point(view, point) for point in (points[at], expected))
            yield (
                say(
                    "{path} is {said}, where the others, turned by 120°, would have {asked}; "
                    "usual is that all fit. Look at the signs and the order of its coordinates. "
                    "If it is meant, leave it",
                    path=paths[at],
                    said=said,
                    asked=asked,
                ),
                (paths[at],),
            )


def _misfits(points: Floats) -> Iterator[tuple[int, Floats]]:
    """The one point that falls out of a threefold pattern about z, and where it would fit."""
    radius = float(np.sqrt((points[:, :2] ** 2).sum(axis=1)).max())
    if radius == 0.0:
        return
    for at in range(len(points)):
        rest = np.delete(points, at, axis=0)
        wanted = [
            image
            for turned in (rest @ _TURN.T, rest @ _TURN)
            for image in turned
            if np.linalg.norm(rest - image, axis=1).min() > ALIKE * radius
        ]
        # Its two neighbours in the pattern both ask for the same place, and nobody else for any.
        if len(wanted) != 2 or np.linalg.norm(wanted[0] - wanted[1]) > ALIKE * radius:
            continue
        away = float(np.linalg.norm(points[at] - wanted[0]))
        if away > APART * radius and _slip(points[at], wanted[0], ALIKE * radius):
            yield at, wanted[0]
            return


def _slip(point: Floats, expected: Floats, near: float) -> bool:
    """Whether signs or the order of coordinates alone make one of the other."""
    return any(
        np.linalg.norm(np.array(signs) * point[list(order)] - expected) <= near
        for order in permutations(range(3))
        for signs in product((1.0, -1.0), repeat=3)
    )


def _point(view: MachineAtHome, point: Floats) -> str:
    unit = view.machine.shown.length
    return f"({', '.join(f'{value * unit.per_si + 0.0:.6g}' for value in point)}) {unit.label}"


RULE = Rule(
    "broken-symmetry",
    "one joint centre differs by a sign or the order of its coordinates from where the others "
    "put it",
    "All others of three or six turn into each other by 120° about z to 0.2 % of their radius, and "
    "both neighbours ask for one place, more than 5 % away, which another sign or order of the "
    "same coordinates would give. Layouts with no such symmetry are not looked at, and a "
    "calibrated file is off by far less.",
    inspect,
)
