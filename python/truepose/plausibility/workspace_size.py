"""A workspace as small as a speck, or larger than the machine: another unit of length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

SMALLEST = 1e-3
LARGEST = 5.0
"""Of the machine's size."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The longest side of the workspace that is a length."""
    names = view.machine.commanded
    columns = [at for at, name in enumerate(names) if name in ("x", "y", "z")]
    if not columns or len(view.poses) < 2:
        return
    side = float(np.ptp(view.poses[:, columns], axis=0).max())
    if side == 0.0 or SMALLEST * view.size <= side <= LARGEST * view.size:
        return
    small = side < SMALLEST * view.size
    yield (
        say(
            "the workspace is {side} long, the machine {size}; usual is {share} of it. Look at "
            "the unit of [workspace]: bare numbers are in the file's length. If it is meant, "
            "leave it",
            side=view.length(side),
            size=view.length(view.size),
            share=say("more than a thousandth") if small else say("less than five times"),
        ),
        ("workspace",),
    )


RULE = Rule(
    "workspace-size",
    "the workspace is shorter than 1/1000 of the machine, or longer than five of it",
    "Piezo stages, with the shortest strokes in use, move some 1/1000 of their size; a "
    "machine of rigid struts cannot leave the sphere of its struts, but carriages may run along "
    "rails longer than the struts. m for mm is a factor of 1000.",
    inspect,
)
