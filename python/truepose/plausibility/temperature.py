"""308 degrees Celsius: kelvin, or degrees Fahrenheit, declared as degrees Celsius."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

COLDEST = 183.15
HOTTEST = 393.15
"""K: -90 and 120 degC."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The temperature of every part, and of every sample of a log."""
    condition = view.machine.condition
    temperatures = {part: condition.temperature(part) for part in view.machine.parts}
    if condition.temperature_log is not None:
        for part, values in condition.temperature_log.temperatures.items():
            for value in (float(values.min()), float(values.max())):
                if not COLDEST <= value <= HOTTEST:
                    temperatures[part] = value
    odd = {part: k for part, k in temperatures.items() if not COLDEST <= k <= HOTTEST}
    if not odd:
        return
    kelvin = max(odd.values(), key=lambda value: abs(value - 293.15))
    yield (
        say(
            "{names}: a temperature of {kelvin}; usual is from {coldest}, the coldest air on "
            "Earth, to {hottest}, from which on bearings grow for good. Look at the unit of "
            "temperatures: 35 °C is 308 K and 95 °F. If it is meant, leave it, but expansion is "
            "taken as the same at all temperatures",
            names=listed(odd),
            kelvin=view.degrees(kelvin),
            coldest=view.degrees(COLDEST),
            hottest=view.degrees(HOTTEST),
        ),
        ("condition.temperature",),
    )


RULE = Rule(
    "odd-temperature",
    "a part is colder than -90 °C or hotter than 120 °C",
    "Rolling bearings of standard heat treatment keep their size up to 120 °C (SKF, Rolling "
    "bearings, dimensional stability SN); the coldest air at a weather station was -89.2 °C "
    "(Vostok, 1983, WMO). All that is above -153 °C is more than 120 where kelvin are read as °C.",
    inspect,
)
