"""Going round the base, the joints of the platform come in the opposite order."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule
from truepose.spatial import tangents

CLEAR = 0.05
"""Least part of a full correlation that counts."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Sign of the best plane map from base to platform joint centres, seen along the struts."""
    if len(view.machine.struts) < 3 or not np.isfinite(view.centres).all():
        return
    about = view.centres - view.centres.mean(axis=0)
    if view.is_planar:
        plane = np.eye(3)[:2]
    else:
        mean = (view.centres[:, 1] - view.centres[:, 0]).mean(axis=0)
        if np.linalg.norm(mean) < CLEAR * view.size:
            return
        plane = tangents(mean)[:2]
    base, platform = about[:, 0] @ plane.T, about[:, 1] @ plane.T
    full = float(np.linalg.det(base.T @ base) * np.linalg.det(platform.T @ platform))
    if full <= 1e-12 * view.size**8:
        return
    share = float(np.linalg.det(base.T @ platform)) / full**0.5
    if share < -CLEAR:
        yield (
            say(
                "going round the struts, the joints of the platform come in the opposite order to "
                "those of the base; usual is the same order, so that struts stand beside each "
                "other. Look whether two platform joints are exchanged, or one list is counted "
                "the other way round. If it is meant, leave it"
            ),
            ("strut.*.base", "strut.*.platform"),
        )


RULE = Rule(
    "mirrored-order",
    "the platform's joints go round the other way than the base's",
    "The best linear map from the base's joint centres to the platform's, both seen along the mean "
    "strut, is a turn and a scaling in every layout in which struts stand side by side; a mirror "
    "image has a negative determinant. 5 % of full correlation is called clear.",
    inspect,
)
