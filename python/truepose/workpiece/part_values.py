"""Values of sampled parts: of one feature, and of all quantities of a part together."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from truepose.arrays import Floats, Indices
from truepose.workpiece.alignment import Alignment
from truepose.workpiece.features import Feature, Forms
from truepose.workpiece.worst import in_part


class FeatureValues:
    """The quantities of a feature, of parts that are first aligned where that changes them.

    Called with parts (s, m, 3) at `points` (m,) of the part: the feature's own, or all where the
    alignment moves them.
    """

    def __init__(
        self,
        feature: Feature,
        parts: Sequence[Indices],
        alignment: Alignment,
        forms: Sequence[Forms],
    ) -> None:
        members = np.concatenate(list(parts))
        self._feature, self._alignment = feature, alignment
        self.moved = any(
            in_part(alignment, one, members)[2] for of in forms for one in (of, *of.plus)
        )
        self.points: Indices = np.arange(len(alignment.nominal)) if self.moved else members
        ends = np.cumsum([0, *(part.size for part in parts)]).tolist()
        own = [np.arange(low, high) for low, high in itertools.pairwise(ends)]
        self._parts = list(parts) if self.moved else own

    def __call__(self, points: Floats) -> Floats:
        """(s, n_quantity)."""
        aligned = self._alignment.apply(points) if self.moved else points
        quantities: Floats = self._feature.values([aligned[:, place] for place in self._parts])
        return quantities


class PartValues:
    """All quantities of the features of a part, in their order.

    It is handed to other processes: what it holds can be pickled.
    """

    def __init__(self, features: Sequence[Feature], alignment: Alignment) -> None:
        self._features, self._alignment = tuple(features), alignment
        self._moved = tuple(
            FeatureValues(feature, places(feature), alignment, feature.forms()).moved
            for feature in features
        )

    def __call__(self, points: Floats) -> Floats:
        """(s, n_quantity) of parts whose points are (s, n, 3)."""
        aligned = self._alignment.apply(points) if any(self._moved) else points
        return np.concatenate(
            [
                feature.values([(aligned if moved else points)[:, at] for at in places(feature)])
                for feature, moved in zip(self._features, self._moved, strict=True)
            ],
            axis=1,
        )


def places(feature: Feature) -> tuple[Indices, ...]:
    """Points of the part, of each element and then each datum of a feature."""
    return tuple(element.place for element in [*feature.elements, *feature.datums])


__all__ = ["FeatureValues", "PartValues", "places"]
