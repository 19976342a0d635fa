"""A slipped decimal point: one of several that are alike is ten times as large, or as small."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.plausibility._base import MachineAtHome, Remark, Rule
from truepose.sources.tolerance import bands_of

FACTOR = 5.0
"""From the nearest of the others."""

ALIKE = 2.0
"""Largest over smallest of the others."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """What struts and drives have in common."""
    for values in _compared(view):
        if len(values) < 3 or min(values.values()) <= 0.0:
            continue
        ranked = sorted(values, key=lambda path: values[path])
        for path, rest in ((ranked[-1], ranked[:-1]), (ranked[0], ranked[1:])):
            least, most = values[rest[0]], values[rest[-1]]
            factor = max(values[path] / most, least / values[path])
            if most <= ALIKE * least and factor > FACTOR:
                size = "times as large as" if values[path] > most else "times smaller than"
                yield (
                    f"{path} is {factor:.3g} {size} that of any other, and those are alike; usual "
                    "is that all are. Look for a slipped decimal point. If it is meant, leave it",
                    (path,),
                )


def _compared(view: MachineAtHome) -> Iterator[dict[str, float]]:
    """Values by path, of one kind each."""
    machine, struts, drives = view.machine, view.machine.struts, view.machine.drives
    nominal = view.nominal
    yield {
        path: nominal[path] for strut in struts if (path := f"{strut.part}.length") in nominal
    }
    yield {f"{s.part}.section_area": s.area for s in struts if s.area is not None}
    yield {f"{s.part}.modulus": s.modulus for s in struts if s.modulus is not None}
    yield {f"{s.part}.stiffness": s.stiffness for s in struts if s.stiffness is not None}
    yield {f"{s.part}.mass": s.mass for s in struts if s.mass > 0.0}
    for kind in dict.fromkeys(drive.kind for drive in drives):
        yield {
            f"{drive.part}.travel": drive.travel[1] - drive.travel[0]
            for drive in drives
            if drive.kind == kind
        }
    for parts, name in ((struts, "base"), (struts, "platform"), (drives, "origin")):
        points = {f"{part.part}.{name}": view.vector(f"{part.part}.{name}") for part in parts}
        yield {
            path: float(np.linalg.norm(point))
            for path, point in points.items()
            if point is not None and point.any()
        }
    bands = bands_of(machine)
    if bands is not None:
        of_lengths = set(machine.kernel.length_parameters.tolist())
        yield {
            machine.parameters[column]: float(half)
            for column, half in zip(bands.parameters.tolist(), bands.half[0], strict=True)
            if column in of_lengths and half > 0.0
        }


RULE = Rule(
    "slipped-decimal",
    "one length, section, stiffness, mass, travel, tolerance or distance is 5 times off all others",
    "A slipped decimal point is a factor of ten. At least two others must be within a factor of two "
    "of each other; sizes that are chosen differently rarely differ by five where all others agree.",
    inspect,
)
