"""Derivatives of a plain function, to as many digits as its values allow.

    complex step  df/dx = Im f(x + i h) / h, no difference and so no rounding
                  (Squire & Trapp 1998, SIAM Review 40, 110-112)
    differences   central, of ever shorter steps, extrapolated to none (Ridders 1982, Advances in
                  Engineering Software 4, 75-76)

The first needs a function that is analytic all along and takes complex numbers; one that takes an
absolute value, say, gives wrong ones without a word. So the second stands beside it, and counts
where they differ.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np

from truepose.arrays import Floats

Function = Callable[[np.ndarray], np.ndarray]
"""Outputs (s, m) at arguments (s, n), real or complex."""

FIRST = 0.125
"""First step of the differences, of an input's scale."""

HALVINGS = 10
"""Steps after the first, each half the one before."""

RELATIVE = 1e-3
"""Of the size of an input: its scale, where its half band is less."""

EPSILON = float(np.finfo(np.float64).eps)
"""Of a value: its rounding."""

COMPLEX = 1e-30
"""The complex step, of an input's scale."""

_AGREE = 1e-5
"""Of a slope: how far the two may differ besides what the differences themselves differ by."""


def steps(centre: Floats, half: Floats) -> Floats:
    """(n,) scale of each input, over which the function is looked at; 0 where it is exact.

    Not less than a thousandth of the input, or a difference would be its rounding.
    """
    scale: Floats = np.where(half > 0.0, np.maximum(half, RELATIVE * np.abs(centre)), 0.0)
    return scale


def slopes(function: Function, at: Floats, scale: Floats) -> Floats:
    """(m, n) derivatives at `at` (n,), inputs of no scale left out as 0."""
    moved = np.flatnonzero(scale)
    difference, doubt = _differences(function, at, scale, moved)
    slope = difference
    exact = _complex_step(function, at, scale, moved)
    if exact is not None and exact.shape == difference.shape:
        size = np.maximum(np.abs(exact), np.abs(difference))
        with np.errstate(invalid="ignore"):
            agrees = np.abs(exact - difference) <= 10.0 * doubt + _AGREE * size
        # A function without a finite neighbourhood has the complex step only.
        slope = np.where(agrees | ~np.isfinite(difference), exact, difference)
    result = np.zeros((slope.shape[0], at.size))
    result[:, moved] = slope
    return result


def _complex_step(
    function: Function, at: Floats, scale: Floats, moved: np.ndarray
) -> Floats | None:
    """(m, k); None where the function does not take complex numbers."""
    arguments = np.tile(at.astype(np.complex128), (moved.size, 1))
    step = COMPLEX * scale[moved]
    arguments[np.arange(moved.size), moved] += 1j * step
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            # numpy warns where it drops an imaginary part: no slope then.
            warnings.simplefilter("error", np.exceptions.ComplexWarning)
            values = function(arguments)
    except (
        Exception
    ):  # what a function says to numbers that it was not made for is its own business
        return None
    if not np.iscomplexobj(values):
        return None
    slope: Floats = values.imag.T / step
    return slope if np.isfinite(slope).all() else None


def _differences(
    function: Function, at: Floats, scale: Floats, moved: np.ndarray
) -> tuple[Floats, Floats]:
    """(m, k) extrapolated central differences, and by how much they may be wrong."""
    levels = HALVINGS + 1
    step = FIRST * scale[moved] * 0.5 ** np.arange(levels)[:, np.newaxis]
    arguments = np.tile(at, (2, levels, moved.size, 1))
    place = np.arange(moved.size)
    arguments[0, :, place, moved] += step.T
    arguments[1, :, place, moved] -= step.T
    # The steps as the arguments really have them, rounded.
    apart = (arguments[0, :, place, moved] - arguments[1, :, place, moved]).T
    with np.errstate(all="ignore"):
        values = np.asarray(function(arguments.reshape(-1, at.size)), np.float64)
        values = values.reshape(2, levels, moved.size, -1)
        row = (values[0] - values[1]) / apart[:, :, np.newaxis]
        rounding = EPSILON * np.abs(values).max(axis=0) / apart[:, :, np.newaxis]
        return _extrapolated(row, rounding)


def _extrapolated(row: Floats, rounding: Floats) -> tuple[Floats, Floats]:
    """From differences (levels, k, m), each of half the step before: best (m, k), and its doubt.

    Neville's scheme; of all its entries the one that differs least from its two neighbours, the
    rounding of its shortest step added.
    """
    best = row[-1].copy()
    doubt = np.full(best.shape, np.inf)
    column = row
    power = 1.0
    for order in range(1, len(row)):
        power *= 4.0
        higher = (power * column[1:] - column[:-1]) / (power - 1.0)
        error = np.maximum(np.abs(higher - column[1:]), np.abs(higher - column[:-1]))
        error += rounding[order:]
        for value, differs in zip(higher, error, strict=True):
            better = differs < doubt
            best = np.where(better, value, best)
            doubt = np.where(better, differs, doubt)
        column = higher
    doubt = np.where(np.isfinite(doubt), doubt, 0.0)
    return best.T, doubt.T
