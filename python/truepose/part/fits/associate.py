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
from truepose.part.fits.chebyshev import Reference, chebyshev, first_reference
from truepose.part.fits.shapes import FittedShape

_MOST_STEPS = 40
_MOST_HALVINGS = 12
"""Of a step to a zone that is wider: where the narrowest one is touched by fewer points than it has
freedoms, as the shape's bend allows, whole steps would go to and fro."""

_STILL = 1e-13
"""A step below this part of the size of the points is the last."""

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
        else:
            if reference is None:
                one = first_reference(columns[:, 0])
                reference = Reference(
                    np.repeat(one.index, len(values), 0), np.repeat(one.sign, len(values), 0)
                )
            x, reference = chebyshev(columns, values, reference, _LEVEL * size)
            x = x[:, :freedoms]
            width = _width(shape, values) + _LEVEL * size
            for _ in range(_MOST_HALVINGS):
                moved = shape.moved(x)
                columns, values = moved.linearised(points)
                wider = _width(shape, values) > width
                if not wider.any():
                    break
                x[wider] *= 0.5
            else:
                x[wider] = 0.0
                moved = shape.moved(x)
                columns, values = moved.linearised(points)
            shape = moved
        if np.abs(x).max(initial=0.0) <= _STILL * size:
            break
    return shape, values


def _width(shape: FittedShape, values: Floats) -> Floats:
    """(s,) of the zone that residuals (s, n) need."""
    if shape.offset:
        return np.asarray(values.max(axis=1) - values.min(axis=1))
    return np.asarray(2.0 * np.abs(values).max(axis=1))
