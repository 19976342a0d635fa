"""Second-order remainder of guides, for the second-order term of the compensation law.

Taylor's series of a guide's closure, as `second_order.py` has it of a strut's: a known step c and
a band of unknown steps, whose movements add. With `half(x) = (x_c + x / 2) x` and
`mixed(x, y) = x_c y + x y_c + x y` of movements x, y by the band and x_c, y_c by the known step:

    plane       half(turn) |arm| + mixed(turn, own) + mixed(tilt_frame, relative)
    line        half(turn) |arm| + mixed(turn, shift) + mixed(tilt_platform, relative)
    universal   half(turn) + mixed(turn, tilt_frame) + mixed(turn, tilt_platform)
                + mixed(tilt_frame, tilt_platform)

`turn` is the platform's; `arm` what it carries, from the tool point to the platform's point of a
plane, to the frame's point of a line (seen from the platform, it is that point which turns). `own`
is the motion of the platform's point in the platform, `shift` that of the tool point against the
frame's point, `relative` all motion of one point against the other. A unit vector that tilts moves,
to second order, along itself, where no closure sees it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from truepose.machine import Guide, Machine
from truepose.sources import Block
from truepose.sources._base import Floats, Indices

FRAME_POINT, PLATFORM_POINT = "origin", "platform"
FRAME_DIRECTIONS = ("normal", "base_axis")
PLATFORM_DIRECTIONS = ("axis", "platform_axis")


@dataclass(frozen=True)
class PlatformStep:
    """What a step does to the platform: displacement and rotation vector, (n, 1, 3) each."""

    shift: Floats
    turn: Floats


@dataclass
class Movement:
    """Bounds of what steps do to the guides: absolute components (n or 1, n_guide or 1, 2 or 3).

    m and rad. Steps of unknown sign add component by component.
    """

    turn: Floats
    own: Floats
    shift: Floats
    relative: Floats
    tilt_frame: Floats
    tilt_platform: Floats

    def add(self, other: Movement) -> None:
        """Another step, of any sign."""
        for each in fields(self):
            setattr(self, each.name, getattr(self, each.name) + getattr(other, each.name))

    def norms(self) -> Sizes:
        """Of each movement."""
        return Sizes(*(np.linalg.norm(getattr(self, each.name), axis=2) for each in fields(self)))


@dataclass(frozen=True)
class Sizes:
    """Norms of a movement: (n or 1, n_guide or 1), m and rad."""

    turn: Floats
    own: Floats
    shift: Floats
    relative: Floats
    tilt_frame: Floats
    tilt_platform: Floats


def _half(known: Floats, band: Floats) -> Floats:
    return (known + 0.5 * band) * band


def _mixed(known: Sizes, band: Sizes, one: str, other: str) -> Floats:
    x, y = getattr(band, one), getattr(band, other)
    product: Floats = getattr(known, one) * y + x * getattr(known, other) + x * y
    return product


def _plane(known: Sizes, band: Sizes, arm: Floats) -> Floats:
    return (
        _half(known.turn, band.turn) * arm
        + _mixed(known, band, "turn", "own")
        + _mixed(known, band, "tilt_frame", "relative")
    )


def _line(known: Sizes, band: Sizes, arm: Floats) -> Floats:
    return (
        _half(known.turn, band.turn) * arm
        + _mixed(known, band, "turn", "shift")
        + _mixed(known, band, "tilt_platform", "relative")
    )


def _universal(known: Sizes, band: Sizes, arm: Floats) -> Floats:
    return (
        _half(known.turn, band.turn)
        + _mixed(known, band, "turn", "tilt_frame")
        + _mixed(known, band, "turn", "tilt_platform")
        + _mixed(known, band, "tilt_frame", "tilt_platform")
    )


REMAINDERS: dict[str, Callable[[Sizes, Sizes, Floats], Floats]] = {
    "plane": _plane,
    "line": _line,
    "universal": _universal,
}


class Guides:
    """The guides of a machine that has some, at the nominal poses of one block."""

    def __init__(self, machine: Machine, block: Block) -> None:
        self._machine, self._block = machine, block
        self._index = {guide.part: at for at, guide in enumerate(machine.guides)}
        self._arm = np.stack([self._lever(guide) for guide in machine.guides], axis=1)

    def influence(self) -> Floats:
        """(n, n_component, n_guide) most that a residual of 1 m (universal: 1 rad) moves the tool.

        By the place where a guide is held: a unit vector of it opens the closure, or the two
        closures of a line, by a unit vector.
        """
        found = []
        for guide in self._machine.guides:
            held = FRAME_POINT if FRAME_POINT in guide.fields else "base_axis"
            columns = [
                at
                for at, name in enumerate(self._machine.parameters)
                if name.startswith(f"{guide.part}.{held}.")
            ]
            sensitivity, _ = self._machine.kernel.sensitivity_at(
                self._block.joints, self._block.placements, columns
            )
            found.append(np.linalg.norm(sensitivity, axis=2))
        return np.stack(found, axis=2)

    def movement(self, columns: Indices, values: Floats, platform: PlatformStep) -> Movement:
        """Of one step: deviations `values` (n or 1, k) of parameters, and of the platform."""
        count = len(self._machine.guides)
        frame, own = (np.zeros((len(values), count, 3)) for _ in range(2))
        tilt_frame, tilt_platform = (np.zeros((len(values), count, 2)) for _ in range(2))
        for at, column in enumerate(columns.tolist()):
            name, value = self._machine.parameters[column], values[:, at]
            if name.startswith("tool."):
                own[:, :, "xyz".index(name[-1])] -= value[:, np.newaxis]
                continue
            *part, field, axis = name.split(".")
            guide = self._index.get(".".join(part))
            if guide is None:
                continue
            if field in FRAME_DIRECTIONS:
                tilt_frame[:, guide, "uv".index(axis)] += value
            elif field in PLATFORM_DIRECTIONS:
                tilt_platform[:, guide, "uv".index(axis)] += value
            else:
                moved = frame if field == FRAME_POINT else own
                moved[:, guide, "xyz".index(axis)] += value
        turned = np.einsum(
            "nij,ngj->ngi",
            self._block.rotations,
            np.broadcast_to(own, (len(self._block.placements), count, 3)),
        )
        shift = platform.shift - frame
        relative = shift + np.cross(platform.turn, self._arm) + turned
        parts = (platform.turn, turned, shift, relative, tilt_frame, tilt_platform)
        return Movement(*(np.abs(part) for part in parts))

    def with_platform(self, sizes: Sizes, shift: Floats, turn: Floats) -> Sizes:
        """The same with the platform moved by `shift` and `turn` (n, 1) as well."""
        reach = np.linalg.norm(self._arm, axis=2)
        return Sizes(
            sizes.turn + turn,
            sizes.own,
            sizes.shift + shift,
            sizes.relative + shift + turn * reach,
            sizes.tilt_frame,
            sizes.tilt_platform,
        )

    def remainder(self, known: Sizes, band: Sizes) -> Floats:
        """(n, n_guide) second-order remainder, m (universal: rad)."""
        guides = self._machine.guides
        reach = np.linalg.norm(self._arm, axis=2)
        return np.stack(
            [REMAINDERS[g.kind](known, band, reach)[:, at] for at, g in enumerate(guides)], axis=1
        )

    def _lever(self, guide: Guide) -> Floats:
        """(n, 3) what the platform's turn carries, from the tool point, base axes, m."""
        nominal = dict(zip(self._machine.parameters, self._machine.nominal, strict=True))

        def point(part: str) -> Floats:
            return np.array([nominal.get(f"{part}.{axis}", 0.0) for axis in "xyz"])

        if guide.kind == "line":
            return point(f"{guide.part}.{FRAME_POINT}") - self._block.placements[:, :3]
        arm = point(f"{guide.part}.{PLATFORM_POINT}") - point("tool")
        return np.asarray(self._block.rotations @ arm)
