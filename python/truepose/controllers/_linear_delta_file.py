"""The machine file of a linear delta of which only a firmware's numbers are known.

A firmware takes the two parallel rods of a tower as one line and the effector as a point, so that
its radius is that of the carriages' joints less the effector's, and the platform never tilts. Such
is the machine that is written here: three rods, x y z. What no firmware says is assumed, widely,
each in a line whose comment begins with ASSUMED.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from truepose.controllers._reader import ASSUMED, Assumption

TOWERS = ("a", "b", "c")

WIDE_LENGTH, WIDE_ROD = 1.0, 0.5
"""mm: assumed of radius, endstops and places of towers, and of the length of each rod."""
WIDE_SCALE = "0.2 %"
"""Assumed of how far a carriage moves for a step: the pitch of a belt on its pulley."""
ACCURACY = "0.2 mm"
"""Assumed to be asked for: what a printer's nozzle is hoped to keep."""


@dataclass(frozen=True)
class LinearDeltaFile:
    """A linear delta in mm and degrees, tower by tower in the controller's order.

    `radius` (3,): from the tool's axis to each carriage's joints, less the effector's; `angles`,
    `rods` (3,); `switches` (3,): heights of the carriages' joints over z = 0 where the endstops
    trip, which are the ends of the travels. `workspace`: radius, lowest and highest z. `origin`:
    where the numbers come from. `lowest` (3,): the other ends of the travels, and `home`: z of the
    tool there, None where the controller does not say.
    """

    name: str
    origin: str
    radius: Sequence[float]
    angles: Sequence[float]
    rods: Sequence[float]
    switches: Sequence[float]
    workspace: tuple[float, float, float]
    lowest: Sequence[float] | None = None
    home: float | None = None

    def assumptions(self) -> tuple[Assumption, ...]:
        """What the file says and no firmware does."""
        return (
            Assumption(
                f"delta radius, endstops and towers to ±{WIDE_LENGTH:g} mm, rods to "
                f"±{WIDE_ROD:g} mm, steps to ±{WIDE_SCALE}",
                "tolerance",
            ),
            Assumption(f"an accuracy of {ACCURACY} is asked for", "accuracy.target"),
            *(
                (Assumption("carriages go down as far as the workspace needs", "drive.*.travel"),)
                if self.lowest is None
                else ()
            ),
            Assumption(
                "one rod a tower, and so no tilt: how the tool tilts is unknown until the spacing "
                "of the rods and the effector's radius are known",
                "machine.dof",
            ),
        )

    def text(self) -> str:
        """The machine file."""
        return "\n".join([*self._head(), *self._rows(), *self._tail(), ""])

    def _head(self) -> Iterator[str]:
        yield "schema = 1"
        yield ""
        yield "[machine]"
        yield f"name = {quoted(self.name)}"
        yield 'description = "Three carriages on vertical guideways, one rod to the tool each."'
        yield f"origin = {quoted(self.origin)}"
        yield 'dof = ["x", "y", "z"] # each pair of rods is one line, as the controller has it'
        yield ""
        yield "[units]"
        yield 'length = "mm"'
        yield 'angle = "deg"'
        yield ""
        yield "[each.drive]"
        yield 'kind = "slider"'
        yield "axis = [0, 0, 1]"
        yield 'working_mode = "+"'
        yield ""
        yield "[each.strut]"
        yield "base = [0, 0, 0]"
        yield "platform = [0, 0, 0]"

    def _rows(self) -> Iterator[str]:
        down, note = self.lowest, ""
        if down is None:
            down, note = [min(0.0, self.workspace[1])] * 3, f"; the lower end is {ASSUMED}"
        rows = zip(TOWERS, self.radius, self.angles, self.rods, down, self.switches, strict=True)
        for name, radius, angle, rod, low, switch in rows:
            out = math.radians(angle)
            place = f"{radius * math.cos(out)!r}, {radius * math.sin(out)!r}"
            yield ""
            yield "[[drive]]"
            yield f'name = "{name}" # at {angle:.10g} degrees, {radius:.10g} mm'
            yield f"origin = [{place}, 0]"
            yield f"travel = [{low!r}, {switch!r}] # the endstop above{note}"
            yield ""
            yield "[[strut]]"
            yield f'name = "{name}"'
            yield f'drive = "{name}"'
            yield f"length = {rod!r}"

    def _tail(self) -> Iterator[str]:
        yield ""
        yield f"[tolerance] # {ASSUMED}, widely: put in what is known"
        yield f'"drive.*.offset" = {WIDE_LENGTH} # endstops'
        yield f'"drive.*.scale" = "{WIDE_SCALE}" # steps per mm'
        yield f'"strut.*.length" = {WIDE_ROD}'
        for tower, angle in zip(TOWERS, self.angles, strict=True):
            yield from self._band(tower, angle, "delta radius")
        # The tower that is the last says where y is.
        for tower, angle in zip(TOWERS[:2], self.angles[:2], strict=True):
            yield from self._band(tower, angle + 90.0, f"tower {tower} sideways")
        radius, low, high = self.workspace
        yield ""
        yield "[workspace]"
        step = max(radius, high - low) / 5.0
        if self.home is not None:
            yield f"home = {{ z = {self.home!r} }}"
        yield f"cylinder = {{ radius = {radius!r}, z = [{low!r}, {high!r}], step = {step:.6g} }}"
        yield ""
        yield "[accuracy]"
        yield f'target = "{ACCURACY}" # {ASSUMED}'

    def _band(self, tower: str, angle: float, group: str) -> Iterator[str]:
        """A tower goes by the band along an angle, together with the others of its group."""
        part = "drive" if group == "delta radius" else "strut"
        key = "origin" if part == "drive" else "base"
        along = (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
        for axis, share in zip("xy", along, strict=True):
            if abs(share) > 1e-9:
                sign = ", sign = -1" if share < 0.0 else ""
                band = f"band = {WIDE_LENGTH * abs(share):.9g}"
                yield f'"{part}.{tower}.{key}.{axis}" = {{ {band}, group = "{group}"{sign} }}'


def quoted(text: str) -> str:
    """Text as a string of TOML, on one line."""
    plain = " ".join(text.split()).replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(mark for mark in plain if mark.isprintable()) + '"'


__all__ = ["LinearDeltaFile", "quoted"]
