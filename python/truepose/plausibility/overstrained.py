"""Forces under which struts would yield: kN for N, or a stiffness too low."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

MOST = {"m": 0.002, "rad": 0.01}
"""Share of its length by which a strut gives way; rad by which a crank does."""

LOADED = ("elastic", "loads")
"""Sources that say by how much the machine gives way."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """By which share of its length each strut's length, offset or place gives way at home."""
    for name, deviation in view.deviations:
        if name not in LOADED:
            continue
        columns = deviation.parameters.tolist()
        most = [view.lever(c) * MOST.get(view.machine.units[c], np.inf) for c in columns]
        over = np.abs(deviation.shift[0]) / np.array(most)
        if over.max(initial=0.0) <= 1.0:
            continue
        worst = int(np.argmax(over))
        parameter = view.machine.parameters[columns[worst]]
        by = view.quantity(abs(float(deviation.shift[0, worst])), columns[worst])
        yield (
            say(
                "under the file's forces {parameter} gives way by {by}; usual is less than "
                "{most}: 0.2 % of a strut, at which steel yields, or 0.01 rad of a crank. Look at "
                "the unit of forces (N or kN), and at sections and stiffnesses. If it is meant, "
                "leave it, but deflections are computed as small ones",
                parameter=parameter,
                by=by,
                most=view.quantity(most[worst], columns[worst]),
            ),
            (parameter,),
        )


RULE = Rule(
    "overstrained",
    "the forces make a strut give way by more than 0.2 % of its length, or a crank by 0.01 rad",
    "0.2 % is the strain of the yield strength Rp0.2 itself (ISO 6892-1); structural steel of 235 "
    "MPa yields at 0.11 %. The elastic law holds below only. A crank that is held by a belt or a "
    "gear gives way by more, but by 1 % of a radian deflections are no longer small.",
    inspect,
)
