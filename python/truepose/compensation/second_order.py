"""Second-order term of the compensation law, from the nominal geometry alone.

A strut closes as g = |v| - L, with v from its base-side joint centre A to its platform-side one B.
Corrected command and shifts move the machine by one known step c; the band then moves it by
unknown t[j] in [-1, 1] times the steps of its variables. Taylor's series of the closure about the
nominal machine, with the linear part solved for the platform, leaves the remainder, by which the
residual exceeds the linear bound:

    residual[C] - bound[C]  <=  sum over closures i of |sensitivity[C, i]| * r[i]

with the sensitivity to a residual of the closure, for a strut to its length; the r of guides stands
in `second_order_guides.py`, what more closures than freedoms add in `second_order_strain.py`. For
struts

    r = (eta delta + delta^2 / 2) / |v|
      + turn_c reach + turn reach_c + turn reach                             (base side)
      + turn_c own + turn own_c + turn own + (turn_c + turn / 2) turn |arm|  (platform side)

`delta` is how far v may move across itself over the band, the sum of its variables' steps, and
`eta` how far the known step moves it: the first term is the second differential of |v|. The others
bound the second differentials of A and B: a point that a rotation or a stretch by `turn` carries
and that moves by `reach` to first order moves by no more than the products to second. On the
platform the arm from the tool point is carried, and `own` is the motion of the joint centre in it.
The deviation of a drive's scale times the joint correction, of a crank times the arm as well, is
added. Where the platform-side joint slides on a ring of radius rho about a point at the distance D
from A's foot in its plane, it slides so that |v| stays least; by the second differential of a
minimum that adds

    rho / D |v| (kappa_c + kappa / 2) kappa,   kappa = delta / |v| + turn

The movements are of first order; the term is evaluated twice, the second time with the platform
moved by the first result as well and |v| shortened by all of it. What is left out is smaller by
the deviation over the strut's length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from truepose import _kernel
from truepose.budget.percent import POSITIONS
from truepose.compensation.second_order_guides import Guides, Movement, PlatformStep
from truepose.compensation.second_order_strain import Strain
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
    slide: Floats
    """(n, n_strut, 3, 3) how a platform-side joint slides on its ring as its base joint moves."""

    @property
    def slide_share(self) -> Floats:
        """(n, n_strut) radius of the ring over the distance of the base joint; 0 without a ring."""
        return np.asarray(np.trace(self.slide, axis1=2, axis2=3))


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
        self._ring_bases = [
            [names.index(f"{strut.part}.base.{axis}") for axis in "xyz"]
            if f"{strut.part}.ring_radius" in names
            else []
            for strut in machine.struts
        ]
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
        if not band:
            return np.zeros((len(block.lengths), len(self._machine.components)))
        geometry = self._geometry(block)
        unknown = self._movement(geometry, band[0])
        for step in band[1:]:
            unknown.add(self._movement(geometry, step))
        known, first = _Bounds.of(self._movement(geometry, centre)), _Bounds.of(unknown)
        lengths, _ = self._kernel.sensitivity_at(
            block.joints, block.placements, self._kernel.length_parameters
        )
        influence = np.abs(lengths)
        arm, corrections = geometry.arm_length, self._corrections(geometry, centre)
        slide = geometry.slide_share
        guided = self._guided(block, centre, band)
        strained = self._strained(geometry, centre, band)

        def remainder(length: Floats, band: _Bounds) -> Floats:
            return _remainder(length, arm, known, band, corrections, slide)

        moved = _through(influence, remainder(geometry.length, first)) + guided(None)
        moved += strained(geometry.length, known, first)
        further = self._norms(moved)
        second = first.with_platform(*further, arm)
        # A band that outgrows its strut has no bound: infinite.
        shortened = np.maximum(geometry.length - known.across - second.across, 0.0)
        with np.errstate(divide="ignore"):
            result = _through(influence, remainder(shortened, second)) + guided(further)
            return result + strained(shortened, known, second)

    def _strained(
        self, geometry: _Geometry, centre: Step, band: Sequence[Step]
    ) -> Callable[[Floats, _Bounds, _Bounds], Floats]:
        """A function to what strain adds, (n, n_component), m and rad.

        It takes the struts' lengths and the movements by the known step and by the band.
        """
        block = geometry.block
        nothing = np.zeros((len(block.placements), len(self._machine.components)))
        if not self._kernel.overconstrained:
            return lambda length, known, unknown: nothing
        strain = Strain(self._machine, block)
        by_known = strain.forces(centre.columns, centre.values, centre.joints)
        by_band = np.zeros_like(by_known)
        for step in band:
            by_band += strain.forces(step.columns, step.values, step.joints)

        def added(length: Floats, known: _Bounds, unknown: _Bounds) -> Floats:
            arm = geometry.arm_length
            known_tilt, tilt = known.across / length, unknown.across / length
            known_lever, lever = (
                bounds.turn_platform * arm + bounds.own_platform + arm * leaned
                for bounds, leaned in ((known, known_tilt), (unknown, tilt))
            )
            return strain.added((by_known, by_band), (known_tilt, tilt), (known_lever, lever))

        return added

    def _guided(
        self, block: Block, centre: Step, band: Sequence[Step]
    ) -> Callable[[tuple[Floats, Floats] | None], Floats]:
        """A function to what the guides add, (n, n_component), m and rad.

        It takes by how much the platform moves further, (n, 1) m and rad.
        """
        nothing = np.zeros((len(block.placements), len(self._machine.components)))
        if not self._machine.guides:
            return lambda further: nothing
        guides = Guides(self._machine, block)

        def movement(step: Step) -> Movement:
            platform = PlatformStep(*self._platform(step.platform, len(block.placements)))
            return guides.movement(step.columns, step.values, platform)

        known, unknown = movement(centre).norms(), movement(band[0])
        for step in band[1:]:
            unknown.add(movement(step))
        first, influence = unknown.norms(), guides.influence()

        def added(further: tuple[Floats, Floats] | None) -> Floats:
            sizes = first if further is None else guides.with_platform(first, *further)
            return _through(influence, guides.remainder(known, sizes))

        return added

    def _geometry(self, block: Block) -> _Geometry:
        centres = self._kernel.joint_centres(block.joints, block.placements)
        base, platform = centres[:, :, 0], centres[:, :, 1]
        along = platform - base
        length = np.linalg.norm(along, axis=2)
        arm = platform - block.placements[:, np.newaxis, :3]
        unit = along / length[:, :, np.newaxis]
        arm_length = np.linalg.norm(arm, axis=2)
        slide = np.zeros((*length.shape, 3, 3))
        geometry = _Geometry(block, base, platform, arm, unit, length, arm_length, slide)
        for strut, columns in enumerate(self._ring_bases):
            for axis, column in enumerate(columns):
                _, of_platform, small = self._centres_moved(geometry, column)
                slide[:, strut, :, axis] = of_platform[:, strut] / small
        return geometry

    def _moved(self, geometry: _Geometry, column: int) -> tuple[Floats, Floats, float]:
        """Moves (n, n_closure, 3) of base and platform centres by a small step of one parameter.

        And that step, m or rad or 1: together a difference quotient. On a ring the platform-side
        joint is the ring's own point here, which does not slide: of what is seen, p = m + slide
        (a - m), the motion m, where a is that of the base joint.
        """
        of_base, of_platform, small = self._centres_moved(geometry, column)
        slide = geometry.slide
        if slide.any():
            carried = np.eye(3) + slide / (1.0 - geometry.slide_share)[:, :, np.newaxis, np.newaxis]
            seen = of_platform - np.einsum("nsij,nsj->nsi", slide, of_base)
            of_platform = np.einsum("nsij,nsj->nsi", carried, seen)
        return of_base, of_platform, small

    def _centres_moved(self, geometry: _Geometry, column: int) -> tuple[Floats, Floats, float]:
        """As `_moved`, of the joint centres as they are: a joint on a ring slides."""
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

    def _corrections(self, geometry: _Geometry, centre: Step) -> Floats:
        """(n, n_closure) how far, m, the joint correction moves a base joint, or the strut's end.

        It is that of the drive that carries the strut, absolute; of a crank's angle times its arm.
        """
        steps = np.zeros_like(geometry.length)
        if centre.joints is None:
            return steps
        for closure, joint in enumerate(self._joint_of):
            if joint >= 0:
                steps[:, closure] = np.abs(centre.joints[:, joint])
                if self._machine.drives[joint].coordinate == "angle":
                    steps[:, closure] *= self._crank_arm(geometry, closure, joint)
        return steps

    def _crank_arm(self, geometry: _Geometry, closure: int, joint: int) -> Floats:
        """(n,) distance, m, of a base joint from the axis of the crank that carries it."""
        drive = self._machine.drives[joint]
        names = [f"{drive.part}.origin.{axis}" for axis in "xyz"]
        origin = self._machine.nominal[[self._machine.parameters.index(name) for name in names]]
        axis = np.asarray(drive.fields["axis"], np.float64)
        arm = np.cross(axis, geometry.base[:, closure] - origin)
        return np.asarray(np.linalg.norm(arm, axis=1))

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
    length: Floats,
    arm: Floats,
    known: _Bounds,
    band: _Bounds,
    corrections: Floats,
    slide: Floats,
) -> Floats:
    """(n, n_closure) second-order remainder of each closure, m."""
    # Times |v|, so that a strut without a ring that a wide band shortens to nothing gives no 0 / 0.
    known_swing = known.across + known.turn_platform * length
    swing = band.across + band.turn_platform * length
    sliding = slide * (known_swing + 0.5 * swing) * swing
    return (
        (known.across + 0.5 * band.across) * band.across / length
        + known.turn_base * band.reach_base
        + band.turn_base * (known.reach_base + band.reach_base)
        + known.turn_platform * band.own_platform
        + band.turn_platform * (known.own_platform + band.own_platform)
        + (known.turn_platform + 0.5 * band.turn_platform) * band.turn_platform * arm
        + band.scale * corrections
        + np.divide(sliding, length, out=np.zeros_like(sliding), where=slide > 0.0)
    )
