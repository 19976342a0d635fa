"""The other working mode is meant: with it, home would be inside the travel."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed
from truepose.plausibility._roots import inside_otherwise


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Drives whose coordinate at home is out of travel, but not in the other mode."""
    wrong = inside_otherwise(view, mode=-1.0)
    if wrong:
        yield (
            say(
                "{names}: home is out of travel, and inside it in the other working mode; usual "
                "is a home that all drives reach. Look at working_mode, on which side of the "
                "platform joint the carriage or the elbow stands. If it is meant, give "
                "[workspace] another home",
                names=listed(wrong),
            ),
            tuple(f"{part}.working_mode" for part in wrong),
        )


RULE = Rule(
    "other-working-mode",
    "home is out of a drive's travel, and would be inside in the other working mode",
    "No threshold: both joint coordinates are solved in closed form.",
    inspect,
)
