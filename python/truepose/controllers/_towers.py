"""A linear delta's numbers as printers' firmware holds them: three towers and a rod each.

The carriage of a tower stands at z + sqrt(rod^2 - distance^2), with the distance that the rod
bridges in plan; that height is the joint coordinate, as in `truepose.controllers._linear_delta`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from decimal import Decimal

from truepose.controllers._delta_file import LinearDeltaFile, Rods
from truepose.errors import Fault, Problem

Three = tuple[Decimal, Decimal, Decimal]

NARROW = 0.75
"""Of the delta radius: the workspace of a printer that does not say how far its bed reaches."""

STEEPEST = 0.95
"""Of a rod's length, how far it bridges at most in such a workspace."""

NARROWED = (
    "nothing says how far the bed reaches: the workspace's radius is three quarters of the delta "
    "radius, or less where the rods are short"
)


@dataclass(frozen=True)
class Held:
    """A number of a controller: its name there, the text as printed, the value in mm or degrees.

    `file` and `line`: where it stands.
    """

    name: str
    text: str
    value: Decimal
    file: str
    line: int

    def problem(self, code: str, message: str, expected: str, hint: str | None = None) -> Problem:
        """What is wrong with it."""
        fault = Fault(code, f"{self.name}: {message}", self.text[:80], expected, hint)
        return fault.at(self.file, self.line, self.name)


@dataclass(frozen=True)
class Towers:
    """Three towers, in the controller's order, mm and degrees.

    `radius`: from the z axis, less the effector's; `angle`: about z from x, counter-clockwise;
    `rod`: lengths. `trips`: for each carriage the height of the tool at x = y = 0 at which it is at
    its switch. `reach`: radius of the workspace, None where the controller does not say; `low`: its
    lowest z.
    """

    radius: Three
    angle: Three
    rod: Three
    trips: Three
    reach: Decimal | None
    low: Decimal = Decimal(0)

    def file(self, name: str, origin: str, rods: Rods | None) -> LinearDeltaFile:
        """The machine file of it."""
        radius, arms = [float(r) for r in self.radius], [float(r) for r in self.rod]
        switches = [
            float(trip) + math.sqrt(arm * arm - out * out)
            for trip, arm, out in zip(self.trips, arms, radius, strict=True)
        ]
        most = STEEPEST * min(arms) - max(radius)
        reach = min(NARROW * min(radius), most) if self.reach is None else float(self.reach)
        if self.reach is None:
            reach = float(f"{max(reach, 0.05 * min(radius)):.3g}")
        low = float(self.low)
        # Above the cone carriages would leave their rails at the rim of the workspace.
        cone = min(switch - arm for switch, arm in zip(switches, arms, strict=True))
        high = cone if cone > low else min(float(trip) for trip in self.trips)
        return LinearDeltaFile(
            name=name,
            origin=origin,
            radius=radius,
            angles=[float(angle) for angle in self.angle],
            arms=arms,
            ends=switches,
            workspace=(reach, low, high),
            rods=rods,
            reach_assumed=NARROWED if self.reach is None else None,
        )


def require(held: Mapping[str, Held], names: Mapping[str, str]) -> Iterator[Fault]:
    """A fault for every name that is not there; `names`: with what each is."""
    for name, what in names.items():
        if name not in held:
            yield Fault("missing-key", f"{name}: missing", "nothing", f"{name}, {what}")


def bridged(
    held: Mapping[str, Held], radius: str, rods: Mapping[str, Three | Decimal]
) -> Iterator[Problem]:
    """What is wrong with a delta radius, and with rods that do not reach over it."""
    out = held[radius]
    if out.value <= 0:
        yield out.problem("not-positive", "this is not above zero", "mm, above zero")
        return
    for name, rod in rods.items():
        longest = min(rod) if isinstance(rod, tuple) else rod
        if longest <= out.value and name in held:
            yield held[name].problem(
                "import-value",
                "a rod that does not reach from its tower to the middle",
                f"mm, longer than the delta radius of {out.text}",
            )


__all__ = ["Held", "Three", "Towers", "bridged", "require"]
