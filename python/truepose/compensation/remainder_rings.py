"""Remainder of struts whose platform-side joint slides on a ring (pentapods).

    F = sqrt(h^2 + (s - radius)^2) - L,    y = exp(-r) (A - p - d) - arm - w

where y goes from the ring's centre to the base-side joint as the platform sees it, h is its part
along the ring's axis and s the size of its part across. With b = A - p and y to first order split
along the axis, out from it, and round it, the part of second order is

    |across the strut|^2 / (2 l) + u_s round^2 / (2 s) + u . (- r x (r x b) / 2 - r x (y + w))

with the strut's direction u and its part u_s out from the axis: an arm's end that goes round gets
further out. All of it is told with its sign.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats
from truepose.compensation import majorants
from truepose.compensation.motion import Motion, Names
from truepose.compensation.remainder_closures import Closures, Products, turned_about
from truepose.compensation.remainder_struts import CLOSED, Bases
from truepose.machine import Machine
from truepose.spatial import cross, norm, skew


class Rings:
    """The struts of a machine whose platform-side joints slide on rings."""

    def __init__(self, machine: Machine, struts: Sequence[int]) -> None:
        self._bases = Bases(machine, struts)
        self._names = Names(machine)
        self._tool = self._names.point("tool")
        self._parts = [machine.struts[at].part for at in struts]
        axes = np.array([machine.struts[at].ring_axis for at in struts], np.float64).reshape(-1, 3)
        self._axes = axes / np.linalg.norm(axes, axis=1, keepdims=True)
        self.parameters = machine.kernel.length_parameters[list(struts)].astype(np.intp)
        """Parameters whose sensitivities `closures` takes, (k,)."""

    @property
    def is_proven(self) -> bool:
        """Whether the remainder of all that is there is proven here."""
        return self._bases.is_proven

    def closures(self, motion: Motion, sensitivity: Floats) -> list[Closures]:
        """At the poses of a motion, from sensitivities (n, m, k) to `parameters`."""
        return [
            self._closure(motion, at, sensitivity[:, :, at : at + 1])
            for at in range(len(self._parts))
        ]

    def _closure(self, motion: Motion, which: int, sensitivity: Floats) -> Closures:
        part, base = self._parts[which], self._bases.base(motion, which)
        ring, centre = self._names[f"{part}.ring_radius"], self._names.point(f"{part}.platform")
        stated, stretched = self._bases.length(motion, which)
        arm = motion.arms(centre[np.newaxis], self._tool)[:, 0]
        own = motion.forms(centre) - motion.forms(self._tool)
        seen = base.place - motion.position

        axis = motion.rotation @ self._axes[which]
        height = ((seen - arm) * axis).sum(axis=1)
        outward = seen - arm - height[:, np.newaxis] * axis
        radius = norm(outward)
        outward = outward / radius[:, np.newaxis]
        beyond = radius - motion.parameters[:, ring]
        length = np.hypot(height, beyond)
        up, out = (height / length)[:, np.newaxis], (beyond / length)[:, np.newaxis]
        unit = up * axis + out * outward

        axes = np.stack([axis, outward, cross(axis, outward)], axis=1)
        moves = motion.rotation @ own
        rows = -motion.of_platform(axes, np.repeat(seen[:, np.newaxis], 3, axis=1)) - axes @ moves
        for parameter, slope in base.slopes:
            if motion.of_parameter(parameter):
                motion.add(rows, parameter, (axes @ slope[:, :, np.newaxis])[:, :, 0])
        wider = motion.forms([ring])[:, 0]
        across = up * (rows[:, 1] - wider) - out * rows[:, 0]

        def column(values: Floats) -> Floats:
            return np.broadcast_to(values, len(seen))[:, np.newaxis]

        size, turn = column(norm(seen)), column(norm(motion.turn_reach))
        reach = motion.reach(rows)
        leant, along = column(motion.reach(across)), column(stretched)
        outer, inner = column(length), column(radius)
        about, off = column(reach[:, 2]), column(reach[:, 1])
        point = column(norm(reach)) + turn * size + column(norm(motion.reach(own)))
        bent = column(base.bent)

        def rest(shift: Floats, further: Floats) -> Floats:
            whole, more = turn + further, shift + further * size
            swung = majorants.turn(whole)
            carried = majorants.turn_bent(whole) * size + swung * (point + shift)
            carried = carried + (1.0 + swung) * bent
            all_ = more + carried
            round_ = majorants.length_bent(inner, about + all_, off + all_)
            rest = majorants.length_bent(outer, leant + all_ + round_, along + all_ + round_)
            signed = (leant + more) ** 2 / (2.0 * outer)
            signed = signed + np.abs(out) * (about + more) ** 2 / (2.0 * inner)
            signed = signed + 0.5 * whole**2 * size + whole * (point + shift)
            return np.asarray(np.maximum(rest + np.abs(out) * round_ + carried - signed, 0.0))

        moved = np.swapaxes(axes, 1, 2) @ rows + moves
        both = np.stack([across, rows[:, 2]], axis=1)[:, np.newaxis]
        coefficient = np.stack([0.5 / length, out[:, 0] / (2.0 * radius)], axis=1)[:, np.newaxis]
        return Closures(
            # A longer strut has a smaller residual.
            -sensitivity,
            (Products(coefficient, both, both),),
            -turned_about(seen, unit)[:, np.newaxis],
            (skew(unit) @ moved)[:, np.newaxis],
            rest,
            np.asarray(np.abs(length - stated) <= CLOSED * length),
        )
