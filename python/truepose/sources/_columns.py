"""The columns of a deviation, gathered one at a time."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from truepose.sources.deviation import OWN_GROUP, UNIFORM, Deviation, Distribution
from truepose.sources.variation import WITH_MACHINE, Variation


@dataclass
class Columns:
    """Collects columns, each for one parameter; `deviation()` has them together."""

    _parameters: list[int] = field(default_factory=list)
    _tables: list[tuple[ArrayLike, ArrayLike]] = field(default_factory=list)
    _groups: list[int] = field(default_factory=list)
    _edge: list[bool] = field(default_factory=list)
    _distributions: list[Distribution] = field(default_factory=list)
    _variations: list[Variation] = field(default_factory=list)

    def new_group(self) -> int:
        """A group that no column has yet."""
        return max(self._groups, default=OWN_GROUP) + 1

    def add(
        self,
        parameter: int,
        shift: ArrayLike = 0.0,
        half_width: ArrayLike = 0.0,
        *,
        group: int = OWN_GROUP,
        edge: bool = True,
        distribution: Distribution = UNIFORM,
        variation: Variation = WITH_MACHINE,
    ) -> None:
        """A column of the kernel's `parameter`, one number or (n,) of each kind.

        `half_width` is the deviation about `shift` where the column's variable is at +1:
        the half band, with the sign that the column has in its group.
        """
        self._parameters.append(parameter)
        self._tables.append((shift, half_width))
        self._groups.append(group)
        self._edge.append(edge)
        self._distributions.append(distribution)
        self._variations.append(variation)

    def deviation(self) -> Deviation:
        """All columns, (n or 1, k)."""
        shift = _side_by_side([shift for shift, _ in self._tables])
        half_width = _side_by_side([half_width for _, half_width in self._tables])
        return Deviation.of(
            self._parameters,
            shift,
            np.abs(half_width),
            groups=np.array(self._groups, np.intp),
            sign=np.where(half_width < 0.0, -1.0, 1.0),
            edge=np.array(self._edge, np.bool_),
            distribution=self._distributions,
            variation=self._variations,
        )


def _side_by_side(columns: list[ArrayLike]) -> np.ndarray[Any, np.dtype[np.float64]]:
    if not columns:
        return np.empty((1, 0))
    arrays = np.broadcast_arrays(*(np.atleast_1d(np.asarray(one, np.float64)) for one in columns))
    return np.stack(arrays, axis=1)
