"""A crank that may turn round more than once: degrees read as radians."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

MOST = 2.0 * math.pi
"""rad."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Travels of drives that turn."""
    odd = {
        drive.part: drive.travel[1] - drive.travel[0]
        for drive in view.machine.drives
        if drive.coordinate == "angle" and drive.travel[1] - drive.travel[0] > 1.001 * MOST
    }
    if odd:
        turn = max(odd.values()) / MOST
        yield (
            say(
                "{names}: a travel of {turn} turns; usual is less than one, beyond which all "
                "repeats. Look at [units]: the file's angles are read as {angle}. If it is meant, "
                "leave it",
                names=listed(odd),
                turn=marked(f"{turn:.3g}"),
                angle=view.machine.unit_labels["angle"],
            ),
            tuple(f"{part}.travel" for part in odd),
        )


RULE = Rule(
    "crank-travel",
    "a crank's travel is more than a full turn",
    "After a turn a crank is where it was. Degrees read as radians are a factor of 57, so that "
    "every travel of more than 7° is found.",
    inspect,
)
