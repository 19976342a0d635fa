"""Second-order term of the compensation law, from the nominal geometry alone.

A strut closes as g = |v| - L, with v from its base-side joint centre A to its platform-side one B.
Corrected command and shifts move the machine by one known step c; the band then moves it by
unknown t[j] in [-1, 1] times the steps of its variables. Taylor's series of the closure about the
nominal machine, with the linear part solved for the platform, leaves the remainder, by which the
residual exceeds the linear bound:

    residual[C] - bound[C]  <=  sum over struts i of |sensitivity[C, length i]| * r[i]

    r = (eta delta + delta^2 / 2) / |v|
      + turn_c reach + turn reach_c + turn reach                             (base side)
      + turn_c own + turn own_c + turn own + (turn_c + turn / 2) turn |arm|  (platform side)

`delta` is how far v may move across itself over the band, the sum of its variables' steps, and
`eta` how far the known step moves it: the first term is the second differential of |v|. The others
bound the second differentials of A and B: a point that a rotation or a stretch by `turn` carries
and that moves by `reach` to first order moves by no more than the products to second. On the
platform the arm from the tool point is carried, and `own` is the motion of the joint centre in it.
Where a drive's scale multiplies the strut's length, its deviation times the joint correction is
added.

The movements are of first order; the term is evaluated twice, the second time with the platform
moved by the first result as well and |v| shortened by all of it. What is left out is smaller by
the deviation over the strut's length.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from truepose import _kernel
from truepose.budget.percent import POSITIONS
from truepose.machine import Machine
from truepose.sources import Block, Deviation
from truepose.sources._base import Floats, Indices

DIFFERENCE = 1e-6
"""Step of the difference quotients of joint centres, in characteristic lengths, rad or scales."""

_ROTATIONS = ("rx", "ry", "rz")


@dataclass(frozen=True)
class Step:
    """One small step of the machine off its nominal state, first order.

    `columns` (k,) and `values` (n or 1, k): parameters and their deviations, SI;
    `joints` (n, n_joint): step of the joint coordinates, or None;
    `platform` (n, n_component): displacement of the tool point and rotation vector.
    """

    columns: Indices
    values: Floats
    joints: Floats | None
    platform: Floats


@dataclass
class _Movement:
    """Bounds of what steps do to the struts: absolute components (n, n_closure or 1, 3), m, rad.

    Steps of unknown sign add component by component, which is never more than their norms do.
    """

    across: Floats
    reach_base: Floats
    own_platform: Floats
    turn_platform: Floats
    turn_base: Floats  # (n, n_closure)
    scale: Floats  # (n, n_closure)

    def add(self, other: _Movement) -> None:
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))


@dataclass(frozen=True)
class _Bounds:
    """Norms of a movement: (n, n_closure or 1), m and rad."""

    across: Floats
    reach_base: Floats
    own_platform: Floats
    turn_platform: Floats
    turn_base: Floats
    scale: Floats

    @classmethod
    def of(cls, movement: _Movement) -> _Bounds:
        return cls(
            np.linalg.norm(movement.across, axis=2),
            np.linalg.norm(movement.reach_base, axis=2),
            np.linalg.norm(movement.own_platform, axis=2),
            np.linalg.norm(movement.turn_platform, axis=2),
            movement.turn_base,
            movement.scale,
        )

    def with_platform(self, shift: Floats, turn: Floats, arm: Floats) -> _Bounds:
        """The same with the platform moved by `shift` and `turn` (n, 1) as well."""
        return replace(
            self,
            across=self.across + shift + turn * arm,
            turn_platform=self.turn_platform + turn,
        )


@dataclass(frozen=True)
class _Geometry:
    """Struts at the nominal poses of a block: (n, n_closure, 3) and (n, n_closure), m."""

    block: Block
    base: Floats
    platform: Floats
    arm: Floats
    unit: Floats
    length: Floats
    arm_length: Floats


class SecondOrder:
    """The term, for the poses of one machine."""

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._kernel = machine.kernel
        # A strut's length moves no joint centre, wherever the platform is.
        self._still = frozenset(map(int, self._kernel.length_parameters))
        self._stepped: dict[int, tuple[_kernel.Machine, float]] = {}
        names = list(machine.parameters)
        self._joint_of = [
            -1 if strut.drive is None else machine.joints.index(strut.drive)
            for strut in machine.struts
        ]
        self._scale_of = [
            names.index(f"drive.{strut.drive}.scale")
            if f"drive.{strut.drive}.scale" in names
            else -1
            for strut in machine.struts
        ]
        self._scales = np.array(
            [abs(float(machine.nominal[at])) if at >= 0 else 1.0 for at in self._scale_of]
        )
        self._linear = [machine.components.index(c) for c in machine.components if c in POSITIONS]
        self._into_linear = [POSITIONS.index(c) for c in machine.components if c in POSITIONS]
        self._angular = [machine.components.index(c) for c in machine.components if c in _ROTATIONS]
        self._into_angular = [_ROTATIONS.index(c) for c in machine.components if c in _ROTATIONS]

    def steps(self, deviation: Deviation, effects: Floats) -> list[Step]:
        """One step for each variable of a deviation that has a band, in the order of `effects`.

        `effects` (n, n_component, n_variable) as `truepose.budget.worst.variable_effects` has it.
        """
        banded = deviation.banded
        variables = deviation.variables[banded]
        steps = []
        for at, variable in enumerate(np.unique(variables)):
            columns = banded[variables == variable]
            steps.append(
                Step(
                    deviation.parameters[columns],
                    deviation.signed_half[:, columns],
                    None,
                    effects[:, :, at],
                )
            )
        return steps

    def bound(self, block: Block, centre: Step, band: Sequence[Step]) -> Floats:
        """(n, n_component) the term, m and rad: 0 where nothing has a band."""
        n_pose, n_closure = block.lengths.shape
        if not band:
            return np.zeros((n_pose, len(self._machine.components)))
        geometry = self._geometry(block)
        unknown = self._movement(geometry, band[0])
        for step in band[1:]:
            unknown.add(self._movement(geometry, step))
        known, first = _Bounds.of(self._movement(geometry, centre)), _Bounds.of(unknown)
        lengths, _ = self._kernel.sensitivity_at(
            block.joints, block.placements, self._kernel.length_parameters
        )
        influence = np.abs(lengths)
        arm, corrections = geometry.arm_length, self._corrections(centre, n_pose, n_closure)
        moved = _through(influence, _remainder(geometry.length, arm, known, first, corrections))
        second = first.with_platform(*self._norms(moved), arm)
        # A band that outgrows its strut has no bound: infinite.
        shortened = np.maximum(geometry.length - known.across - second.across, 0.0)
        with np.errstate(divide="ignore"):
            return _through(influence, _remainder(shortened, arm, known, second, corrections))

    def _geometry(self, block: Block) -> _Geometry:
        centres = self._kernel.joint_centres(block.joints, block.placements)
        base, platform = centres[:, :, 0], centres[:, :, 1]
        along = platform - base
        length = np.linalg.norm(along, axis=2)
        arm = platform - block.placements[:, np.newaxis, :3]
        unit = along / length[:, :, np.newaxis]
        return _Geometry(block, base, platform, arm, unit, length, np.linalg.norm(arm, axis=2))

    def _moved(self, geometry: _Geometry, column: int) -> tuple[Floats, Floats, float]:
        """Moves (n, n_closure, 3) of base and platform centres by a small step of one parameter.

        And that step, m or rad or 1: together a difference quotient.
        """
        if column not in self._stepped:
            nominal = float(self._machine.nominal[column])
            size = {"m": self._machine.characteristic_length, "rad": 1.0}
            step = DIFFERENCE * size.get(self._machine.units[column], abs(nominal) or 1.0)
            name = self._machine.parameters[column]
            self._stepped[column] = (self._kernel.replace({name: nominal + step}), step)
        kernel, step = self._stepped[column]
        centres = kernel.joint_centres(geometry.block.joints, geometry.block.placements)
        return centres[:, :, 0] - geometry.base, centres[:, :, 1] - geometry.platform, step

    def _movement(self, geometry: _Geometry, step: Step) -> _Movement:
        n_pose, n_closure = geometry.length.shape
        base = np.zeros_like(geometry.base)
        platform = np.zeros_like(geometry.base)
        turn_base = np.zeros((n_pose, n_closure))
        scale = np.zeros((n_pose, n_closure))
        for at, column in enumerate(step.columns.tolist()):
            value = step.values[:, at, np.newaxis]
            if column in self._still or not value.any():
                continue
            of_base, of_platform, small = self._moved(geometry, column)
            steps = (value / small)[:, :, np.newaxis]
            base += of_base * steps
            platform += of_platform * steps
            unit = self._machine.units[column]
            if unit == "rad":
                turn_base += np.abs(value) * of_base.any(axis=2)
            elif unit == "1":
                mine = np.array(self._scale_of) == column
                turned = self._angles(geometry.block.joints)
                turn_base += (
                    np.abs(value) * (1.0 / abs(self._machine.nominal[column]) + turned) * mine
                )
                scale += np.abs(value) * mine
        if step.joints is not None:
            centres = self._kernel.joint_centres(
                geometry.block.joints + step.joints, geometry.block.placements
            )
            base += centres[:, :, 0] - geometry.base
            turn_base += self._angles(step.joints) * self._scales
        shift, rotation = self._platform(step.platform, n_pose)
        relative = platform + shift + np.cross(rotation, geometry.arm) - base
        along = (relative * geometry.unit).sum(axis=2, keepdims=True)
        return _Movement(
            np.abs(relative - along * geometry.unit),
            np.abs(base),
            np.abs(platform),
            np.abs(rotation),
            turn_base,
            scale,
        )

    def _angles(self, joints: Floats) -> Floats:
        """(n, n_closure) absolute joint coordinate of the crank that carries each strut, rad."""
        angles = np.zeros((len(joints), len(self._joint_of)))
        for closure, joint in enumerate(self._joint_of):
            if joint >= 0 and self._machine.drives[joint].coordinate == "angle":
                angles[:, closure] = np.abs(joints[:, joint])
        return angles

    def _corrections(self, centre: Step, n_pose: int, n_closure: int) -> Floats:
        """(n, n_closure) absolute joint correction of the drive that carries each strut."""
        steps = np.zeros((n_pose, n_closure))
        if centre.joints is not None:
            for closure, joint in enumerate(self._joint_of):
                if joint >= 0:
                    steps[:, closure] = np.abs(centre.joints[:, joint])
        return steps

    def _platform(self, moved: Floats, n_pose: int) -> tuple[Floats, Floats]:
        """Displacement and rotation vector, each (n, 1, 3)."""
        shift, rotation = np.zeros((n_pose, 1, 3)), np.zeros((n_pose, 1, 3))
        shift[:, 0, self._into_linear] = moved[:, self._linear]
        rotation[:, 0, self._into_angular] = moved[:, self._angular]
        return shift, rotation

    def _norms(self, moved: Floats) -> tuple[Floats, Floats]:
        """Norms (n, 1) of the displacement and of the rotation in (n, n_component)."""
        shift = np.linalg.norm(moved[:, self._linear], axis=1, keepdims=True)
        turn = np.linalg.norm(moved[:, self._angular], axis=1, keepdims=True)
        return shift, turn


def _through(influence: Floats, remainder: Floats) -> Floats:
    """(n, n_component) displacement that remainders (n, n_closure) of the closures allow."""
    moved: Floats = (influence @ remainder[:, :, np.newaxis])[:, :, 0]
    return moved


def _remainder(
    length: Floats, arm: Floats, known: _Bounds, band: _Bounds, corrections: Floats
) -> Floats:
    """(n, n_closure) second-order remainder of each closure, m."""
    return (
        (known.across + 0.5 * band.across) * band.across / length
        + known.turn_base * band.reach_base
        + band.turn_base * (known.reach_base + band.reach_base)
        + known.turn_platform * band.own_platform
        + band.turn_platform * (known.own_platform + band.own_platform)
        + (known.turn_platform + 0.5 * band.turn_platform) * band.turn_platform * arm
        + band.scale * corrections
    )
