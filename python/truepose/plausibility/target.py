"""An accuracy asked that is no accuracy, or that nothing could show."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

COARSEST = 0.01
FINEST = 1e-8
"""Of the machine's size."""

COARSEST_ANGLE = math.radians(5.0)
FINEST_ANGLE = 1e-8
"""rad."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Both targets."""
    accuracy = view.machine.accuracy
    if accuracy.target is not None:
        share = accuracy.target / view.size
        if not FINEST <= share <= COARSEST:
            yield (
                say(
                    "the accuracy asked, {value}, is {share} of the machine's size of {size}; "
                    "usual is from 1e-08 to 0.01 of it. Look at its unit: a bare number is in the "
                    "file's length. If it is meant, leave it",
                    value=accuracy.said("position"),
                    share=marked(f"{share:.2g}"),
                    size=view.length(view.size),
                ),
                ("accuracy.target",),
            )
    angle = accuracy.angle_target
    if angle is not None and not FINEST_ANGLE <= angle <= COARSEST_ANGLE:
        yield (
            say(
                "the accuracy of orientation asked, {value}, is {angle}°; usual is from 1e-08 rad "
                "to 5°. Look at its unit: a bare number is in the file's angle. If it is meant, "
                "leave it",
                value=accuracy.said("orientation"),
                angle=marked(f"{math.degrees(angle):.3g}"),
            ),
            ("accuracy.angle_target",),
        )


RULE = Rule(
    "odd-target",
    "the accuracy asked is above 1 % of the machine's size or below 1e-8 of it",
    "What is off by more than 1 % of its size is met by every machine without blunders "
    "(`wide-tolerance`); below 1e-8 no position in air is known (`fine-tolerance` says why). 5° "
    "are 9 % of a radian.",
    inspect,
)
