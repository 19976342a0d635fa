"""The arrays that functions take and give, named by what is in them; shapes stand in docstrings."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import ArrayLike, NDArray

from truepose.errors import ArgumentError

Floats = NDArray[np.float64]
"""Numbers, in SI units where they have one."""

Indices = NDArray[np.intp]
"""Places in another array, counted from 0."""

Flags = NDArray[np.bool_]
"""Yes or no, of each."""

Codes = NDArray[np.uint8]
"""Codes of the kernel, such as the status of a pose (`truepose._kernel.STATUS`)."""


def sorted_union(*indices: Indices) -> Indices:
    """The places that are in any of them, each once and in order, as `np.unique` would have them.

    That imports `numpy.ma`.
    """
    every = np.sort(np.concatenate(indices).astype(np.intp))
    return every[np.diff(every, prepend=-1) > 0]


def is_masked(value: object) -> bool:
    """Whether any number of it is masked; where nobody imported `numpy.ma`, nothing can be.

    Importing that takes half as long as importing numpy.
    """
    masked_arrays = sys.modules.get("numpy.ma")
    return masked_arrays is not None and bool(masked_arrays.is_masked(value))


def real_numbers(name: str, value: ArrayLike) -> Floats:
    """The argument `name` as an array of real numbers, in its own shape.

    Raises `ArgumentError` (bad-argument) for what is none, and for numbers that are masked.
    """
    try:
        given = np.asarray(value)
    except (TypeError, ValueError):
        given = np.asarray(None)
    if given.dtype.kind not in "fiub" or is_masked(value):
        raise ArgumentError.of(name, value, "an array of real numbers")
    return given.astype(np.float64, copy=False)
