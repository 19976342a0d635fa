"""Base and platform exchanged: the platform is wider than the base."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

WIDEST = 1.25
"""Radius of the platform's joint centres in that of the base's (root mean square)."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Radii about the centroids, of the struts whose base joints stand on the frame."""
    struts = view.machine.struts
    frame = [strut.drive is None or view.telescope(strut) is not None for strut in struts]
    points = [
        [view.vector(f"{strut.part}.{end}") for end in ("base", "platform")]
        for strut, kept in zip(struts, frame, strict=True)
        if kept
    ]
    if len(points) < 3:
        return
    about = np.array(points)
    about -= about.mean(axis=0)
    base, platform = np.sqrt((about**2).sum(axis=2).mean(axis=0)).tolist()
    if platform > WIDEST * base:
        yield (
            say(
                "the joint centres of the platform lie {platform} from their middle, those of the "
                "base {base}; usual is a platform smaller than the base. Look whether base and "
                "platform of the struts are exchanged. If it is meant, leave it",
                platform=view.length(platform),
                base=view.length(base),
            ),
            ("strut.*.base", "strut.*.platform"),
        )


RULE = Rule(
    "exchanged-ends",
    "the platform's joint centres are spread 1.25 times as wide as the base's",
    "The platform is what moves: machines are built with it smaller than the base, or as large "
    "(Merlet, Parallel Robots, 2nd ed., ch. 2 and 11). Exchanged, a ratio of less than 0.8 is more "
    "than 1.25.",
    inspect,
)
