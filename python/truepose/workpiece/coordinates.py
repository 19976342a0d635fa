"""Coordinates of a feature: in its working plane, about the middle of its points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from truepose.arrays import Floats
from truepose.spatial import tangents
from truepose.workpiece.element import Element, FeatureError

_SAME_PLANE = 1e-9
"""Sine of the angle between working planes that are one."""


@dataclass(frozen=True, eq=False)
class Coordinates:
    """u v w of a point of the machine: `axes` (3, 3) @ (point - `middle` (3,)); w across the plane.

    About the middle of the points numbers are small, and so is their rounding.
    """

    axes: Floats
    middle: Floats

    @classmethod
    def of(cls, elements: Sequence[Element], datums: Sequence[Element] = ()) -> Coordinates:
        """Of a feature. Raises `FeatureError` where its working planes differ."""
        normal = elements[0].plane
        for element in (*elements, *datums):
            if np.linalg.norm(np.cross(element.plane, normal)) > _SAME_PLANE:
                raise FeatureError(
                    "feature-elements",
                    f"{element.name}: driven in another working plane than {elements[0].name}",
                    found="two working planes",
                    expected="one working plane (G17, G18 or G19) for all that belongs together",
                )
        middle = np.concatenate([element.points for element in elements]).mean(axis=0)
        return cls(np.concatenate([tangents(normal), normal[np.newaxis]]), middle)

    def local(self, points: Floats) -> Floats:
        """(..., 3) points of the machine, m, in u v w."""
        return np.asarray((points - self.middle) @ self.axes.T)
