"""Directions of parts and the two angles in which they deviate, as the kernel has them.

A direction has two parameters `u`, `v`: it points along `axis + u t1 + v t2`, where the tangents t1
and t2 follow from the nominal axis alone (`tangents` in `crates/kernel/src/spatial/vector.rs`). A
machine file has the axis only. So a direction that deviates is written as a new axis, from which
its deviations count about new tangents: the covariance of `u`, `v` has to be transformed with them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from truepose.arrays import Floats
from truepose.machine import Drive, Guide, Machine
from truepose.spatial import tangents

_FIRST, _SECOND = ".u", ".v"


@dataclass(frozen=True)
class PartDirection:
    """A direction: `table`, `part` and `key` in its file, its two columns, its unit axis (3,)."""

    table: str
    part: str
    key: str
    columns: tuple[int, int]
    axis: Floats


def directions(machine: Machine) -> Iterator[PartDirection]:
    """All directions of a machine whose deviations are parameters, in the parameters' order."""
    parts: tuple[Drive | Guide, ...] = (*machine.drives, *machine.guides)
    rows = {part.part: part for part in parts}
    names = machine.parameters
    for column, name in enumerate(names):
        if not name.endswith(_FIRST):
            continue
        path, _, key = name.removesuffix(_FIRST).rpartition(".")
        table, _, part = path.partition(".")
        second = names.index(name.removesuffix(_FIRST) + _SECOND)
        axis = np.array(rows[path].fields[key], np.float64)
        yield PartDirection(table, part, key, (column, second), axis / np.linalg.norm(axis))


def direction_at(axis: ArrayLike, deviation: ArrayLike) -> Floats:
    """(3,) the unit vector at the deviations (2,) `u`, `v` from the unit `axis` (3,)."""
    along: Floats = np.asarray(axis, np.float64) + np.asarray(deviation) @ tangents(axis)
    return along / np.linalg.norm(along)


def deviation_of(axis: ArrayLike, direction: ArrayLike) -> Floats:
    """(2,) the `u`, `v` at which a direction with `axis` (3,) points along `direction` (3,).

    The two are at less than a right angle.
    """
    unit, along = np.asarray(axis, np.float64), np.asarray(direction, np.float64)
    ratios: Floats = (tangents(unit) @ along) / (unit @ along)
    return ratios


def deviation_jacobian(axis: ArrayLike, deviation: ArrayLike, new_axis: ArrayLike) -> Floats:
    """(2, 2) change of the `u`, `v` about `new_axis` for one of those about `axis`.

    Where the direction is at the deviation (2,) from `axis`.
    """
    across, unit = tangents(axis), np.asarray(new_axis, np.float64)
    along = np.asarray(axis, np.float64) + np.asarray(deviation) @ across
    length = np.linalg.norm(along)
    along /= length
    slopes = (across - np.outer(across @ along, along)) / length
    seen = deviation_of(unit, along)
    return np.asarray((tangents(unit) - np.outer(seen, unit)) @ slopes.T / (unit @ along))
