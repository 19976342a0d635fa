"""How numbers are shown to people: millimetres in, micrometres and microradians out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

MICRO = 1e6
"""m -> µm and rad -> µrad."""
MILLI = 1e3
"""m -> mm."""
POSITION = ("x", "y", "z")
MISSING = "–"
ROUNDING = 1e-9
"""Values that differ relatively by less are equal where one of them has to be named."""

Array = NDArray[np.float64]


def is_position(component: str) -> bool:
    """Whether a component of an error or a coordinate of a pose is a length (x, y or z)."""
    return component in POSITION


def error_unit(component: str) -> str:
    """Unit in which an error component is shown: "µm" or "µrad"."""
    return "µm" if is_position(component) else "µrad"


def pose_unit(coordinate: str) -> str:
    """Unit in which a coordinate of a pose (x y z a b c) is shown: "mm" or "°"."""
    return "mm" if is_position(coordinate) else "°"


def shown_poses(poses: ArrayLike, coordinates: Sequence[str]) -> NDArray[np.float64]:
    """Poses (n, n_coordinate) from m and rad to mm and degrees."""
    per_unit = [MILLI if is_position(name) else 180.0 / np.pi for name in coordinates]
    shown: Array = np.asarray(poses, dtype=np.float64) * np.array(per_unit)
    return shown


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
    return text.replace("-", "\N{MINUS SIGN}")


def column(values: ArrayLike, decimals: int | None = None) -> tuple[str, ...]:
    """Numbers of one table column, all with the same decimals so that they line up."""
    array = np.asarray(values, dtype=np.float64).ravel()
    places = decimals_for(array) if decimals is None else decimals
    return tuple(number(float(value), places) for value in array)


def pose_text(pose: ArrayLike, coordinates: Sequence[str]) -> str:
    """One pose (n_coordinate,), m and rad, as people write it: "x 200, y 100 mm"."""
    shown = shown_poses(pose, coordinates)
    parts = [
        f"{name} {value + 0.0:.6g} {pose_unit(name)}"  # -0 is 0
        for name, value in zip(coordinates, shown, strict=True)
    ]
    return ", ".join(parts).replace("-", "\N{MINUS SIGN}")


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


def nearest_middle(poses: Array) -> NDArray[np.intp]:
    """Indices of poses (n, n_coordinate) from the middle outwards, each coordinate by its range."""
    if len(poses) == 0:
        return np.empty(0, dtype=np.intp)
    span = np.ptp(poses, axis=0)
    middle = (poses.max(axis=0) + poses.min(axis=0)) / 2
    scaled = (poses - middle) / np.where(span > 0, span, 1.0)
    return np.asarray(np.argsort((scaled**2).sum(axis=1).round(9), kind="stable"))
