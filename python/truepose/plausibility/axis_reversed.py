"""An axis with the wrong sign: with it turned, home would be inside the travel."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed
from truepose.plausibility._roots import inside_otherwise


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Drives whose coordinate at home is out of travel, but not with the opposite axis."""
    wrong = inside_otherwise(view, turn=-1.0)
    if wrong:
        yield (
            say(
                "{names}: home is out of travel, and inside it were the axis to point the other "
                "way; usual is a home that all drives reach. Look at the sign of axis, and at the "
                "travel. If it is meant, give [workspace] another home",
                names=listed(wrong),
            ),
            tuple(f"{part}.axis" for part in wrong),
        )


RULE = Rule(
    "axis-reversed",
    "home is out of a drive's travel, and would be inside with its axis the other way",
    "No threshold: both joint coordinates are solved in closed form.",
    inspect,
)
