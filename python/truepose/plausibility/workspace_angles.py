"""Degrees that are read as radians: a workspace tilted by several turns."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule

MOST = {"a": math.radians(120.0), "b": math.radians(120.0), "c": 2.0 * math.pi}
"""rad from zero."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """The largest angle of each rotation of the workspace."""
    for at, name in enumerate(view.machine.commanded):
        if name not in MOST or not len(view.poses):
            continue
        largest = float(np.abs(view.poses[:, at]).max())
        if largest > 1.001 * MOST[name]:
            unit = view.machine.unit_labels["angle"]
            yield (
                say(
                    "the workspace has {name} up to {largest}°; usual is less than {most}°. Look "
                    "at [units]: the file's angles are read as {unit}. If it is meant, leave it",
                    name=name,
                    largest=marked(f"{math.degrees(largest):.4g}"),
                    most=marked(f"{math.degrees(MOST[name]):.0f}"),
                    unit=unit,
                ),
                (f"workspace.grid.{name}",),
            )


RULE = Rule(
    "workspace-angles",
    "the workspace tilts by more than 120°, or turns by more than one turn",
    "A platform tilted by 90° has its struts beside it, and passive joints lean by at most some "
    "60° to 90° (Merlet, Parallel Robots, 2nd ed., ch. 2.2): 120° is not reached. Two radians "
    "are 115°, so that degrees read as radians are outside from 3° on.",
    inspect,
)
