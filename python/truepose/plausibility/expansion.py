"""A coefficient of expansion that no material has."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

LEAST = -2e-5
MOST = 3e-4
"""1/K."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Expansion of struts, drives' scales and bodies."""
    machine = view.machine
    given = {
        **{strut.part: strut.expansion for strut in machine.struts},
        **{drive.part: drive.expansion for drive in machine.drives},
        **{body.part: body.expansion for body in machine.bodies},
    }
    odd = {
        part: value
        for part, value in given.items()
        if value is not None and not LEAST <= value <= MOST
    }
    if odd:
        value = max(odd.values(), key=abs)
        yield (
            say(
                "{names}: an expansion of {value} 1/K; usual is 0 to 3e-05 1/K of what machines "
                "are built of (steel 1.2e-05), and no solid has more than 3e-04. Look at the "
                'power of ten: "11.5 ppm/K" is 1.15e-05 1/K. If it is meant, leave it',
                names=listed(odd),
                value=marked(f"{value:.3g}"),
            ),
            tuple(f"{part}.expansion" for part in odd),
        )


RULE = Rule(
    "odd-expansion",
    "an expansion below -2e-5 or above 3e-4 per kelvin",
    "Metals have 1 to 30e-6 per kelvin, polyethylene and rubber up to 250e-6; carbon fibre along "
    "its fibres some -1e-6, Kevlar -6e-6 (Ashby, Materials Selection in Mechanical Design, fig. "
    "4.12). A slip by 1000, or a forgotten power of ten, is outside.",
    inspect,
)
