"""A tool point far outside the machine."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

MOST = 5.0
"""Of the longest strut and the platform together."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Distance of the tool point from the middle of the platform's joint centres."""
    tool = view.vector("tool")
    points = [view.vector(f"{strut.part}.platform") for strut in view.machine.struts]
    known = np.array([point for point in points if point is not None])
    if tool is None or not len(known) or not np.isfinite(view.lengths).any():
        return
    own = float(np.nanmax(view.lengths) + np.linalg.norm(np.ptp(known, axis=0)))
    away = float(np.linalg.norm(tool - known.mean(axis=0)))
    if away > MOST * own:
        yield (
            say(
                "the tool point is {away} from the platform's joints, whose struts are {lengths} "
                "long; usual is less than the machine's own size. Look at the unit of [machine] "
                "tool. If it is meant, leave it: errors of orientation become large errors of "
                "position",
                away=view.length(away),
                lengths=view.length(float(np.nanmax(view.lengths))),
            ),
            ("machine.tool",),
        )


RULE = Rule(
    "far-tool",
    "the tool point is more than five times the machine's own size away from the platform",
    "A far pivot multiplies errors of orientation. The camera hexapod of the Rubin Observatory "
    "has its pivot at 1.3 times its size (machines/hexapod_telescope.toml); m for mm is a factor "
    "of 1000.",
    inspect,
)
