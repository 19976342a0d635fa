"""A telescope that becomes more than five times as long as it was: a forgotten offset."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

MOST = 5.0
"""Longest over shortest length."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Lengths at both ends of the travel of struts whose drive is their length."""
    odd = {
        f"drive.{strut.drive}": ends
        for strut in view.machine.struts
        if (ends := view.telescope(strut)) is not None and ends[1] > MOST * ends[0]
    }
    if odd:
        short, long = next(iter(odd.values()))
        yield (
            say(
                "{names}: the strut goes from {short} to {long}; usual is up to twice as long as "
                "at its shortest, and up to five times of four stages or a screw that passes "
                "through its joint. Look whether the travel is a stroke: offset is the length at "
                "zero. If it is meant, leave it",
                names=listed(odd),
                short=view.length(short),
                long=view.length(long),
            ),
            tuple(f"{part}.travel" for part in odd),
        )


RULE = Rule(
    "telescope-stroke",
    "a telescopic strut's longest length is more than five times its shortest",
    "A rod that slides out of a tube as long as itself makes it at most twice as long, each "
    "further stage once more, and the bodies of a tube of four take what is left of 5. Screws "
    "that pass through their joint have no such bound, but a part as short needs their own "
    "length behind it. A stroke without its offset begins near zero.",
    inspect,
)
