"""A machine that gives way at home."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

LEAST = 0.002
"""Smallest over largest scaled singular value."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Conditioning at home."""
    value = view.conditioning
    if value < LEAST:
        yield (
            say(
                "home is all but singular: conditioning {value}, so that an error of a strut may "
                "grow {growth}; usual is more than 0.05. Look whether base and platform are of "
                "one shape and turned alike, or struts lie in one plane or go through one line. "
                "If it is meant, leave it",
                value=marked(f"{value:.2g}"),
                growth=say("without bound")
                if value == 0.0
                else say("{times} times", times=f"{1.0 / value:.0f}"),
            ),
            ("workspace.home",),
        )


RULE = Rule(
    "singular-home",
    "conditioning at home is below 0.002",
    "Conditioning is the least over the largest singular value of the Jacobian, rotations scaled "
    "by the characteristic length: errors grow up to its inverse, 500 times. Hexapods whose base "
    "and platform are similar and turned alike are singular everywhere (Merlet, Parallel Robots, "
    "2nd ed., ch. 6).",
    inspect,
)
