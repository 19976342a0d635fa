"""Remainder of struts: two joint centres at a distance.

    F = |B - A| - L,    B = p + d + exp(r) (arm + w)

with the displacement d of the tool point, the turn r, and w what the platform's own dimensions
move. A moves as its drive says: on the frame by its own deviation alone; on a carriage to
`origin + base + s axis`, on a crank to `origin + Rot(axis, angle) base`, where the way s and the
angle are linear in the variables (the command does not change) and an axis that tilts stays a unit
vector. With v = B - A, u its direction, l its length, and the relative motion to first order

    delta = d + r x arm + w - (what A moves)

the part of second order is

    |delta across u|^2 / (2 l) + u . (r x (r x arm)) / 2 + u . (r x w) - (that of u . A)

That of an arm
by its angle t is `k x (k x base) t^2 / 2` with its axis k, and products with what moves its end; of
a carriage by tilts a of its axis k `- s |a|^2 k / 2`, and a times what s changes by. All that is
told with its sign. Along itself a strut moves by what its length deviates, to first order: its
closure says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.compensation import majorants
from truepose.compensation.motion import Motion, Names, Tilt
from truepose.compensation.remainder_closures import Closures, Products, turned_about
from truepose.machine import Machine
from truepose.machine.parts import Drive
from truepose.spatial import cross, norm, rotate_about, skew, tangents

CLOSED = 1e-8
"""By how much of its length a strut may miss where the machine stands: rounding, and no more."""

KINDS = ("slider", "crank", "telescopic")
"""Kinds of drive that are known here."""


_Second = tuple[Floats, Floats, Floats]
"""A vector (n, 3), and the two forms (n or 1, v + m) that it is multiplied by."""


@dataclass(frozen=True, eq=False)
class _Base:
    """The base-side joint of one strut: where it is, and what moves it beyond first order.

    `place` (n, 3), and of each parameter that moves it by how much it does, (n or 1, 3) per unit.
    `bent` (n,): the most of its motion that is not linear. Of that `second` are products of two
    forms (n or 1, v + m), each times a vector (n, 3), and `signed` (n,) is as much of `bent`.
    """

    place: Floats
    slopes: list[tuple[int, Floats]]
    bent: Floats
    second: list[_Second]
    signed: Floats


class Bases:
    """The base-side joints of a machine's struts, and their lengths."""

    def __init__(self, machine: Machine, struts: Sequence[int]) -> None:
        self._names = Names(machine)
        self._drives = {drive.name: (at, drive) for at, drive in enumerate(machine.drives)}
        self._struts = [machine.struts[at] for at in struts]
        self._lengths = [int(machine.kernel.length_parameters[at]) for at in struts]

    @property
    def is_proven(self) -> bool:
        """Whether all drives are of kinds that are proven here, and no carriage yields."""
        drives = [drive for _, drive in self._drives.values()]
        return all(drive.kind in KINDS and not drive.chain for drive in drives)

    def base(self, motion: Motion, which: int) -> _Base:
        """Of one of the struts."""
        strut = self._struts[which]
        point = self._names.point(f"{strut.part}.base")
        base = motion.values(point)
        drive = self._drives.get(strut.drive or "")
        zero = np.zeros(len(motion.position))
        if drive is None or drive[1].kind == "telescopic":
            slopes = [
                (int(at), axis[np.newaxis]) for at, axis in zip(point, np.eye(3), strict=True)
            ]
            return _Base(base, slopes, zero, [], zero)
        on = self._on_carriage if drive[1].kind == "slider" else self._on_crank
        return on(motion, *drive, point, base)

    def length(self, motion: Motion, which: int) -> tuple[Floats, Floats]:
        """(n or 1,) length of a strut, and the most that it deviates, linear in the variables."""
        parameter = self._lengths[which]
        drive = self._drives.get(self._struts[which].drive or "")
        if drive is None or drive[1].kind != "telescopic":
            form = motion.forms([parameter])[:, 0]
            return motion.parameters[:, parameter], motion.reach(form)
        joint = motion.joints[:, drive[0]]
        scale = self._names[f"{drive[1].part}.scale"]
        offset, ratio = motion.parameters[:, parameter], motion.parameters[:, scale]
        return offset + ratio * joint, motion.reach(self._way(motion, drive[0], drive[1]))

    def _way(self, motion: Motion, joint: int, drive: Drive) -> Floats:
        """(n or 1, v) form of scale q + offset."""
        offset, scale = (self._names[f"{drive.part}.{name}"] for name in ("offset", "scale"))
        form = motion.forms([offset, scale])
        if not form[:, 1].any():
            return form[:, 0]
        return np.asarray(form[:, 0] + motion.joints[:, joint, np.newaxis] * form[:, 1])

    def _driven(
        self, motion: Motion, joint: int, drive: Drive
    ) -> tuple[Floats, list[tuple[int, Floats]], Floats]:
        """Way or angle (n,), its parameters with their factors (n or 1, 1), and its reach (n,)."""
        offset, scale = (self._names[f"{drive.part}.{name}"] for name in ("offset", "scale"))
        q = motion.joints[:, joint]
        way = motion.parameters[:, offset] + motion.parameters[:, scale] * q
        factors = [(offset, np.ones((1, 1))), (scale, q[:, np.newaxis])]
        return way, factors, motion.reach(self._way(motion, joint, drive))

    def _tilt(self, motion: Motion, drive: Drive) -> tuple[Tilt, Indices]:
        tilts = self._names.tilts(f"{drive.part}.axis")
        return Tilt.of(motion, np.asarray(drive.fields["axis"], np.float64), tilts), tilts

    def _on_carriage(
        self, motion: Motion, joint: int, drive: Drive, point: Indices, base: Floats
    ) -> _Base:
        way, factors, reach = self._driven(motion, joint, drive)
        tilt, tilts = self._tilt(motion, drive)
        origin = self._names.point(f"{drive.part}.origin")
        place = motion.values(origin) + base + way[:, np.newaxis] * tilt.axis
        slopes = [(at, factor * tilt.axis) for at, factor in factors]
        slopes += [
            (int(at), way[:, np.newaxis] * tilt.slopes[:, number])
            for number, at in enumerate(tilts)
        ]
        for points in (point, origin):
            slopes += [
                (int(at), axis[np.newaxis]) for at, axis in zip(points, np.eye(3), strict=True)
            ]
        bent = np.abs(way) * majorants.unit_bent(tilt.reach, tilt.along)
        bent = bent + reach * majorants.unit(tilt.reach, tilt.along)
        moved, leant = self._way(motion, joint, drive), motion.forms(tilts)
        squared = -0.5 * (way * np.square(tilt.tangents[:, 0]).sum(axis=1))[:, np.newaxis]
        second = [(squared * tilt.axis, leant[:, axis], leant[:, axis]) for axis in (0, 1)]
        second += [(tilt.slopes[:, axis], moved, leant[:, axis]) for axis in (0, 1)]
        signed = 0.5 * np.abs(way) * tilt.reach**2 + reach * tilt.reach
        return _Base(place, slopes, bent, second, signed)

    def _on_crank(
        self, motion: Motion, joint: int, drive: Drive, point: Indices, base: Floats
    ) -> _Base:
        angle, factors, reach = self._driven(motion, joint, drive)
        tilt, tilts = self._tilt(motion, drive)
        origin = self._names.point(f"{drive.part}.origin")
        axis, sine, cosine = tilt.axis, np.sin(angle)[:, None], np.cos(angle)[:, None]

        arm = rotate_about(base, axis, angle[:, None])
        across = cross(axis, arm)
        slopes = [(at, factor * across) for at, factor in factors]
        for number, at in enumerate(tilts):
            change = tilt.slopes[:, number]
            axial = change * (axis * base).sum(axis=1, keepdims=True)
            axial = axial + axis * (change * base).sum(axis=1, keepdims=True)
            slopes.append((int(at), sine * cross(change, base) + (1.0 - cosine) * axial))
        form = self._way(motion, joint, drive)
        second: list[_Second] = [(0.5 * cross(axis, across), form, form)]
        for at, direction in zip(point, np.eye(3), strict=True):
            moved = rotate_about(direction, axis, angle[:, None])
            slopes.append((int(at), moved))
            second.append((cross(axis, moved), form, motion.forms([at])[:, 0]))
        for at, direction in zip(origin, np.eye(3), strict=True):
            slopes.append((int(at), direction[np.newaxis]))
        own = norm(motion.reach(motion.forms(point)))
        bent = majorants.turn_bent(reach) * norm(across) + majorants.turn(reach) * own
        signed = 0.5 * reach**2 * norm(across) + reach * own
        if tilt.reach.any():
            # Of what `_tilted_crank` says, with all that is added to angle, axis and base at once.
            size, lean = norm(base), tilt.reach
            turned_by, rise = np.abs(sine[:, 0]), 1.0 - cosine[:, 0]
            more, tilted = majorants.turn(reach), majorants.unit(lean, tilt.along)
            whole = (turned_by + 2.0 * rise + 3.0 * more) * tilted + (rise + more) * tilted**2
            bent = bent + whole * (size + own)
            bent = bent - (turned_by + 2.0 * rise) * (1.0 + tilt.along) * lean * size
            signed = signed + (turned_by + 2.0 * rise) * lean * (0.5 * lean * size + own)
            signed = signed + 3.0 * reach * lean * size + rise * lean**2 * size
            second += self._tilted_crank(motion, tilt, tilts, (form, point), (base, sine, cosine))
        place = motion.values(origin) + arm
        return _Base(place, slopes, bent, second, signed)

    @staticmethod
    def _tilted_crank(
        motion: Motion,
        tilt: Tilt,
        tilts: Indices,
        moving: tuple[Floats, Indices],
        stands: tuple[Floats, Floats, Floats],
    ) -> list[_Second]:
        """What is of second order by a crank's axis k that tilts by a, with base b at angle t.

        Of `sin t a x b + (1 - cos t) [a (k . b) + k (a . b) + a (a . b)]`, a itself beyond first
        order being `- |a|^2 k / 2`; `moving` the angle's form and the parameters of b, `stands` b
        and the sine and cosine of t.
        """
        (angle, point), (base, sine, cosine), axis = moving, stands, tilt.axis
        rise = 1.0 - cosine

        def dot(one: Floats, other: Floats) -> Floats:
            return np.asarray((one * other).sum(axis=1, keepdims=True))

        def raised(change: Floats, vector: Floats) -> Floats:
            return np.asarray(change * dot(axis, vector) + axis * dot(change, vector))

        leant = motion.forms(tilts)
        back = -0.5 * np.square(tilt.tangents[:, 0]).sum(axis=1)[:, np.newaxis]
        back = back * (sine * cross(axis, base) + 2.0 * rise * axis * dot(axis, base))
        products: list[_Second] = []
        for one in (0, 1):
            change, lean = tilt.slopes[:, one], leant[:, one]
            turned = cosine * cross(change, base) + sine * raised(change, base)
            products += [(turned, angle, lean), (back, lean, lean)]
            for other in (0, 1):
                along = rise * change * dot(tilt.slopes[:, other], base)
                products.append((along, lean, leant[:, other]))
            for at, direction in zip(point, np.eye(3)[:, np.newaxis], strict=True):
                vector = sine * cross(change, np.broadcast_to(direction, change.shape))
                vector = vector + rise * raised(change, direction)
                products.append((vector, lean, motion.forms([at])[:, 0]))
        return products


