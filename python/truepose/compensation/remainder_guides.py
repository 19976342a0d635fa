"""Remainder of guides: closures that a passive limb adds, each written as what must vanish.

With the displacement d of the tool point, the platform's turn r, and w what its own dimensions
move:

    plane       n . (B - O),        B = p + d + exp(r) (arm + w)
    line        y across - s y along,    y = exp(-r) (O - p - d) - arm - w
    universal   f . exp(r) g

n, f and g need not be unit vectors, nor need the line's direction c, of which s is the part across
over the part along: all vanish where the kernel's closures do, whatever lengths these have, and so
the tool moves alike. They tilt linearly in the variables. A line is seen from the platform; with
b = O - p and the motion y to first order, its part of second order is

    - r x (r x b) / 2 - r x (y + w) - s y along

as y stays across what a tilt makes of it. All products are told with their signs.

Where a guide belongs to a limb, its closures are e, what the limb gives way by, and not 0. That is
a length: it takes no part in products, but that the vectors above are not of unit length once they
tilt by t, by which e counts t^2 more at the most (of a line) or t^2 / 2.
"""

from __future__ import annotations

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.compensation import majorants
from truepose.compensation.motion import Motion, Names, Tilt
from truepose.compensation.remainder_closures import Closures, Products, turned_about
from truepose.compensation.remainder_struts import CLOSED, carried_about
from truepose.machine import Guide, Machine
from truepose.spatial import norm, skew, tangents

KINDS = ("plane", "line", "universal")
"""Kinds of guide that are known here."""


