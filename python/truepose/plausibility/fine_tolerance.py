"""A tolerance finer than anything that can be measured."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed
from truepose.sources.tolerance import bands_of

LEAST = 1e-7
"""Of the length of the strut that the parameter belongs to."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Every band of a length; a known deviation has none."""
    bands = bands_of(view.machine)
    if bands is None:
        return
    columns = bands.parameters.tolist()
    half = bands.half[0]
    levers = np.array([view.lever(column) for column in columns])
    metres = np.array([view.machine.units[column] == "m" for column in columns], bool)
    fine = np.flatnonzero(metres & (half > 0.0) & (half < LEAST * levers))
    if fine.size:
        first = int(fine[0])
        names = [view.machine.parameters[columns[at]] for at in fine]
        yield (
            say(
                "{names}: a tolerance of ±{half} nm on {length}; usual is more than a "
                "ten-millionth, finer than which no length is measured in air. Look at its unit: "
                "a bare number is in the file's length. If it is meant, leave it",
                names=listed(names),
                half=marked(f"{half[first] * 1e9:.3g}"),
                length=view.length(levers[first]),
            ),
            tuple(names),
        )


RULE = Rule(
    "fine-tolerance",
    "a tolerance is less than a ten-millionth of the length of its strut",
    "The refractive index of air limits interferometers to some 1e-7 (Bobroff, Measurement Science "
    "and Technology 4, 1993, 907); a tenth of a kelvin changes steel by 1.2e-6. Metres in a file "
    "in millimetres are a factor of 1000.",
    inspect,
)
