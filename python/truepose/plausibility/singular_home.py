"""A machine that gives way at home."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.plausibility._base import MachineAtHome, Remark, Rule

LEAST = 0.002
"""Smallest over largest scaled singular value."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Conditioning at home."""
    value = view.conditioning
    if value < LEAST:
        yield (
            f"home is all but singular: conditioning {value:.2g}, so that an error of a strut may "
            f"grow {'without bound' if value == 0.0 else f'{1.0 / value:.0f} times'}; usual is "
            "more than 0.05. Look whether base and platform are of one shape and turned alike, or "
            "struts lie in one plane or go through one line. If it is meant, leave it",
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
