"""Metres for millimetres, or the reverse: a machine as large or small as none was built."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

SMALLEST = 0.01
LARGEST = 30.0
"""m: size between which all machines lie that are built of rigid struts."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The machine's size at home."""
    if SMALLEST <= view.size <= LARGEST:
        return
    label = view.machine.unit_labels["length"]
    side = (
        say("larger than any that was built")
        if view.size > LARGEST
        else say("smaller than a fingertip")
    )
    yield (
        say(
            "the machine's joint centres span {size}, {side}; usual is from {smallest} to "
            "{largest}. Look at [units]: the file's lengths are read as {label}, and length = "
            '"mm" and length = "m" differ by a thousand',
            size=view.length(view.size),
            side=side,
            smallest=view.length(SMALLEST),
            largest=view.length(LARGEST),
            label=label,
        ),
        ("units.length",),
    )


RULE = Rule(
    "machine-size",
    "the joint centres span less than 10 mm or more than 30 m",
    "Parallel machines of rigid struts are built from some 15 mm (the milliDelta: McClintock, "
    "Temel, Doshi, Koh, Wood, Science Robotics 3, 2018, eaar3018) to some 10 m (ship gangways and "
    "large motion platforms). Between both bounds lies a factor of 3000, so that a usual machine "
    "whose unit is wrong by 1000 falls out of them.",
    inspect,
)
