"""Limbs that say what they are made of: chains of joints and beams, and what of them gives way.

A limb takes together a strut and the guides that keep the platform from what the limb does not let
it do. Its family is its joints' initials from the base: which closures it has follows from them.
How it gives way is the kernel's to say, which knows where its parts are at a pose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from truepose._kernel import _rebuild
from truepose.machine.chains import Beam, ChainJoint, Vector, triad, yields
from truepose.machine.parts import Drive, limb_part

if TYPE_CHECKING:
    from truepose.machine.model import Machine


@dataclass(frozen=True)
class Family:
    """What limbs of these joints consist of: a strut on which kinds of drive, and which guides."""

    drives: tuple[str, ...]
    guides: tuple[tuple[str, ...], ...]

    @property
    def has_strut(self) -> bool:
        """Whether a strut is one of its closures."""
        return bool(self.drives)


FAMILIES: Mapping[str, Family] = {
    "UPS": Family(("telescopic",), ((),)),
    "PUS": Family(("slider",), ((),)),
    "PRS": Family(("slider",), (("plane",),)),
    "RPS": Family(("telescopic",), (("plane",),)),
    "UP": Family((), (("line", "universal"),)),
}
"""By the initials of their joints, from the base to the platform."""


@dataclass(frozen=True)
class Limb:
    """A limb. `strut` and `guides` are names; `axis` is None where it has none.

    `axis`: of its revolute, axes of the carriage or frame; of a tube on the platform the y of its
    section, platform axes. `mass` (kg) and `length` (m) are those of such a tube, which the
    platform carries; a strut's mass is the strut's. `compliance`: how many times as much its beams
    give way as they say.
    """

    name: str
    strut: str | None
    guides: tuple[str, ...]
    axis: Vector | None
    chain: tuple[ChainJoint | Beam, ...] = field(default=())
    mass: float = 0.0
    length: float | None = None
    compliance: float = 1.0

    @property
    def part(self) -> str:
        """Its path: `limb.1`."""
        return limb_part(self.name)

    @property
    def family(self) -> str:
        """The initials of its joints, from the base to the platform."""
        return "".join(joint.kind[0].upper() for joint in self.joints)

    @property
    def joints(self) -> tuple[ChainJoint, ...]:
        """From the base to the platform."""
        return tuple(part for part in self.chain if isinstance(part, ChainJoint))

    @property
    def beams(self) -> tuple[Beam, ...]:
        """From the base to the platform."""
        return tuple(part for part in self.chain if isinstance(part, Beam))


def described(limb: Limb, drives: Sequence[Drive], struts: Sequence[Any]) -> dict[str, Any]:
    """What the kernel is told of a limb that `limb_checks` has no objection to."""
    strut = next((each for each in struts if each.name == limb.strut), None)
    drive = next((each for each in drives if strut and each.name == strut.drive), None)
    side = limb.axis or (0.0, 0.0, 1.0)
    on_platform = strut is None
    parts = [
        _beam(part, limb.compliance)
        if isinstance(part, Beam)
        else _joint(part, number, side, drive)
        for number, part in enumerate(limb.chain)
    ]
    return {
        "name": limb.name,
        "strut": limb.strut,
        "guides": list(limb.guides),
        "platform_side" if on_platform else "side": list(side),
        "parts": parts,
        "mass": limb.mass if strut is None else strut.mass,
        "whole_length": limb.length or 0.0,
        "carriage_mass": 0.0 if drive is None else drive.mass,
    }


def with_limbs(machine: Machine, limbs: tuple[Limb, ...]) -> Machine:
    """The machine with other limbs of the same names and closures: stiffer, or less so."""
    given = [described(limb, machine.drives, machine.struts) for limb in limbs]
    state = cast("tuple[dict[str, Any], dict[int, float]]", machine.kernel.__reduce__()[1])
    table, replaced = state
    return replace(machine, kernel=_rebuild({**table, "limbs": given}, replaced), limbs=limbs)


def _beam(beam: Beam, factor: float) -> dict[str, Any]:
    *yields_by, expansion = beam.per_metre
    section = [*(value * factor for value in yields_by), expansion]
    return {"length": beam.length, "section": section}


def _joint(joint: ChainJoint, number: int, side: Vector, drive: Drive | None) -> dict[str, Any]:
    """Springs in the axes of the joint; what it leaves free carries nothing, and is told as 0."""
    radial, axial = yields(joint.radial), yields(joint.axial)
    turns = [yields(stiffness) for stiffness in joint.tilt]
    at_carriage = number == 0 and joint.kind == "prismatic"
    axes: list[list[float]] | None = None
    if joint.kind == "prismatic":
        # A telescopic drive is where its rod slides; that of a carriage moves the drive's offset.
        of_drive = drive is not None and not at_carriage and drive.held_stiffness
        springs = [
            1.0 / of_drive if of_drive else 0.0,
            *(yields(stiffness) for stiffness in joint.across),
            *turns,
        ]
        if at_carriage:
            assert drive is not None
            way = np.asarray(drive.fields["axis"], np.float64)
            axes = triad(way, np.array(joint.axis or side))
    elif joint.kind == "revolute":
        springs = [axial, radial, radial, 0.0, *turns[1:]]
        axes = triad(np.array(side), None)
    elif joint.kind == "universal":
        springs = [axial, radial, radial, *turns]
    else:
        springs = [axial, radial, radial, 0.0, 0.0, 0.0]
    return {"at_carriage": at_carriage, "axes": axes, "compliance": springs}


__all__ = ["FAMILIES", "Family", "Limb", "described", "with_limbs"]
