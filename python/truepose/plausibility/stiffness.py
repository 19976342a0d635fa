"""A stiffness far from that of any bar as long: N/m for N/um, or the reverse."""

from __future__ import annotations

import math
from collections.abc import Iterator

from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule, listed

STEEL = 2.1e11
THICKEST = 0.5
THINNEST = 1.0 / 5000.0
"""Diameter of a steel bar as stiff, in the strut's length."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """Every stiffness along a strut, that of the strut, its joints and its telescopic drive."""
    drives = {drive.name: drive for drive in view.machine.drives}
    odd = {}
    for strut, length in zip(view.machine.struts, view.lengths.tolist(), strict=True):
        given = {
            f"{strut.part}.stiffness": strut.stiffness,
            f"{strut.part}.base_joint.stiffness": strut.base_joint.stiffness,
            f"{strut.part}.platform_joint.stiffness": strut.platform_joint.stiffness,
        }
        drive = drives.get(strut.drive or "")
        if drive is not None and drive.coordinate == "length":
            given[f"{drive.part}.stiffness"] = drive.stiffness
        for path, stiffness in given.items():
            if stiffness is None or not math.isfinite(length):
                continue
            bar = math.sqrt(4.0 * stiffness * length / (math.pi * STEEL))
            if bar > THICKEST * length or bar < THINNEST * length:
                odd[path] = (stiffness, bar, length)
    if odd:
        stiffness, bar, length = next(iter(odd.values()))
        yield (
            say(
                "{names}: {stiffness} N/µm, like a steel bar {length} long and {bar} thick; usual "
                "is one from 1/5000 to 1/2 as thick as long. Look at the unit: a bare number is "
                'in N per file length, "30 N/um" is 3e7 N/m. If it is meant, leave it',
                names=listed(odd),
                stiffness=marked(f"{stiffness / 1e6:.3g}"),
                length=view.length(length),
                bar=view.length(bar),
            ),
            tuple(odd),
        )


RULE = Rule(
    "odd-stiffness",
    "a stiffness like that of a steel bar thinner than 1/5000 of the strut's length or thicker "
    "than half",
    "EA/L of a steel bar (210 GPa). A toothed belt of 6 mm, the softest drive in use, has EA of "
    "some 1e4 N and is as stiff as a bar of 1/1000 of half a metre (a thirtieth of N/µm); a 1/5000 "
    "leaves a factor of 25, N/m for N/µm is a million.",
    inspect,
)
