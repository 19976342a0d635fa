"""Where an instrument must have stood: its frame, target and biases, fitted to what it read.

The machine stays nominal. A frame from points in space starts with the closed form of Kabsch
(1976), Acta Crystallographica A32:922-923; everything else, and what is only partly unknown, is
found by damped Gauss and Newton steps from where it is stated to be.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.calibration.data_checks.nominal import (
    DISTANCE,
    LENGTH,
    A,
    Geometry,
    Placement,
    X,
    read,
)
from truepose.calibration.instruments._base import Instrument
from truepose.calibration.observables import UNITS
from truepose.spatial import register, vector_to_matrix

ENOUGH = 2.0
"""Residuals, in what is allowed, below which no other start is tried."""

TILT = 0.2
"""rad by which a frame is tilted where a search did not lead anywhere."""

FAINT = 1e-5
"""Derivatives below this share of the largest count as zero: differences cannot resolve them."""

FLAT = 0.02
"""Points that reach this share of their width out of a plane count as in it."""

STEPS, SETTLED = 40, 1e-10
ROUGH_STEPS, ROUGH = 12, 1e-3
"""The most steps; and one that takes less than this share off the sum of squares is the last."""


@dataclass(frozen=True)
class Free:
    """What is fitted of an instrument: six of the frame, three of the target, its biases."""

    frame: tuple[bool, ...]
    target: bool
    bias: bool

    @classmethod
    def stated(cls, instrument: Instrument) -> Free:
        """What the measurements say is unknown of it."""
        return cls(
            tuple(instrument.frame.unknown), instrument.target_unknown, instrument.bias_unknown
        )


@dataclass(frozen=True, eq=False)
class Readings:
    """What one instrument read: (k,) each; `row` counts in the geometry it is compared with."""

    row: Indices
    observable: Indices
    strut: Indices
    value: Floats
    scale: Floats

    def kept(self, kept: Indices) -> Readings:
        """These observations only."""
        return Readings(
            self.row[kept],
            self.observable[kept],
            self.strut[kept],
            self.value[kept],
            self.scale[kept],
        )


def difference(observable: Indices, left: Floats, right: Floats) -> Floats:
    """(k,) left minus right; of angles, the nearest way round."""
    gap = left - right
    angular = _ANGULAR[observable]
    if angular.any():
        gap[angular] -= 2.0 * np.pi * np.round(gap[angular] / (2.0 * np.pi))
    return gap


_ANGULAR = np.array([unit == "rad" for unit in UNITS])


def fit_instrument(
    geometry: Geometry,
    instrument: Instrument,
    readings: Readings,
    free: Free,
    *,
    roughly: bool = False,
) -> tuple[Placement, Floats, int]:
    """(placement, residual (k,) read minus predicted, number of unknowns fitted), SI.

    `roughly`: only from the likeliest start, and no further than what a hypothesis needs, most of
    which are wrong anyway.
    """
    columns, which = np.unique(
        readings.observable * 100_000 + readings.strut + 1, return_inverse=True
    )
    n_bias = columns.size if free.bias else 0
    axes = np.flatnonzero(free.frame)
    count = axes.size + 3 * free.target + n_bias

    def placement_of(start: Placement, unknown: Floats) -> Placement:
        change = np.zeros(6)
        change[axes] = unknown[: axes.size]
        target = start.target
        if free.target:
            target = target + unknown[axes.size : axes.size + 3]
        return Placement(
            start.origin + change[:3], vector_to_matrix(change[3:]) @ start.rotation, target
        )

    def residual_of(start: Placement, unknown: Floats) -> Floats:
        predicted = read(
            geometry,
            instrument,
            placement_of(start, unknown),
            readings.row,
            readings.observable,
            readings.strut,
        )
        gap = difference(readings.observable, readings.value, predicted)
        return gap - unknown[count - n_bias :][which] if n_bias else gap

    starts = (
        list(_starts(geometry, instrument, readings, free))
        if count
        else [Placement.stated(instrument)]
    )
    if roughly and len(starts) > 1:
        none = np.zeros(count)
        starts = [
            min(starts, key=lambda s: float(np.linalg.norm(residual_of(s, none) / readings.scale)))
        ]
    steps, settled = (ROUGH_STEPS, ROUGH) if roughly else (STEPS, SETTLED)
    best: tuple[float, Placement, Floats] | None = None
    for start in starts:
        over = partial(_over, residual_of, start, readings.scale)
        unknown = _least_squares(over, count, steps, settled)
        residual = residual_of(start, unknown)
        size = float(np.mean((residual / readings.scale) ** 2))
        if best is None or size < best[0]:
            best = (size, placement_of(start, unknown), residual)
        if best[0] < ENOUGH**2:
            break
    assert best is not None
    return best[1], best[2], count


def _over(
    residual_of: Callable[[Placement, Floats], Floats],
    start: Placement,
    scale: Floats,
    unknown: Floats,
) -> Floats:
    quotients: Floats = residual_of(start, unknown) / scale
    return quotients


def _starts(
    geometry: Geometry, instrument: Instrument, readings: Readings, free: Free
) -> Iterator[Placement]:
    """Where to search from, the likeliest first; the next only where that one leads nowhere."""
    first = _start(geometry, instrument, readings, free)
    yield first
    if any(free.frame[:3]) and (readings.observable == DISTANCE).any():
        for origin in _trilaterated(geometry, first, readings):
            yield Placement(
                np.where(free.frame[:3], origin, first.origin), first.rotation, first.target
            )
    axes = np.flatnonzero(free.frame[3:])
    if axes.size and (readings.observable >= LENGTH).any():
        # Seen along an axis, a tilt changes nothing to first order: a search may stand still there.
        for axis in axes:
            for angle in (-TILT, TILT):
                tilt = vector_to_matrix(angle * np.eye(3)[axis])
                yield Placement(first.origin, tilt @ first.rotation, first.target)


def _trilaterated(geometry: Geometry, placement: Placement, readings: Readings) -> Iterator[Floats]:
    """Points (3,) with given distances to the target's: d^2 - P^2 = o^2 - 2 P.o, linear in o, o^2.

    And the mirror image behind the plane in which the points most nearly lie.
    """
    of_distance = readings.observable == DISTANCE
    points = (geometry.points + geometry.rotations @ placement.target)[readings.row[of_distance]]
    middle = points.mean(axis=0)
    points = points - middle
    right = readings.value[of_distance] ** 2 - (points**2).sum(axis=1)
    mean = right.mean()
    _, size, axes = np.linalg.svd(points)
    thin = size[-1] < FLAT * size[0] or size.size < 3
    known = axes[:2] if thin else axes
    along = np.linalg.lstsq(-2.0 * points @ known.T, right - mean, rcond=None)[0]
    origin = along @ known
    if thin:
        height = max(mean - float(origin @ origin), 0.0) ** 0.5
        for sign in (-1.0, 1.0):
            yield middle + origin + sign * height * axes[2]
    else:
        yield middle + origin
        yield middle + origin - 2.0 * (origin @ axes[2]) * axes[2]


def _start(geometry: Geometry, instrument: Instrument, readings: Readings, free: Free) -> Placement:
    """The stated frame, or, where enough of it is unknown, the closed form's."""
    stated = Placement.stated(instrument)
    axes = [axis for axis in range(3) if (readings.observable == X + axis).any()]
    origin_free, rotation_free = free.frame[:3], free.frame[3:]
    spatial = len(axes) == 3 and all(rotation_free)
    planar = len(axes) == 2 and rotation_free[3 - sum(axes)] and sum(rotation_free) == 1
    if not (spatial or planar) or not all(origin_free[axis] for axis in axes):
        return stated
    table = np.full((geometry.points.shape[0], 3), np.nan)
    of_point = readings.observable < A
    table[readings.row[of_point], readings.observable[of_point]] = readings.value[of_point]
    full = np.flatnonzero(np.isfinite(table[:, axes]).all(axis=1))
    if full.size < len(axes):
        return stated
    points = (geometry.points + geometry.rotations @ stated.target)[full][:, axes]
    seen = table[full][:, axes]
    rotation, origin = np.eye(3), stated.origin.copy()
    rotation[np.ix_(axes, axes)], origin[axes] = register(points, seen)
    return Placement(origin, rotation, stated.target)


