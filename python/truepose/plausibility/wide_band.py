"""Play, resolution, lead or guidance errors above a percent of their length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

MOST = 0.01
"""Of the length of the strut that the parameter belongs to; of a radian, or of a ratio."""

OTHERS = ("tolerance", "thermal", "elastic", "loads")
"""Sources that have rules of their own."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Shift and band of every other source at home."""
    for name, deviation in view.deviations:
        if name in OTHERS or not deviation.parameters.size:
            continue
        columns = deviation.parameters.tolist()
        reach = (np.abs(deviation.shift) + deviation.half)[0]
        shares = reach / np.array([view.lever(column) for column in columns])
        worst = int(np.argmax(shares))
        if shares[worst] <= MOST:
            continue
        parameter = view.machine.parameters[columns[worst]]
        yield (
            say(
                "the error source {name} moves {parameter} by up to {reach}, {share} % of its "
                "strut's length; usual is less than 1 %. Look at the unit of what the file says of "
                "it, µm or mm. If it is meant, leave it",
                name=name,
                parameter=parameter,
                reach=view.quantity(reach[worst], columns[worst]),
                share=marked(f"{100 * shares[worst]:.3g}"),
            ),
            (parameter,),
        )


RULE = Rule(
    "wide-band",
    "clearance, backlash, sensor, actuator or guideway is off by more than 1 % of the strut's "
    "length",
    "Rod ends, the poorest joints in use, have some 0.1 mm of play (ISO 12240-4, group N) on "
    "struts of 50 mm and more: 0.2 %. mm for µm is a factor of 1000.",
    inspect,
)
