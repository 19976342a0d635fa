"""Two struts that would run through each other."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np

from truepose.arrays import Floats
from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

THIN = 0.01
"""Thickness of a strut, in its length, where the file gives no section."""

END = 0.05
"""Share of a strut at either end that is its joint's."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The nearest points of every two struts at home, but for machines in a plane."""
    if view.is_planar or not view.is_reached:
        return
    struts = view.machine.struts
    bars = [
        THIN * length if strut.area is None else math.sqrt(4.0 * strut.area / math.pi)
        for strut, length in zip(struts, view.lengths.tolist(), strict=True)
    ]
    for one, other in combinations(range(len(struts)), 2):
        gap, at = _gap(view.centres[one], view.centres[other])
        if all(END < share < 1.0 - END for share in at) and gap < 0.5 * (bars[one] + bars[other]):
            names = struts[one].part, struts[other].part
            yield (
                say(
                    "{one} and {other} cross at home: {gap} apart, {share} % along the first from "
                    "its base; usual is that struts keep clear of each other. Look whether their "
                    "platform joints, or their drives, are exchanged. If it is meant, leave it: "
                    "collisions are not computed",
                    one=names[0],
                    other=names[1],
                    gap=view.length(gap),
                    share=marked(f"{100 * at[0]:.0f}"),
                ),
                names,
            )


def _gap(one: Floats, other: Floats) -> tuple[float, tuple[float, float]]:
    """Distance of two struts' lines, m, and where: shares of each from its base; parallel: ends."""
    along, beside = one[1] - one[0], other[1] - other[0]
    between = other[0] - one[0]
    matrix = np.stack([along, -beside], axis=1)
    if np.linalg.norm(np.cross(along, beside)) < 1e-9 * (along @ along):
        return math.inf, (0.0, 0.0)
    shares = np.linalg.solve(matrix.T @ matrix, matrix.T @ between)
    return float(np.linalg.norm(matrix @ shares - between)), (float(shares[0]), float(shares[1]))


RULE = Rule(
    "crossed-struts",
    "two struts touch between their joints at home",
    "Struts are taken as bars of their section; where the file gives none, as thick as 1/100 of "
    "their length, the thinnest that is used in compression (AISC 360, E2: slenderness of 200 is "
    "1/50). The twentieth at each end is the joint's, where struts may share one. Machines in a "
    "plane have their struts in layers and are left out.",
    inspect,
)