def _least_squares(
    function: Callable[[Floats], Floats], count: int, steps: int, settled: float
) -> Floats:
    """(count,) that minimise the sum of squares, from zero; Levenberg's damping."""
    unknown = np.zeros(count)
    if not count:
        return unknown
    value = function(unknown)
    cost, damping = float(value @ value), 1e-9
    for _ in range(steps):
        jacobian = np.empty((value.size, count))
        for k in range(count):
            # Readings are lengths and angles of a machine of metres: 1e-7 of either.
            step = np.zeros(count)
            step[k] = 1e-7
            jacobian[:, k] = (function(unknown + step) - value) / 1e-7
        size = np.linalg.norm(jacobian, axis=0)
        # What changes nothing to first order must not be made large by its own scale.
        size = np.maximum(size, max(FAINT * float(size.max()), np.finfo(float).tiny))
        scaled, gained = jacobian / size, 0.0
        for _ in range(12):
            rows = np.vstack([scaled, np.sqrt(damping) * np.eye(count)])
            right = np.concatenate([-value, np.zeros(count)])
            tried = unknown + np.linalg.lstsq(rows, right, rcond=None)[0] / size
            other = function(tried)
            if (less := float(other @ other)) <= cost:
                gained, damping = cost - less, max(damping / 10.0, 1e-12)
                unknown, value, cost = tried, other, less
                break
            damping *= 10.0
        if gained <= settled * cost:
            break
    return unknown
