"""How large the compensation gets: what the clamp has to leave room for."""

from __future__ import annotations

import math

import numpy as np

from truepose.compensation.commands import ActualMachine, blocks
from truepose.controllers.linuxcnc._description import Description, status_ok
from truepose.machine import Condition

SPARE = 3.0
"""The clamp, in largest compensations of the condition exported for: hotter days come."""

LEAST_CLAMP = 0.1e-3
"""m: the clamp of a machine of which nothing, or next to nothing, is known."""


def default_clamp(description: Description) -> float:
    """m: `SPARE` times the largest compensation, rounded up to two digits."""
    wanted = max(SPARE * largest(description), LEAST_CLAMP)
    digit = 10.0 ** (math.floor(math.log10(wanted)) - 1)
    return float(f"{math.ceil(wanted / digit * (1.0 - 1e-12)) * digit:.2g}")


def largest(description: Description) -> float:
    """The largest compensation of any joint over the file's workspace, m at the end of its arm.

    In the condition of the file and in the opposite one: as much colder as it is warmer, and
    loaded the other way. Raises `RequestError` (no-workspace).
    """
    given = description.machine.condition
    return max(_largest(description, given), _largest(description, opposite(given)))


def opposite(condition: Condition) -> Condition:
    """The condition with every rise of temperature, and the wrench, of the other sign."""
    twice = 2.0 * condition.reference_temperature
    temperatures = {part: twice - condition.temperature(part) for part in condition.named_parts}
    return condition.replace(
        temperature={"default": twice - condition.default_temperature, **temperatures},
        force=[-component for component in condition.force],
        moment=[-component for component in condition.moment],
    )


def _largest(description: Description, condition: Condition) -> float:
    machine = description.machine
    actual = ActualMachine(machine, condition)
    poses = machine.poses()
    most = 0.0
    for rows in blocks(len(poses)):
        known = actual.deviations_at(poses[rows])
        command = actual.command(known)
        added = np.abs(command.joints - known.block.joints) * description.arms
        most = max(most, float(added[status_ok(command.status)].max(initial=0.0)))
    return most
