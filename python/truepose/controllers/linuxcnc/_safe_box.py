"""A box of poses that the machine can be sent to, found and verified on a dense grid.

LinuxCNC plans along straight lines and arcs of the tool and limits each of its axes by itself, so
that what it knows of the workspace is a box. It does not ask whether a joint reaches on the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truepose.arrays import Flags, Floats
from truepose.controllers._export import unsupported_machine
from truepose.controllers.linuxcnc._description import HELD, Description, status_ok
from truepose.machine.workspace import GridAxis, grid

COUNTS = {1: 1001, 2: 151, 3: 25, 4: 11, 5: 7, 6: 7}
"""Poses along an axis of the dense grid, by the number of axes: 10^4 to 10^5 poses in all."""

NEAR_SINGULAR = 0.05
"""Share of the conditioning at home below which a pose counts as near a singularity."""

BACK = 1e-9
"""Characteristic lengths, or rad, within which the forward solution from home has to come back."""

ROUNDS = 30
"""Cuts, each verified on a new grid, after which the search is given up."""


@dataclass(frozen=True)
class Box:
    """`low`, `high` (n_commanded,), m and rad; `asked`: whether it is the workspace uncut.

    `checked`: poses that were verified. `conditioning`: at home; `least`: in the box.
    """

    low: Floats
    high: Floats
    asked: bool
    checked: int
    conditioning: float
    least: float


def safe_box(description: Description, clamp: float) -> Box:
    """The box of the file's workspace, cut towards home until every pose of it is sound.

    A pose is sound where its joints are within travel by the compensation at `clamp` (m at the end
    of a joint's arm), its conditioning is at least `NEAR_SINGULAR` of home's, and the forward
    solution from home comes back to it. Raises `RequestError`: no-workspace, controller-cannot
    where home itself is not sound.
    """
    judge = _Judge(description, clamp)
    home = description.commanded_home
    judge.require_home(home)
    low, high = _asked(description)
    checked, asked = 0, True
    for _ in range(ROUNDS):
        axes = _axes(description, low, high)
        poses = grid(axes)
        shape = tuple(axis.count for axis in axes)
        sound, conditioning = judge(poses)
        checked += len(poses)
        if sound.all():
            return Box(low, high, asked, checked, judge.home, float(conditioning.min()))
        asked = False
        low, high = _cut(axes, sound.reshape(shape, order="F"), home)
    raise unsupported_machine(
        "linuxcnc",
        description.machine,
        "no box of the workspace about home that the machine can be sent to everywhere",
        "poses within travel and off singularities about home",
        "move home or the workspace, or leave more travel for the compensation",
    )


def _asked(description: Description) -> tuple[Floats, Floats]:
    """Ends of the workspace, home included, and a little room along axes that are held."""
    low, high = description.reach
    room = HELD * description.pose_units
    held, centre = description.held, 0.5 * (low + high)
    return np.where(held, centre - room, low), np.where(held, centre + room, high)


def _axes(description: Description, low: Floats, high: Floats) -> tuple[GridAxis, ...]:
    wide = high - low > 2.5 * HELD * description.pose_units
    count = COUNTS[max(int(wide.sum()), 1)]
    return tuple(
        GridAxis(name, float(a), float(b), count if spread else 2)
        for name, a, b, spread in zip(description.machine.commanded, low, high, wide, strict=True)
    )


class _Judge:
    """Says of poses whether they are sound, and how well conditioned."""

    def __init__(self, description: Description, clamp: float) -> None:
        self._machine = description.machine
        self._description = description
        self._margin = clamp / description.arms
        home = description.commanded_home[np.newaxis]
        self.home = float(self._machine.conditioning(home, status=True)[0][0])
        self._columns = [self._machine.dof.index(name) for name in self._machine.commanded]

    def require_home(self, home: Floats) -> None:
        """Raises `RequestError` (controller-cannot)."""
        if self(home[np.newaxis])[0][0]:
            return
        raise unsupported_machine(
            "linuxcnc",
            self._machine,
            "a home pose that cannot be used, or not with the compensation at its clamp",
            "a home within travel, off singularities",
            "give [workspace] home, or leave more travel for the compensation",
        )

    def __call__(self, poses: Floats) -> tuple[Flags, Floats]:
        """(n,) sound, and conditioning (n,), 0 where there is none."""
        machine = self._machine
        joints, status = machine.inverse(poses, status=True)
        sound = status_ok(status)
        low, high = self._description.travels.T
        with np.errstate(invalid="ignore"):
            inside = (joints - self._margin >= low) & (joints + self._margin <= high)
        sound &= inside.all(axis=1)
        conditioning = np.zeros(len(poses))
        there, status = machine.conditioning(poses[sound], status=True)
        conditioning[sound] = np.where(status_ok(status), there, 0.0)
        sound &= conditioning >= NEAR_SINGULAR * self.home
        back, status = machine.forward(joints[sound], status=True)
        unit = np.where(np.array(self._description.freedoms) < 3, machine.characteristic_length, 1)
        gap = np.abs(back[:, self._columns] - poses[sound]) / unit
        sound[sound] = status_ok(status) & (gap.max(axis=1, initial=0.0) <= BACK)
        return sound, np.where(sound, conditioning, np.inf)


def _cut(axes: tuple[GridAxis, ...], sound: Flags, home: Floats) -> tuple[Floats, Floats]:
    """The ends of a smaller box without the poses that are not sound, home still inside.

    Face by face, each time the one with the largest share of such poses; of equals the one
    farther from home.
    """
    values = [np.linspace(axis.start, axis.stop, axis.count) for axis in axes]
    first = [0] * len(axes)
    last = [axis.count - 1 for axis in axes]
    while True:
        inner = sound[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))]
        if inner.all():
            break
        best: tuple[float, float, int, bool] | None = None
        for k, axis in enumerate(axes):
            span = max(axis.stop - axis.start, np.finfo(float).tiny)
            for upper in (False, True):
                at = last[k] if upper else first[k]
                inward = at - 1 if upper else at + 1
                if not 0 <= inward < axis.count:
                    continue
                if values[k][inward] < home[k] if upper else values[k][inward] > home[k]:
                    continue  # home would be left out
                face = np.take(inner, -1 if upper else 0, axis=k)
                rank = (float(np.mean(~face)), abs(values[k][at] - home[k]) / span, k, upper)
                best = rank if best is None or rank > best else best
        if best is None:
            break  # nothing but home's own cell: the next grid is finer
        _, _, k, upper = best
        if upper:
            last[k] -= 1
        else:
            first[k] += 1
    low = np.array([v[a] for v, a in zip(values, first, strict=True)])
    high = np.array([v[b] for v, b in zip(values, last, strict=True)])
    return low, high
