"""How numbers are shown to people: in the units of `truepose.files.shown_units`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats, Indices
from truepose.files.shown_units import ShownUnits
from truepose.language import marked

POSITION = ("x", "y", "z")
MISSING = "–"
LOWER, UPPER = "all at lower ends", "all at upper ends"
"""Where lengths and offsets stand in their tolerance bands: the paper's minimum and maximum."""

NOTHING = 1e-15
"""m or rad: a coordinate so small is the rounding of 0."""

ROUNDING = 1e-9
"""Values that differ relatively by less are equal where one of them has to be named."""


def is_position(component: str) -> bool:
    """Whether a component of an error or a coordinate of a pose is a length (x, y or z)."""
    return component in POSITION


def is_length(name: str) -> bool:
    """Whether a component of an error, or a magnitude, is a length."""
    return is_position(name) or name == "position"


def decimals_for(values: ArrayLike, significant: int = 5) -> int:
    """Decimals that show the largest of `values` with `significant` digits, at most six."""
    finite = np.abs(np.asarray(values, dtype=np.float64))
    finite = finite[np.isfinite(finite)]
    largest = float(finite.max()) if finite.size else 0.0
    if largest == 0.0:
        return 1
    return int(np.clip(significant - 1 - np.floor(np.log10(largest)), 1, 6))


def number(value: float, decimals: int) -> str:
    """A number with fixed decimals and a true minus sign; a missing one as a dash."""
    if not np.isfinite(value):
        return MISSING
    text = f"{value:.{decimals}f}"
    if float(text) == 0.0:
        text = text.lstrip("-")
    return marked(text.replace("-", "\N{MINUS SIGN}"))


def column(values: ArrayLike, decimals: int | None = None) -> tuple[str, ...]:
    """Numbers of one table column, all with the same decimals so that they line up."""
    array = np.asarray(values, dtype=np.float64).ravel()
    places = decimals_for(array) if decimals is None else decimals
    return tuple(number(float(value), places) for value in array)


def pose_text(pose: ArrayLike, coordinates: Sequence[str], units: ShownUnits) -> str:
    """One pose (n_coordinate,), m and rad, as people write it: "x 200 mm, y 100 mm"."""
    parts = []
    for name, value in zip(coordinates, np.asarray(pose, np.float64).tolist(), strict=True):
        unit = units.pose(name)
        shown = value * unit.per_si if abs(value) > NOTHING else 0.0
        parts.append(f"{name} {shown:.6g} {unit.label}")
    return ", ".join(marked(part) for part in parts).replace("-", "\N{MINUS SIGN}")


def where_highest(sizes: ArrayLike) -> int:
    """Index of the highest of `sizes` (n,), missing ones passed over; 0 where all are missing.

    Of those equal but for rounding it is the first, on every processor.
    """
    values = np.asarray(sizes, dtype=np.float64)
    if np.isnan(values).all():
        return 0
    highest = np.nanmax(values)
    if np.isinf(highest):
        return int(np.flatnonzero(values == highest)[0])
    return int(np.flatnonzero(values >= highest - ROUNDING * abs(highest))[0])


def nearest_middle(poses: Floats) -> Indices:
    """Indices of poses (n, n_coordinate) from the middle outwards, each coordinate by its range."""
    if len(poses) == 0:
        return np.empty(0, dtype=np.intp)
    span = np.ptp(poses, axis=0)
    middle = (poses.max(axis=0) + poses.min(axis=0)) / 2
    scaled = (poses - middle) / np.where(span > 0, span, 1.0)
    return np.asarray(np.argsort((scaled**2).sum(axis=1).round(9), kind="stable"))