class Struts:
    """The struts of a machine whose platform-side joints stay where they are."""

    def __init__(self, machine: Machine, struts: Sequence[int]) -> None:
        self._struts = list(struts)
        self._bases = Bases(machine, struts)
        self._names = Names(machine)
        self._tool = self._names.point("tool")
        parts = [machine.struts[at].part for at in struts]
        self._platform = np.array([self._names.point(f"{part}.platform") for part in parts])
        self.parameters = machine.kernel.length_parameters[self._struts].astype(np.intp)
        """Parameters whose sensitivities `closures` takes, (k,)."""

    @property
    def is_proven(self) -> bool:
        """Whether the remainder of all that is there is proven here."""
        return self._bases.is_proven

    def closures(self, motion: Motion, sensitivity: Floats) -> list[Closures]:
        """At the poses of a motion, from sensitivities (n, m, k) to `parameters`."""
        n, count = len(motion.position), len(self._struts)
        bases = [self._bases.base(motion, at) for at in range(count)]
        lengths = [self._bases.length(motion, at) for at in range(count)]
        arm = motion.arms(self._platform, self._tool)
        base = np.stack([np.broadcast_to(joint.place, (n, 3)) for joint in bases], axis=1)
        v = motion.position[:, np.newaxis] + arm - base
        length = norm(v)
        unit = v / length[:, :, np.newaxis]
        stated = np.stack([np.broadcast_to(own, n) for own, _ in lengths], axis=1)
        along = np.stack([np.broadcast_to(own, n) for _, own in lengths], axis=1)

        rows = self._across(motion, unit, arm, bases)
        across = norm(motion.reach(rows))
        own = self._own(motion)
        moved = norm(motion.reach(own))
        bent = np.stack([np.broadcast_to(joint.bent, n) for joint in bases], axis=1)
        half = np.repeat(0.5 / length[:, :, np.newaxis], 2, axis=2)
        second = _second(motion, bases, unit)
        size, turn = norm(arm), norm(motion.turn_reach)[:, np.newaxis]
        told = np.stack([np.broadcast_to(joint.signed, n) for joint in bases], axis=1)

        def rest(shift: Floats, further: Floats) -> Floats:
            whole, more = turn + further, shift + further * size
            carried = majorants.turn_bent(whole) * size + majorants.turn(whole) * moved + bent
            rest = majorants.length_bent(length, across + more + carried, along + more + carried)
            signed = (across + more) ** 2 * half[:, :, 0]
            signed = signed + 0.5 * whole**2 * size + whole * moved + told
            return np.asarray(np.maximum(rest + carried - signed, 0.0))

        closures = Closures(
            # A longer strut has a smaller residual.
            -sensitivity,
            (Products(half, rows, rows), *second),
            turned_about(arm, unit),
            carried_about(motion, own, unit) if own.any() else None,
            rest,
            np.asarray((np.abs(length - stated) <= CLOSED * length).all(axis=1)),
        )
        return [closures]

    def _across(self, motion: Motion, unit: Floats, arm: Floats, bases: list[_Base]) -> Floats:
        """(n, s, 2, v) forms of the relative motion across each strut."""
        n, count = unit.shape[:2]
        frame = tangents(unit)  # (n, s, 2, 3)
        flat = frame.reshape(n, 2 * count, 3)
        rows = motion.of_platform(flat, np.repeat(arm, 2, axis=1))
        own = (flat @ motion.rotation).reshape(n, count, 2, 3)
        for at in range(count):
            mine = rows[:, 2 * at : 2 * at + 2]
            for parameter, slope in bases[at].slopes:
                if motion.of_parameter(parameter):
                    motion.add(mine, parameter, -(frame[:, at] @ slope[:, :, np.newaxis])[:, :, 0])
            for axis, parameter in enumerate(self._platform[at]):
                motion.add(mine, int(parameter), own[:, at, :, axis])
        for axis, parameter in enumerate(self._tool):
            motion.add(rows, int(parameter), -own[:, :, :, axis].reshape(n, -1))
        return rows.reshape(n, count, 2, -1)

    def _own(self, motion: Motion) -> Floats:
        """(n or 1, s, 3, v) w, what the platform's own dimensions move each joint, its axes."""
        forms = motion.forms(self._platform.ravel())
        forms = forms.reshape(len(motion.half_width), len(self._struts), 3, -1)
        return np.asarray(forms - motion.forms(self._tool)[:, np.newaxis])


def carried_about(motion: Motion, own: Floats, along: Floats) -> Floats:
    """(n, c, 3, v) Q of `along . (r x w) = r . Q t`.

    Of forms w (n or 1, c, 3, v) in the platform's axes.
    """
    rows: Floats = -(skew(along) @ motion.rotation[:, np.newaxis]) @ own
    return rows


def _second(motion: Motion, bases: list[_Base], unit: Floats) -> list[Products]:
    """What the base-side joints move along their struts in second order, as far as it is told."""
    moving = [
        [(vector, one, other) for vector, one, other in base.second if one.any() and other.any()]
        for base in bases
    ]
    count = max(map(len, moving))
    if not count:
        return []
    shape = (*unit.shape[:2], count)
    coefficient = np.zeros(shape)
    forms = [np.zeros((*shape, motion.effects.shape[2])) for _ in range(2)]
    for at, products in enumerate(moving):
        for number, (vector, *pair) in enumerate(products):
            coefficient[:, at, number] = -(vector * unit[:, at]).sum(axis=1)
            for form, given in zip(forms, pair, strict=True):
                form[:, at, number] = given
    return [Products(coefficient, *forms)]
