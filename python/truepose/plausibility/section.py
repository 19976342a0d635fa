"""A strut as thin as a hair, or thicker than half its length."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

THICKEST = 0.5
THINNEST = 1.0 / 2000.0
"""Diameter of a round bar of the strut's section, in its length."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Diameter of a bar of the same section, over the length at home."""
    odd = {}
    for strut, length in zip(view.machine.struts, view.lengths.tolist(), strict=True):
        if strut.area is not None:
            diameter = math.sqrt(4.0 * strut.area / math.pi)
            if diameter > THICKEST * length or diameter < THINNEST * length:
                odd[strut.part] = (diameter, length)
    if odd:
        diameter, length = next(iter(odd.values()))
        yield (
            say(
                "{names}: a section_area like that of a round bar {diameter} thick, the strut "
                "{length} long; usual is a bar from 1/2000 to 1/2 of its length. Look at the "
                'unit: a bare number is in the square of the file\'s length, "28 mm^2" is not. '
                "If it is meant, leave it",
                names=listed(odd),
                diameter=view.length(diameter),
                length=view.length(length),
            ),
            tuple(f"{part}.section_area" for part in odd),
        )


RULE = Rule(
    "odd-section",
    "a strut's section is that of a bar thinner than 1/2000 of its length or thicker than half",
    "A strut in compression has a slenderness (length over radius of gyration, a quarter of a "
    "bar's diameter) of at most 200 (AISC 360, E2), which is a bar of 1/50 of its length; 1/2000 "
    "leaves room for wires. What is thicker than half its length is no strut but a block, to "
    "which EA/L does not apply.",
    inspect,
)
