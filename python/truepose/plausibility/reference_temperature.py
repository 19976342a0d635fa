"""A reference temperature that nobody measures at."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

LOWEST = 283.15
HIGHEST = 303.15
"""K: 10 and 30 degC."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The temperature at which the dimensions hold."""
    kelvin = view.machine.condition.reference_temperature
    if LOWEST <= kelvin <= HIGHEST:
        return
    yield (
        say(
            "the dimensions hold at a reference temperature of {kelvin}; usual is {value} (ISO "
            "1). Look at the unit: 20 °C is 68 °F and 293 K. If the dimensions were really taken "
            "there, leave it",
            kelvin=view.degrees(kelvin),
            value=view.degrees(293.15),
        ),
        ("condition.reference_temperature",),
    )


RULE = Rule(
    "odd-reference-temperature",
    "the dimensions hold at less than 10 °C or more than 30 °C",
    "ISO 1:2022 sets 20 °C for dimensions. Rooms in which they are measured stay within 10 °C of "
    "that; 68 (°F) and 293 (K) do not, nor does 0.",
    inspect,
)
