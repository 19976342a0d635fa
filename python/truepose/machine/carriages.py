"""Carriages and arms that carry several struts: how their six displacements give way together.

What lies between the frame and the body that a drive moves gives way by three displacements and
three turns of that body, in its own axes and about the point that the drive moves (of an arm: on
its axis, where its origin is). All struts on the body move with it, and load it by their sum.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.machine.chains import Beam, ChainJoint, triad, yields
from truepose.machine.parts import Drive
from truepose.spatial import skew

COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")

CHAINS = {"slider": ("prismatic",), "crank": ("revolute",)}
"""The joints of what moves such a body, by the kind of drive."""


def carriage_parameters(drive: Drive) -> list[str]:
    """The six displacements of the body that a drive moves, if it says how that gives way."""
    return [f"{drive.part}.carriage.{name}" for name in COMPONENTS] if drive.chain else []


def carriage_compliance(drive: Drive, bases: Floats) -> Floats:
    """(6, 6) m/N, rad/(N m) and between: of the body of a drive, in its axes.

    `bases` (n, 3): the base joints that it carries, m; an arm's beams reach from its axis to their
    mean. A part with compliances c at r moves the body by c under the load moved to r (see
    `crates/kernel/src/statics/chain.rs`).
    """
    axis = np.asarray(drive.fields["axis"], np.float64)
    end = bases.mean(axis=0)
    foot = (end @ axis) * axis
    along = end - foot
    reach = float(np.linalg.norm(along))
    stated = sum(b.length or 0.0 for b in drive.chain if isinstance(b, Beam))
    matrix = np.zeros((6, 6))
    station = 0.0
    for part in drive.chain:
        if isinstance(part, Beam):
            length = reach - stated if part.length is None else part.length
            springs = _beam(part, length)
            axes = np.array(triad(along, axis))
            at = foot + along * ((station + 0.5 * length) / reach)
            station += length
        else:
            springs, axes, at = _joint(part), np.array(triad(axis, _side(part))), np.zeros(3)
        x, y = axes
        matrix += _about_origin(springs, np.stack([x, y, np.cross(x, y)]), at)
    return matrix


def beams_reach(drive: Drive, bases: Floats) -> float:
    """m from an arm's axis to the mean of the base joints that it carries."""
    axis = np.asarray(drive.fields["axis"], np.float64)
    end = bases.mean(axis=0)
    return float(np.linalg.norm(end - (end @ axis) * axis))


def _side(part: ChainJoint) -> Floats | None:
    return None if part.axis is None else np.array(part.axis)


def _joint(joint: ChainJoint) -> Sequence[float]:
    """Springs along and about x, y and z; along x, and about it, the drive itself holds it."""
    turns = [yields(stiffness) for stiffness in joint.tilt]
    if joint.kind == "prismatic":
        return [0.0, *(yields(stiffness) for stiffness in joint.across), *turns]
    radial = yields(joint.radial)
    return [yields(joint.axial), radial, radial, 0.0, *turns[1:]]


def _beam(beam: Beam, length: float) -> Sequence[float]:
    """Springs at the middle of a uniform beam."""
    stretch, shear_y, shear_z, torsion, about_y, about_z, _ = beam.per_metre
    cubic = length**3 / 12.0
    return [
        stretch * length,
        shear_y * length + about_z * cubic,
        shear_z * length + about_y * cubic,
        torsion * length,
        about_y * length,
        about_z * length,
    ]


def _about_origin(springs: Sequence[float], axes: Floats, at: Floats) -> Floats:
    """(6, 6) of springs at a point: of the displacement and turn of the body about its origin."""
    turned = np.kron(np.eye(2), axes)
    # A load on the body, moved to the springs: force F, moment M - r x F.
    moved = np.eye(6)
    moved[3:, :3] = -skew(at)
    local = turned @ moved
    return np.asarray(local.T @ np.diag(springs) @ local)


__all__ = ["CHAINS", "beams_reach", "carriage_compliance", "carriage_parameters"]
