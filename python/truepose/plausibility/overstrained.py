"""Forces under which struts would yield: kN for N, or a stiffness too low."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.plausibility._base import MachineAtHome, Remark, Rule

MOST = 0.002
"""Share of its length by which a strut gives way."""

LOADED = ("elastic", "loads")
"""Sources that say by how much the machine gives way."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """By which share of its length each strut's length, offset or place gives way at home."""
    for name, deviation in view.deviations:
        if name not in LOADED:
            continue
        columns = deviation.parameters.tolist()
        shares = np.abs(deviation.shift[0]) / np.array([view.lever(c) for c in columns])
        if shares.max(initial=0.0) <= MOST:
            continue
        worst = int(np.argmax(shares))
        parameter = view.machine.parameters[columns[worst]]
        by = view.quantity(float(deviation.shift[0, worst]), columns[worst])
        yield (
            f"under the file's forces {parameter} gives way by {by}, {100 * shares[worst]:.2g} % of "
            "its strut; usual is less than 0.2 %, at which steel yields. Look at the unit of forces "
            "(N or kN), and at sections and stiffnesses. If it is meant, leave it, but deflections "
            "are computed as small ones",
            (parameter,),
        )


RULE = Rule(
    "overstrained",
    "the forces make a strut give way by more than 0.2 % of its length",
    "0.2 % is the strain of the yield strength Rp0.2 itself (ISO 6892-1); structural steel of 235 "
    "MPa yields at 0.11 %. The elastic law holds below only.",
    inspect,
)
