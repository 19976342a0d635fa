"""What errors do along a path, a second time: from docs/sources and docs/variation.md alone.

Of s machines at n points of a path; coordinates q (n,) of one drive in the order of the path, m or
rad. All give what is added to the drive's offset, (s, n) or broadcasting to it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def ripple(q: Floats, amplitude: float, period: float, turns: Floats) -> Floats:
    """A sine along the travel, `turns` (s, 1) of it gone by at coordinate 0."""
    return np.asarray(amplitude * np.sin(2.0 * np.pi * (q / period + turns)))


def rounding(q: Floats, step: float, origin: Floats) -> Floats:
    """The coordinate on a grid, less the coordinate; `origin` (s, 1) in steps."""
    line = np.floor(q / step - origin + 0.5) + origin
    return np.asarray(line * step - q)


def scale_error(q: Floats, ratio: Floats | float, zero_at: float = 0.0) -> Floats:
    """True travel per measured travel, less one: (s, 1); right at `zero_at`."""
    return np.asarray(ratio * (q - zero_at))


def direction(q: Floats, still: float = 1e-12) -> NDArray[np.int64]:
    """(n,) +1 or -1 as the drive last moved on the way into each point; 0 until it first has."""
    found, last = np.zeros(len(q), np.int64), 0
    for at in range(1, len(q)):
        step = q[at] - q[at - 1]
        if abs(step) > still:
            last = 1 if step > 0.0 else -1
        found[at] = last
    return found


def play(q: Floats, width: float, unknown: Floats) -> Floats:
    """The carriage lags behind by half the play; where it has no way yet `unknown` (s, 1), +-1.

    In between it is anywhere of [-1, 1].
    """
    way = direction(q)
    return np.asarray(np.where(way == 0, unknown, -way) * 0.5 * width)


def table(
    q: Floats,
    targets: Floats,
    ahead: tuple[Floats, Floats],
    back: tuple[Floats, Floats],
    which: Floats,
    draws: Floats,
) -> Floats:
    """Of a measured table: mean and spread (targets,) of runs in either direction.

    `which` (s, 1), -1 or +1: the side of the reversal where the drive has no way yet; `draws`
    (s, n): standard normal, of each visit.
    """
    way = direction(q)
    mean = [np.interp(q, targets, one[0]) for one in (ahead, back)]
    spread = [np.interp(q, targets, one[1]) for one in (ahead, back)]
    known = np.where(way > 0, mean[0], mean[1])
    unknown = 0.5 * (mean[0] + mean[1]) + which * 0.5 * np.abs(mean[0] - mean[1])
    sigma = np.where(
        way > 0, spread[0], np.where(way < 0, spread[1], np.maximum(spread[0], spread[1]))
    )
    return np.asarray(np.where(way == 0, unknown, known) + sigma * draws)


def directions(random: np.random.Generator, count: int) -> Floats:
    """(count, 3) unit vectors, any as likely as another."""
    vectors = random.normal(size=(count, 3))
    return np.asarray(vectors / np.sqrt((vectors**2).sum(axis=1, keepdims=True)))
