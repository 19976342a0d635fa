"""Rails that point down, with their carriages under the platform."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

STEEP = 0.7
"""Cosine from which on a rail is upright rather than level."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The z component of each slider's axis, and on which side of the platform its carriage is."""
    if view.is_planar:
        return
    down = []
    for drive in view.machine.drives:
        axis = drive.fields.get("axis")
        if drive.kind != "slider" or not isinstance(axis, tuple):
            continue
        if axis[2] > -STEEP * np.linalg.norm(axis):
            continue
        carried = [strut.drive == drive.name for strut in view.machine.struts]
        rise = view.centres[carried, 1, 2] - view.centres[carried, 0, 2]
        if rise.size and (rise > 0.0).all():
            down.append(drive.part)
    if down:
        yield (
            say(
                "{names}: the rail points down and its carriage is under the platform at home; "
                "usual is an axis that points up, or one that counts down from carriages above. "
                "Look at the sign of axis. If it is meant, leave it",
                names=listed(down),
            ),
            tuple(f"{part}.axis" for part in down),
        )


RULE = Rule(
    "rail-down",
    "an upright rail points down in the base frame, and its carriage is under the platform",
    "ISO 841 counts Z upwards from the workpiece, and controllers of deltas count the height of "
    "carriages over the bed. An axis with a wrong sign keeps its working mode, and puts the "
    "carriage on the other side of the platform. Carriages that hang above and count down are "
    "not odd, nor are those below that count up.",
    inspect,
)
