"""Accelerations in mm/s^2 that are read as m/s^2."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

STRONGEST_GRAVITY = 30.0
FASTEST = 2000.0
"""m/s^2."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Gravity, and the platform's acceleration."""
    condition = view.machine.condition
    if condition.gravity > STRONGEST_GRAVITY:
        yield (
            say(
                "gravity is {gravity} m/s^2; usual is 9.81, and 25 on Jupiter. Look at the unit: "
                "9810 are mm/s^2",
                gravity=marked(f"{condition.gravity:.5g}"),
            ),
            ("condition.gravity",),
        )
    size = math.hypot(*condition.acceleration)
    if size > FASTEST:
        yield (
            say(
                "the platform accelerates by {size} m/s^2, {times} times gravity; usual is up to "
                "20 times, and the fastest machine built has 100. Look at the unit, m/s^2 or "
                "mm/s^2. If it is meant, leave it",
                size=marked(f"{size:.5g}"),
                times=marked(f"{size / 9.80665:.3g}"),
            ),
            ("condition.acceleration",),
        )


RULE = Rule(
    "odd-acceleration",
    "gravity above 30 m/s2, or an acceleration above 2000 m/s2",
    "Gravity is 9.81 m/s2 on Earth and 24.8 on Jupiter. The fastest parallel robot reached 100 "
    "times gravity, 1000 m/s2 (Corbel, Gouttefarde, Company, Pierrot, Towards 100G with PKM, IROS "
    "2010); mm/s2 for m/s2 is a factor of 1000.",
    inspect,
)
