"""Loads beside the wrench on the tool that is known: weight, inertia, a force of any direction.

Weight and inertia of the machine's own masses are known; they deflect what gives way as the wrench
on the tool does:

    shift = load on the parameter * compliance of the parameter

A strut's weight loads its ends unlike its middle, so that its joints (and the drive of a telescopic
strut) give way otherwise than under the mean tension, which is the load on its length.

A force on the tool of known size F but unknown direction is a band: along each of three orthogonal
axes d (two, in a plane) a common variable moves all parameters together by

    sign * half = load on the parameter under F d * compliance of the parameter

and the variables of the axes are together a unit vector, the direction, one in a run.

`docs/sources/loads.md` says what this covers.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np

from truepose.errors import Problem, TrueposeError
from truepose.sources._stiffness import lacking
from truepose.sources.deviation import ARCSINE, OWN_GROUP, UNIFORM, Deviation
from truepose.sources.pose_block import Cause, PoseBlock
from truepose.sources.variation import WITH_RUN, variation

if TYPE_CHECKING:
    from pydantic import BaseModel

    from truepose.machine import Condition, Envelope, Machine, SourceBuilder

UNKNOWN_DIRECTION = "force of unknown direction"
"""What varies with the direction of the envelope's force."""

_CAUSE = "weight, inertia or a force of any direction acts on the machine"


@dataclass(frozen=True)
class Loads:
    """Deflection under the machine's own masses, and under a force of unknown direction."""

    name: ClassVar[str] = "loads"
    doc: ClassVar[str] = "weight and inertia of the machine, and a force of unknown direction"
    tables: ClassVar[Mapping[str, type[BaseModel]]] = {}
    sets_overall_edges: ClassVar[bool] = False
    yields_under: ClassVar[Cause] = "own"

    weighs: bool
    """Something has a mass."""

    @classmethod
    def build(cls, parts: SourceBuilder) -> Self | None:
        """Always there, for a condition given later may have what the file has not."""
        masses = [parts.platform.mass]
        masses += [drive.mass for drive in parts.drives]
        masses += [strut.mass for strut in parts.struts]
        source = cls(weighs=any(mass > 0.0 for mass in masses))
        condition = parts.condition
        if not source.weighs and condition.gravity > 0.0 and parts.has("condition.gravity"):
            parts.record(_no_mass("gravity", "a mass of [platform], a [[strut]] or a [[drive]]"))
        if np.any(condition.acceleration) and parts.platform.mass == 0.0:
            parts.record(_no_mass("acceleration", "a mass of [platform]"))
        elif source.acts(condition):
            for problem in lacking(parts.drives, parts.struts, parts.limbs, _CAUSE):
                parts.record(problem)
        return source

    def acts(self, condition: Condition) -> bool:
        """Where something has a weight, the platform is accelerated, or a force has no direction.

        Without a mass there is neither weight nor inertia, whatever the condition says.
        """
        accelerated = bool(np.any(condition.acceleration))
        weight = self.weighs and condition.gravity > 0.0
        return weight or accelerated or condition.envelope is not None

    def deviation(self, machine: Machine, condition: Condition, block: PoseBlock) -> Deviation:
        """Deflection of every parameter that gives way, m or rad, and its band, (n, k).

        Raises `TrueposeError`: no-stiffness for limbs whose stiffness the machine does not say;
        no-mass for an acceleration of a platform without mass.
        """
        if np.any(condition.acceleration) and machine.platform.mass == 0.0:
            raise TrueposeError(_no_mass("acceleration", "a mass of [platform]"))
        problems = lacking(machine.drives, machine.struts, machine.limbs, _CAUSE)
        if problems:
            raise TrueposeError(*problems)
        yielding = block.compliances
        columns = yielding.columns
        shift = yielding.deflection(block.loads(columns, "own"))
        if block.uneven_stretch is not None:
            # The struts' lengths are the first columns.
            shift[:, : len(machine.struts)] += block.uneven_stretch
        if block.sag is not None:
            places = [
                int(np.flatnonzero(columns == at)[0]) for at in machine.kernel.limb_parameters
            ]
            shift[:, places] += block.sag
        if condition.envelope is None:
            return Deviation.of(columns, shift)
        return _with_envelope(block, condition.envelope, shift)


def _with_envelope(block: PoseBlock, envelope: Envelope, shift: np.ndarray) -> Deviation:
    """The shift, and for each axis a group of columns moved by the direction's component."""
    yielding = block.compliances
    columns = yielding.columns
    shifts, halves, signs = [shift], [np.zeros_like(shift)], [np.ones_like(shift)]
    groups = [np.full(columns.size, OWN_GROUP)]
    axes = envelope.wrenches
    for group, wrench in enumerate(axes):
        load = block.loads_of(wrench[np.newaxis], columns)
        moved = np.broadcast_to(yielding.deflection(load), yielding.own.shape)
        shifts.append(np.zeros_like(moved))
        halves.append(np.abs(moved))
        signs.append(np.where(moved < 0.0, -1.0, 1.0))
        groups.append(np.full(columns.size, group))
    # A component of a direction that is anywhere on the sphere is uniform (Archimedes), of one
    # that is anywhere on a circle it is distributed as a sine.
    return Deviation.of(
        np.tile(columns, len(shifts)),
        np.concatenate([np.broadcast_to(table, yielding.own.shape) for table in shifts], axis=1),
        np.concatenate([np.broadcast_to(table, yielding.own.shape) for table in halves], axis=1),
        groups=np.concatenate(groups),
        sign=np.concatenate(
            [np.broadcast_to(table, yielding.own.shape) for table in signs], axis=1
        ),
        edge=False,
        distribution=UNIFORM if len(axes) == 3 else ARCSINE,
        group_names=dict.fromkeys(range(len(axes)), UNKNOWN_DIRECTION),
        directions=[range(len(axes))],
        variation=variation(envelope.varies, WITH_RUN),
    )


def _no_mass(key: str, wanted: str) -> Problem:
    return Problem(
        code="no-mass",
        message=f"{key} is given, but nothing has a mass for it to act on",
        path=f"condition.{key}",
        found="no mass",
        expected=wanted,
        hint=f"or leave {key} away",
    )
