"""A Young's modulus that no strut's material has."""

from __future__ import annotations

from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

SOFTEST = 1e9
STIFFEST = 1.2e12
"""Pa: rigid plastics, and diamond."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Modulus of each strut."""
    odd = {
        strut.part: strut.modulus
        for strut in view.machine.struts
        if strut.modulus is not None and not SOFTEST <= strut.modulus <= STIFFEST
    }
    if odd:
        value = next(iter(odd.values())) / 1e9
        yield (
            say(
                "{names}: a modulus of {value} GPa; usual is from 1 GPa (plastics) over 70 "
                "(aluminium) and 210 (steel) to 1200 (diamond). Look at the unit, GPa or MPa: 210 "
                "GPa are 210000 N/mm2. If it is meant, leave it",
                names=listed(odd),
                value=marked(f"{value:.3g}"),
            ),
            tuple(f"{part}.modulus" for part in odd),
        )


RULE = Rule(
    "odd-modulus",
    "a strut's modulus below 1 GPa or above 1200 GPa",
    "Rigid plastics begin at 1 GPa, diamond has 1200 (Ashby, Materials Selection in Mechanical "
    "Design, fig. 4.3). Metals lie from 15 to 410, so that MPa for GPa is outside.",
    inspect,
)
