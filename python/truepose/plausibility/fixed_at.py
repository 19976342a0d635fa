"""A screw or scale that is fixed far outside of its travel."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Distance of fixed_at from the nearer end of the travel, for drives of a length."""
    odd = {}
    for drive in view.machine.drives:
        if drive.coordinate != "length" or not drive.fixed_at:
            continue
        first, last = drive.travel
        away = max(first - drive.fixed_at, drive.fixed_at - last)
        if away > view.size + (last - first):
            odd[drive.part] = (drive.fixed_at, away)
    if odd:
        at, away = next(iter(odd.values()))
        yield (
            say(
                "{names}: fixed_at is {at}, {away} from the nearer end of the travel; usual is a "
                "bearing within or near the travel. Look at its unit and for a slipped decimal "
                "point. If it is meant, leave it: the screw grows from there",
                names=listed(odd),
                at=view.length(at),
                away=view.length(away),
            ),
            tuple(f"{part}.fixed_at" for part in odd),
        )


RULE = Rule(
    "fixed-far",
    "a screw or scale is fixed further from its travel than travel and machine are long together",
    "A screw is held at its bearings, which stand on the machine: no further away than its size.",
    inspect,
)
