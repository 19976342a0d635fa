"""Which laws a source follows in a page: those of a controller, own weight, and dead zones.

A page has the kernel, so that more than in a controller follows from few numbers there:

* deflection under the machine's own weight and inertia: its masses, compliance times load;
* play, which the load takes up: how wide it is, and from which load on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from truepose.machine import Condition, Machine
from truepose.sources import PoseBlock, Source
from truepose.sources._play import NO_LOAD, DeadZone, all_that_acts
from truepose.sources.pose_block import base_masses, limbs_weigh
from truepose.uncertainty_analysis.known_shifts import (
    PROBING,
    NoLawError,
    SourceLaw,
    require_law,
    source_law,
)


@dataclass(frozen=True)
class LiveLaw:
    """What a source is known to do, and its dead zones, one a column of its deviation.

    `under`: what gives way under loads, and has no shift of its own, gives way under these.
    """

    source: Source
    shifts: SourceLaw
    under: str | None
    dead_zones: tuple[DeadZone, ...]


def live_law(source: Source, block: PoseBlock) -> LiveLaw:
    """The laws that the source follows at the poses of `probed_poses`.

    Held against it in the file's condition, too. Raises `NoLawError`, or what the source raises.
    """
    machine = block.machine
    under = getattr(source, "yields_under", None)
    has_play = hasattr(source, "dead_zones")
    if machine.condition.envelope is not None and (under == "own" or has_play):
        raise NoLawError("follows from a force of unknown direction")
    if under == "own":
        return LiveLaw(source, SourceLaw(source.name, (), {}, False), under, ())
    if has_play:
        zones = _dead_zones(source, block)
        return LiveLaw(source, SourceLaw(source.name, (), {}, False), None, zones)
    law = source_law(source, block)
    require_law(source, law, block, machine.condition)
    return LiveLaw(source, law, under, ())


def at_rest(block: PoseBlock) -> PoseBlock:
    """The same poses where nothing presses: no wrench, weight or acceleration. Plays are open."""
    nothing = block.condition.replace(
        force=(0, 0, 0), moment=(0, 0, 0), gravity=0.0, acceleration=(0, 0, 0), envelope=0.0
    )
    return replace(block, condition=nothing)


def _dead_zones(source: Source, block: PoseBlock) -> tuple[DeadZone, ...]:
    """Those of the source, held against what it does under loads. Raises `NoLawError`."""
    machine, rest = block.machine, at_rest(block)
    zones: tuple[DeadZone, ...] = cast("Any", source).dead_zones(machine)
    opened = source.deviation(machine, rest.condition, rest)
    if [zone.parameter for zone in zones] != opened.parameters.tolist() or opened.shift.any():
        raise NoLawError("has other dead zones than it says")
    for condition in _pressing(block):
        loaded = replace(block, condition=condition)
        found = source.deviation(machine, condition, loaded)
        side = _sides(loaded, zones)
        shift, half = side * opened.half, np.where(side == 0.0, opened.half, 0.0)
        if np.any(found.shift != shift) or np.any(found.half != half):
            raise NoLawError("has other dead zones than it says")
    return zones


def _pressing(block: PoseBlock) -> list[Condition]:
    """The file's condition, and wrenches small and large, some way and the other."""
    random, file = np.random.default_rng(0), block.machine.condition
    size = block.machine.characteristic_length
    conditions = [file, block.condition]
    for newtons in PROBING:
        force, moment = random.uniform(-newtons, newtons, (2, 3))
        for sign in (1.0, -1.0):
            conditions.append(file.replace(force=sign * force, moment=sign * size * moment))
    return conditions


def _sides(block: PoseBlock, zones: Sequence[DeadZone]) -> Any:
    """(n, k) to which side each is pressed, 0 where it is open: as a page works it out."""
    columns = np.array([zone.parameter for zone in zones], np.intp)
    loads = block.loads(columns, "all")
    for at, zone in enumerate(zones):
        if zone.end is not None:
            strut, end = zone.end
            loads[:, at] += block.over_tension[:, strut, end]
    rounding = NO_LOAD * all_that_acts(block) * np.array([zone.lever for zone in zones])
    least = np.maximum([zone.threshold for zone in zones], rounding)
    return np.where(np.abs(loads) > least, np.sign(loads), 0.0)


def play(zone: DeadZone, source: str) -> dict[str, Any]:
    """A dead zone as a bundle has it; `share` of all that acts is a load of rounding only."""
    end = None if zone.end is None else list(zone.end)
    share = NO_LOAD * zone.lever
    return {"source": source, "threshold": zone.threshold, "share": share, "end": end}


def weight(machine: Machine) -> dict[str, Any] | None:
    """What the machine weighs, as a bundle has it; None where nothing weighs or is accelerated."""
    condition, platform = machine.condition, machine.platform
    per_kilogram = condition.gravity * machine.down
    at_bases = base_masses(machine)
    tubes = [[limb.mass, limb.length or 0.0] for limb in machine.limbs]
    struts = [[strut.mass, strut.centre_of_mass] for strut in machine.struts]
    masses = [platform.mass, *at_bases, *(mass for mass, _ in [*tubes, *struts])]
    if not any(masses) or not (per_kilogram.any() or np.any(condition.acceleration)):
        return None
    return {
        "per_kilogram": per_kilogram.tolist(),
        "acceleration": [float(value) for value in condition.acceleration],
        "platform": [float(platform.mass), *(float(value) for value in platform.centre_of_mass)],
        "struts": struts,
        "bases": at_bases.tolist(),
        "tubes": tubes,
        "sags": limbs_weigh(machine),
        "ends": machine.end_compliances.tolist(),
    }


__all__ = ["LiveLaw", "at_rest", "live_law", "play", "weight"]
