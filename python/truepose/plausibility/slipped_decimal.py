"""A slipped decimal point: one of several that are alike is ten times as large, or as small."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from truepose.arrays import Floats
from truepose.language import marked, say
from truepose.plausibility._base import MachineAtHome, Remark, Rule
from truepose.sources.tolerance import bands_of

FACTOR = 5.0
"""From the nearest of the others."""

FAR = 0.2
"""Of the machine's size: a joint centre that is less far from the others is not looked at."""

ALIKE = 1.01
APART = 2.0
"""Largest over smallest of the others: of sizes, and of distances."""


def inspect(view: MachineAtHome) -> Iterator[Remark]:
    """What struts and drives have in common: sizes, and how far apart their points are."""
    for values in _sizes(view):
        yield from _largest(values, ALIKE)
        yield from _smallest(values)
    for values in _distances(view):
        # One joint may well stand in the middle of the others.
        yield from _largest(values, APART)


def _largest(values: dict[str, float], alike: float) -> Iterator[Remark]:
    path, *rest = sorted(values, key=lambda path: -values[path])
    if len(rest) > 1 and 0.0 < values[rest[0]] <= alike * values[rest[-1]]:
        factor = values[path] / values[rest[0]]
        if factor > FACTOR:
            yield (
                say(
                    "{path} is {factor} times as large as that of any other, and those are alike; "
                    "usual is that all are. Look for a slipped decimal point. If it is meant, "
                    "leave it",
                    path=path,
                    factor=marked(f"{factor:.3g}"),
                ),
                (path,),
            )


def _smallest(values: dict[str, float]) -> Iterator[Remark]:
    path, *rest = sorted(values, key=lambda path: values[path])
    if len(rest) > 1 and values[rest[-1]] <= ALIKE * values[rest[0]]:
        factor = values[rest[0]] / values[path]
        if factor > FACTOR:
            yield (
                say(
                    "{path} is {factor} times smaller than that of any other, and those are "
                    "alike; usual is that all are. Look for a slipped decimal point. If it is "
                    "meant, leave it",
                    path=path,
                    factor=marked(f"{factor:.3g}"),
                ),
                (path,),
            )


def _sizes(view: MachineAtHome) -> Iterator[dict[str, float]]:
    """Values above zero by path, of one kind each; at least one."""
    yield from filter(None, _every_size(view))


def _every_size(view: MachineAtHome) -> Iterator[dict[str, float]]:
    machine, struts, drives = view.machine, view.machine.struts, view.machine.drives
    nominal = view.nominal
    yield {path: nominal[path] for strut in struts if (path := f"{strut.part}.length") in nominal}
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
    bands = bands_of(machine)
    if bands is not None:
        of_lengths = set(machine.kernel.length_parameters.tolist())
        yield {
            machine.parameters[column]: float(half)
            for column, half in zip(bands.parameters.tolist(), bands.half[0], strict=True)
            if column in of_lengths and half > 0.0
        }


def _median(points: Floats) -> Floats:
    """(3,) of each coordinate of points (n, 3); numpy's own imports numpy.ma."""
    ranked = np.sort(points, axis=0)
    middle: Floats = 0.5 * (ranked[(len(points) - 1) // 2] + ranked[len(points) // 2])
    return middle


def _distances(view: MachineAtHome) -> Iterator[dict[str, float]]:
    """Of joint centres and origins from the median of their kind, where that is far."""
    struts, drives = view.machine.struts, view.machine.drives
    for parts, name in ((struts, "base"), (struts, "platform"), (drives, "origin")):
        paths = [f"{part.part}.{name}" for part in parts]
        points = np.array([point for path in paths if (point := view.vector(path)) is not None])
        if len(points) == len(paths):
            # From the median, so that no rule asks where the frame's origin stands.
            away = np.linalg.norm(points - _median(points), axis=1)
            if away.max(initial=0.0) > FAR * view.size:
                yield dict(zip(paths, away.tolist(), strict=True))


RULE = Rule(
    "slipped-decimal",
    "one length, section, stiffness, mass, travel, tolerance or distance is 5 times off all others",
    "A slipped decimal point is a factor of ten. At least two others must be the same but for 1 "
    "%, as they are where one was typed and copied; distances of joint centres from the middle "
    "of their kind within a factor of two. Who chooses sizes one by one has others that differ.",
    inspect,
)
