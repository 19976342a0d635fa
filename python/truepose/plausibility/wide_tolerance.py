"""A tolerance above a percent of its length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed
from truepose.sources.tolerance import bands_of

MOST = 0.01
"""Of the length of the strut that the parameter belongs to; of a radian."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Every band of [tolerance] and length_tolerance, with its shift."""
    bands = bands_of(view.machine)
    if bands is None:
        return
    columns = bands.parameters.tolist()
    reach = np.maximum(np.abs(bands.shift + bands.ends[0]), np.abs(bands.shift + bands.ends[1]))[0]
    levers = np.array([view.lever(column) for column in columns])
    shares = reach / levers
    wide = np.flatnonzero(shares > MOST)
    if wide.size:
        worst = int(wide[np.argmax(shares[wide])])
        names = [view.machine.parameters[columns[at]] for at in wide]
        of = (
            say("of {length}", length=view.length(levers[worst]))
            if view.machine.units[columns[worst]] == "m"
            else say("of its lever")
        )
        yield (
            say(
                "{names}: a tolerance of up to {reach}, {share} % {of}; usual is less than 1 %, "
                "as even coarse work keeps. Look at its unit, and for a slipped decimal point. If "
                "it is meant, leave it",
                names=listed(names),
                reach=view.quantity(reach[worst], columns[worst]),
                share=marked(f"{100 * shares[worst]:.3g}"),
                of=of,
            ),
            tuple(names),
        )


RULE = Rule(
    "wide-tolerance",
    "a tolerance is more than 1 % of the length of its strut, or of a radian",
    "ISO 2768-1, class m, allows 0.3 mm from 30 to 120 mm and 0.8 mm up to 1 m: less than 1 % of "
    "every length from 30 mm on. An angle of 1 % of a radian moves the end of its lever by 1 %.",
    inspect,
)