class Guides:
    """The guides of a machine."""

    def __init__(self, machine: Machine) -> None:
        self._guides = machine.guides
        self._names = Names(machine)
        self._tool = self._names.point("tool")
        self._length = machine.characteristic_length
        held = [self._held(guide) for guide in self._guides]
        self._columns = np.cumsum([0, *(guide.size for guide in held)])
        self.parameters = np.concatenate([np.empty(0, np.intp), *held])
        """Parameters whose sensitivities `closures` takes, (k,)."""

    @property
    def is_proven(self) -> bool:
        """Whether all guides are of kinds whose remainder is proven here."""
        return all(guide.kind in KINDS for guide in self._guides)

    def closures(self, motion: Motion, sensitivity: Floats) -> list[Closures]:
        """At the poses of a motion, from sensitivities (n, m, k) to `parameters`."""
        of = {"plane": self._plane, "line": self._line, "universal": self._universal}
        return [
            of[guide.kind](guide, motion, sensitivity[:, :, first:last])
            for guide, first, last in zip(
                self._guides, self._columns[:-1], self._columns[1:], strict=True
            )
        ]

    def _held(self, guide: Guide) -> Indices:
        """Parameters of the frame's side that can open the closure in every direction."""
        if guide.kind == "universal":
            return self._names.tilts(f"{guide.part}.base_axis")
        return self._names.point(f"{guide.part}.origin")

    def _tilt(self, guide: Guide, field: str, motion: Motion) -> tuple[Tilt, Floats]:
        """A direction in its own axes, and the forms (n or 1, 2, v) of its tilts."""
        tilts = self._names.tilts(f"{guide.part}.{field}")
        nominal = np.asarray(guide.fields[field], np.float64)
        return Tilt.of(motion, nominal, tilts), motion.forms(tilts)

    def _own(self, guide: Guide, motion: Motion) -> tuple[Floats, Floats]:
        """Arm (n, 3) of the platform's point, base axes, and forms (n or 1, 3, v) of w, its own."""
        point = self._names.point(f"{guide.part}.platform")
        arm = motion.arms(point[np.newaxis], self._tool)[:, 0]
        return arm, np.asarray(motion.forms(point) - motion.forms(self._tool))

    def _offsets(self, guide: Guide, motion: Motion, count: int) -> tuple[Floats, Floats]:
        """(n or 1, count) what its closures have given way by, m, and (n or 1, 1) at the most."""
        names = [f"{guide.part}.offset"]
        if count > 1:
            names = [f"{guide.part}.offset.{number + 1}" for number in range(count)]
        if not self._names.has(names[0]):
            return np.zeros((1, count)), np.zeros((1, 1))
        columns = np.array([self._names[name] for name in names], np.intp)
        values = motion.values(columns)
        return values, norm(np.abs(values) + motion.reach(motion.forms(columns)))[:, np.newaxis]

    def _plane(self, guide: Guide, motion: Motion, sensitivity: Floats) -> Closures:
        origin = self._names.point(f"{guide.part}.origin")
        tilt, tilts = self._tilt(guide, "normal", motion)
        normal = np.broadcast_to(tilt.axis, motion.position.shape)
        arm, own = self._own(guide, motion)
        base = np.broadcast_to(np.eye(3), (len(arm), 3, 3))
        rows = motion.of_platform(base, np.repeat(arm[:, np.newaxis], 3, axis=1))
        rows = rows + motion.rotation @ own - motion.forms(origin)
        given_way, give = self._offsets(guide, motion, 1)
        off = ((motion.position + arm - motion.values(origin)) * normal).sum(axis=1)
        off = off - given_way[:, 0]

        size, turn = norm(arm)[:, np.newaxis], norm(motion.turn_reach)[:, np.newaxis]
        moved = norm(motion.reach(own))[:, np.newaxis]
        relative, tilted = norm(motion.reach(rows))[:, np.newaxis], tilt.reach[:, np.newaxis]

        def rest(shift: Floats, further: Floats) -> Floats:
            whole, more = turn + further, relative + shift + further * size
            carried = majorants.turn_bent(whole) * size + majorants.turn(whole) * moved
            signed = 0.5 * whole**2 * size + whole * moved + tilted * more
            rest = carried + tilted * (more + carried) + 0.5 * give * tilted**2
            return np.asarray(np.maximum(rest - signed, 0.0))

        return Closures(
            -(sensitivity @ normal[:, :, np.newaxis]),
            _pairs(
                np.ones((len(arm), 1, 2)), tilts[:, np.newaxis], (tilt.tangents @ rows)[:, None]
            ),
            turned_about(arm, normal)[:, np.newaxis],
            carried_about(motion, own[:, np.newaxis], normal[:, np.newaxis]),
            rest,
            np.asarray(np.abs(off) <= CLOSED * (size[:, 0] + self._length)),
        )

    def _line(self, guide: Guide, motion: Motion, sensitivity: Floats) -> Closures:
        origin = self._names.point(f"{guide.part}.origin")
        tilt, tilts = self._tilt(guide, "axis", motion)
        axis = motion.rotation @ tilt.axis[:, :, np.newaxis]
        axis = axis[:, :, 0]
        ways = tilt.tangents @ np.swapaxes(motion.rotation, 1, 2)
        arm, own = self._own(guide, motion)
        seen = motion.values(origin) - motion.position
        along = ((seen - arm) * axis).sum(axis=1)
        given_way, give = self._offsets(guide, motion, 2)
        off = seen - arm - along[:, np.newaxis] * axis
        off = off - (given_way[:, np.newaxis] @ ways)[:, 0]
        across = tangents(axis)

        moves = motion.rotation @ own
        base = np.broadcast_to(np.eye(3), (len(arm), 3, 3))
        rows = motion.forms(origin) - moves
        rows = rows - motion.of_platform(base, np.repeat(seen[:, np.newaxis], 3, axis=1))
        slide = axis[:, np.newaxis] @ rows

        size, turn = norm(seen)[:, np.newaxis], norm(motion.turn_reach)[:, np.newaxis]
        tilted, askew = tilt.reach[:, np.newaxis], tilt.along[:, np.newaxis]
        slid = motion.reach(slide)
        point = norm(motion.reach(rows))[:, None] + turn * size + norm(motion.reach(own))[:, None]
        lever = np.abs(along)[:, np.newaxis]

        def rest(shift: Floats, further: Floats) -> Floats:
            whole, more = turn + further, slid + shift + further * size
            carried = majorants.turn_bent(whole) * size + majorants.turn(whole) * (point + shift)
            signed = 0.5 * whole**2 * size + whole * (point + shift) + more * tilted
            with np.errstate(divide="ignore"):
                skewed = np.where(askew * tilted < 1.0, tilted / (1.0 - askew * tilted), np.inf)
            rest = carried + (more + carried) * skewed + lever * askew * tilted * skewed
            rest = rest + give * tilted**2
            return np.repeat(np.maximum(rest - signed, 0.0), 2, axis=1)

        other = np.swapaxes(ways @ np.swapaxes(across, 1, 2), 1, 2) @ tilts
        both = np.broadcast_to(slide[:, np.newaxis], (len(arm), 2, 1, slide.shape[2]))
        return Closures(
            sensitivity @ np.swapaxes(across, 1, 2),
            _pairs(-np.ones((len(arm), 2, 1)), both, other[:, :, np.newaxis]),
            -turned_about(seen[:, np.newaxis], across),
            skew(across) @ (rows + moves)[:, np.newaxis],
            rest,
            np.asarray(norm(off) <= CLOSED * (size[:, 0] + self._length)),
        )

    def _universal(self, guide: Guide, motion: Motion, sensitivity: Floats) -> Closures:
        frame, of_frame = self._tilt(guide, "base_axis", motion)
        platform, of_platform = self._tilt(guide, "platform_axis", motion)
        on_frame = np.broadcast_to(frame.axis, motion.position.shape)
        on_platform = (motion.rotation @ platform.axis[:, :, np.newaxis])[:, :, 0]
        ways = platform.tangents @ np.swapaxes(motion.rotation, 1, 2)
        opened = (frame.tangents @ on_platform[:, :, np.newaxis])[:, :, 0]

        given_way, give = self._offsets(guide, motion, 1)
        turn = norm(motion.turn_reach)[:, np.newaxis]
        one, other = frame.reach[:, np.newaxis], platform.reach[:, np.newaxis]

        def rest(_: Floats, further: Floats) -> Floats:
            whole = turn + further
            swung = majorants.turn(whole)
            signed = 0.5 * whole**2 + whole * (one + other) + one * other
            rest = majorants.turn_bent(whole) + swung * other + one * (other + swung * (1 + other))
            rest = rest + 0.5 * give / self._length * (one**2 + other**2 + (one * other) ** 2)
            return np.asarray(np.maximum(rest - signed, 0.0))

        leans = np.swapaxes(ways, 1, 2) @ of_platform
        carried = skew(on_platform) @ (np.swapaxes(frame.tangents, 1, 2) @ of_frame)
        carried = carried - skew(on_frame) @ leans
        size = np.square(opened).sum(axis=1, keepdims=True)
        off = np.abs((on_frame * on_platform).sum(axis=1) - given_way[:, 0] / self._length)
        return Closures(
            sensitivity @ (opened / size)[:, :, np.newaxis],
            _pairs(
                np.ones((len(turn), 1, 2)), of_frame[:, None], (frame.tangents @ leans)[:, None]
            ),
            turned_about(on_platform, on_frame)[:, np.newaxis],
            carried[:, np.newaxis],
            rest,
            np.asarray(off <= CLOSED),
        )


def _pairs(coefficient: Floats, one: Floats, other: Floats) -> tuple[Products, ...]:
    """As products; none where one of the two does not move."""
    if not (one.any() and other.any()):
        return ()
    shape = (*coefficient.shape, one.shape[-1])
    return (Products(coefficient, np.broadcast_to(one, shape), np.broadcast_to(other, shape)),)
