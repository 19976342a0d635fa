"""A temperature gradient that no part could bear."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

MOST = 100.0
"""K between the ends of a part."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Gradients times the part's length: the strut's own, or the machine's size."""
    lengths = dict(zip((s.part for s in view.machine.struts), view.lengths.tolist(), strict=True))
    for part, gradient in view.machine.condition.gradients.items():
        length = lengths.get(part, view.size)
        difference = math.hypot(*gradient) * length
        if difference > MOST:
            yield (
                say(
                    "the gradient of {part} makes its ends differ by {difference} K over "
                    '{length}; usual is some kelvin, and at most {most} K. Look at the unit: "2 '
                    'K/m" is not 2 K/mm. If it is meant, leave it',
                    part=part,
                    difference=marked(f"{difference:.3g}"),
                    length=view.length(length),
                    most=marked(f"{MOST:g}"),
                ),
                (f"condition.gradient.{part}",),
            )


RULE = Rule(
    "steep-gradient",
    "a gradient makes the ends of a part differ by more than 100 K",
    "As no part is usually colder than -90 °C nor hotter than 120 °C (`odd-temperature`), its ends "
    "hardly differ by half of that; K/mm for K/m is a factor of 1000.",
    inspect,
)
