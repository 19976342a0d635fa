"""A part that is heavier than a block of steel in its place would be."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

STEEL = 7850.0
"""kg/m^3."""

THICKEST = 0.5
"""Of a strut, in its length (`odd-section`)."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Struts against the thickest bar, bodies against a cube of the machine's size."""
    machine = view.machine
    blocks = {
        strut.part: (strut.mass, STEEL * math.pi / 4.0 * THICKEST**2 * length**3)
        for strut, length in zip(machine.struts, view.lengths.tolist(), strict=True)
    }
    cube = STEEL * view.size**3
    blocks |= {body.part: (body.mass, cube) for body in machine.bodies if body.part != "frame"}
    blocks |= {drive.part: (drive.mass, cube) for drive in machine.drives}
    odd = {part: both for part, both in blocks.items() if both[0] > both[1]}
    if odd:
        mass, block = next(iter(odd.values()))
        yield (
            say(
                "{names}: a mass of {mass} kg; a solid block of steel in its place would have "
                "{block} kg. Look at the unit: 25 kg are 25000 g. If it is meant, leave it",
                names=listed(odd),
                mass=marked(f"{mass:.3g}"),
                block=marked(f"{block:.3g}"),
            ),
            tuple(f"{part}.mass" for part in odd),
        )


RULE = Rule(
    "odd-mass",
    "a strut, platform, tool or carriage is heavier than solid steel in its place",
    "Steel has 7850 kg/m3. A strut is compared with a bar half as thick as long, a body with a "
    "cube as large as the whole machine: real ones have less than a hundredth.",
    inspect,
)
