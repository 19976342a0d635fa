"""A shape brought to points, by the minimum zone or by least squares, and exactly.

The linear problem is solved about where the shape stands, and again from where that takes it, until
it stays: at a minimum zone the points that touch it are as many as it has freedoms and one, so that
the steps converge quadratically (Newton's method on these), and with least squares linearly by the
points' deviation over their size (Gauss and Newton's).
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from truepose.arrays import Floats
from truepose.workpiece.fits.chebyshev import Reference, chebyshev, first_reference
from truepose.workpiece.fits.shapes import FittedShape

_MOST_STEPS = 40
_MOST_HALVINGS = 12
"""Of a step to a zone that is wider: where the narrowest one is touched by fewer points than it has
freedoms, as the shape's bend allows, whole steps would go to and fro."""

_STILL = 1e-13
"""A step below this part of the size of the points is the last."""

_ENOUGH = 1e-10
"""Share of a minimum zone that the linear problem promises by another step, and that is the last:
where a zone has many places, as between two walls alone, only its bend tells them apart."""

_LEVEL = 2e-15
"""Of the size of the points: the rounding of some coordinates, to which a level is exact."""

_SAMPLES = 500
"""Samples at once, so that what is computed on the way stays in the processor's memory."""

AnyShape = TypeVar("AnyShape", bound=FittedShape)


def associate(
    shape: AnyShape, points: Floats, *, least_squares: bool = False
) -> tuple[AnyShape, Floats]:
    """The shape where it fits best, and the residuals (s, n) of the points there, m.

    `points` (s, n, 3). A shape with an offset has it in all residuals: a circle's are radii, a
    plane's are along its normal, from the origin.
    """
    pieces = []
    residuals = np.empty(points.shape[:2])
    for first in range(0, len(points), _SAMPLES):
        some = slice(first, first + _SAMPLES)
        piece, residuals[some] = _associate(shape.of(some), points[some], least_squares)
        pieces.append(piece)
    return (shape.joined(pieces) if pieces else shape), residuals


def _associate(shape: AnyShape, points: Floats, least_squares: bool) -> tuple[AnyShape, Floats]:
    size = float(np.abs(points).max(initial=0.0)) or 1.0
    fitted = {name: getattr(shape, name).copy() for name in shape.places}
    residuals = np.empty(points.shape[:2])
    whole, left = shape, np.arange(len(points))
    reference: Reference | None = None
    columns, values = shape.linearised(points)
    for _ in range(_MOST_STEPS):
        freedoms = len(columns)
        middle = 0.5 * (values.max(axis=1) + values.min(axis=1))[:, np.newaxis]
        if shape.offset:
            columns = np.concatenate([columns, np.ones((1, *values.shape))])
            values = values - middle
        if least_squares:
            square = np.einsum("ksn,lsn->skl", columns, columns)
            right = np.einsum("ksn,sn->sk", columns, values)
            x = np.linalg.solve(square, right[..., np.newaxis])[:, :freedoms, 0]
            shape = shape.moved(x)
            columns, values = shape.linearised(points)
            settled = np.zeros(len(left), np.bool_)
        else:
            if reference is None:
                one = first_reference(columns[:, 0])
                reference = Reference(
                    np.repeat(one.index, len(values), 0), np.repeat(one.sign, len(values), 0)
                )
            x, reference = chebyshev(columns, values, reference, _LEVEL * size)
            x = x[:, :freedoms]
            width = _width(shape, values)
            promised = _width(shape, values - np.einsum("ksn,sk->sn", columns[:freedoms], x))
            settled = width - promised <= _ENOUGH * width + _LEVEL * size
            columns, values = _narrower(shape, points, x, width + _LEVEL * size)
            shape = shape.moved(x)
        settled |= np.abs(x).max(axis=1, initial=0.0) <= _STILL * size
        if settled.any():
            for name, place in fitted.items():
                place[left[settled]] = getattr(shape, name)[settled]
            residuals[left[settled]] = values[settled]
            on = np.flatnonzero(~settled)
            if not on.size:
                return whole.with_places(fitted), residuals
            left, shape, points = left[on], shape.of(on), points[on]
            columns, values = columns[:, on], values[on]
            reference = None if reference is None else reference.of(on)
    for name, place in fitted.items():
        place[left] = getattr(shape, name)
    residuals[left] = values
    return whole.with_places(fitted), residuals


def _narrower(
    shape: FittedShape, points: Floats, x: Floats, width: Floats
) -> tuple[Floats, Floats]:
    """The shape moved by x (s, k), linearised; steps to what is wider than `width` are halved."""
    columns, values = shape.moved(x).linearised(points)
    wider = np.flatnonzero(_width(shape, values) > width)
    for halving in range(_MOST_HALVINGS):
        if not wider.size:
            break
        x[wider] *= 0.5 if halving < _MOST_HALVINGS - 1 else 0.0
        columns[:, wider], values[wider] = shape.of(wider).moved(x[wider]).linearised(points[wider])
        wider = wider[_width(shape, values[wider]) > width[wider]]
    return columns, values


def _width(shape: FittedShape, values: Floats) -> Floats:
    """(s,) of the zone that residuals (s, n) need."""
    if shape.offset:
        return np.asarray(values.max(axis=1) - values.min(axis=1))
    return np.asarray(2.0 * np.abs(values).max(axis=1))
